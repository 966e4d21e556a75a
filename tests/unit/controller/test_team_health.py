"""Mode and reason of the team estimate."""

import numpy as np
import pytest

from relform_controller.estimation.team_health import TeamHealth
from relform_core.measurements import TeamMeasurements, VehicleMeasurements
from relform_core.names import EstimatorMode
from relform_core.sensors.range_bearing import RangeBearing, RangeBearings
from relform_core.sensors.sonar import Sonar

SENSORS = {"leader": ["sonar", "range_bearing"], "wing": ["sonar", "range_bearing"]}
TARGETS = {"leader": ["wing"], "wing": ["leader"]}
PERIOD_NS = 100_000_000


def step(k: int, *silent: str, delay: int = 0) -> TeamMeasurements:
    """All sensors measure except the silent ones; ``wing>leader`` is a sighting."""
    by_vehicle = {}
    stamp_ns = (k - delay) * PERIOD_NS
    for name, other in (("leader", "wing"), ("wing", "leader")):
        seen = RangeBearing(other, 1.5, 0.4, -0.2, 1e-3 * np.eye(3))
        targets = {} if f"{name}>{other}" in silent else {other: seen}
        measured = {
            "sonar": (Sonar(stamp_ns, 1.2, 0.1, 5.0, 0.4),),
            "range_bearing": (RangeBearings(stamp_ns, targets),),
        }
        by_vehicle[name] = VehicleMeasurements(
            {sensor: each for sensor, each in measured.items() if f"{sensor} of {name}" not in silent}
        )
    return TeamMeasurements(k, k * PERIOD_NS, by_vehicle)


def judged(*steps: TeamMeasurements, found: tuple[str, ...] = ()) -> tuple[EstimatorMode, str]:
    health = TeamHealth(SENSORS, TARGETS, start_ns=0)
    for each in steps:
        health.note(each)
    return health.judge(steps[-1].arrival_ns, found)


def test_everything_measured() -> None:
    assert judged(step(0), step(1)) == (EstimatorMode.MEASURED, "")


def test_everything_measured_late() -> None:
    """A delay of the link is no loss."""
    assert judged(*(step(k, delay=2) for k in range(2, 12))) == (EstimatorMode.MEASURED, "")


def test_a_single_loss() -> None:
    assert judged(step(0), step(1, "sonar of wing")) == (EstimatorMode.PREDICTED, "sonar of wing")


@pytest.mark.parametrize(
    ("silent", "reason"),
    [
        ("sonar of wing", "no sonar of wing for 0.7 s"),
        ("range_bearing of leader", "no range_bearing of leader for 0.7 s"),
        ("wing>leader", "wing has not seen leader for 0.7 s"),
    ],
)
def test_a_silent_sensor(silent: str, reason: str) -> None:
    steps = [step(k) for k in range(4)] + [step(k, silent) for k in range(4, 11)]
    assert judged(*steps) == (EstimatorMode.DEGRADED, reason)
    assert judged(*steps[:7])[0] is not EstimatorMode.DEGRADED
    assert judged(*steps, step(11)) == (EstimatorMode.MEASURED, "")


def test_contradictions_come_first() -> None:
    lost = step(1, "sonar of wing")
    assert judged(step(0), lost, found=("it jumped",)) == (EstimatorMode.DEGRADED, "it jumped")


def test_who_sees_each_other() -> None:
    health = TeamHealth(SENSORS, TARGETS, start_ns=0)
    health.note(step(0))
    assert health.see_each_other("leader", "wing")
    health.note(step(1, "wing>leader"))
    assert not health.see_each_other("leader", "wing")


def test_a_vehicle_outside_of_the_sensing_graph_is_not_missed() -> None:
    health = TeamHealth(SENSORS, {"leader": ["wing"], "wing": []}, start_ns=0)
    for k in range(12):
        health.note(step(k, "wing>leader"))
    assert health.judge(11 * PERIOD_NS, ()) == (EstimatorMode.MEASURED, "")
