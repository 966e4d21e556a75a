"""What the vehicles fly in each interval: as commanded, until they acknowledge what it really was.

From these inputs follow the thrusts of the rotors with their lag.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from relform_controller.estimation.estimator import AppliedInputs
from relform_controller.ocp import layout
from relform_controller.ocp.rotor_lag import RotorLag, Rotors
from relform_core.arrays import Array, Mask
from relform_core.measurements import TeamMeasurements
from relform_core.sensors.applied_rotor_speeds import ACKNOWLEDGED_INTERVALS, APPLIED_ROTOR_SPEEDS
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_core.vehicle_config import VehicleConfig

SAME = 1e-9
"""Relative difference up to which an acknowledged thrust is the commanded one, rounded."""


class _Interval:
    """Thrusts of one interval."""

    def __init__(self, planned: Array) -> None:
        self.planned = planned
        """By the command for it, this interval and those that follow [N], shape (vehicle, interval, 4)."""
        self.thrusts: Array = planned[:, 0]
        """Best knowledge of what is commanded [N], shape (vehicle, 4); replaced, never changed in place."""
        self.is_acknowledged: Mask = np.zeros(len(planned), dtype=np.bool_)
        self.is_doubted: Mask = np.zeros(len(planned), dtype=np.bool_)
        """By vehicle, whether it was reported with doubt."""


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
        self._newest: list[tuple[int, int | None]] = [(0, None)] * len(vehicles)
        """By vehicle: end of the newest interval that it has acknowledged, and stamp of the command whose
        plan it flew there [ns]; None: none."""
        self._changed: set[int] = set()
        """Starts of the intervals that ``take_changes`` has not reported."""

    def command(self, start_ns: int, planned: Array) -> None:
        """Note the commands for an interval, which nobody has flown yet.

        Args:
            start_ns: of the interval.
            planned: for this interval and those that follow [N], shape (vehicle, interval, 4).
        """
        self._intervals[start_ns] = _Interval(planned)
        self._changed.add(start_ns)

    def plan_continues(self, start_ns: int) -> None:
        """Note that there is no command for an interval: the plan of the interval before continues."""
        before = self._intervals.get(start_ns - self._period_ns)
        if before is not None and before.planned.shape[1] > 1:
            self.command(start_ns, before.planned[:, 1:])

    def acknowledge(self, measurements: TeamMeasurements) -> None:
        """Take in what the vehicles report to have flown, and forget what no report will be about."""
        for vehicle, name in enumerate(self._vehicles):
            for report in measurements.by_vehicle[name].arrived(APPLIED_ROTOR_SPEEDS):
                if report.stamp_ns > self._newest[vehicle][0]:
                    self._newest[vehicle] = report.stamp_ns, report.command_stamp_ns
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
        past_ns = sorted(each for each in self._intervals if each < start_ns)
        if lag.time_constant == 0.0:
            past_ns = past_ns[-1:]  # the thrusts are those of the last command
        for before_ns in past_ns:
            rotors = rotors.after(self._intervals[before_ns].thrusts, self._period)
        return rotors

    def mean_thrusts(self, start_ns: int, end_ns: int, lag: RotorLag) -> Iterator[Array]:
        """Mean thrusts of the rotors in each interval from one instant to another [N], shape (vehicle, 4)."""
        rotors = self.rotors(start_ns, lag)
        for each_ns in range(start_ns, end_ns, self._period_ns):
            commanded = self.thrusts(each_ns)
            yield rotors.mean(commanded, self._period)
            rotors = rotors.after(commanded, self._period)

    def take_changes(self, now_ns: int) -> Mapping[int, AppliedInputs]:
        """Intervals that ended until now and became known or changed since the last call.

        Returns:
            By start of the interval [ns], in this order.
        """
        self._interval(now_ns - self._period_ns)
        taken = sorted(start_ns for start_ns in self._changed if start_ns < now_ns)
        self._changed.difference_update(taken)
        return {
            start_ns: AppliedInputs(self._intervals[start_ns].thrusts, self._doubt(start_ns))
            for start_ns in taken
        }

    def _doubt(self, start_ns: int) -> Array:
        """What is added to the thrusts of an interval if the plans last known to be flown continue."""
        interval = self._intervals[start_ns]
        doubt = np.zeros_like(interval.thrusts)
        for vehicle, (_, command_ns) in enumerate(self._newest):
            flown = self._intervals.get(command_ns) if command_ns is not None else None
            if flown is None or command_ns is None or interval.is_acknowledged[vehicle]:
                continue
            later = (start_ns - command_ns) // self._period_ns
            if 0 < later < flown.planned.shape[1]:
                doubt[vehicle] = flown.planned[vehicle, later] - interval.thrusts[vehicle]
        interval.is_doubted = np.asarray(doubt.any(axis=1))
        return doubt

    def _interval(self, start_ns: int) -> _Interval:
        if start_ns not in self._intervals:
            self.command(start_ns, self._hover[:, None])
        return self._intervals[start_ns]

    def _acknowledge(self, vehicle: int, start_ns: int, thrusts: Array) -> None:
        interval = self._interval(start_ns)
        if interval.is_acknowledged[vehicle]:
            return
        interval.is_acknowledged[vehicle] = True
        is_same = np.allclose(thrusts, interval.thrusts[vehicle], rtol=SAME, atol=0.0)
        if not is_same:
            interval.thrusts = interval.thrusts.copy()
            interval.thrusts[vehicle] = thrusts
        if not is_same or interval.is_doubted[vehicle]:
            self._changed.add(start_ns)
