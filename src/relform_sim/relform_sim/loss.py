"""Random loss of messages."""

from collections.abc import Sequence

import numpy as np

from relform_core.events_config import CommandLoss, Dropout, LinkFault


class Loss:
    """Independent causes of loss, each with its probability: a permanent one, and events.

    Each message takes one draw, so that an event affects no message but those that it loses.
    """

    def __init__(
        self,
        generator: np.random.Generator,
        probability: float = 0.0,
        events: Sequence[Dropout | CommandLoss | LinkFault] = (),
    ) -> None:
        self._generator = generator
        self._probability = probability
        self._events = tuple(events)

    def loses(self, time: float) -> bool:
        """Draw whether the message of this time [s] is lost."""
        arrives = 1.0 - self._probability
        for event in self._events:
            if event.active(time):
                arrives *= 1.0 - event.probability
        return self._generator.random() >= arrives
