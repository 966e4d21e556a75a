"""What the paper says in numbers (its section V), beside the numbers of summary.json that answer it."""

from dataclasses import dataclass

FORMATION_STEADY_MEAN_M = 0.068
"""The paper: in steady state and on average the formation error norms are smaller than this."""
FORMATION_STEADY_MAX_M = 0.015
"""The paper: around this at most, which contradicts the mean."""
ROUNDING = 1e-9
"""A limit that went from rpm to rad/s and back is still kept by who flew at it."""


@dataclass(frozen=True)
class Compared:
    """A number of summary.json and what the paper says of it."""

    key: str
    label: str
    paper: str
    """In the paper's words; empty where it says nothing."""
    unit: str = ""
    digits: int = 0
    factor: float = 1.0
    """From the number of summary.json to the unit."""
    claim: float | None = None
    """The paper's number, in the unit."""
    bound: bool = False
    """Whether the paper claims that it is not exceeded."""

    def text(self, value: float | None) -> str:
        """A value of summary.json for people; ``-`` if there is none."""
        return self.bare(value) if value is None else f"{self.bare(value)} {self.unit}".rstrip()

    def bare(self, value: float | None) -> str:
        """Likewise, without its unit."""
        return "-" if value is None else f"{self.factor * value:.{self.digits}f}"

    def holds(self, value: float | None) -> bool | None:
        """Whether a value of summary.json keeps the paper's bound; None: there is no bound, or no value."""
        if not self.bound or self.claim is None or value is None:
            return None
        return self.factor * value <= self.claim * (1.0 + ROUNDING)


COMPARED = (
    Compared(
        "steady_mean_m",
        "formation error, steady, mean",
        "< 0.068 m",
        "m",
        3,
        claim=FORMATION_STEADY_MEAN_M,
        bound=True,
    ),
    Compared("steady_p95_m", "formation error, steady, 95 %", "", "m", 3),
    Compared(
        "steady_max_m",
        "formation error, steady, maximum",
        "about 0.015 m *",
        "m",
        3,
        claim=FORMATION_STEADY_MAX_M,
    ),
    Compared("peak_m", "formation error, maximum of all", "", "m", 3),
    Compared("leader_steady_mean_m", "leader position error, steady, mean", "slight", "m", 3),
    Compared("leader_yaw_steady_mean_deg", "leader yaw error, steady, mean", "", "deg", 1),
    Compared("follower_yaw_steady_mean_deg", "follower yaw error, steady, mean", "", "deg", 1),
    Compared("view_margin_min_deg", "margin in the field of view, smallest", "satisfied", "deg", 1),
    Compared("separation_min_m", "smallest separation", "", "m", 2),
    Compared("tilt_max_deg", "tilt, maximum", "", "deg", 0),
    Compared("rotor_max_rpm", "rotor speed, maximum", "<= 6000 rpm", "rpm", claim=6000.0, bound=True),
    Compared("rotor_std_rpm", "rotor speed, standard deviation", "around 600 rpm", "rpm", claim=600.0),
    Compared("saturated_fraction", "steps with a rotor at its limit", "", "%", 1, factor=100.0),
    Compared("sqp_steps_median", "SQP steps per control step, median", "2", claim=2.0),
    Compared(
        "step_ms_median", "solver time per control step, median", "< 50 ms", "ms", 1, claim=50.0, bound=True
    ),
    Compared("realtime_factor", "real-time factor", "", "", 1),
)
"""In the order in which they are shown."""
FOOTNOTE = "* contradicts the mean that the paper gives"
