"""The formation reference: when it changes, how it is blended in, and that its pairs fit each other."""

import itertools

import numpy as np
import pytest

from relform_controller.ocp.layout import ordered_pairs
from relform_controller.reference.formation import FormationSchedule
from relform_core.errors import ConfigError
from relform_core.scenario_config import ScenarioConfig
from support.scenarios import paper_scenario, team_of

PERIOD_NS = 50_000_000
SWITCH = 220
"""Control step at which phase D changes the formation of the paper's scenario."""
NEW = {"follower_1": (-2.0, -0.25, 0.5), "follower_2": (1.5, 2.0, -0.25)}


def config_with(*overrides: str) -> ScenarioConfig:
    return paper_scenario(*overrides).config


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


def test_the_scenario_changes_the_formation_at_its_phase() -> None:
    references = follow(FormationSchedule(config_with()), range(SWITCH + 5))[:, :, 0]
    np.testing.assert_allclose(references[:SWITCH, 0], np.tile([-1.0, -0.5, -0.5], (SWITCH, 1)))
    np.testing.assert_allclose(references[SWITCH:, 0], np.tile([-1.0, -0.75, -0.5], (5, 1)))
    np.testing.assert_allclose(references[SWITCH:, 3], np.tile([0.0, 1.5, 0.0], (5, 1)))


def test_a_ramp_blends_over_its_time_without_a_jump() -> None:
    schedule = FormationSchedule(config_with("controller.formation_ramp_s=1.0"))
    references = follow(schedule, range(SWITCH + 40))[:, 0, 0, 1]
    np.testing.assert_allclose(references[: SWITCH + 1], -0.5)
    np.testing.assert_allclose(references[SWITCH + 10], -0.625)  # half way
    np.testing.assert_allclose(references[SWITCH + 20 :], -0.75)
    assert (np.diff(references[SWITCH : SWITCH + 21]) < 0).all()
    assert np.abs(np.diff(references)).max() < 1.6 * 0.25 / 20
    np.testing.assert_allclose(schedule.target[0], [-1.0, -0.75, -0.5])


def test_the_horizon_sees_the_ramp_that_has_begun() -> None:
    schedule = FormationSchedule(config_with("controller.formation_ramp_s=1.0"))
    references = follow(schedule, range(SWITCH + 30), n_instants=16)
    for ahead in (1, 7, 15):
        later = references[SWITCH + ahead : SWITCH + ahead + 15, :, 0]
        np.testing.assert_allclose(references[SWITCH:-15, :, ahead], later, atol=1e-12)


@pytest.mark.parametrize("n_vehicles", [2, 3, 5])
def test_all_pairs_fit_each_other_at_every_instant(n_vehicles: int) -> None:
    schedule = FormationSchedule(config_with(*team_of(n_vehicles), "controller.formation_ramp_s=0.7"))
    references = follow(schedule, range(SWITCH + 20), n_instants=16)
    pairs = ordered_pairs(n_vehicles)
    of = {pair: references[:, index] for index, pair in enumerate(pairs)}
    for i, j in pairs:
        np.testing.assert_allclose(of[i, j], -of[j, i], atol=1e-12)
    for i, j, k in itertools.permutations(range(n_vehicles), 3):
        np.testing.assert_allclose(of[i, j] + of[j, k], of[i, k], atol=1e-12)


def test_a_request_holds_from_the_next_step_until_the_scenario_changes_the_formation() -> None:
    schedule = FormationSchedule(config_with())
    follow(schedule, range(100))
    schedule.request(NEW)
    np.testing.assert_allclose(schedule.target[0], [-1.0, -0.5, -0.5])  # not before the next step
    references = follow(schedule, range(100, SWITCH + 1))[:, :, 0]
    np.testing.assert_allclose(references[:-1, 0], np.tile([-2.0, -0.25, 0.5], (SWITCH - 100, 1)))
    np.testing.assert_allclose(references[0, 3], [3.5, 2.25, -0.75])
    np.testing.assert_allclose(references[-1, 0], [-1.0, -0.75, -0.5])


def test_a_request_during_a_ramp_starts_from_where_the_reference_is() -> None:
    schedule = FormationSchedule(config_with("controller.formation_ramp_s=1.0"))
    before = follow(schedule, range(SWITCH + 8))[-1]
    schedule.request(NEW)
    references = follow(schedule, range(SWITCH + 8, SWITCH + 40))
    largest_jump = np.abs(np.diff(np.concatenate([before[None], references]), axis=0)).max()
    assert largest_jump < 1.6 * 3.5 / 20  # of the ramp itself: at most 3.5 m in one coordinate
    np.testing.assert_allclose(references[-1, 0, 0], [-2.0, -0.25, 0.5])


def test_of_two_requests_the_last_one_counts() -> None:
    schedule = FormationSchedule(config_with())
    schedule.request({"follower_1": (-3.0, 0.0, 0.0), "follower_2": (3.0, 0.0, 0.0)})
    schedule.request(NEW)
    np.testing.assert_allclose(follow(schedule, range(1))[0, 0, 0], [-2.0, -0.25, 0.5])


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
def test_an_impossible_request_changes_nothing(
    formation: dict[str, tuple[float, float, float]], problem: str
) -> None:
    schedule = FormationSchedule(config_with())
    with pytest.raises(ConfigError) as caught:
        schedule.request(formation)
    assert str(caught.value) == problem
    np.testing.assert_allclose(follow(schedule, range(1))[0, 0, 0], [-1.0, -0.5, -0.5])
