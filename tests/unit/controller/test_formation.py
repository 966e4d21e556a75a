"""The formation reference: when it changes, how a new formation is blended in, consistent pairs, refusals."""

import itertools
import math
from collections.abc import Mapping

import numpy as np
import pytest

from relform_controller.ocp.layout import ordered_pairs
from relform_controller.reference.formation import FormationSchedule
from relform_core.errors import ConfigError
from relform_core.scenario_config import ScenarioConfig
from relform_core.schema import Vector3
from support.scenarios import paper_scenario, team_of

PERIOD_NS = 50_000_000
SWITCH = 220
"""Control step at which phase D changes the formation of the paper's scenario."""
FIXED_RAMP = ("controller.formation_change=null", "controller.formation_ramp_s=1.0")
"""Overrides: every change takes one second, as in recordings of older versions."""
RAMPED_PHASE = "phases.3.formation_step=false"
NEW: dict[str, Vector3] = {"follower_1": (-2.0, -0.25, 0.5), "follower_2": (1.5, 2.0, -0.25)}


def config_with(*overrides: str) -> ScenarioConfig:
    return paper_scenario(*overrides).config


def request(schedule: FormationSchedule, formation: Mapping[str, Vector3]) -> None:
    """Check, then request, as a mission does."""
    schedule.check(formation)
    schedule.request(formation)


def follow(schedule: FormationSchedule, steps: range, n_instants: int = 1) -> np.ndarray:
    """The reference at every step, shape (step, pair, instant, 3)."""
    references = []
    for step in steps:
        schedule.advance(step * PERIOD_NS)
        references.append(schedule.reference(np.arange(step, step + n_instants) * PERIOD_NS))
    return np.array(references)


def test_pairs_by_hand() -> None:
    schedule = FormationSchedule(config_with())
    (reference,) = follow(schedule, range(1))
    # leader at the origin, followers at (-1, -.5, -.5) and (-1, .5, -.5); pairs 01 02 10 12 20 21
    expected = [[-1, -0.5, -0.5], [-1, 0.5, -0.5], [1, 0.5, 0.5], [0, 1, 0], [1, -0.5, 0.5], [0, -1, 0]]
    np.testing.assert_allclose(reference[:, 0], expected)
    np.testing.assert_allclose(schedule.target, expected)


def test_phase_changes_the_formation() -> None:
    references = follow(FormationSchedule(config_with()), range(SWITCH + 5))[:, :, 0]
    np.testing.assert_allclose(references[:SWITCH, 0], np.tile([-1.0, -0.5, -0.5], (SWITCH, 1)))
    np.testing.assert_allclose(references[SWITCH:, 0], np.tile([-1.0, -0.75, -0.5], (5, 1)))
    np.testing.assert_allclose(references[SWITCH:, 3], np.tile([0.0, 1.5, 0.0], (5, 1)))


def test_fixed_ramp_takes_its_time_without_a_jump() -> None:
    schedule = FormationSchedule(config_with(*FIXED_RAMP, RAMPED_PHASE))
    references = follow(schedule, range(SWITCH + 40))[:, 0, 0, 1]
    np.testing.assert_allclose(references[: SWITCH + 1], -0.5)
    np.testing.assert_allclose(references[SWITCH + 10], -0.625)  # half way
    np.testing.assert_allclose(references[SWITCH + 20 :], -0.75)
    assert (np.diff(references[SWITCH : SWITCH + 21]) < 0).all()
    assert np.abs(np.diff(references)).max() < 1.6 * 0.25 / 20
    np.testing.assert_allclose(schedule.target[0], [-1.0, -0.75, -0.5])


def test_horizon_follows_the_ramp() -> None:
    schedule = FormationSchedule(config_with(*FIXED_RAMP, RAMPED_PHASE))
    references = follow(schedule, range(SWITCH + 30), n_instants=16)
    for ahead in (1, 7, 15):
        later = references[SWITCH + ahead : SWITCH + ahead + 15, :, 0]
        np.testing.assert_allclose(references[SWITCH:-15, :, ahead], later, atol=1e-12)


@pytest.mark.parametrize("n_vehicles", [2, 3, 5])
def test_references_of_all_pairs_are_consistent(n_vehicles: int) -> None:
    schedule = FormationSchedule(config_with(*team_of(n_vehicles), RAMPED_PHASE))
    references = follow(schedule, range(SWITCH + 20), n_instants=16)
    pairs = ordered_pairs(n_vehicles)
    of = {pair: references[:, index] for index, pair in enumerate(pairs)}
    for i, j in pairs:
        np.testing.assert_allclose(of[i, j], -of[j, i], atol=1e-12)
    for i, j, k in itertools.permutations(range(n_vehicles), 3):
        np.testing.assert_allclose(of[i, j] + of[j, k], of[i, k], atol=1e-12)


