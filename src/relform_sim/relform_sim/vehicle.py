"""One simulated quadrotor: plant, link, onboard logic and sensors, moved from control step to control step.

Step k is the instant t_k = k * period. Call ``advance(k)``, ``measure(k)`` and ``fault(k)`` in this order for
k = 0, 1, 2 ... Sensors see the other vehicles only through the ground truth that ``advance`` returns: a
flight is the same, bit for bit, in one process and over ROS.
"""

import math
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from relform_core.arrays import Array
from relform_core.errors import FlightError
from relform_core.events_config import ThrustLoss, Wind
from relform_core.flight_modes import VehicleMode
from relform_core.measurements import Odometry, RotorCommand, VehicleMeasurements
from relform_core.randomness import Stream, Streams
from relform_core.scenario_config import ScenarioConfig
from relform_core.sensors.applied_rotor_speeds import (
    ACKNOWLEDGED_INTERVALS,
    APPLIED_ROTOR_SPEEDS,
    AppliedRotorSpeeds,
)
from relform_core.sensors.flight_status import FLIGHT_STATUS, FlightStatus
from relform_core.sensors.imu import IMU
from relform_core.sensors.localization import LOCALIZATION
from relform_core.sensors.optic_flow import OPTIC_FLOW
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_core.sensors.sonar import SONAR
from relform_core.units import NANOSECONDS_PER_SECOND, seconds_to_ns
from relform_core.vehicle_config import VehicleConfig
from relform_sensors.suite import SensorSuite
from relform_sim.faults import find_fault
from relform_sim.ground_contact import GroundContact
from relform_sim.link import radio_link
from relform_sim.onboard import Onboard, OnboardCounts
from relform_sim.pilot import Readings
from relform_sim.plant import Plant
from relform_sim.rigid_body import ALL_WHOLE, draw_body
from relform_sim.start import start_poses


