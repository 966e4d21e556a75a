"""A Kalman filter of position and velocity along one axis."""


class AxisFilter:
    """Kalman filter of position and velocity along one axis, driven by a measured acceleration."""

    def __init__(self) -> None:
        self.position = self.velocity = 0.0
        self._pp = self._pv = self._vv = 0.0

    def reset(self, position: float, velocity_std: float = 0.0) -> None:
        """Rest at a known position, if the velocity is known as well."""
        self.position, self.velocity = position, 0.0
        self._pp = self._pv = 0.0
        self._vv = velocity_std**2

    @property
    def position_variance(self) -> float:
        """Of the estimated position [m^2]."""
        return self._pp

    def predict(self, acceleration: float, std: float, period: float) -> None:
        """Move by an acceleration with this standard deviation."""
        self.position += period * (self.velocity + 0.5 * period * acceleration)
        self.velocity += period * acceleration
        variance = (std * period) ** 2
        self._pp += period * (2.0 * self._pv + period * self._vv) + 0.25 * period**2 * variance
        self._pv += period * self._vv + 0.5 * period * variance
        self._vv += variance

    def measure_velocity(self, velocity: float, variance: float) -> None:
        """Correct by a measured velocity."""
        self._correct(velocity - self.velocity, self._pv, self._vv, self._vv + variance)

    def measure_position(self, position: float, variance: float) -> None:
        """Correct by a measured position."""
        self._correct(position - self.position, self._pp, self._pv, self._pp + variance)

    def _correct(self, innovation: float, of_position: float, of_velocity: float, variance: float) -> None:
        """Joseph's form is not needed: variances stay above those of the process noise of one step."""
        gain_p, gain_v = of_position / variance, of_velocity / variance
        self.position += gain_p * innovation
        self.velocity += gain_v * innovation
        self._pp -= gain_p * of_position
        self._pv -= gain_p * of_velocity
        self._vv -= gain_v * of_velocity
