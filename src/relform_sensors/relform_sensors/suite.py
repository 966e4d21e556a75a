"""All sensors of one vehicle."""

from collections.abc import Mapping

from relform_core.arrays import Array
from relform_core.measurements import Odometry, VehicleMeasurements
from relform_core.randomness import Streams
from relform_core.scenario_config import ScenarioConfig
from relform_sensors.model import Carrier, Scene, mount


class SensorSuite:
    """The sensors that one vehicle carries."""

    def __init__(self, config: ScenarioConfig, name: str, streams: Streams) -> None:
        """Sensors of the vehicle ``name``, which must be in the team, and its generators."""
        carrier = Carrier.of(config, name)
        self._name = name
        self._sensors = config.sensors_of(name)
        self._reads = [
            mount(sensor, config.sensors.of(sensor), streams[sensor.stream], carrier)
            for sensor in self._sensors
        ]

    def read(self, ground_truth: Mapping[str, Odometry], f_NB_B: Array) -> VehicleMeasurements:
        """Read all sensors, once per step.

        Args:
            ground_truth: true states of all vehicles at one instant, by name.
            f_NB_B: true specific force of this vehicle [m/s^2], shape (3,).
        """
        scene = Scene(self._name, ground_truth, f_NB_B)
        return VehicleMeasurements.collect(
            (sensor, read(scene)) for sensor, read in zip(self._sensors, self._reads, strict=True)
        )
