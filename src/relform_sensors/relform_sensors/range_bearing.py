"""Range and bearing from one vehicle to the others (eqs. CameraRange1, CameraRange2)."""

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from relform_core.events_config import Occlusion, Outliers
from relform_core.measurements import Odometry
from relform_core.rotation import rotation_matrix, wrap_angle
from relform_core.schema import Vector3
from relform_core.sensors.range_bearing import RangeBearing, RangeBearingConfig, RangeBearings
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_sensors.model import Carrier, Read

UNKNOWN_ANGLE_STD = math.pi / math.sqrt(3.0)
"""Standard deviation of an unknown angle, uniform in (-pi, pi] [rad]."""


class RangeBearingSensor:
    """Sees every target that is within the range limits and in one of the sectors of the field of view.

    The noise has the same standard deviation along the line of sight and across it. Every step draws the same
    numbers for every possible target, in team order, whether or not it is seen.
    """

    def __init__(
        self,
        config: RangeBearingConfig,
        generator: np.random.Generator,
        observer: str,
        targets: Sequence[str],
        outliers: Sequence[Outliers],
        occlusions: Sequence[Occlusion] = (),
        never_seen: Collection[str] = (),
    ) -> None:
        """Observer, all others in team order, events, and the others that are outside of the sensing graph.

        Of several outlier events the first acts.
        """
        self._config = config
        self._generator = generator
        self._observer = observer
        self._targets = tuple(targets)
        self._outliers = tuple(outliers)
        self._occlusions = tuple(occlusions)
        self._never_seen = frozenset(never_seen)

    def read(self, ground_truth: Mapping[str, Odometry]) -> RangeBearings:
        """Measure, given the true states of observer and targets at one instant."""
        observer = ground_truth[self._observer]
        time = observer.stamp_ns / NANOSECONDS_PER_SECOND
        outlier = next((event for event in self._outliers if event.active(time)), None)
        hidden = self._never_seen | {event.hidden for event in self._occlusions if event.active(time)}
        R_BN = rotation_matrix(observer.q_NB).T
        p_BT_N = np.array([ground_truth[target].p_NB_N for target in self._targets]) - observer.p_NB_N
        # Body {t} of each target relative to body {b} of the observer.
        p_BT_B = (R_BN @ p_BT_N[..., None])[..., 0].tolist()
        by_target = {}
        for target, position in zip(self._targets, p_BT_B, strict=True):
            measured = self._read_target(target, position, outlier)
            if measured is not None and target not in hidden:
                by_target[target] = measured
        return RangeBearings(observer.stamp_ns, by_target)

    def _read_target(
        self, target: str, p_BT_B: Sequence[float], outlier: Outliers | None
    ) -> RangeBearing | None:
        dropout_draw, outlier_draw = self._generator.random(), self._generator.random()
        draws = self._generator.standard_normal(6).tolist()
        noise, outlier_noise = draws[:3], draws[3:]

        truth = _spherical(p_BT_B)
        if not self._in_view(*truth) or dropout_draw < self._config.dropout_probability:
            return None
        std = self._std(truth[0], truth[2])
        if outlier is not None and outlier_draw < outlier.probability:
            std = outlier.range_std, outlier.bearing_std, outlier.bearing_std
            noise = outlier_noise
        distance = abs(truth[0] + std[0] * noise[0])
        azimuth, elevation = _principal(truth[1] + std[1] * noise[1], truth[2] + std[2] * noise[2])
        # The sensor knows neither the truth nor whether this is an outlier.
        of_range, of_azimuth, of_elevation = self._std(distance, elevation)
        covariance = np.zeros((3, 3))
        covariance[0, 0] = of_range * of_range
        covariance[1, 1] = of_azimuth * of_azimuth
        covariance[2, 2] = of_elevation * of_elevation
        return RangeBearing(target, distance, azimuth, elevation, covariance)

    def _in_view(self, distance: float, azimuth: float, elevation: float) -> bool:
        return self._config.range_min <= distance <= self._config.range_max and any(
            sector.contains(azimuth, elevation) for sector in self._config.sectors
        )

    def _std(self, distance: float, elevation: float) -> Vector3:
        """Standard deviations of range [m], azimuth and elevation [rad]."""
        across = self._config.position_std
        return across, _angle_std(across, distance * math.cos(elevation)), _angle_std(across, distance)


def mount(config: RangeBearingConfig, generator: np.random.Generator, carrier: Carrier) -> Read:
    """The model on this vehicle."""
    targets = [vehicle for vehicle in carrier.vehicles if vehicle != carrier.name]
    outliers = [event for event in carrier.events if isinstance(event, Outliers)]
    occlusions = [event for event in carrier.events if isinstance(event, Occlusion)]
    never_seen = set(targets) - set(carrier.targets)
    sensor = RangeBearingSensor(config, generator, carrier.name, targets, outliers, occlusions, never_seen)
    return lambda scene: sensor.read(scene.ground_truth)


def _spherical(p_BT_B: Sequence[float]) -> Vector3:
    """Range, azimuth and elevation of a relative position."""
    x, y, z = p_BT_B
    horizontal = math.hypot(x, y)
    return math.hypot(horizontal, z), math.atan2(y, x), math.atan2(z, horizontal)


def _angle_std(across: float, arm: float) -> float:
    """Angle of an error ``across`` at distance ``arm``, at most that of an unknown angle."""
    return across / max(arm, across / UNKNOWN_ANGLE_STD)


def _principal(azimuth: float, elevation: float) -> tuple[float, float]:
    """The same direction with elevation in [-pi/2, pi/2]; noise may move it over a pole."""
    elevation = wrap_angle(elevation)
    if abs(elevation) > 0.5 * math.pi:
        elevation = math.copysign(math.pi, elevation) - elevation
        azimuth += math.pi
    return wrap_angle(azimuth), elevation
