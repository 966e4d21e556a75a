"""All sensors of one vehicle."""

from collections.abc import Mapping

from relform_core.arrays import Array
from relform_core.measurements import Odometry, VehicleMeasurements
from relform_core.randomness import Streams
from relform_core.scenario_config import Dropout, ScenarioConfig
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_sensors.loss import Loss
from relform_sensors.model import Carrier, Scene, mount


class SensorSuite:
    """The sensors that one vehicle carries; ``read``, then ``transmit``, once per step."""

    def __init__(self, config: ScenarioConfig, name: str, streams: Streams) -> None:
        """Sensors of the vehicle ``name``, which must be in the team, and its generators."""
        carrier = Carrier.of(config, name)
        self._name = name
        self._sensors = config.sensors_of(name)
        self._reads = [
            mount(sensor, config.sensors.of(sensor), streams[sensor.stream], carrier)
            for sensor in self._sensors
        ]
        dropouts = [event for event in carrier.events if isinstance(event, Dropout)]
        self._losses = {
            sensor.name: Loss(
                streams[sensor.stream],
                config.sensors.of(sensor).message_loss,
                [event for event in dropouts if event.sensor == sensor.name],
            )
            for sensor in self._sensors
        }

    def read(self, ground_truth: Mapping[str, Odometry], f_NB_B: Array) -> VehicleMeasurements:
        """Read all sensors, on board: before any message can be lost.

        Args:
            ground_truth: true states of all vehicles at one instant, by name.
            f_NB_B: true specific force of this vehicle [m/s^2], shape (3,).
        """
        scene = Scene(self._name, ground_truth, f_NB_B)
        return VehicleMeasurements.collect(
            (sensor, read(scene)) for sensor, read in zip(self._sensors, self._reads, strict=True)
        )

    def transmit(self, readings: VehicleMeasurements) -> VehicleMeasurements:
        """What of these readings is sent."""
        return VehicleMeasurements.collect(
            (sensor, measurement)
            for sensor in self._sensors
            for measurement in readings.arrived(sensor)
            if not self._losses[sensor.name].loses(measurement.stamp_ns / NANOSECONDS_PER_SECOND)
        )
