"""All sensors of one vehicle."""

from collections.abc import Mapping
from dataclasses import dataclass

from relform_core.arrays import Array
from relform_core.measurements import Odometry, VehicleMeasurements
from relform_core.randomness import Stream, spawn_generator
from relform_core.scenario_config import Dropout, Outliers, ScenarioConfig, SensorName
from relform_core.sensors.imu import Imu
from relform_core.sensors.optic_flow import OpticFlow
from relform_core.sensors.range_bearing import RangeBearings
from relform_core.sensors.registry import SENSORS
from relform_core.sensors.sonar import Sonar
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_sensors.imu import ImuSensor
from relform_sensors.localization import LocalizationSensor
from relform_sensors.loss import Loss
from relform_sensors.optic_flow import OpticFlowSensor
from relform_sensors.range_bearing import RangeBearingSensor
from relform_sensors.sonar import SonarSensor


@dataclass(frozen=True)
class Readings:
    """What the sensors of one vehicle read at one instant, on board: before any message of it can be lost."""

    stamp_ns: int
    imu: Imu
    optic_flow: OpticFlow
    sonar: Sonar
    range_bearing: RangeBearings
    localization: Odometry | None
    """Only the leader has it."""


class SensorSuite:
    """The sensors of one vehicle, each with its own generator; ``read``, then ``transmit``, once per step."""

    def __init__(self, config: ScenarioConfig, seed: int, name: str) -> None:
        """Sensors of the vehicle ``name``, which must be in the team."""
        sensors, team = config.sensors, config.team
        is_leader = name == team.leader
        index = team.vehicles.index(name)
        generators = {stream: spawn_generator(seed, index, stream) for stream in Stream}
        events = [event for event in config.events if event.target == name]

        self._name = name
        self._imu = ImuSensor(sensors.imu, generators[Stream.IMU], yaw_is_known=is_leader)
        self._optic_flow = OpticFlowSensor(sensors.optic_flow, generators[Stream.OPTIC_FLOW])
        self._sonar = SonarSensor(sensors.sonar, generators[Stream.SONAR])
        self._range_bearing = RangeBearingSensor(
            sensors.range_bearing,
            generators[Stream.RANGE_BEARING],
            observer=name,
            targets=[vehicle for vehicle in team.vehicles if vehicle != name],
            outliers=[event for event in events if isinstance(event, Outliers)],
        )
        self._localization: LocalizationSensor | None = None
        if is_leader:
            self._localization = LocalizationSensor(sensors.localization, generators[Stream.LOCALIZATION])

        dropouts = [event for event in events if isinstance(event, Dropout)]
        transmissions: tuple[tuple[SensorName, Stream, float], ...] = (
            ("imu", Stream.IMU, sensors.imu.dropout_probability),
            ("optic_flow", Stream.OPTIC_FLOW, sensors.optic_flow.dropout_probability),
            ("sonar", Stream.SONAR, sensors.sonar.dropout_probability),
            ("range_bearing", Stream.RANGE_BEARING, 0.0),  # its own dropouts hide single targets
            ("localization", Stream.LOCALIZATION, sensors.localization.dropout_probability),
        )
        self._losses: dict[str, Loss] = {
            sensor: Loss(
                generators[stream], probability, [event for event in dropouts if event.sensor == sensor]
            )
            for sensor, stream, probability in transmissions
        }

    def read(self, ground_truth: Mapping[str, Odometry], f_NB_B: Array) -> Readings:
        """Read all sensors.

        Args:
            ground_truth: true states of all vehicles at one instant, by name.
            f_NB_B: true specific force of this vehicle [m/s^2], shape (3,).
        """
        truth = ground_truth[self._name]
        return Readings(
            stamp_ns=truth.stamp_ns,
            imu=self._imu.read(truth, f_NB_B),
            optic_flow=self._optic_flow.read(truth),
            sonar=self._sonar.read(truth),
            range_bearing=self._range_bearing.read(ground_truth),
            localization=self._localization.read(truth) if self._localization else None,
        )

    def transmit(self, readings: Readings) -> VehicleMeasurements:
        """What of these readings is sent."""
        time = readings.stamp_ns / NANOSECONDS_PER_SECOND

        measured = [(sensor, getattr(readings, sensor.name)) for sensor in SENSORS]
        return VehicleMeasurements.collect(
            (sensor, measurement)
            for sensor, measurement in measured
            if not self._losses[sensor.name].loses(time) and measurement is not None
        )
