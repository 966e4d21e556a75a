"""Names of soft constraints, and how far a state is beyond each bound."""

import math

import casadi as ca
import numpy as np
import pytest

from relform_controller.ocp import layout
from relform_controller.ocp.constraints import Constraints, make_constraints
from relform_core.constraints_config import BoxObstacle, ConstraintsConfig, SphereObstacle
from relform_core.obstacles import clearance

PRICES = {"price_per_unit": 30.0, "square_price_per_unit2": 100.0}
CONFIG = ConstraintsConfig.model_validate(
    {
        "tilt": {"max_deg": 30.0, **PRICES},
        "speed": {"max_m_s": 2.0, **PRICES},
        "separation": {"min_m": 1.5, **PRICES},
        "field_of_view": {
            "axis_azimuth_deg": 90.0,
            "axis_elevation_deg": 0.0,
            "half_angle_deg": 40.0,
            "range_max_m": 1.9,
            "pairs": (("b", "a"),),
            **PRICES,
        },
        "keep_out": {"margin_m": 0.4, **PRICES},
    }
)
OBSTACLES = (
    SphereObstacle(kind="sphere", center_m=(1.0, -2.0, 0.5), radius_m=0.75),
    BoxObstacle(kind="box", center_m=(5.0, 1.0, 2.0), size_m=(2.0, 4.0, 1.0), yaw_deg=70.0),
)


@pytest.fixture(scope="module")
def constraints() -> Constraints:
    return make_constraints(CONFIG, OBSTACLES, ("a", "b"))


def test_names(constraints: Constraints) -> None:
    own = ["tilt {}", "speed {}", "keep_out {} obstacles.0", "keep_out {} obstacles.1"]
    assert constraints.names == [
        *(name.format("a") for name in own),
        *(name.format("b") for name in own),
        "separation a b",
        "field_of_view b a",
        "view_range b a",
    ]


def test_names_of_active_constraints(constraints: Constraints) -> None:
    rows = np.zeros((3, len(constraints.names)), dtype=bool)
    assert constraints.active(rows) == ()
    rows[0, 1] = rows[2, 1] = rows[2, 8] = True
    assert constraints.active(rows) == ("speed a", "separation a b")


def state(roll_deg: float = 0.0, pitch_deg: float = 0.0, speed: float = 0.0) -> ca.DM:
    values = np.zeros(layout.N_STATE)
    values[layout.ROLL], values[layout.PITCH] = math.radians(roll_deg), math.radians(pitch_deg)
    values[layout.VELOCITY] = speed * np.array([0.48, -0.6, 0.64])
    return ca.DM(values)


@pytest.mark.parametrize(
    ("name", "state", "position", "beyond"),
    [
        ("tilt", state(roll_deg=-30.0), (0.0, 0.0, 0.0), 0.0),
        ("tilt", state(pitch_deg=30.5), (0.0, 0.0, 0.0), math.radians(0.5)),
        ("tilt", state(20.0, 22.831), (0.0, 0.0, 0.0), 0.0),
        ("speed", state(speed=2.0), (0.0, 0.0, 0.0), 0.0),
        ("speed", state(speed=2.05), (0.0, 0.0, 0.0), 0.05),
        ("separation", state(5.0), (0.8, -0.6, 0.0), 0.5),
        ("field_of_view", state(), (math.tan(math.radians(40.0)), 1.0, 0.0), 0.0),
        ("field_of_view", state(roll_deg=40.5), (0.0, 2.0, 0.0), math.radians(0.5)),
        ("view_range", state(5.0), (1.2, -1.6, 0.0), 0.1),
    ],
)
def test_how_far_beyond_a_bound(
    constraints: Constraints, name: str, state: ca.DM, position: tuple[float, ...], beyond: float
) -> None:
    """To first order: the position is that of a vehicle in the world, or of the target of a pair."""
    (found,) = (each for each in (*constraints.vehicle, *constraints.pair) if each.name == name)
    assert float(found.excess(state, ca.DM(position))) == pytest.approx(beyond, abs=1e-3)


@pytest.mark.parametrize("number", [0, 1])
def test_distance_from_obstacles_is_that_of_the_world(constraints: Constraints, number: int) -> None:
    constraint = constraints.vehicle[2 + number]
    for point in np.random.default_rng(number).uniform(-3.0, 7.0, (50, 3)):
        expected = 0.4 - float(clearance([OBSTACLES[number]], point))
        assert float(constraint.excess(state(), ca.DM(point))) == pytest.approx(expected, abs=1e-5)
