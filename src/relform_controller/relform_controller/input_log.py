"""What the vehicles fly in each interval: as commanded, until they acknowledge what it really was.

From these inputs follow the thrusts of the rotors with their lag.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from relform_controller.ocp import layout
from relform_controller.ocp.rotor_lag import RotorLag, Rotors
from relform_core.arrays import Array
from relform_core.measurements import TeamMeasurements
from relform_core.sensors.applied_rotor_speeds import ACKNOWLEDGED_INTERVALS, APPLIED_ROTOR_SPEEDS
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_core.vehicle_config import VehicleConfig

SAME = 1e-9
"""Relative difference up to which an acknowledged thrust is the commanded one, rounded."""


class _Interval:
    """Thrusts of one interval."""

    def __init__(self, thrusts: Array) -> None:
        self.thrusts = thrusts
        """Best knowledge of what is commanded [N], shape (vehicle, 4); replaced, never changed in place."""
        self.is_acknowledged: npt.NDArray[np.bool_] = np.zeros(len(thrusts), dtype=np.bool_)


class InputLog:
    """The best knowledge of the inputs of all vehicles, by interval: the thrusts that their rotors aim at.

    A vehicle that has not acknowledged an interval is assumed to fly the command for it, and to hover before
    the first command.

    Args:
        vehicles: names in team order.
        period_ns: length of each interval.
        config: nominal vehicle.
    """

    def __init__(self, vehicles: tuple[str, ...], period_ns: int, config: VehicleConfig) -> None:
        self._vehicles = vehicles
        self._period_ns = period_ns
        self._period = period_ns / NANOSECONDS_PER_SECOND
        self._thrust_coefficient = config.thrust_coefficient
        self._hover = np.full((len(vehicles), layout.N_INPUT), config.hover_thrust)
        self._intervals: dict[int, _Interval] = {}
        """By start [ns]."""
        self._changed: set[int] = set()
        """Starts of the intervals that ``take_changes`` has not reported."""

    def command(self, start_ns: int, thrusts: Array) -> None:
        """Note the commands for an interval [N], shape (vehicle, 4), which nobody has flown yet."""
        self._intervals[start_ns] = _Interval(thrusts)
        self._changed.add(start_ns)

    def acknowledge(self, measurements: TeamMeasurements) -> None:
        """Take in what the vehicles report to have flown, and forget what no report will be about."""
        for vehicle, name in enumerate(self._vehicles):
            for report in measurements.by_vehicle[name].arrived(APPLIED_ROTOR_SPEEDS):
                for start_ns, speeds in zip(report.starts_ns, report.speeds, strict=True):
                    self._acknowledge(vehicle, start_ns, self._thrust_coefficient * speeds**2)
        oldest_ns = measurements.arrival_ns - 2 * ACKNOWLEDGED_INTERVALS * self._period_ns
        for start_ns in [each for each in self._intervals if each < oldest_ns]:
            del self._intervals[start_ns]
            self._changed.discard(start_ns)

    def thrusts(self, start_ns: int) -> Array:
        """Best knowledge of the inputs in an interval [N], shape (vehicle, 4)."""
        return self._interval(start_ns).thrusts

    def rotors(self, start_ns: int, lag: RotorLag) -> Rotors:
        """The rotors at the start of an interval."""
        rotors = Rotors(lag, self._hover)
        for before_ns in sorted(each for each in self._intervals if each < start_ns):
            rotors = rotors.after(self._intervals[before_ns].thrusts, self._period)
        return rotors

    def mean_thrusts(self, start_ns: int, lag: RotorLag) -> Array:
        """Mean thrusts of the rotors in an interval [N], shape (vehicle, 4)."""
        return self.rotors(start_ns, lag).mean(self.thrusts(start_ns), self._period)

    def take_changes(self, now_ns: int) -> Mapping[int, Array]:
        """Intervals that ended until now and became known or changed since the last call.

        Returns:
            Thrusts [N], shape (vehicle, 4), by start of the interval [ns], in this order.
        """
        self._interval(now_ns - self._period_ns)
        taken = sorted(start_ns for start_ns in self._changed if start_ns < now_ns)
        self._changed.difference_update(taken)
        return {start_ns: self._intervals[start_ns].thrusts for start_ns in taken}

    def _interval(self, start_ns: int) -> _Interval:
        if start_ns not in self._intervals:
            self.command(start_ns, self._hover)
        return self._intervals[start_ns]

    def _acknowledge(self, vehicle: int, start_ns: int, thrusts: Array) -> None:
        interval = self._interval(start_ns)
        if interval.is_acknowledged[vehicle]:
            return
        interval.is_acknowledged[vehicle] = True
        if not np.allclose(thrusts, interval.thrusts[vehicle], rtol=SAME, atol=0.0):
            interval.thrusts = interval.thrusts.copy()
            interval.thrusts[vehicle] = thrusts
            self._changed.add(start_ns)
