"""Random missions: each seed gives a scenario that can be flown, and always the same one."""

import numpy as np
import pytest

from relform_bringup.long_mission import CLIMB_M_S, HEIGHT_M, random_mission
from relform_core.load import load_scenario

LONGEST_S = 25
"""Of a phase."""


@pytest.mark.parametrize("seed", [0, 7, 4711])
def test_mission_can_be_flown(seed: int) -> None:
    config = load_scenario("field", random_mission(seed, 300.0), seed=seed).config
    assert sum(phase.duration for phase in config.phases) == pytest.approx(300.0)
    assert {event.kind for event in config.events} <= {
        "wind", "thrust_scale", "outliers", "dropout", "command_loss", "link",
    }  # fmt: skip
    assert len({phase.formation for phase in config.phases}) > 1
    heights = [
        HEIGHT_M + sum(getattr(phase.motion, "climb", 0.0) * phase.duration for phase in config.phases[:n])
        for n in range(len(config.phases) + 1)
    ]
    assert np.ptp(heights) <= 2.0 * CLIMB_M_S * LONGEST_S


def test_mission_comes_from_its_seed() -> None:
    assert random_mission(5, 120.0) == random_mission(5, 120.0)
    assert random_mission(5, 120.0) != random_mission(6, 120.0)
