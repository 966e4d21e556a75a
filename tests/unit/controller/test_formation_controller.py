"""The controller as a whole, on measurements of a short agile flight."""

import copy
import dataclasses
import itertools
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relform_controller.estimation.estimator import AppliedInputs, Estimator, TeamEstimate, Waiting
from relform_controller.estimation.raw import RawEstimator
from relform_controller.estimation.registry import make_estimator
from relform_controller.estimation.team import TeamEstimator
from relform_controller.formation_controller import FormationController
from relform_controller.ocp.problem import Prediction
from relform_controller.reference.mission import MissionReference, ScenarioMission
from relform_controller.solver.algorithm import ModifiedRti
from relform_core.controller_config import WeightsConfig
from relform_core.errors import ConfigError, FlightError
from relform_core.measurements import TeamMeasurements
from relform_core.names import SolverState
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.telemetry import Decision, Standby
from support.flights import AGILE, all_speeds, record, replaced, replay
from support.scenarios import NOISE_FREE, paper_scenario

SCENARIO = paper_scenario(AGILE, seed=4)
CONFIG = SCENARIO.config
N_STEPS = 36
NAMES = CONFIG.team.vehicles
EXACT = paper_scenario(AGILE, *NOISE_FREE, "controller.solver.sqp_steps_max=30", seed=4)


@dataclasses.dataclass(frozen=True)
class Flight:
    """A flight of the simulated team, by control step."""

    measured: list[TeamMeasurements]
    decided: list[Decision]


@pytest.fixture(scope="module")
def flight() -> Flight:
    return Flight(*record(SCENARIO, N_STEPS))


@pytest.fixture(scope="module")
def exact() -> Flight:
    """Without noise."""
    return Flight(*record(EXACT, N_STEPS))


def with_yaw_offsets(measurements: TeamMeasurements, offsets: dict[str, float]) -> TeamMeasurements:
    """The same, but the yaws of the IMUs are offset."""
    for name, offset in offsets.items():
        imu = measurements.by_vehicle[name].newest(IMU)
        assert imu is not None
        q_NB = (Rotation.from_euler("z", offset) * Rotation.from_quat(imu.q_NB)).as_quat()
        measurements = replaced(measurements, name, imu=dataclasses.replace(imu, q_NB=q_NB))
    return measurements


@pytest.mark.parametrize(
    "offsets", [{"follower_1": 1.3}, {"follower_2": -2.9}, {"follower_1": np.pi, "follower_2": 0.4}]
)
def test_the_yaw_of_a_followers_imu_changes_no_command(flight: Flight, offsets: dict[str, float]) -> None:
    turned = [with_yaw_offsets(measurements, offsets) for measurements in flight.measured]
    speeds = all_speeds(replay(FormationController(CONFIG), turned))
    assert np.abs(speeds - all_speeds(flight.decided)).max() < 1e-9


def test_the_same_measurements_give_the_same_decisions_bit_for_bit(flight: Flight) -> None:
    again = replay(FormationController(CONFIG), flight.measured)
    np.testing.assert_array_equal(all_speeds(again), all_speeds(flight.decided))
    for found, expected in zip(again, flight.decided, strict=True):
        for name in NAMES:
            predicted = found.commands[name].predicted_speeds
            np.testing.assert_array_equal(predicted, expected.commands[name].predicted_speeds)
        assert found.solver.objective == expected.solver.objective
        assert found.solver.kkt == expected.solver.kkt


def test_feedback_then_prepare_next_is_a_step(flight: Flight) -> None:
    controller = FormationController(CONFIG)
    for measurements, expected in zip(flight.measured[:10], flight.decided, strict=False):
        found = controller.feedback(measurements)
        controller.prepare_next()
        np.testing.assert_array_equal(all_speeds([found]), all_speeds([expected]))


