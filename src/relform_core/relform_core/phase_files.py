"""The files that the phases of a scenario name, read into the scenario."""

from pathlib import Path
from typing import Any

from relform_core.errors import ConfigError
from relform_core.explain import Origins
from relform_core.path_file import read_path
from relform_core.scenario_config import ScenarioConfig
from relform_core.spline_limits import broken_limit


def read_phase_files(tree: dict[str, Any], folder: Path, origins: Origins) -> None:
    """Replace the ``file`` of each motion ``path`` in an unchecked scenario by the samples in it.

    Args:
        tree: the scenario; changed.
        folder: files are relative to it, those of overrides to the working directory.
        origins: of the keys.
    Raises:
        ConfigError: one line: a file cannot be read, is wrong, or has samples beside it.
    """
    phases = tree.get("phases")
    for index, phase in enumerate(phases if isinstance(phases, list) else ()):
        motion = phase.get("motion") if isinstance(phase, dict) else None
        if not isinstance(motion, dict) or motion.get("kind") != "path":
            continue
        key = ("phases", str(index), "motion", "file")
        where = origins.locate(key)
        if "file" not in motion:
            if motion.keys() == {"kind"}:
                raise ConfigError(f"{where}: missing key")
            continue
        file = motion.pop("file")
        if not isinstance(file, str):
            raise ConfigError(f"{where}: must be text (got {file!r})")
        if motion.keys() != {"kind"}:
            raise ConfigError(f"{where}: gives the samples, so {', '.join(motion.keys() - {'kind'})} must go")
        try:
            motion |= read_path((Path() if origins.is_override(key) else folder) / file)
        except ConfigError as error:
            raise ConfigError(f"{where}: {error}") from None


def phase_problem(config: ScenarioConfig) -> tuple[int, str] | None:
    """The first phase whose path is too fast, by index, and the limit that it breaks; None if none is."""
    for index, phase in enumerate(config.phases):
        if phase.motion.kind == "path":
            broken = broken_limit(phase.motion.spline, config.controller.leader_motion)
            if broken is not None:
                return index, f"motion 'path' is too fast: {broken}"
    return None