def test_request_applies_from_the_next_step_until_a_phase_changes_the_formation() -> None:
    schedule = FormationSchedule(config_with())
    follow(schedule, range(100))
    request(schedule, NEW)
    np.testing.assert_allclose(schedule.target[0], [-1.0, -0.5, -0.5])  # not before the next step
    references = follow(schedule, range(100, SWITCH + 1))[:, :, 0]
    np.testing.assert_allclose(schedule.target[0], [-1.0, -0.75, -0.5])
    np.testing.assert_allclose(references[0, 0], [-1.0, -0.5, -0.5])
    arrived = 100 + 20 * 5  # 3.08 m at 1 m/s take 4.61 s
    np.testing.assert_allclose(references[100:-1, 0], np.tile([-2.0, -0.25, 0.5], (SWITCH - arrived, 1)))
    np.testing.assert_allclose(references[100, 3], [3.5, 2.25, -0.75])
    np.testing.assert_allclose(references[-1, 0], [-1.0, -0.75, -0.5])


def test_request_during_a_fixed_ramp_starts_from_the_present_reference() -> None:
    schedule = FormationSchedule(config_with(*FIXED_RAMP, RAMPED_PHASE))
    before = follow(schedule, range(SWITCH + 8))[-1]
    request(schedule, NEW)
    references = follow(schedule, range(SWITCH + 8, SWITCH + 40))
    largest_jump = np.abs(np.diff(np.concatenate([before[None], references]), axis=0)).max()
    assert largest_jump < 1.6 * 3.5 / 20  # of the ramp itself: at most 3.5 m in one coordinate
    np.testing.assert_allclose(references[-1, 0, 0], [-2.0, -0.25, 0.5])


def test_last_of_two_requests_in_one_step_applies() -> None:
    schedule = FormationSchedule(config_with())
    request(schedule, {"follower_1": (-3.0, 0.0, 0.0), "follower_2": (3.0, 0.0, 0.0)})
    request(schedule, NEW)
    follow(schedule, range(1))
    assert schedule.by_follower == NEW
    np.testing.assert_allclose(schedule.target[0], [-2.0, -0.25, 0.5])