def test_measurements_are_not_changed(flight: Flight) -> None:
    before = copy.deepcopy(flight.measured[:5])
    replay(FormationController(CONFIG), flight.measured[:5])
    for measurements, original in zip(flight.measured, before, strict=False):
        for name in NAMES:
            now, then = measurements.by_vehicle[name], original.by_vehicle[name]
            assert now.newest(IMU) is not None
            assert then.newest(IMU) is not None
            np.testing.assert_array_equal(now.newest(IMU).q_NB, then.newest(IMU).q_NB)
            np.testing.assert_array_equal(now.newest(IMU).w_NB_B, then.newest(IMU).w_NB_B)
        leader = measurements.by_vehicle["leader"].newest(LOCALIZATION)
        original_leader = original.by_vehicle["leader"].newest(LOCALIZATION)
        assert leader is not None
        assert original_leader is not None
        np.testing.assert_array_equal(leader.p_NB_N, original_leader.p_NB_N)


def test_later_steps_do_not_change_earlier_decisions(flight: Flight) -> None:
    """A decision does not share memory with the next step."""
    controller = FormationController(CONFIG)
    first = controller.step(flight.measured[0])
    kept = copy.deepcopy(first)
    replay(controller, flight.measured[1:4])
    for name in NAMES:
        np.testing.assert_array_equal(first.commands[name].speeds, kept.commands[name].speeds)
        np.testing.assert_array_equal(
            first.commands[name].predicted_speeds, kept.commands[name].predicted_speeds
        )
    for pair, kept_pair in zip(first.state.pairs, kept.state.pairs, strict=True):
        np.testing.assert_array_equal(pair.p_B1B2_C1__est, kept_pair.p_B1B2_C1__est)


