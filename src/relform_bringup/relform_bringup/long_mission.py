"""A random mission of any length: motions, changes of formation and disturbances, all from one seed."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

TAKE_OFF_S = 15.0
"""The disturbances begin after take-off [s]."""
FORMATIONS = {
    "near": {"follower_1": [-1.0, -0.6, -0.4], "follower_2": [-1.0, 0.6, -0.4]},
    "wide": {"follower_1": [-0.8, -1.1, 0.2], "follower_2": [-0.8, 1.1, 0.2]},
    "swapped": {"follower_1": [-1.0, 0.6, -0.4], "follower_2": [-1.0, -0.6, -0.4]},
    "column": {"kind": "column", "spacing_m": 1.2, "slope_deg": 10.0},
    "v": {"kind": "v", "spacing_m": 1.1, "slope_deg": 15.0},
}
HEIGHT_M = 4.0
"""Of the leader at the start [m]."""
CLIMB_M_S = 0.05
"""Vertical speed of a spiral [m/s]."""
STEADY_SHARE = 0.5
"""A phase is scored from this share of its length on."""


def random_mission(seed: int, length: float) -> list[str]:
    """Changes of the scenario ``field``: its phases, formations and events.

    The height stays near that of the start: spirals climb below it and sink above it.

    Args:
        seed: of all draws.
        length: of the phases together [s].
    """
    rng = np.random.default_rng(seed)
    phases: list[Mapping[str, object]] = []
    left, above = round(length), 0.0
    while left > 0:
        duration = min(int(rng.integers(10, 26)), left)
        motion = _motion(rng, sinks=above > 0.0)
        above += float(motion.get("climb_m_s", 0.0)) * duration
        phases.append(
            {
                "name": f"P{len(phases) + 1}",
                "title": motion["kind"],
                "duration_s": float(duration),
                "steady_from_s": STEADY_SHARE * duration,
                "formation": str(rng.choice(list(FORMATIONS))),
                "motion": motion,
            }
        )
        left -= duration
    changes = {
        "start.position_m": [1.0, -0.5, HEIGHT_M],
        "formations_m": FORMATIONS,
        "phases": phases,
        "events": _events(rng, length),
    }
    return [f"{key}={json.dumps(value)}" for key, value in changes.items()]  # JSON is YAML


def _motion(rng: np.random.Generator, sinks: bool) -> dict[str, Any]:
    """What the leader flies; a spiral sinks or climbs."""
    kind = rng.choice(["hover", "straight", "turn", "spiral"])
    speed = round(float(rng.uniform(0.5, 1.5)), 3)
    side = int(rng.choice([-1, 1]))
    if kind == "hover":
        return {"kind": "hover", "ramp_s": 1.5}
    if kind == "straight":
        return {"kind": "straight", "speed_m_s": speed, "ramp_s": 1.5}
    if kind == "turn":
        angle = side * round(float(rng.uniform(30.0, 170.0)), 1)
        return {"kind": "turn", "angle_deg": angle, "turn_s": 4.0}
    radius = side * round(float(rng.uniform(2.0, 4.0)), 2)
    climb = -CLIMB_M_S if sinks else CLIMB_M_S
    return {"kind": "spiral", "radius_m": radius, "speed_m_s": speed, "climb_m_s": climb, "ramp_s": 1.5}


def _events(rng: np.random.Generator, length: float) -> list[Mapping[str, object]]:
    """One disturbance after the other, with pauses between them."""
    events: list[Mapping[str, object]] = []
    time = TAKE_OFF_S
    while (start := time + float(rng.uniform(10.0, 30.0))) + 3.0 < length:
        time = start + float(rng.uniform(1.0, 3.0))
        target = str(rng.choice(["leader", "follower_1", "follower_2"]))
        kinds: list[dict[str, object]] = [
            {"kind": "wind", "force_n": np.round(rng.uniform(-0.6, 0.6, 3), 2).tolist()},
            {"kind": "thrust_scale", "scale": 0.93},
            {"kind": "outliers", "probability": 0.1, "range_std_m": 1.0, "bearing_std_deg": 40.0},
            {"kind": "dropout", "sensor": "optic_flow", "probability": 0.5},
            {"kind": "command_loss", "probability": 0.3},
            {"kind": "link", "loss_probability": 0.3, "jitter_s": 0.02},
        ]
        event = kinds[rng.integers(len(kinds))]
        events.append({**event, "start_s": round(start, 2), "end_s": round(time, 2), "target": target})
    return events
