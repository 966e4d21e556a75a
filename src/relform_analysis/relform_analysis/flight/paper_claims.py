"""The numbers in section V of the paper, beside those of summary.json."""

from dataclasses import dataclass

FORMATION_STEADY_MEAN_M = 0.068
"""The paper: in steady state and on average the formation error norms are smaller than this."""
FORMATION_STEADY_MAX_M = 0.015
"""The paper: around this at most, which contradicts the mean."""
ROTOR_MAX_RPM = 6000.0
"""The paper: rotor speeds never exceed this."""
ROTOR_STD_RPM = 600.0
"""The paper: rotor speeds change around this; we read it as their standard deviation."""
SQP_STEPS = 2
"""The paper: for the vast majority of control steps."""
STEP_MS = 50.0
"""The paper: every control step is solved within this, its control period."""
ROUNDING = 1e-9
"""A limit converted from rpm to rad/s and back differs by this, relatively, and is still kept."""


@dataclass(frozen=True)
class ComparedNumber:
    """A number of summary.json and what the paper says of it."""

    key: str
    label: str
    paper: str
    """The paper's words; empty if it does not mention the number."""
    unit: str = ""
    digits: int = 0
    factor: float = 1.0
    """From the number of summary.json to the unit."""
    claim: float | None = None
    """The paper's number, in the unit."""
    bound: bool = False
    """Whether the paper claims that it is not exceeded."""

    def text(self, value: float | None) -> str:
        """A value of summary.json as text with its unit; ``-`` if there is none."""
        return self.bare(value) if value is None else f"{self.bare(value)} {self.unit}".rstrip()

    def bare(self, value: float | None) -> str:
        """The same without the unit."""
        return "-" if value is None else f"{self.factor * value:.{self.digits}f}"

    def holds(self, value: float | None) -> bool | None:
        """Whether a value of summary.json keeps the paper's bound; None: there is no bound, or no value."""
        if not self.bound or self.claim is None or value is None:
            return None
        return self.factor * value <= self.claim * (1.0 + ROUNDING)


COMPARED = (
    ComparedNumber(
        "steady_mean_m",
        "formation error, steady, mean",
        f"< {FORMATION_STEADY_MEAN_M} m",
        "m",
        3,
        claim=FORMATION_STEADY_MEAN_M,
        bound=True,
    ),
    ComparedNumber("steady_p95_m", "formation error, steady, 95 %", "", "m", 3),
    ComparedNumber(
        "steady_max_m",
        "formation error, steady, maximum",
        f"about {FORMATION_STEADY_MAX_M} m *",
        "m",
        3,
        claim=FORMATION_STEADY_MAX_M,
    ),
    ComparedNumber("peak_m", "formation error, maximum of all", "", "m", 3),
    ComparedNumber("leader_steady_mean_m", "leader position error, steady, mean", "slight", "m", 3),
    ComparedNumber("leader_yaw_steady_mean_deg", "leader yaw error, steady, mean", "", "deg", 1),
    ComparedNumber("follower_yaw_steady_mean_deg", "follower yaw error, steady, mean", "", "deg", 1),
    ComparedNumber("view_margin_min_deg", "margin in the field of view, smallest", "satisfied", "deg", 1),
    ComparedNumber("separation_min_m", "smallest separation", "", "m", 2),
    ComparedNumber("tilt_max_deg", "tilt, maximum", "", "deg", 0),
    ComparedNumber(
        "rotor_max_rpm",
        "rotor speed, maximum",
        f"<= {ROTOR_MAX_RPM:.0f} rpm",
        "rpm",
        claim=ROTOR_MAX_RPM,
        bound=True,
    ),
    ComparedNumber(
        "rotor_std_rpm",
        "rotor speed, standard deviation",
        f"around {ROTOR_STD_RPM:.0f} rpm",
        "rpm",
        claim=ROTOR_STD_RPM,
    ),
    ComparedNumber("saturated_fraction", "steps with a rotor at its limit", "", "%", 1, factor=100.0),
    ComparedNumber("sqp_steps_median", "SQP steps per control step, median", f"{SQP_STEPS}", claim=SQP_STEPS),
    ComparedNumber(
        "step_ms_median",
        "solver time per control step, median",
        f"< {STEP_MS:.0f} ms",
        "ms",
        1,
        claim=STEP_MS,
        bound=True,
    ),
    ComparedNumber("fallback_steps", "control steps that fell back", "", "", 0),
    ComparedNumber("realtime_factor", "real-time factor", "", "", 1),
)
"""In the order of the tables."""
FOOTNOTE = "* contradicts the mean that the paper gives"