@pytest.mark.parametrize("speed_max", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("acceleration_max", [0.5, 1.0, 4.0])
def test_change_reaches_and_keeps_its_bounds(speed_max: float, acceleration_max: float) -> None:
    schedule = FormationSchedule(
        config_with(
            f"controller.formation_change.speed_max_m_s={speed_max}",
            f"controller.formation_change.acceleration_max_m_s2={acceleration_max}",
        )
    )
    schedule.advance(0)
    request(schedule, NEW)
    schedule.advance(PERIOD_NS)
    time = np.linspace(0.0, 20.0, 20001)
    places = schedule.reference((time * 1e9).astype(np.int64) + PERIOD_NS)[:2]  # of both followers
    speed = np.linalg.norm(np.gradient(places, time, axis=1), axis=2)
    # Away from the ends, where the acceleration jumps and a difference shows half of it.
    acceleration = np.abs(np.gradient(speed, time, axis=1))
    assert speed.max() < 1.001 * speed_max
    assert acceleration.max() < 1.001 * acceleration_max
    assert max(speed.max() / speed_max, acceleration.max() / acceleration_max) > 0.95


def test_phase_without_formation_step_changes_within_the_bounds() -> None:
    schedule = FormationSchedule(config_with(RAMPED_PHASE))
    references = follow(schedule, range(SWITCH + 40))[:, 0, 0, 1]
    ramp_steps = math.ceil(20 * math.sqrt(6.0 * 0.25 / 1.0))  # 0.25 m within 1 m/s^2
    np.testing.assert_allclose(references[: SWITCH + 1], -0.5)
    assert references[SWITCH + ramp_steps - 1] > -0.75
    np.testing.assert_allclose(references[SWITCH + ramp_steps :], -0.75)


def test_request_during_a_change_continues_the_motion_of_the_reference() -> None:
    schedule = FormationSchedule(config_with())
    request(schedule, NEW)
    before = follow(schedule, range(40))[:, 0, 0]
    back = {"follower_1": (-1.0, -0.5, -0.5), "follower_2": (-1.0, 0.5, -0.5)}
    request(schedule, back)
    after = follow(schedule, range(40, 200))[:, 0, 0]
    velocity = np.diff(np.concatenate([before, after]), axis=0) / 0.05
    acceleration = np.diff(velocity, axis=0) / 0.05
    assert np.linalg.norm(velocity, axis=1).max() < 1.001  # the bounds are 1 m/s and 1 m/s^2
    assert np.linalg.norm(acceleration, axis=1).max() < 1.01
    np.testing.assert_allclose(after[-1], back["follower_1"])


SWAPPED = {"follower_1": (-1.0, 0.5, -0.5), "follower_2": (-1.0, -0.5, -0.5)}
NO_ROOM = {"follower_1": (-1.0, 0.25, -0.5), "follower_2": (-1.0, -0.25, -0.5)}
"""The followers change sides, to places at exactly the collision distance."""


def flown(schedule: FormationSchedule, first: int, n_steps: int) -> np.ndarray:
    """Places of both followers over time, shape (step, follower, 3)."""
    return follow(schedule, range(first, first + n_steps))[:, :2, 0]


def test_followers_change_places_around_each_other() -> None:
    schedule = FormationSchedule(config_with())
    follow(schedule, range(10))
    request(schedule, SWAPPED)
    way = schedule.way_to(SWAPPED)
    places = flown(schedule, 10, 100)
    np.testing.assert_allclose(places[0], [[-1.0, -0.5, -0.5], [-1.0, 0.5, -0.5]])
    np.testing.assert_allclose(places[math.ceil(20 * way.duration)], list(SWAPPED.values()))
    apart = np.linalg.norm(places[:, 0] - places[:, 1], axis=1)
    assert 0.75 < apart.min() < 0.85  # collision distance and margin of raw feedback: 0.5 m and 0.25 m
    np.testing.assert_allclose(places[:, :, 2], -0.5)
    middle = places[math.ceil(10 * way.duration)]
    assert middle[1, 0] < -1.3 < -0.7 < middle[0, 0]  # each keeps the other on its left
    speed = np.linalg.norm(np.diff(places, axis=0), axis=2) / 0.05
    assert speed.max() < 1.0
    assert np.linalg.norm(np.diff(places, 2, axis=0), axis=2).max() / 0.05**2 < 1.01


def test_the_same_request_on_a_way_around_changes_nothing() -> None:
    once, twice = FormationSchedule(config_with()), FormationSchedule(config_with())
    for schedule in (once, twice):
        request(schedule, SWAPPED)
        follow(schedule, range(30))
    twice.request(SWAPPED)
    np.testing.assert_array_equal(flown(once, 30, 60), flown(twice, 30, 60))


def test_references_of_all_pairs_agree_on_a_way_around() -> None:
    schedule = FormationSchedule(config_with())
    request(schedule, SWAPPED)
    of = dict(zip(ordered_pairs(3), np.moveaxis(follow(schedule, range(60))[:, :, 0], 1, 0), strict=True))
    np.testing.assert_allclose(of[0, 1] + of[1, 2], of[0, 2], atol=1e-12)
    np.testing.assert_allclose(of[2, 1], -of[1, 2], atol=1e-12)


def test_a_follower_flies_around_the_leader() -> None:
    schedule = FormationSchedule(config_with())
    ahead = {"follower_1": (1.0, 0.5, 0.5), "follower_2": (-1.0, 0.5, -0.5)}
    request(schedule, ahead)
    places = flown(schedule, 0, 160)
    np.testing.assert_allclose(places[-1], list(ahead.values()))
    assert np.linalg.norm(places[:, 0], axis=1).min() > 0.75


def test_a_way_without_room_is_refused() -> None:
    schedule = FormationSchedule(config_with())
    follow(schedule, range(10))
    with pytest.raises(ConfigError) as caught:
        request(schedule, NO_ROOM)
    assert str(caught.value) == (
        "no way to this formation: 'follower_1' and 'follower_2' would come within 0.000 m of each other on "
        "the way, at least 0.500 m are needed; change it in two steps"
    )
    np.testing.assert_allclose(flown(schedule, 10, 20)[:, 0], np.tile([-1.0, -0.5, -0.5], (20, 1)))


def test_a_request_without_a_way_to_the_formation_that_comes_next_is_refused() -> None:
    narrow = "{follower_1: [-1.0, -0.25, -0.5], follower_2: [-1.0, 0.25, -0.5]}"
    schedule = FormationSchedule(config_with(f"formations_m.wide={narrow}"))
    with pytest.raises(ConfigError) as caught:
        request(schedule, SWAPPED)
    assert str(caught.value) == (
        "no way from this formation to that of phase 'D', which comes next: 'follower_1' and 'follower_2' "
        "would come within 0.000 m of each other on the way, at least 0.500 m are needed"
    )


def test_a_step_on_which_vehicles_would_meet_is_a_blend_around() -> None:
    """The paper's phase D, after the followers have changed sides."""
    schedule = FormationSchedule(config_with())
    follow(schedule, range(10))
    request(schedule, SWAPPED)
    follow(schedule, range(10, SWITCH))
    places = flown(schedule, SWITCH, 100)
    np.testing.assert_allclose(places[0], list(SWAPPED.values()), atol=1e-12)
    np.testing.assert_allclose(places[-1], [[-1.0, -0.75, -0.5], [-1.0, 0.75, -0.5]])
    assert np.linalg.norm(places[:, 0] - places[:, 1], axis=1).min() > 0.75


def test_a_way_starts_from_the_present_reference() -> None:
    """Half-way through a change the straight way to a formation may be free that was blocked before."""
    schedule = FormationSchedule(config_with("phases.3.formation=initial", "phases.4.formation=initial"))
    aside = {"follower_1": (-1.0, -0.5, 1.5), "follower_2": (-1.0, 0.5, -0.5)}
    across = {"follower_1": (-1.0, 1.5, -0.5), "follower_2": (-1.0, 0.5, -0.5)}
    schedule.advance(0)
    assert schedule.way_to(across).detours is not None
    request(schedule, aside)
    follow(schedule, range(1, 41))
    assert schedule.way_to(across).detours is None


def test_formation_at_the_smallest_distance_is_accepted() -> None:
    schedule = FormationSchedule(config_with(RAMPED_PHASE))
    close = {"follower_1": (-1.3, -0.1, -0.5), "follower_2": (-1.3, 0.4, -0.5)}
    request(schedule, close)
    follow(schedule, range(100))
    request(schedule, NEW)
    follow(schedule, range(100, 101))
    assert schedule.by_follower == NEW


def test_configuration_of_an_older_version_changes_as_it_did() -> None:
    """A step, also on crossing paths; or a blend over a fixed time."""
    step = ("controller.formation_change=null", "controller.formation_ramp_s=0.0")
    for overrides, n_steps in ((step, 0), (FIXED_RAMP, 20)):
        schedule = FormationSchedule(config_with(*overrides))
        request(schedule, SWAPPED)
        references = follow(schedule, range(30))[:, 0, 0]
        np.testing.assert_array_equal(references[n_steps:], np.tile([-1.0, 0.5, -0.5], (30 - n_steps, 1)))


@pytest.mark.parametrize(
    ("formation", "problem"),
    [
        ({"follower_1": (-1.0, 0.0, 0.0)}, "formation has no position for 'follower_2'"),
        (
            NEW | {"follower_3": (0.0, 0.0, 3.0)},
            "formation names 'follower_3', which is no follower; followers are follower_1, follower_2",
        ),
        (
            NEW | {"leader": (0.0, 0.0, 3.0)},
            "formation names 'leader', which is no follower; followers are follower_1, follower_2",
        ),
        (
            NEW | {"follower_2": (-2.0, -0.25, 0.3)},
            "formation is impossible: 'follower_1' and 'follower_2' are 0.200 m apart, "
            "at least 0.500 m are needed",
        ),
        (
            NEW | {"follower_2": (0.1, 0.2, 0.2)},
            "formation is impossible: 'leader' and 'follower_2' are 0.300 m apart, "
            "at least 0.500 m are needed",
        ),
        (
            NEW | {"follower_2": (1.5, float("nan"), 0.25)},
            "formation puts 'follower_2' at (1.5, nan, 0.25), which is not finite",
        ),
    ],
)
def test_impossible_request_changes_nothing(
    formation: dict[str, tuple[float, float, float]], problem: str
) -> None:
    schedule = FormationSchedule(config_with())
    with pytest.raises(ConfigError) as caught:
        request(schedule, formation)
    assert str(caught.value) == problem
    np.testing.assert_allclose(follow(schedule, range(1))[0, 0, 0], [-1.0, -0.5, -0.5])


def test_crossing_paths_are_accepted_with_a_separation_constraint() -> None:
    """The vehicles fly around each other, if the constraint asks for at least the collision distance."""

    def schedule(separation_min: float) -> FormationSchedule:
        prices = "price_per_unit: 300, square_price_per_unit2: 1000"
        constraint = f"{{separation: {{min_m: {separation_min}, {prices}}}}}"
        return FormationSchedule(config_with(f"controller.constraints={constraint}"))

    assert schedule(0.5).way_to(SWAPPED).straight
    schedule(0.5).check(NO_ROOM)
    assert not schedule(0.49).way_to(SWAPPED).straight
    with pytest.raises(ConfigError, match=r"would come within 0\.000 m"):
        schedule(0.49).check(NO_ROOM)