class Vehicle:
    """The quadrotor ``name`` of a scenario.

    It starts at rest, at its place of the first formation and with the leader's yaw if ``start`` draws
    nothing else, and with the rotors at the hover speed of the nominal vehicle.
    """

    def __init__(self, config: ScenarioConfig, seed: int, name: str) -> None:
        """Raises FlightError if the team has no such vehicle, or no start is found, see ``start_poses``."""
        if name not in config.team.vehicles:
            raise FlightError(f"'{name}' is not in the team, known are {', '.join(config.team.vehicles)}")
        index = config.team.vehicles.index(name)
        self._config = config
        self._period_ns = config.period_ns
        self._takes_every_ns = (
            self._period_ns if config.real_time is None else seconds_to_ns(config.plant.step)
        )
        """How often commands are taken: in lock-step they arrive at control instants only."""
        self._acknowledges_commands = config.acknowledges_commands
        self._limits = config.vehicle
        self._name = name
        self._vehicles = config.team.vehicles
        self._step = -1
        """Last step advanced to."""
        self._readings = VehicleMeasurements({})
        """Of the last step measured, on board."""
        streams = Streams(seed, index)
        start = start_poses(config, seed)[name]
        self._plant = Plant(
            draw_body(config.true_vehicle, streams[Stream.PLANT], has_ground=config.landing is not None),
            step=config.plant.step,
            rotor_time_constant=config.true_vehicle.rotor_time_constant,
            rotor_speed=config.vehicle.hover_speed if config.ground is None else 0.0,
            p_NB_N=start.p_NB_N,
            q_NB=(0.0, 0.0, math.sin(0.5 * start.yaw), math.cos(0.5 * start.yaw)),
        )
        self._obstacles = config.obstacles
        height = config.start_places[name][2]
        self._onboard = Onboard(
            config.vehicle,
            config.controller.period,
            config.landing,
            height,
            config.separation,
            config.geofence,
            is_airborne=config.ground is None,
        )
        self._contact = GroundContact(name, config.vehicle.leg_height)
        self._applied: deque[Array] = deque(maxlen=ACKNOWLEDGED_INTERVALS)
        """Rotor speeds of the last intervals [rad/s], the oldest first."""
        self._carried = config.sensors_of(name)
        self._sensors = SensorSuite(config, name, streams)
        self._link = radio_link(config, name, streams)
        events = config.events_on(name)
        self._winds = [event for event in events if isinstance(event, Wind)]
        self._thrust_losses = [event for event in events if isinstance(event, ThrustLoss)]

    @property
    def counts(self) -> OnboardCounts:
        """How often the vehicle flew without a fresh command."""
        return self._onboard.counts

    @property
    def mode(self) -> VehicleMode:
        """What the vehicle has done until the step that it is at."""
        return self._onboard.mode

    @property
    def report(self) -> Mapping[str, object]:
        """What the vehicle says about itself, by key of /diagnostics."""
        share = self._onboard.thrust_share
        return vars(self.counts) | ({} if share is None else {"thrust_percent": round(100.0 * share, 1)})

    def set_limits(self, config: VehicleConfig) -> None:
        """Apply other limits of the failsafe and of the tilt, and nothing else, from the next step on."""
        self._limits = config
        self._onboard.set_limits(config.failsafe)

    def receive(self, command: RotorCommand, sent_ns: int) -> None:
        """Send a command of the controller over the link at an instant of the interval to be flown next [ns].

        The instants of the calls never decrease.
        """
        self._link.down.send(sent_ns, command)

    def advance(self, step: int, command: RotorCommand | None = None) -> Odometry:
        """Integrate from the step before and return the ground truth at t_step; step 0: the initial one.

        Args:
            command: one that the controller sent at t_{step - 1}; None: none beside those of ``receive``.
                Step 0: not used.
        Raises:
            FlightError: the step before was not advanced to, or not measured.
        """
        if step != self._step + 1:
            raise FlightError(f"{self._name}: step {step} cannot follow step {self._step}")
        self._step = step
        if step > 0:
            self._fly_interval(step - 1, command)
        truth = self._plant.odometry(self._stamp_ns(step))
        self._contact.update(truth, self.mode, touches=self._plant.touches_ground)
        return truth

    def measure(self, step: int, ground_truth: Mapping[str, Odometry]) -> VehicleMeasurements:
        """Measure at t_step, given the true states of all vehicles, its own included, and send.

        Returns:
            This vehicle's measurements that arrive at the controller at t_step; their stamps may be older.
        Raises:
            FlightError: not the step just advanced to, or ground truth of another instant.
        """
        self._check_instant(step, ground_truth)
        self._readings = self._sensors.read(ground_truth, self._plant.specific_force())
        stamp_ns = self._stamp_ns(step)
        for sensor in self._carried:
            for measurement in self._readings.arrived(sensor):
                self._link.up.send(stamp_ns, (sensor, measurement))
        if self._applied and self._acknowledges_commands:
            report = AppliedRotorSpeeds(
                stamp_ns, self._period_ns, np.array(self._applied), self._onboard.flown_stamp_ns
            )
            self._link.up.send(stamp_ns, (APPLIED_ROTOR_SPEEDS, report))
        if self._config.landing is not None:
            status = FlightStatus(stamp_ns, self.mode, self._onboard.reason)
            self._link.up.send(stamp_ns, (FLIGHT_STATUS, status))
        return VehicleMeasurements.collect(self._link.up.deliver(stamp_ns))

    def fault(self, step: int, ground_truth: Mapping[str, Odometry]) -> str | None:
        """Why this vehicle cannot continue, in one line, or None. Arguments and errors as ``measure``."""
        self._check_instant(step, ground_truth)
        may_land = self._config.landing is not None
        fault = find_fault(self._limits, self._name, ground_truth, self._obstacles, may_land=may_land)
        return fault or self._contact.fault

    def _fly_interval(self, step: int, command: RotorCommand | None) -> None:
        """Fly [t_step, t_{step + 1}]; events act on whole intervals, as they are at the start."""
        stamp_ns = self._stamp_ns(step)
        readings = self._own_readings(step)
        time = stamp_ns / NANOSECONDS_PER_SECOND
        if command is not None:
            self.receive(command, stamp_ns)
        arrived = self._link.down.deliver(stamp_ns)
        speeds = self._onboard.rotor_speeds(stamp_ns, arrived, readings)
        flown: list[tuple[float, Array]] = []
        """Rotor speeds [rad/s], and how long each were commanded [s]."""
        begin_ns = stamp_ns
        for now_ns in range(
            stamp_ns + self._takes_every_ns, stamp_ns + self._period_ns, self._takes_every_ns
        ):
            newer = self._onboard.update(now_ns, self._link.down.deliver(now_ns))
            if newer is not None:
                flown.append(((now_ns - begin_ns) / NANOSECONDS_PER_SECOND, speeds))
                begin_ns, speeds = now_ns, newer
        duration = self._config.controller.period - (begin_ns - stamp_ns) / NANOSECONDS_PER_SECOND
        flown.append((duration, speeds))
        self._applied.append(_mean_speeds(flown))
        winds = [wind.force_N for wind in self._winds if wind.active(time)]
        wind_N = (sum(w[0] for w in winds), sum(w[1] for w in winds), sum(w[2] for w in winds))
        losses = [event for event in self._thrust_losses if event.active(time)]
        thrust_scale = math.prod(event.scale_at(time) for event in losses)
        rotor_scales = tuple(
            math.prod(each) for each in zip(*(event.rotor_scales for event in losses), strict=True)
        )
        for duration, speeds in flown:
            self._plant.advance(
                tuple(speeds.tolist()),
                duration,
                wind_N=wind_N,
                thrust_scale=thrust_scale,
                rotor_scales=rotor_scales or ALL_WHOLE,
            )

    def _own_readings(self, step: int) -> Readings:
        imu, optic_flow = self._readings.newest(IMU), self._readings.newest(OPTIC_FLOW)
        sonar, localization = self._readings.newest(SONAR), self._readings.newest(LOCALIZATION)
        if imu is None or optic_flow is None or sonar is None or imu.stamp_ns != self._stamp_ns(step):
            raise FlightError(f"{self._name}: step {step} was not measured before step {step + 1}")
        place_N = None if localization is None else localization.p_NB_N
        seen = self._readings.newest(RANGE_BEARING)
        sights = {} if seen is None else seen.by_target
        before = self._vehicles[: self._vehicles.index(self._name)]
        landmarks = {name: sights[name] for name in before if name in sights}
        return Readings(imu, optic_flow, sonar, landmarks, place_N, sights)

    def _check_instant(self, step: int, ground_truth: Mapping[str, Odometry]) -> None:
        if step != self._step:
            raise FlightError(f"{self._name}: asked about step {step}, but it is at step {self._step}")
        now_ns = self._stamp_ns(step)
        for name in self._vehicles:
            if name not in ground_truth:
                raise FlightError(f"{self._name}: ground truth of {name} is missing in step {step}")
            if (stamp_ns := ground_truth[name].stamp_ns) != now_ns:
                raise FlightError(
                    f"{self._name}: ground truth of {name} is stamped {stamp_ns} ns, "
                    f"step {step} is at {now_ns} ns"
                )

    def _stamp_ns(self, step: int) -> int:
        return step * self._period_ns


def _mean_speeds(flown: Sequence[tuple[float, Array]]) -> Array:
    """Rotor speeds of the mean thrusts of some spans, given with their lengths [s] and speeds [rad/s]."""
    if len(flown) == 1:
        return flown[0][1]
    durations, speeds = zip(*flown, strict=True)
    means: Array = np.sqrt(np.average(np.square(speeds), axis=0, weights=durations))
    return means
