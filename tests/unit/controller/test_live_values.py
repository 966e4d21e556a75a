"""Live values: keys and bounds of the files; a change applies as a whole or is refused as a whole."""

import math

import pytest

from relform_controller.live_values import LiveControllerValues
from relform_controller.reference.mission import ScenarioMission
from relform_core.controller_config import WeightsConfig
from relform_core.errors import ConfigError
from relform_core.live_values import LiveValues, Value, live_vehicle_values
from relform_core.vehicle_config import FailsafeConfig
from support.scenarios import paper_scenario

SCENARIO = paper_scenario("controller.weights.torque_per_n2_m2=7", "vehicle.tilt_max_deg=60")
CONTROLLER = LiveControllerValues.from_scenario(SCENARIO, ScenarioMission(SCENARIO.config).check_formation)
VEHICLE = live_vehicle_values(SCENARIO)


def test_keys_are_those_of_the_files() -> None:
    weights = {f"weights.{key}" for key in SCENARIO.written["controller"]["weights"]}
    assert set(CONTROLLER.described) == weights | {"formation.follower_1", "formation.follower_2"}
    limits = {f"failsafe.{key}" for key in SCENARIO.written["vehicle"]["failsafe"]}
    assert set(VEHICLE.described) == limits | {"tilt_max_deg"}


def test_values_are_those_of_the_scenario_in_the_units_of_its_keys() -> None:
    assert CONTROLLER.values["weights.torque_per_n2_m2"] == 7.0
    assert CONTROLLER.values["formation.follower_1"] == (-1.0, -0.5, -0.5)
    assert VEHICLE.values["tilt_max_deg"] == 60.0
    assert all(
        isinstance(value, float) for key, value in CONTROLLER.values.items() if key.startswith("weights.")
    )


def test_descriptions_and_bounds_are_those_of_the_schema() -> None:
    torque = CONTROLLER.described["weights.torque_per_n2_m2"]
    assert torque.description == WeightsConfig.model_fields["torque"].description
    assert (torque.lowest, torque.highest, torque.constraint) == (0.0, 1e6, "")
    speed = VEHICLE.described["failsafe.descent_speed_m_s"]
    assert speed.description == FailsafeConfig.model_fields["descent_speed"].description
    assert (speed.lowest, speed.highest, speed.constraint) == (0.0, 3.0, "greater than 0")
    assert all(each.description for each in (*CONTROLLER.described.values(), *VEHICLE.described.values()))
    assert "0.5 m apart" in CONTROLLER.described["formation.follower_1"].constraint


def test_change_equals_a_file_with_these_values() -> None:
    changed = CONTROLLER.changed({"weights.formation_per_m2": 3.5, "weights.terminal_scale": 2.0})
    overrides = ("formation_per_m2=3.5", "terminal_scale=2.0", "torque_per_n2_m2=7")
    written = paper_scenario(*(f"controller.weights.{override}" for override in overrides))
    assert changed.weights == written.config.controller.weights
    assert changed.values["weights.formation_per_m2"] == 3.5
    assert changed.formation == CONTROLLER.formation
    limits = VEHICLE.changed({"tilt_max_deg": 45.0, "failsafe.plan_max_s": 0.2}).config
    assert limits.tilt_max == pytest.approx(math.radians(45.0))
    assert limits.failsafe.plan_max == 0.2
    assert limits.failsafe.descent_speed == SCENARIO.config.vehicle.failsafe.descent_speed


def test_changes_add_up_and_do_not_modify_the_original() -> None:
    before = dict(CONTROLLER.values)
    first = CONTROLLER.changed({"formation.follower_1": (-2.0, -1.0, 0.5)})
    second = first.changed({"weights.leader_yaw_per_rad2": 0.0})
    assert second.formation == {"follower_1": (-2.0, -1.0, 0.5), "follower_2": (-1.0, 0.5, -0.5)}
    assert second.weights.leader_yaw == 0.0
    assert dict(CONTROLLER.values) == before


