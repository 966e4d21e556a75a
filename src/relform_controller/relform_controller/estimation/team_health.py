"""How complete the measurements of the team are, in words that people can act on."""

from collections.abc import Iterator, Mapping, Sequence

from relform_controller.estimation.estimator import listed
from relform_core.measurements import TeamMeasurements
from relform_core.names import EstimatorMode
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_core.units import NANOSECONDS_PER_SECOND

SILENT_AFTER_NS = NANOSECONDS_PER_SECOND // 2
"""A sensor that has measured nothing for so long is silent [ns]."""


class TeamHealth:
    """Remembers when each sensor last measured, and when each vehicle last saw each other.

    Args:
        sensors: names of the sensors that the estimator uses, by vehicle in team order.
        targets: the vehicles that each vehicle may see.
        start_ns: start of the flight.
    """

    def __init__(
        self, sensors: Mapping[str, Sequence[str]], targets: Mapping[str, Sequence[str]], start_ns: int
    ) -> None:
        self._last_ns = {
            f"{sensor} of {vehicle}": start_ns for vehicle, each in sensors.items() for sensor in each
        }
        self._last_seen_ns = {
            (observer, target): start_ns for observer, seen in targets.items() for target in seen
        }
        self._missing: list[str] = []
        self._seen: set[tuple[str, str]] = set()

    def note(self, measurements: TeamMeasurements) -> None:
        """What arrived in one control step."""
        arrived = set()
        self._seen = set()
        for vehicle, each in measurements.by_vehicle.items():
            for sensor, values in each.by_sensor.items():
                if (name := f"{sensor} of {vehicle}") in self._last_ns:
                    arrived.add(name)
                    self._last_ns[name] = max(self._last_ns[name], values[-1].stamp_ns)
            for bearings in each.arrived(RANGE_BEARING):
                for target in bearings.by_target:
                    self._seen.add((vehicle, target))
                    last_ns = self._last_seen_ns.get((vehicle, target), bearings.stamp_ns)
                    self._last_seen_ns[vehicle, target] = max(last_ns, bearings.stamp_ns)
        self._missing = [name for name in self._last_ns if name not in arrived]

    def see_each_other(self, one: str, other: str) -> bool:
        """Whether sightings of two vehicles by each other arrived in this step."""
        return (one, other) in self._seen and (other, one) in self._seen

    def judge(self, now_ns: int, contradictions: Sequence[str]) -> tuple[EstimatorMode, str]:
        """Mode of the estimate and its reason.

        Args:
            contradictions: what the filter found to be wrong in this step.
        """
        if degraded := [*contradictions, *self._silent(now_ns)]:
            return EstimatorMode.DEGRADED, listed(degraded)
        if self._missing:
            return EstimatorMode.PREDICTED, listed(self._missing)
        return EstimatorMode.MEASURED, ""

    def _silent(self, now_ns: int) -> Iterator[str]:
        silent = set()
        for name, last_ns in self._last_ns.items():
            if now_ns - last_ns >= SILENT_AFTER_NS:
                silent.add(name)
                yield f"no {name} for {_seconds(now_ns - last_ns)}"
        for (observer, target), last_ns in self._last_seen_ns.items():
            if now_ns - last_ns >= SILENT_AFTER_NS and f"{RANGE_BEARING.name} of {observer}" not in silent:
                yield f"{observer} has not seen {target} for {_seconds(now_ns - last_ns)}"


def _seconds(duration_ns: int) -> str:
    return f"{duration_ns / NANOSECONDS_PER_SECOND:.1f} s"
