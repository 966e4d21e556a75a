"""Teams at rest and what their team estimator makes of the first measurements."""

import dataclasses
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from relform_controller.estimation.team import TeamEstimator
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.sensors.range_bearing import RANGE_BEARING, RangeBearing
from support.scenarios import paper_scenario, team_of
from support.world import TrueVehicle, measure, random_team

Change = Callable[[str, str, RangeBearing], RangeBearing | None]
"""From observer, target and sighting to another sighting; None: it is lost."""


def names_of(n_vehicles: int) -> tuple[str, ...]:
    """The leader and its followers."""
    return ("leader", *(f"follower_{number}" for number in range(1, n_vehicles)))


def estimator_of(n_vehicles: int) -> TeamEstimator:
    """A new team estimator of the paper's vehicles and sensors."""
    return TeamEstimator(paper_scenario(*team_of(n_vehicles)).config)


def resting_team(generator: np.random.Generator, n_vehicles: int) -> tuple[TrueVehicle, ...]:
    """A team anywhere, with any yaws, nearly level and at rest."""
    still = {"v_NB_N": np.zeros(3), "w_NB_B": np.zeros(3)}
    return tuple(
        dataclasses.replace(vehicle, **still) for vehicle in random_team(generator, n_vehicles, tilt_max=0.05)
    )


def measured(team: Sequence[TrueVehicle], step: int = 0) -> TeamMeasurements:
    """What a team measures without noise; followers have any yaw offset of the IMU."""
    offsets = [0.0, *np.linspace(1.0, 2.5, len(team) - 1)]
    return measure(team, names_of(len(team)), step, offsets)


def seen_along(measurements: TeamMeasurements, edges: Iterable[tuple[int, int]]) -> TeamMeasurements:
    """The same with the mutual sightings of these vehicles only."""
    names = list(measurements.by_vehicle)
    kept = {(names[i], names[j]) for i, j in edges} | {(names[j], names[i]) for i, j in edges}

    def keep(observer: str, target: str, seen: RangeBearing) -> RangeBearing | None:
        return seen if (observer, target) in kept else None

    return with_sightings(measurements, keep)


def with_sightings(measurements: TeamMeasurements, change: Change) -> TeamMeasurements:
    """The same with other sightings."""
    by_vehicle = {}
    for observer, vehicle in measurements.by_vehicle.items():
        sights = vehicle.newest(RANGE_BEARING)
        assert sights is not None
        changed = {target: change(observer, target, seen) for target, seen in sights.by_target.items()}
        by_target = {target: seen for target, seen in changed.items() if seen is not None}
        arrived = (dataclasses.replace(sights, by_target=by_target),)
        by_vehicle[observer] = VehicleMeasurements({**vehicle.by_sensor, RANGE_BEARING.name: arrived})
    return dataclasses.replace(measurements, by_vehicle=by_vehicle)