def test_the_change_of_thrust_is_counted_from_what_was_commanded(
    flight: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    applied: list[np.ndarray] = []
    solve = ModifiedRti.solve

    def listen(solver: ModifiedRti, *arguments: Any) -> Any:
        applied.append(arguments[0].applied_thrusts)
        return solve(solver, *arguments)

    monkeypatch.setattr(ModifiedRti, "solve", listen)
    decisions = replay(FormationController(CONFIG), flight.measured[:6])
    np.testing.assert_array_equal(applied[0], np.full((3, 4), CONFIG.vehicle.hover_thrust))
    thrusts = CONFIG.vehicle.thrust_coefficient * all_speeds(decisions) ** 2
    np.testing.assert_allclose(applied[1:], thrusts[:-1])


def test_commands_are_complete_and_within_the_limits(flight: Flight) -> None:
    for step, decision in enumerate(flight.decided):
        assert decision.step == step
        assert decision.stamp_ns == step * 50_000_000
        assert tuple(decision.commands) == NAMES
        for command in decision.commands.values():
            assert (command.stamp_ns, command.period_ns) == (decision.stamp_ns, 50_000_000)
            assert command.predicted_speeds.shape == (CONFIG.controller.horizon_steps - 1, 4)
            speeds = np.vstack([command.speeds, command.predicted_speeds])
            assert speeds.min() >= CONFIG.vehicle.rotor_speed_min * (1 - 1e-12)
            assert speeds.max() <= CONFIG.vehicle.rotor_speed_max * (1 + 1e-12)


def test_a_decision_reports_its_reference_and_estimates(flight: Flight) -> None:
    for step, decision in enumerate(flight.decided):
        phase, width = ("P", 0.5) if step < 20 else ("Q", 0.75)
        assert decision.reference.phase == phase
        np.testing.assert_allclose(decision.reference.formation["leader", "follower_1"], [-1.0, -width, -0.5])
        assert [(pair.observer, pair.target) for pair in decision.state.pairs] == list(
            itertools.permutations(NAMES, 2)
        )
        for pair in decision.state.pairs:
            np.testing.assert_array_equal(
                pair.p_B1B2_C1__ref, decision.reference.formation[pair.observer, pair.target]
            )
            # A team in formation: 0.025 m of noise, and what the turn and the change of the formation need.
            assert np.linalg.norm(pair.p_B1B2_C1__est - pair.p_B1B2_C1__ref) < 0.6
            assert not pair.yaw_held
        localization = flight.measured[step].by_vehicle["leader"].newest(LOCALIZATION)
        assert localization is not None
        expected = np.linalg.norm(localization.p_NB_N - decision.reference.p_NB_N)
        assert decision.state.leader_position_error == pytest.approx(expected)
        yaw = Rotation.from_quat(localization.q_NB).as_euler("ZYX")[0]
        assert decision.state.leader_yaw_error == pytest.approx(yaw - decision.reference.yaw_NB, abs=1e-9)


def test_the_start_is_solved_to_its_tolerance_and_later_steps_are_limited(flight: Flight) -> None:
    assert flight.decided[0].solver.state is SolverState.SOLVED
    assert flight.decided[0].solver.kkt < CONFIG.controller.solver.kkt_tolerance_start
    assert flight.decided[0].solver.sqp_steps > 3
    most = max(decision.solver.sqp_steps for decision in flight.decided[1:])
    assert most == CONFIG.controller.solver.sqp_steps_max
    assert all(decision.solver.state is not SolverState.FALLBACK for decision in flight.decided)


def blind(measurements: TeamMeasurements, name: str) -> TeamMeasurements:
    """The same, but the optic flow of one vehicle is not a number."""
    flow = measurements.by_vehicle[name].newest(OPTIC_FLOW)
    assert flow is not None
    return replaced(measurements, name, optic_flow=dataclasses.replace(flow, v_NB_B=np.full(3, np.nan)))


def test_after_a_failed_step_the_plan_is_flown_and_the_solver_recovers(flight: Flight) -> None:
    controller = FormationController(CONFIG)
    replay(controller, flight.measured[:20])
    decisions = [
        controller.step(blind(measurements, "follower_2")) for measurements in flight.measured[20:23]
    ]
    before = flight.decided[19]
    for ahead, decision in enumerate(decisions):
        assert decision.solver.state is SolverState.FALLBACK
        assert decision.solver.fallback_reason
        for name in NAMES:
            planned = before.commands[name].predicted_speeds[ahead]
            np.testing.assert_allclose(decision.commands[name].speeds, planned, rtol=1e-12)
    after = controller.step(flight.measured[23])
    assert after.solver.state is not SolverState.FALLBACK
    assert np.isfinite(all_speeds([after])).all()


@pytest.mark.parametrize("step", [10, 24], ids=["line", "turn"])
@pytest.mark.parametrize(
    "lost",
    [
        {"follower_1": ("imu", "optic_flow", "sonar", "range_bearing")},
        {"leader": ("localization",)},
        {"leader": ("range_bearing",), "follower_2": ("range_bearing", "imu")},
        {name: ("imu", "optic_flow", "sonar", "range_bearing", "localization") for name in NAMES},
    ],
    ids=["follower", "localization", "some", "all"],
)
def test_a_measurement_lost_in_one_step_is_predicted(
    exact: Flight, lost: dict[str, tuple[str, ...]], step: int
) -> None:
    """Without noise the prediction is as good as a measurement, in the middle of an agile flight too."""
    controller = FormationController(EXACT.config)
    replay(controller, exact.measured[:step])
    measurements = exact.measured[step]
    for name, sensors in lost.items():
        measurements = replaced(measurements, name, **dict.fromkeys(sensors))
    found, expected = controller.step(measurements), exact.decided[step]
    for pair, usual in zip(found.state.pairs, expected.state.pairs, strict=True):
        np.testing.assert_allclose(pair.p_B1B2_C1__est, usual.p_B1B2_C1__est, atol=1e-3)
        assert abs(pair.yaw_I1I2 - usual.yaw_I1I2) < 5e-3
    assert found.state.leader_position_error == pytest.approx(expected.state.leader_position_error, abs=1e-3)
    assert found.state.leader_yaw_error == pytest.approx(expected.state.leader_yaw_error, abs=1e-3)
    np.testing.assert_allclose(
        all_speeds([found]), all_speeds([expected]), atol=1.0
    )  # rad/s; the commands change by up to 31 in a step


@pytest.mark.parametrize("sensor", ["imu", "optic_flow", "range_bearing"])
def test_a_start_without_some_measurement_waits_and_then_flies_the_mission_from_its_beginning(
    flight: Flight, sensor: str
) -> None:
    controller = FormationController(CONFIG)
    for measurements in flight.measured[:3]:
        waiting = controller.step(replaced(measurements, "follower_2", **{sensor: None}))
        assert isinstance(waiting, Standby)
        assert "follower_2" in waiting.reason
    decision = controller.step(flight.measured[3])
    assert (decision.step, decision.stamp_ns) == (3, 150_000_000)
    for name in ("p_NB_N", "v_NB_N", "yaw_NB"):
        np.testing.assert_array_equal(
            getattr(decision.reference, name), getattr(flight.decided[0].reference, name)
        )
    later = replay(controller, flight.measured[4:28])
    phases = [each.reference.phase for each in later]
    assert phases.index("Q") + 4 == 20 + 3  # the second phase starts three steps late


@pytest.mark.parametrize(("bound_s", "steps"), [(0.0, 0), (0.2, 4), (5.0, 100)])
def test_the_wait_for_the_start_is_bounded(flight: Flight, bound_s: float, steps: int) -> None:
    scenario = paper_scenario(AGILE, f"controller.start_wait_max_s={bound_s}", seed=4)
    controller = FormationController(scenario.config)
    blind = replaced(flight.measured[0], "follower_2", optic_flow=None)
    for step in range(steps):
        at_step = dataclasses.replace(blind, step=step, arrival_ns=step * 50_000_000)
        assert isinstance(controller.step(at_step), Standby)
    message = (
        f"the flight cannot start: after {bound_s:g} s (controller.start_wait_max_s) there is still no optic "
        "flow of follower_2"
    )
    with pytest.raises(FlightError, match=f"^{re.escape(message)}$"):
        controller.step(dataclasses.replace(blind, step=steps, arrival_ns=steps * 50_000_000))


def test_a_request_while_the_start_is_waited_for_is_flown_from_the_start(flight: Flight) -> None:
    controller = FormationController(CONFIG)
    assert isinstance(controller.step(replaced(flight.measured[0], "leader", imu=None)), Standby)
    controller.set_formation({"follower_1": (-1.5, -0.75, 0.25), "follower_2": (-1.25, 0.5, -0.5)})
    assert isinstance(controller.step(replaced(flight.measured[1], "leader", imu=None)), Standby)
    decision = controller.step(flight.measured[2])
    np.testing.assert_allclose(decision.reference.formation["leader", "follower_1"], [-1.5, -0.75, 0.25])


class HoldEstimator:
    """An estimator without a plan: what is lost stays as it was."""

    estimates_disturbances = False

    def __init__(self) -> None:
        self._raw = RawEstimator(NAMES, np.radians(20.0), 0.05)
        self._before: Prediction | None = None
        self.applied: list[np.ndarray] = []

    def update(
        self,
        measurements: TeamMeasurements,
        applied: Mapping[int, AppliedInputs],
        predicted: Prediction | None,
    ) -> TeamEstimate | Waiting:
        ((start_ns, inputs),) = applied.items()
        assert start_ns == measurements.arrival_ns - 50_000_000
        assert not inputs.doubt.any()
        self.applied.append(inputs.thrusts)
        estimate = self._raw.update(measurements, applied, self._before)
        if isinstance(estimate, TeamEstimate):
            self._before = Prediction(estimate.states, estimate.geometry)
        return estimate


def test_another_estimator_can_be_injected(flight: Flight) -> None:
    estimator: Estimator = HoldEstimator()
    controller = FormationController(CONFIG, estimator=estimator)
    decisions = replay(controller, flight.measured[:6])
    np.testing.assert_array_equal(all_speeds(decisions), all_speeds(flight.decided[:6]))
    lossy = replaced(flight.measured[6], "leader", localization=None)
    held, predicted = controller.step(lossy), FormationController(CONFIG)
    replay(predicted, flight.measured[:6])
    assert held.state.leader_position_error != predicted.step(lossy).state.leader_position_error
    localization = flight.measured[5].by_vehicle["leader"].newest(LOCALIZATION)
    assert localization is not None
    assert held.state.leader_position_error == pytest.approx(
        np.linalg.norm(localization.p_NB_N - held.reference.p_NB_N)
    )
    thrusts = CONFIG.vehicle.thrust_coefficient * all_speeds(decisions) ** 2
    np.testing.assert_allclose(estimator.applied[0], CONFIG.vehicle.hover_thrust)
    np.testing.assert_allclose(estimator.applied[1:], thrusts)


def test_the_configuration_selects_the_estimator() -> None:
    assert CONFIG.controller.estimator.kind == "raw"
    assert isinstance(make_estimator(CONFIG), RawEstimator)
    for written in ("controller=team", "controller.estimator={kind: team}", "controller.estimator=team"):
        assert isinstance(make_estimator(paper_scenario(written).config), TeamEstimator)
    with pytest.raises(ConfigError, match=r"controller\.estimator"):
        paper_scenario("controller.estimator=guess")


LONG_STAGES = ("controller.stage_s=0.12", "controller.horizon_steps=4")


def test_with_long_stages_the_reference_is_sampled_at_them_and_commands_at_control_periods(
    flight: Flight,
) -> None:
    config = paper_scenario(AGILE, *LONG_STAGES, seed=4).config
    asked: list[np.ndarray] = []

    class Listening(ScenarioMission):
        def reference(self, stamps_ns: np.ndarray) -> MissionReference:
            asked.append(stamps_ns)
            return super().reference(stamps_ns)

    decisions = replay(FormationController(config, mission=Listening(config)), flight.measured[:3])
    assert asked[2][0] == 100_000_000  # now, for the telemetry
    np.testing.assert_array_equal(asked[2][1:], 100_000_000 + 120_000_000 * np.arange(5))
    for decision in decisions:
        for command in decision.commands.values():
            assert command.period_ns == 50_000_000
            # The stages start at 0, 0.12, 0.24 and 0.36 s, the control periods at 0, 0.05, ... 0.4 s.
            speeds = np.vstack([command.speeds, command.predicted_speeds])
            stages = [0, 0, 0, 1, 1, 2, 2, 2, 3]
            np.testing.assert_array_equal(speeds, speeds[[stages.index(stage) for stage in stages]])
            assert len(np.unique(speeds, axis=0)) == 4


def test_with_long_stages_the_shifted_plan_is_a_better_guess_than_the_plan_itself() -> None:
    kkt_first = {}
    for warm_start in ("transform", "hold"):
        solver = (f"controller.solver.warm_start={warm_start}", "controller.solver.kkt_tolerance=1.0e-3")
        horizon = ("controller.stage_s=0.12", "controller.horizon_steps=7")
        scenario = paper_scenario(AGILE, *NOISE_FREE, *horizon, *solver, seed=4)
        _, decided = record(scenario, N_STEPS)
        kkt_first[warm_start] = np.median([decision.solver.kkt_first for decision in decided[1:]])
    assert kkt_first["transform"] < 0.1 * kkt_first["hold"]


class TurnedMission(ScenarioMission):
    """The scenario after some more whole turns of the leader."""

    turns = 0

    def reference(self, stamps_ns: np.ndarray) -> MissionReference:
        asked = super().reference(stamps_ns)
        leader = dataclasses.replace(asked.leader, yaw_NB=asked.leader.yaw_NB + self.turns * 2.0 * np.pi)
        return dataclasses.replace(asked, leader=leader)


@pytest.mark.parametrize("turns", [-2, 3])
def test_whole_turns_of_the_leaders_reference_change_no_command(flight: Flight, turns: int) -> None:
    """A measured yaw is in (-pi, pi], the reference is continuous."""
    mission = TurnedMission(CONFIG)
    mission.turns = turns
    decisions = replay(FormationController(CONFIG, mission=mission), flight.measured[:12])
    np.testing.assert_allclose(all_speeds(decisions), all_speeds(flight.decided[:12]), atol=1e-6)
    assert max(abs(decision.state.leader_yaw_error) for decision in decisions) < 0.5


def test_prepare_next_needs_a_decision() -> None:
    with pytest.raises(RuntimeError, match="needs a solve"):
        FormationController(CONFIG).prepare_next()


def test_another_formation_by_request(flight: Flight) -> None:
    controller = FormationController(CONFIG)
    replay(controller, flight.measured[:3])
    controller.set_formation({"follower_1": (-1.5, -0.75, 0.25), "follower_2": (-1.25, 0.5, -0.5)})
    decision = controller.step(flight.measured[3])
    np.testing.assert_allclose(decision.reference.formation["leader", "follower_1"], [-1.5, -0.75, 0.25])
    np.testing.assert_allclose(decision.reference.formation["follower_2", "follower_1"], [-0.25, -1.25, 0.75])
    assert np.abs(all_speeds([decision]) - all_speeds([flight.decided[3]])).max() > 1.0
    with pytest.raises(ConfigError, match="no position for 'follower_2'"):
        controller.set_formation({"follower_1": (-1.5, -0.75, 0.25)})


WEIGHTS = ("controller.weights.formation_per_m2=25", "controller.weights.acceleration_per_m2_s4=0.02")
TORQUE = ("controller.weights.torque_per_n2_m2=4", "controller.weights.terminal_scale=2")


def other_weights(*overrides: str) -> WeightsConfig:
    return paper_scenario(*overrides).config.controller.weights


def test_weights_set_before_the_start_equal_configured_ones(flight: Flight) -> None:
    configured = FormationController(paper_scenario(AGILE, *WEIGHTS, *TORQUE, seed=4).config)
    changed = FormationController(CONFIG)
    changed.set_weights(other_weights(*WEIGHTS, *TORQUE))
    speeds = [all_speeds(replay(each, flight.measured[:5])) for each in (configured, changed)]
    np.testing.assert_array_equal(*speeds)


@pytest.mark.parametrize("warm_start", ["transform", "cold"])
def test_weights_hold_from_the_next_step_on_whenever_they_come(flight: Flight, warm_start: str) -> None:
    config = paper_scenario(AGILE, f"controller.solver.warm_start={warm_start}", seed=4).config
    before = replay(FormationController(config), flight.measured[:12])
    found = []
    for early in (True, False):
        controller = FormationController(config)
        decisions = replay(controller, flight.measured[:6])
        decisions.append(controller.feedback(flight.measured[6]))
        if early:
            controller.set_weights(other_weights(*WEIGHTS))
        controller.prepare_next()
        if not early:
            controller.set_weights(other_weights(*TORQUE))
            controller.set_weights(other_weights(*WEIGHTS))  # the last one counts
        found.append(all_speeds(decisions + replay(controller, flight.measured[7:12])))
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0][:7], all_speeds(before)[:7])
    assert np.abs(found[0][7] - all_speeds(before)[7]).max() > 1.0


