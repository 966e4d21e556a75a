"""The nodes of a flight, started one by one, as by hand."""

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from relform_core.load import LoadedScenario

INSTALL = Path(__file__).parents[2] / "install"
OTHERS = {
    "controller": ("relform_controller", "controller"),
    "clock": ("relform_sim", "clock"),
    "recorder": ("relform_bags", "recorder"),
    "composed": ("relform_bringup", "composed"),
    "visualization": ("relform_bringup", "visualization"),
}
HOVER = "{kind: hover, ramp_s: 0.0}"


def short(duration_s: float) -> str:
    """Override: the flight is a hover of this many seconds."""
    return (
        f"phases=[{{name: A, title: hover, duration_s: {duration_s}, steady_from_s: 0.0, "
        f"formation: initial, motion: {HOVER}}}]"
    )


class Nodes:
    """Processes of the nodes of one scenario in one domain; those that still run at the end are killed."""

    def __init__(
        self,
        scenario: LoadedScenario,
        folder: Path,
        domain_id: int,
        observers: Sequence[str] = (),
    ) -> None:
        self.processes: dict[str, subprocess.Popen[str]] = {}
        config = folder / "config.yaml"
        config.write_text(scenario.effective_yaml)
        self._arguments = [
            "--ros-args",
            "-p",
            f"scenario:={config}",
            "-p",
            f"observers:={list(observers) or ['']}",
        ]
        self._environment = os.environ | {"ROS_DOMAIN_ID": str(domain_id)}
        self._vehicles = scenario.config.team.vehicles

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self.processes.values():
            process.kill()
            process.communicate()

    def start(self, name: str, *parameters: str, arguments: Sequence[str] = ()) -> subprocess.Popen[str]:
        """Start a vehicle, or one of OTHERS."""
        given = (part for each in parameters for part in ("-p", each))
        arguments = [*self._arguments, *given, *arguments]
        if name in self._vehicles:
            command = [str(INSTALL / "relform_sim/lib/relform_sim/quadrotor")]
            arguments += ["-r", f"__ns:=/{name}"]
        else:
            package, program = OTHERS[name]
            command = [str(INSTALL / package / "lib" / package / program)]
        self.processes[name] = subprocess.Popen(
            [*command, *arguments],
            env=self._environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        return self.processes[name]

    def end(self, name: str, timeout_s: float = 60.0) -> tuple[int, str]:
        """Wait for a node to end; return its exit code and its stderr."""
        process = self.processes[name]
        _, errors = process.communicate(timeout=timeout_s)
        return process.returncode, errors

    def ends(self) -> dict[str, tuple[int, str]]:
        """As ``end``, of all nodes, without the lines of nodes that waited long for others."""
        ends = {name: self.end(name) for name in self.processes}
        return {name: (code, _without_waits(errors)) for name, (code, errors) in ends.items()}


def _without_waits(errors: str) -> str:
    lines = errors.splitlines(keepends=True)
    return "".join(line for line in lines if ": still waiting for " not in line)
