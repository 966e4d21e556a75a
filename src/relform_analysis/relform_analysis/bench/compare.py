"""One team size: our SQP step and that of acados on the same instances, one after the other."""

import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relform_analysis.bench.acados_package import PeerUnavailableError
from relform_analysis.bench.acados_peer import AcadosPeer
from relform_analysis.bench.streams import Instance, Stream, record, scenario_of
from relform_analysis.bench.timed_solver import TimedKernelSolver
from relform_controller.blas import one_blas_thread
from relform_controller.ocp.terms.registry import TERMS
from relform_core.arrays import Array
from relform_core.load import LoadedScenario

_PRICES = "price_per_unit: 300.0, square_price_per_unit2: 1000.0"
CONSTRAINTS = (
    f"controller.constraints={{separation: {{min_m: 0.9, {_PRICES}}}, tilt: {{max_deg: 25.0, {_PRICES}}}, "
    f"speed: {{max_m_s: 2.6, {_PRICES}}}}}"
)
"""Override: soft constraints that are active in most of the steps."""
_TURN = 6.0
"""Begin of the agile turn, which the formation change follows [s]."""


@dataclass(frozen=True)
class Setup:
    """What to measure."""

    n_vehicles: int
    controller: str
    """Plain name of the tuning."""
    overrides: Sequence[str]
    """Of the scenario, ``some.key=value``."""
    n_instances: int
    with_peer: bool

    @property
    def scenario(self) -> LoadedScenario:
        """What is flown."""
        return scenario_of(self.n_vehicles, self.controller, self.overrides)


def measure(setup: Setup) -> dict[str, Any]:
    """One row of the table; ``peer_missing`` gives the reason if there is no peer."""
    compile_time = _compile_time(setup)
    with one_blas_thread():
        stream = record(setup.scenario, setup.n_instances, _TURN)
        before = _resident_mb()
        ours = TimedKernelSolver(stream.ocp)
        _solve(ours, stream.instances[0])
        memory = _resident_mb() - before
        peer, missing, before = None, "", _resident_mb()
        if setup.with_peer:
            try:
                peer = AcadosPeer(stream.ocp, TERMS)
                peer.step(stream.instances[0])
            except PeerUnavailableError as error:
                missing = str(error)
        peer_memory = _resident_mb() - before
        row = _row(ours, peer, stream)
    row |= {
        "vehicles": setup.n_vehicles,
        "controller": setup.controller,
        "instances": len(stream.instances),
        "active_bounds_max": max(instance.active_bounds for instance in stream.instances),
        "constrained_share": sum(instance.is_constrained for instance in stream.instances)
        / len(stream.instances),
        "ours_compile_s": compile_time,
        "ours_memory_mb": memory,
    }
    if peer is not None:
        row |= {"peer_compile_s": peer.build_time, "peer_memory_mb": peer_memory}
    elif missing:
        row["peer_missing"] = missing
    return row


def _row(ours: TimedKernelSolver, peer: AcadosPeer | None, stream: Stream) -> dict[str, Any]:
    """Measure alternately; of two passes the faster time of each step counts: other jobs disturb."""
    ours_passes, peer_passes, errors, failures = [], [], [], 0
    for _ in range(2):
        ours.prepare_times.clear()
        ours.feedback_times.clear()
        ours.whole_times.clear()
        peer_times = []
        for instance in stream.instances:
            first_inputs = _solve(ours, instance)
            if peer is not None:
                step = peer.step(instance)
                peer_times.append((step.prepare, step.feedback))
                failures += step.status != 0
                difference = np.abs(step.first_inputs - first_inputs).max()
                errors.append(float(difference / np.abs(first_inputs).max()))
        whole = np.array(ours.whole_times).reshape(-1, 2).sum(axis=1)
        ours_passes.append(np.column_stack([ours.prepare_times, ours.feedback_times, whole]))
        peer_passes.append(np.array(peer_times))
    prepare, feedback, whole = np.min(ours_passes, axis=0).T
    row: dict[str, Any] = {
        "ours_ms": spread_ms(prepare + feedback),
        "ours_prepare_ms": spread_ms(prepare),
        "ours_feedback_ms": spread_ms(feedback),
        "ours_python_ms": spread_ms(whole - prepare - feedback),
    }
    if peer is None:
        return row
    prepare, feedback = np.min(peer_passes, axis=0).T
    row |= {
        "peer_ms": spread_ms(prepare + feedback),
        "peer_prepare_ms": spread_ms(prepare),
        "peer_feedback_ms": spread_ms(feedback),
        "peer_failures": failures,
        "first_input_difference_max": max(errors),
    }
    return row | {
        f"ratio_{name}": row["peer_ms"][name] / row["ours_ms"][name] for name in ("median", "p99", "max")
    }


def spread_ms(times: Sequence[float] | Array) -> dict[str, float]:
    """Median, 99% quantile and largest of times in seconds, in milliseconds."""
    milliseconds = 1e3 * np.asarray(times)
    return {
        "median": float(np.median(milliseconds)),
        "p99": float(np.quantile(milliseconds, 0.99)),
        "max": float(milliseconds.max()),
    }


def _solve(solver: TimedKernelSolver, instance: Instance) -> Array:
    """The first inputs [N], shape (vehicle, N_INPUT), with the geometry that acados is given."""
    solver.prepare(instance.guess, instance.geometry)
    return solver.feedback(instance.start, instance.geometry, instance.reference).plan.thrusts[:, 0]


def _compile_time(setup: Setup) -> float:
    """Time to make the solver with an empty cache [s]."""
    ocp = record(setup.scenario, 0).ocp
    before = os.environ.get("XDG_CACHE_HOME")
    with tempfile.TemporaryDirectory(prefix="relform-") as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        begin = time.perf_counter()
        try:
            TimedKernelSolver(ocp)
        finally:
            if before is None:
                del os.environ["XDG_CACHE_HOME"]
            else:
                os.environ["XDG_CACHE_HOME"] = before
        return time.perf_counter() - begin


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