def test_times_are_those_of_the_given_clock(flight: Flight) -> None:
    readings = itertools.count()
    controller = FormationController(CONFIG, clock=lambda: 0.5 * next(readings))
    _, decision = replay(controller, flight.measured[:2])
    assert decision.solver.prepare_time == 0.5
    assert decision.solver.feedback_time == 0.5 * (
        decision.solver.sqp_steps
    )  # read before the first, between them, and after the last


def test_all_warm_starts_find_the_same_solution_but_some_start_farther_away(exact: Flight) -> None:
    solver = ("controller.solver.sqp_steps_max=30", "controller.solver.kkt_tolerance=1.0e-6")
    decisions = {
        warm_start: replay(
            FormationController(
                paper_scenario(
                    AGILE, *NOISE_FREE, *solver, f"controller.solver.warm_start={warm_start}"
                ).config
            ),
            exact.measured,
        )
        for warm_start in ("transform", "shift", "hold", "cold")
    }
    for other in ("shift", "hold", "cold"):
        np.testing.assert_allclose(
            all_speeds(decisions[other]), all_speeds(decisions["transform"]), atol=0.05
        )
    kkt_first = {
        name: np.median([d.solver.kkt_first for d in found[1:]]) for name, found in decisions.items()
    }
    # A shift alone is no worse: embedding the measurement moves the plan as far as the frames move.
    assert kkt_first["transform"] < 0.1 * kkt_first["hold"] < 0.1 * kkt_first["cold"]
