"""Fly one case of the campaign, and judge it."""

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from relform_bringup.faults import checks
from relform_bringup.faults.evidence import Evidence
from relform_bringup.faults.kinds import KINDS, problems
from relform_bringup.faults.plan import FLY, Action, Case, Draw, Plan
from relform_bringup.faults.processes import FlightProcesses
from relform_bringup.faults.results import Result
from relform_bringup.faults.shim import Shim
from relform_core.errors import FlightError, RelformError
from relform_core.load import LoadedScenario, load_scenario
from relform_core.ros_domain import claimed_domain
from relform_core.run_folder import RunFolder

if TYPE_CHECKING:
    from relform_bringup.nodes.fault_witness import Witness

START_S = 40.0
"""Time in which a flight must begin after the start of its last process [s]."""
LEAVE_S = 5.0
"""Time in which additional processes must end after the flight [s]."""
STEP_TIMEOUT_S = 3.0
DISK = "disk"
"""Folder where the small disk is mounted."""


def fly_case(case: Case, folder: Path) -> Result:
    """Fly a case, and judge it. If it has passed, its folder is removed, else it keeps all files."""
    shutil.rmtree(folder, ignore_errors=True)
    try:
        result = _flown_and_judged(case, folder)
    except RelformError as error:
        return Result(case.kind, case.seed, (f"it cannot be flown: {error}",))
    if not result.problems:
        shutil.rmtree(folder)
    return result


def _flown_and_judged(case: Case, folder: Path) -> Result:
    kind = KINDS[case.kind]
    plan = kind.draw(Draw(case))
    overrides = [*plan.overrides, f"lockstep.step_timeout_s={STEP_TIMEOUT_S}"]
    scenario = load_scenario("paper", overrides, case.seed)
    folder.mkdir(parents=True)
    evidence = _fly(plan, scenario, RunFolder(folder.absolute()))
    takeover = checks.takeover(plan, evidence)
    return Result(case.kind, case.seed, problems(kind, plan, evidence), evidence.wall, takeover)


def _fly(plan: Plan, scenario: LoadedScenario, run: RunFolder) -> Evidence:
    from relform_bringup.faults.from_bag import read_flown
    from relform_bringup.nodes.fault_witness import Witness

    run.log.mkdir()
    run.config.write_text(scenario.effective_yaml, encoding="utf-8")
    shim = Shim(run.path / "shim")
    by_fly = plan.order == (FLY,)
    disk = _disk(run.path / DISK, plan.disk_bytes) if plan.disk_bytes else nullcontext()
    bags = run.path / DISK if plan.disk_bytes else run.path
    with disk, _domain(held=not by_fly) as domain_id:
        os.environ["ROS_DOMAIN_ID"] = str(domain_id)
        began = time.monotonic()
        with Witness(domain_id, scenario) as witness, FlightProcesses(run, shim, bags) as processes:
            done = _watch(plan, processes, witness)
            orphans, ends = processes.orphans(), processes.ends()
        wall = time.monotonic() - began
        read = [read_flown(each, scenario) for each in processes.bags]
    bag_problem = "; ".join(problem for _, problem in read if problem)
    return Evidence(ends, orphans, wall, done, witness.now, read[-1][0], bag_problem)


def _watch(plan: Plan, processes: FlightProcesses, witness: "Witness") -> tuple[float, ...]:
    """Start the processes, do what the plan says, and wait for the end; returns when each fault was done."""
    for name in plan.order:
        if name not in plan.late:
            processes.start(name)
    for name, wait in plan.late.items():
        witness.wait(lambda: False, wait)
        processes.start(name)
    done: list[float] = []
    if witness.wait(lambda: witness.now >= 0.0 or not processes.running, START_S):
        began = time.monotonic()
        for fault in plan.faults:
            witness.wait(lambda: time.monotonic() >= began + fault.time, START_S)  # noqa: B023  # called here only
            if fault.action is Action.FOREIGN:
                witness.disturb(fault.target, fault.value, fault.count)
            else:
                processes.do(fault)
            done.append(witness.now)
        witness.wait(lambda: not processes.flying, began + plan.ends_by - time.monotonic())
        if not witness.wait(lambda: not processes.running, LEAVE_S):
            processes.dismiss()
            witness.wait(lambda: not processes.running, LEAVE_S)
    return tuple(done)


@contextmanager
def _domain(held: bool) -> Iterator[int]:
    """A ROS domain of its own; if it is not held, it is for ``fly``, which claims it itself."""
    os.environ.pop("ROS_DOMAIN_ID", None)
    with claimed_domain(beside_shells=False) as domain_id:
        if held:
            yield domain_id
    if not held:
        yield domain_id


@contextmanager
def _disk(folder: Path, size: int) -> Iterator[None]:
    """A disk of its own in a folder.

    Raises:
        FlightError: this user may not mount one.
    """
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    mounted = subprocess.run(mount, capture_output=True, text=True, check=False)
    if mounted.returncode != 0:
        raise FlightError(f"a small disk cannot be mounted: {mounted.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)
