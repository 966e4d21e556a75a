"""Onboard logic of a vehicle: the rotor speeds of each interval, from a command, a plan or its own pilot.

It knows what arrives over the link and what the vehicle's own sensors measure, nothing else: a rule of
import-linter forbids the plant and the ground truth here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relform_core.arrays import Array
from relform_core.flight_modes import Request, VehicleMode
from relform_core.geofence_config import GeofenceConfig
from relform_core.ground_config import GroundConfig
from relform_core.measurements import RotorCommand
from relform_core.separation_config import SeparationConfig
from relform_core.units import seconds_to_ns
from relform_core.vehicle_config import FailsafeConfig, VehicleConfig
from relform_sim.autopilot import Autopilot
from relform_sim.ceiling import Ceiling
from relform_sim.evasion import Evasion
from relform_sim.failsafe import Failsafe
from relform_sim.inbox import Inbox, planned_speeds
from relform_sim.mode_table import Happening, ModeMachine
from relform_sim.pilot import Guard, Pilot, Readings
from relform_sim.thrust_meter import ThrustMeter
from relform_sim.vertical_thrust import VerticalThrust


@dataclass
class OnboardCounts:
    """How often, since the start, the vehicle flew without a fresh command, and why."""

    missing: int = 0
    """Intervals for which no command arrived."""
    rejected: int = 0
    """Commands that arrived and were rejected: malformed, not finite, old, or too early."""
    refused: int = 0
    """Intervals in which the newest command asked for what the mode does not allow."""
    replayed: int = 0
    """Intervals flown on the predicted sequence of an earlier command."""
    failsafe: int = 0
    """Intervals flown by the failsafe, because no plan was left."""
    hovered: int = 0
    """Intervals before the first good command, in the air."""
    disarmed: int = 0
    """Intervals with motors off for good, because the failsafe has landed or the controller asked for it."""
    evaded: int = 0
    """Intervals in which the vehicle rose or sank, because another one was too close."""
    lowered: int = 0
    """Intervals in which the vehicle sank, because it was above the geofence."""


_GUARDED = frozenset({VehicleMode.HOVERING, VehicleMode.FLYING, VehicleMode.FAILSAFE})
"""Modes in which guards act; vehicles that take off or land side by side do not evade each other."""
_ON_THE_GROUND = frozenset({VehicleMode.IDLE, VehicleMode.ARMED, VehicleMode.STOPPED})
_EVASION, _CEILING = "evasion", "ceiling"
"""Names of guards."""


class Onboard:
    """Flies the newest good command; without one, its predicted sequence for a while; then on its own.

    Where there is a ground, the vehicle takes off and lands as its controller asks. Where
    there is none, it hovers before its first good command, because the controller may still wait for
    measurements, and near the ground its failsafe switches the motors off.
    """

    def __init__(
        self,
        config: VehicleConfig,
        period: float,
        ground: GroundConfig | None = None,
        height: float = 0.0,
        separation: SeparationConfig | None = None,
        geofence: GeofenceConfig | None = None,
        *,
        is_airborne: bool = False,
    ) -> None:
        """Start on the ground, if there is one.

        Args:
            config: nominal vehicle.
            period: length of the intervals [s].
            ground: how it takes off and lands; None: it does not.
            height: to which it takes off [m].
            separation: when it evades other vehicles; None: never.
            geofence: below which height it stays; None: any.
            is_airborne: it starts in the air, at this height.
        """
        self._speed_min = config.rotor_speed_min
        self._speed_max = config.rotor_speed_max
        self._pilot: Pilot
        if ground is None:
            self._pilot = Failsafe(config, period)
            self._machine = ModeMachine(VehicleMode.HOVERING)
        else:
            self._pilot = Autopilot(config, period, ground, height)
            self._machine = ModeMachine(VehicleMode.HOVERING if is_airborne else VehicleMode.IDLE)
        self._guards: dict[str, Guard] = {}
        """By name; the first that acts comes first."""
        if separation is not None and separation.reaction == "evade":
            self._guards[_EVASION] = Evasion(period, separation)
        if geofence is not None:
            self._guards[_CEILING] = Ceiling(geofence)
        self._thrust_meter: ThrustMeter | None = None
        if config.thrust_min is not None:
            self._thrust_meter = ThrustMeter(config, period, config.thrust_min)
        self._vertical_thrust = VerticalThrust(config)
        self._readings: Readings | None = None
        """At the start of the present interval."""
        self._inbox = Inbox()
        self._hears = False
        """Whether a command has arrived within the present interval."""
        self._replays = False
        """Whether the present interval counts as flown on an earlier command."""
        self._applied = np.full(4, config.hover_speed if is_airborne else 0.0)
        """The newest rotor speeds [rad/s]."""
        self.flown_stamp_ns: int | None = None
        """Stamp of the command whose plan the last interval was flown by [ns]; None: by none."""
        self.counts = OnboardCounts()
        self.set_limits(config.failsafe)

    @property
    def mode(self) -> VehicleMode:
        """What the vehicle does."""
        return self._machine.mode

    @property
    def reason(self) -> str:
        """Why it is in its mode, or why it refuses the present request; for people."""
        return self._machine.reason

    @property
    def thrust_share(self) -> float | None:
        """Measured thrust over nominal thrust; None: it is not watched."""
        return None if self._thrust_meter is None else self._thrust_meter.share

    def set_limits(self, config: FailsafeConfig) -> None:
        """Apply other limits from the next interval on."""
        self._plan_max_ns = seconds_to_ns(config.plan_max)
        self._pilot.failsafe_speed = config.descent_speed

    def rotor_speeds(self, stamp_ns: int, commands: Sequence[RotorCommand], readings: Readings) -> Array:
        """Rotor speeds of one interval, within the limits or all zero [rad/s], shape (4,).

        Args:
            stamp_ns: start of the interval.
            commands: what has arrived since the interval before, in order of arrival.
            readings: the vehicle's own, at the start of the interval.
        """
        if not commands and not self._hears:
            self.counts.missing += 1
        self._hears = False
        self.counts.rejected += self._inbox.take(stamp_ns, commands)
        self._pilot.sense(readings, self.mode, self._applied)
        self._readings = readings
        for guard in self._guards.values():
            guard.sense(readings)
        if self._thrust_meter is not None:
            if self.mode in _ON_THE_GROUND:
                self._thrust_meter.reset()
            else:
                self._thrust_meter.sense(readings, self._applied)
        plan = self._inbox.newest_to_fly
        planned = None if plan is None else planned_speeds(plan, stamp_ns, self._plan_max_ns)
        self._change_mode(stamp_ns, has_plan=planned is not None)

        self.flown_stamp_ns = None
        if self.mode is VehicleMode.FLYING and plan is not None and planned is not None:
            self.flown_stamp_ns = plan.stamp_ns
            self._replays = stamp_ns - plan.stamp_ns >= plan.period_ns
            self.counts.replayed += self._replays
            self._applied = np.clip(planned, self._speed_min, self._speed_max)
        elif self.mode in (VehicleMode.IDLE, VehicleMode.STOPPED):
            self.counts.disarmed += self.mode is VehicleMode.STOPPED
            self._applied = np.zeros(4)
        elif self.mode is VehicleMode.ARMED:
            self._applied = np.full(4, self._speed_min)
        else:
            self.counts.failsafe += self.mode is VehicleMode.FAILSAFE
            self.counts.hovered += self._inbox.newest is None
            speeds = self._pilot.rotor_speeds(self.mode)
            self._applied = np.clip(speeds, self._speed_min, self._speed_max)
        acting = self._guard(readings)
        self.counts.evaded += acting == _EVASION
        self.counts.lowered += acting == _CEILING
        return self._applied

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
        before = self._inbox.newest
        self.counts.rejected += self._inbox.take(now_ns, commands)
        newest = self._inbox.newest
        if self.flown_stamp_ns is None or newest is None or newest is before:
            return None
        wants_to_fly = newest.request is Request.FLY
        planned = planned_speeds(newest, now_ns, self._plan_max_ns) if wants_to_fly else None
        if planned is None:
            return None
        self.flown_stamp_ns = newest.stamp_ns
        if self._replays and now_ns - newest.stamp_ns < newest.period_ns:
            self._replays = False
            self.counts.replayed -= 1
        self._applied = np.clip(planned, self._speed_min, self._speed_max)
        if self._readings is not None:
            self._guard(self._readings)
        return self._applied

    def _guard(self, readings: Readings) -> str | None:
        """Change the newest rotor speeds as the first guard asks that does; its name, or None."""
        for name, guard in self._guards.items() if self.mode in _GUARDED else ():
            if guard.climb is not None:
                self._applied = self._vertical_thrust.rotor_speeds(self._applied, readings, guard.climb)
                return name
        return None

    def _change_mode(self, stamp_ns: int, *, has_plan: bool) -> None:
        newest = self._inbox.newest
        is_silent = newest is not None and stamp_ns - newest.stamp_ns > self._plan_max_ns
        wants_to_fly = newest is not None and newest.request is Request.FLY
        lacks_plan = not has_plan and (wants_to_fly or self.mode is VehicleMode.FLYING)
        request = None
        if newest is not None and not is_silent and (has_plan or not wants_to_fly):
            request = newest.request
        is_weak = self._thrust_meter is not None and self._thrust_meter.is_weak
        if is_weak and request in (Request.FLY, Request.HOVER):
            request = None
        if self._inbox.asks_to_stop and self.mode is not VehicleMode.STOPPED:
            request = Request.STOP
        is_so = {
            Happening.UP: self._pilot.is_up,
            Happening.DOWN: self._pilot.is_down,
            Happening.NO_PLAN: lacks_plan,
            Happening.SILENT: is_silent,
            Happening.WEAK: is_weak,
        }
        happenings = frozenset(happening for happening in Happening if is_so[happening])
        self.counts.refused += not self._machine.step(request, happenings)