@pytest.mark.parametrize(
    ("live", "key", "value", "problem"),
    [
        (CONTROLLER, "weights.formation_per_m2", 0.0, "must be greater than 0 (got 0.0)"),
        (CONTROLLER, "weights.torque_per_n2_m2", -1.5, "must be greater than or equal to 0 (got -1.5)"),
        (CONTROLLER, "weights.terminal_scale", 1e7, "must be less than or equal to 1000000 (got 10000000.0)"),
        (CONTROLLER, "weights.leader_yaw_per_rad2", math.nan, "must be a finite number (got nan)"),
        (CONTROLLER, "weights.leader_yaw_per_rad2", (1.0, 2.0), "must be a number (got [1.0, 2.0])"),
        (
            CONTROLLER,
            "weights.thrust",
            1.0,
            "cannot be changed in flight (did you mean 'weights.thrust_rate_per_n2'?)",
        ),
        (CONTROLLER, "period_s", 0.1, "cannot be changed in flight"),
        (CONTROLLER, "formation.follower_1", (1.0, 2.0), "must be a list of 3 numbers (got [1.0, 2.0])"),
        (CONTROLLER, "formation.follower_1", 4.0, "must be a list of 3 numbers (got 4.0)"),
        (VEHICLE, "tilt_max_deg", 180.5, "must be less than or equal to 180 (got 180.5)"),
        (VEHICLE, "failsafe.plan_max_s", -0.1, "must be greater than or equal to 0 (got -0.1)"),
        (VEHICLE, "mass_kg", 1.0, "cannot be changed in flight"),
    ],
)
def test_bad_value_is_refused_in_one_line_even_among_good_ones(
    live: LiveValues, key: str, value: Value, problem: str
) -> None:
    good = next(each for each in live.described if each != key)
    with pytest.raises(ConfigError) as error:
        live.changed({good: live.values[good], key: value})
    assert str(error.value) == f"{key}: {problem}"


@pytest.mark.parametrize(
    ("place", "problem"),
    [
        ((-1.0, 0.5, -0.4), "formation is impossible: 'follower_1' and 'follower_2' are 0.100 m apart"),
        ((-1.0, math.inf, -0.4), "formation puts 'follower_1' at (-1.0, inf, -0.4), which is not finite"),
    ],
)
def test_impossible_formation_is_refused(place: tuple[float, ...], problem: str) -> None:
    with pytest.raises(ConfigError, match=r"^[^\n]+$") as error:
        CONTROLLER.changed({"formation.follower_1": place})
    assert str(error.value).startswith(problem)


def test_several_places_change_together() -> None:
    """Each of the two changes alone would bring the followers too close to each other."""
    places = {"formation.follower_1": (-1.0, 0.25, -0.5), "formation.follower_2": (-1.0, 1.25, -0.5)}
    changed = CONTROLLER.changed(places)
    assert changed.values["formation.follower_1"] == (-1.0, 0.25, -0.5)
    with pytest.raises(ConfigError, match="apart"):
        CONTROLLER.changed({"formation.follower_1": places["formation.follower_1"]})


def test_followers_change_places_if_there_is_room() -> None:
    places = {"formation.follower_1": (-1.0, 0.5, -0.5), "formation.follower_2": (-1.0, -0.5, -0.5)}
    assert CONTROLLER.changed(places).values["formation.follower_1"] == (-1.0, 0.5, -0.5)
    places = {"formation.follower_1": (-1.0, 0.25, -0.5), "formation.follower_2": (-1.0, -0.25, -0.5)}
    with pytest.raises(ConfigError) as error:
        CONTROLLER.changed(places)
    assert str(error.value) == (
        "no way to this formation: 'follower_1' and 'follower_2' would come within "
        "0.000 m of each other on the way, at least 0.500 m are needed; change it in two steps"
    )


def test_a_place_of_an_unknown_follower() -> None:
    with pytest.raises(ConfigError, match="names 'ufo', which is no follower"):
        CONTROLLER.changed({"formation.ufo": (3.0, 0.0, 0.0)})
