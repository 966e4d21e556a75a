"""Scenarios for tests: that of the paper with changes."""

import math
from pathlib import Path

from relform_core.load import LoadedScenario, load_scenario

CONFIG_FOLDER = Path(__file__).parents[2] / "config"
PAPER = CONFIG_FOLDER / "scenarios/paper.yaml"

NOISE_FREE = (
    "sensors.imu.attitude_std_deg=0",
    "sensors.imu.gyro_std_deg_s=0",
    "sensors.imu.accelerometer_std_m_s2=0",
    "sensors.optic_flow.velocity_std_m_s=0",
    "sensors.sonar.range_std_m=0",
    "sensors.range_bearing.position_std_m=1.0e-9",
    "sensors.localization.position_std_m=1.0e-9",
    "sensors.localization.velocity_std_m_s=1.0e-9",
    "sensors.localization.yaw_std_deg=1.0e-9",
    "vehicle.mass_std_percent=0",
    "vehicle.inertia_std_percent=0",
)
"""Overrides: perfect sensors and nominal vehicles."""

BRIEF_HOVER = (
    "phases=[{name: P, title: hover, duration_s: 0.5, steady_from_s: 0.2, formation: initial, "
    "motion: {kind: hover, ramp_s: 0.0}}]"
)
"""Override: the flight is a hover of half a second."""

WITH_BAROMETER = (
    "sensors.barometer={pressure_std_pa: 6, bias_std_pa: 50, drift_std_pa_s: 0.1, dropout_probability: 0}"
)
"""Override: every vehicle carries the optional barometer."""

FROM_GROUND = "ground={climb_speed_m_s: 0.8, descent_speed_m_s: 0.5, interval_s: 1.0, landing: together}"
"""Override: the team starts and ends on the ground."""


def paper_scenario(*overrides: str, seed: int = 0) -> LoadedScenario:
    """The paper's scenario with overrides."""
    return load_scenario(PAPER, overrides, seed)


def team_of(n_vehicles: int) -> tuple[str, ...]:
    """Overrides: this many vehicles, the followers on an arc behind and below the leader."""
    followers = [f"follower_{number}" for number in range(1, n_vehicles)]

    def formation(radius: float) -> str:
        places = []
        for index, follower in enumerate(followers):
            angle = math.pi + (index - 0.5 * (len(followers) - 1)) * 0.7
            x, y, z = radius * math.cos(angle), radius * math.sin(angle), -0.5 - 0.1 * index
            places.append(f"{follower}: [{x:.3f}, {y:.3f}, {z:.3f}]")
        return f"{{{', '.join(places)}}}"

    return (
        f"team.followers=[{', '.join(followers)}]",
        f"formations_m={{initial: {formation(1.2)}, wide: {formation(1.5)}}}",
    )
