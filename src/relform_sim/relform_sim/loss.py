"""Messages that do not arrive."""

import math
from collections.abc import Sequence

import numpy as np

from relform_core.scenario_config import CommandLoss, Dropout


class Loss:
    """Independent causes, each of which loses a message with a probability: one that always acts, and events.

    One draw per message, whatever acts, so that an event changes nothing but what it loses.
    """

    def __init__(
        self,
        generator: np.random.Generator,
        probability: float = 0.0,
        events: Sequence[Dropout | CommandLoss] = (),
    ) -> None:
        self._generator = generator
        self._probability = probability
        self._events = tuple(events)

    def loses(self, time: float) -> bool:
        """Draw whether the message of this time [s] is lost."""
        acting = [self._probability, *(event.probability for event in self._events if event.active(time))]
        arrives = math.prod(1.0 - probability for probability in acting)
        return bool(self._generator.uniform() >= arrives)
