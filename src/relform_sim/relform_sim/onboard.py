"""Onboard logic of a vehicle: the rotor speeds of each interval, from a command, a plan or the failsafe.

It knows what arrives over the link and what the vehicle's own sensors measure, nothing else: a rule of
import-linter forbids the plant and the ground truth here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array
from relform_core.flight_modes import Request, VehicleMode
from relform_core.measurements import RotorCommand
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.sonar import Sonar
from relform_core.units import seconds_to_ns
from relform_core.vehicle_config import FailsafeConfig, VehicleConfig
from relform_sim.failsafe import Failsafe

EARLY_MAX = 1.0
"""How long before its stamp a command may arrive [s]."""


@dataclass
class OnboardCounts:
    """How often, since the start, the vehicle flew without a fresh command, and why."""

    missing: int = 0
    """Intervals for which no command arrived."""
    rejected: int = 0
    """Commands that arrived and were rejected: malformed, not finite, old, or too early."""
    replayed: int = 0
    """Intervals flown on the predicted sequence of an earlier command."""
    failsafe: int = 0
    """Intervals flown by the failsafe, because no plan was left."""
    hovered: int = 0
    """Intervals before the first good command."""
    disarmed: int = 0
    """Intervals with motors off, after the failsafe has brought the vehicle to the ground."""


class Onboard:
    """Flies the newest good command; without one, its predicted sequence for a while; then the failsafe.

    Before its first good command the vehicle hovers, because the controller may still wait for measurements.

    A command applies from its stamp on. One that arrives early is kept until then; of one that arrives late,
    its plan for the interval is flown.

    Near the ground the failsafe switches the motors off, and they stay off.
    """

    def __init__(self, config: VehicleConfig, period: float) -> None:
        """Vehicle, and length of the intervals [s]."""
        self._speed_min = config.rotor_speed_min
        self._speed_max = config.rotor_speed_max
        self._failsafe = Failsafe(config, period)
        self._last: RotorCommand | None = None
        """The newest command that applies already."""
        self._early: dict[int, RotorCommand] = {}
        """Those to come, by stamp [ns]."""
        self._hears = False
        """Whether a command has arrived within the present interval."""
        self._replays = False
        """Whether the present interval counts as flown on an earlier command."""
        self._is_disarmed = False
        self.mode = VehicleMode.HOVERING
        """What the vehicle does."""
        self.reason = ""
        """Why, for people."""
        self.flown_stamp_ns: int | None = None
        """Stamp of the command whose plan the last interval was flown by [ns]; None: by none."""
        self.counts = OnboardCounts()
        self.set_limits(config.failsafe)

    def set_limits(self, config: FailsafeConfig) -> None:
        """Apply other limits from the next interval on."""
        self._plan_max_ns = seconds_to_ns(config.plan_max)
        self._failsafe.descent_speed = config.descent_speed

    def rotor_speeds(
        self,
        stamp_ns: int,
        commands: Sequence[RotorCommand],
        imu: Imu,
        optic_flow: OpticFlow,
        sonar: Sonar,
    ) -> Array:
        """Rotor speeds of one interval, within the limits or all zero [rad/s], shape (4,).

        Args:
            stamp_ns: start of the interval.
            commands: what has arrived since the interval before, in order of arrival.
            imu: the vehicle's own, at the start of the interval.
            optic_flow: likewise.
            sonar: likewise.
        """
        if not commands and not self._hears:
            self.counts.missing += 1
        self._hears = False
        self._take(commands, stamp_ns)
        self.flown_stamp_ns = None
        if self._is_disarmed:
            self.counts.disarmed += 1
            self.mode = VehicleMode.STOPPED
            return np.zeros(4)
        if self._last is None:
            self.counts.hovered += 1
            self.mode = VehicleMode.HOVERING
            speeds = self._failsafe.hover(imu, optic_flow)
        elif (planned := self._planned(stamp_ns, self._last)) is not None:
            self.flown_stamp_ns = self._last.stamp_ns
            self._replays = stamp_ns - self._last.stamp_ns >= self._last.period_ns
            self.counts.replayed += self._replays
            self.mode = VehicleMode.FLYING
            speeds = planned
        else:
            self.counts.failsafe += 1
            self.mode = VehicleMode.FAILSAFE
            self._is_disarmed = sonar.range <= sonar.range_min  # from the next interval on
            speeds = self._failsafe.sink(imu, optic_flow)
        return np.clip(speeds, self._speed_min, self._speed_max)

    def update(self, now_ns: int, commands: Sequence[RotorCommand]) -> Array | None:
        """Take commands within an interval: a vehicle that flies a plan changes to a newer one at once.

        Everything else that commands ask for waits for the next interval.

        Args:
            now_ns: an instant within the interval of the last call of ``rotor_speeds``; never decreases.
            commands: what has arrived since the call before, in order of arrival.
        Returns:
            Rotor speeds of the rest of the interval, within the limits [rad/s], shape (4,); None: as before.
        """
        self._hears |= bool(commands)
        before = self._last
        self._take(commands, now_ns)
        if self.flown_stamp_ns is None or self._last is None or self._last is before:
            return None
        planned = self._planned(now_ns, self._last) if self._last.request is Request.FLY else None
        if planned is None:
            return None
        self.flown_stamp_ns = self._last.stamp_ns
        if self._replays and now_ns - self._last.stamp_ns < self._last.period_ns:
            self._replays = False
            self.counts.replayed -= 1
        return np.clip(planned, self._speed_min, self._speed_max)

    def _take(self, commands: Sequence[RotorCommand], now_ns: int) -> None:
        """Keep the good ones among commands that have arrived, and let those apply that are due."""
        for command in commands:
            if self._acceptable(command, now_ns):
                self._early[command.stamp_ns] = command
            else:
                self.counts.rejected += 1
        for due_ns in sorted(each for each in self._early if each <= now_ns):
            self._last = self._early.pop(due_ns)

    def _acceptable(self, command: RotorCommand, stamp_ns: int) -> bool:
        """Whether a command is well formed, new, newer than the one that is flown, and not too early."""
        return (
            command.period_ns > 0
            and command.speeds.shape == (4,)
            and command.predicted_speeds.shape[1:] == (4,)
            and bool(np.isfinite(command.speeds).all())
            and bool(np.isfinite(command.predicted_speeds).all())
            and (self._last is None or command.stamp_ns > self._last.stamp_ns)
            and command.stamp_ns not in self._early
            and command.stamp_ns <= stamp_ns + seconds_to_ns(EARLY_MAX)
        )

    def _planned(self, stamp_ns: int, last: RotorCommand) -> Array | None:
        """Speeds of a command for the interval that starts at ``stamp_ns``; None: its plan is over."""
        age_ns = stamp_ns - last.stamp_ns
        intervals_later = age_ns // last.period_ns
        if intervals_later == 0:
            return last.speeds
        if age_ns > self._plan_max_ns or intervals_later > len(last.predicted_speeds):
            return None
        predicted: Array = last.predicted_speeds[intervals_later - 1]
        return predicted
