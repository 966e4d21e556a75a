"""What the team estimator has to show, by the case of ``config/sweeps/accuracy.yaml``."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from relform_analysis.flight.summary import Json

NOMINAL = "nominal"


@dataclass(frozen=True)
class Goal:
    """A bound on a number of the flights of a case (a key of their rows, docs/summary.md)."""

    label: str
    key: str
    bound: float
    statistic: Literal["mean", "min", "max"] = "mean"
    """Over the completed flights."""
    unit: str = "m"
    digits: int = 4
    factor: float = 1.0
    """From the number of the row to the unit."""
    is_lower: bool = False
    """Whether the number has to be at least the bound, instead of at most."""
    times_nominal: bool = False
    """Whether the bound is a factor on the same number of the case ``nominal``."""

    def wanted(self, nominal: Json | None) -> float | None:
        """The bound in the unit; None: the case that it refers to was not flown.

        Args:
            nominal: statistics of the case ``nominal``.
        """
        if not self.times_nominal:
            return self.bound
        reference = None if nominal is None else self.found(nominal)
        return None if reference is None else self.bound * reference

    def found(self, variant: Json) -> float | None:
        """The number in the unit; None: not every completed flight has it."""
        metric = variant["metrics"].get(self.key)
        if metric is None or metric["n"] < variant["completed"] or metric[self.statistic] is None:
            return None
        return self.factor * float(metric[self.statistic])

    def is_met(self, variant: Json, nominal: Json | None) -> bool:
        """Whether a case keeps the bound; an unknown number does not."""
        found, wanted = self.found(variant), self.wanted(nominal)
        if found is None or wanted is None:
            return False
        return found >= wanted if self.is_lower else found <= wanted

    def text(self, value: float | None) -> str:
        """A number with its unit."""
        return "unknown" if value is None else f"{value:.{self.digits}f} {self.unit}".rstrip()


def steady(bound: float, times_nominal: bool = False) -> Goal:
    """Formation error in steady state, mean."""
    return Goal("formation, steady mean", "steady_mean_m", bound, times_nominal=times_nominal)


def event_peak(bound: float) -> Goal:
    """Largest formation error after the disturbance, mean over the seeds."""
    return Goal("peak after it begins", "event_peak_m", bound)


def drift(bound: float) -> Goal:
    """Largest error of the leader after the disturbance begins, mean over the seeds."""
    return Goal("leader, maximum after it begins", "event_leader_max_m", bound)


def leader(bound: float) -> Goal:
    """Leader position error in steady state."""
    return Goal("leader, steady mean", "leader_steady_mean_m", bound)


def share(label: str, key: str, bound: float, is_lower: bool = False) -> Goal:
    """A share of the steps, in per cent."""
    return Goal(label, key, bound, unit="%", digits=1, factor=100.0, is_lower=is_lower)


def nees(label: str, key: str, bound: float, is_lower: bool = False) -> Goal:
    """Normalised estimation error squared per degree of freedom."""
    return Goal(f"{label}, NEES", key, bound, unit="", digits=2, is_lower=is_lower)


def _within(label: str, key: str, low: float, high: float) -> tuple[Goal, Goal]:
    return nees(label, key, low, is_lower=True), nees(label, key, high)


_DISTURBED = (
    nees("relative position", "position_nees", 1.3),
    nees("relative yaw", "yaw_nees", 1.3),
    nees("leader", "leader_nees", 1.3),
)
_FORCE = (steady(0.013), event_peak(0.08), *_DISTURBED)

GOALS: Mapping[str, tuple[Goal, ...]] = {
    NOMINAL: (
        steady(0.009),
        Goal("formation, steady 95th percentile", "steady_p95_m", 0.018),
        leader(0.03),
        Goal("leader yaw, steady mean", "leader_yaw_steady_mean_deg", 1.0, unit="deg", digits=2),
        Goal("rotor speeds, standard deviation", "rotor_std_rpm", 210.0, unit="rpm", digits=0),
        Goal("peak in phase A", "phases.A.max_m", 0.02),
        *_within("relative position", "position_nees", 0.7, 1.1),
        *_within("relative yaw", "yaw_nees", 0.7, 1.1),
        *_within("leader", "leader_nees", 0.7, 1.1),
        share("NIS inside its 95 % bounds", "nis_inside_fraction", 90.0, is_lower=True),
        share("NIS inside its 95 % bounds", "nis_inside_fraction", 99.0),
    ),
    "thrust_loss": _FORCE,
    "wind_one": _FORCE,
    "wind_all": _FORCE,
    "combined": (steady(0.017),),
    "noise_x2": (steady(0.018),),
    "noise_x4": (steady(0.036),),
    "loss_30": (steady(0.011),),
    "bursts": (steady(0.015),),
    "jitter": (steady(0.018),),
    "localization_out": (steady(1.2, times_nominal=True), drift(0.1)),
    "localization_out_wind": (steady(0.013), drift(0.5)),
    "localization_jump": (steady(0.010),),
    "start": (
        Goal("tilt at the start", "start_tilt_max_deg", 25.0, "max", unit="deg", digits=1),
        Goal("separation", "separation_min_m", 0.5, "min", digits=2, is_lower=True),
        Goal("settled below 0.05 m after", "start_settled_s", 3.0, "max", unit="s", digits=2),
    ),
    "five": (steady(0.011),),
    "lag_30": (steady(0.012),),
    "lag_50": (steady(0.016),),
    "lag_unknown": (),
    "drag": (steady(0.016),),
    "drag_unknown": (steady(0.016),),
    "crazyflie": (steady(0.016),),
    "outliers_5": (steady(0.012),),
    "outliers_20": (steady(0.02),),
    "half_sightings": (steady(0.015),),
    "eight": (
        steady(0.013),
        leader(0.05),
        share("steps with a rotor at its limit", "saturated_fraction", 2.0),
    ),
}
"""Every case also has to complete all flights."""
