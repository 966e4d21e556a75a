"""A controller that is late leaves out steps, as in real time: the vehicles fly its plan meanwhile."""

from collections.abc import Iterator

import numpy as np

from relform_analysis.flight.log_builder import FlightLogBuilder
from relform_analysis.flight.metrics import flight_metrics
from relform_controller.blas import one_blas_thread
from relform_controller.formation_controller import FormationController
from relform_core.measurements import RotorCommand, TeamMeasurements, VehicleMeasurements
from relform_core.telemetry import Decision
from relform_sim.vehicle import Vehicle
from support.scenarios import paper_scenario

SCENARIO = paper_scenario("controller.estimator=team", "pacing=real_time", seed=5)
CONFIG = SCENARIO.config
PHASE_D = CONFIG.phase_starts[3]
CHANGE = range(PHASE_D, PHASE_D + 6)
"""Steps around the change of formation, later than planned by the time that the team holds its place."""
SKIPPED = {*range(17, CONFIG.n_steps, 13), *CHANGE}


def fly(log: FlightLogBuilder) -> Iterator[Decision]:
    """The decisions of a flight, whose commands arrive 12 ms after the measurements."""
    vehicles = {name: Vehicle(CONFIG, SCENARIO.seed, name) for name in CONFIG.team.vehicles}
    controller = FormationController(CONFIG)
    commands: dict[str, RotorCommand] = {}
    waiting: dict[str, list[VehicleMeasurements]] = {name: [] for name in vehicles}
    for step in range(CONFIG.n_steps):
        for name, command in commands.items():
            vehicles[name].receive(command, (step - 1) * CONFIG.period_ns + 12_000_000)
        truth = {name: vehicle.advance(step) for name, vehicle in vehicles.items()}
        for name, vehicle in vehicles.items():
            waiting[name].append(vehicle.measure(step, truth))
            log.add_ground_truth(name, truth[name])
            assert vehicle.fault(step, truth) is None
        commands = {}
        if step in SKIPPED:
            continue
        arrived = {
            name: VehicleMeasurements.collect(
                (source, measurement)
                for measurements in each
                for source in CONFIG.sources_of(name)
                for measurement in measurements.arrived(source)
            )
            for name, each in waiting.items()
        }
        waiting = {name: [] for name in vehicles}
        decision = controller.step(TeamMeasurements(step, step * CONFIG.period_ns, arrived))
        assert isinstance(decision, Decision)
        log.add_decision(decision)
        commands = dict(decision.commands)
        yield decision


def test_the_team_flies_on_and_no_phase_is_missed() -> None:
    log = FlightLogBuilder(SCENARIO)
    with one_blas_thread():
        decisions = list(fly(log))
    assert [decision.step for decision in decisions] == [
        step for step in range(CONFIG.n_steps) if step not in SKIPPED
    ]
    assert flight_metrics(log.build()).score.formation.steady.mean < 0.015
    asked = {decision.step: decision.reference.formation["leader", "follower_1"] for decision in decisions}
    wide = CONFIG.formations["wide"]["follower_1"]
    assert not np.allclose(asked[PHASE_D - 1], wide)
    assert np.allclose(asked[CHANGE.stop], wide)
