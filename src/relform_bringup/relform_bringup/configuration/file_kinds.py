"""The kinds of configuration files that users write."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pydantic import BaseModel

from relform_analysis.sweep.plan import VariantFile
from relform_core.controller_config import ControllerConfig
from relform_core.json_schema import JsonSchema, json_schema
from relform_core.nodes_config import NodesFile
from relform_core.scenario_file import ScenarioFile
from relform_core.sensors_config import SensorsConfig
from relform_core.vehicle_config import VehicleConfig

SCHEMA_FOLDER = "schema"
"""Folder of the JSON Schemas, in ``config/``."""


@dataclass(frozen=True)
class FileKind:
    """Files with the same keys."""

    name: str
    """Of the file with its JSON Schema."""
    title: str
    """Heading on the page."""
    folder: str
    """Folder of the shipped files, in ``config/``."""
    schema: type[BaseModel]
    intro: str
    """What such a file is for, and how it is used."""
    example: str
    """A shipped file, which the page shows."""

    @cached_property
    def json_schema(self) -> JsonSchema:
        """Its JSON Schema; not to be changed."""
        schema = json_schema(self.schema)
        return {"$schema": schema["$schema"], "title": f"relform: {self.title.lower()}", **schema}

    def files(self, config: Path) -> list[Path]:
        """The shipped files."""
        return sorted((config / self.folder).glob("*.yaml"))

    @property
    def schema_line(self) -> str:
        """The first line of each shipped file, by which editors find its JSON Schema."""
        up = "../" if self.folder else ""
        return f"# yaml-language-server: $schema={up}{SCHEMA_FOLDER}/{self.name}.json"

    @property
    def top(self) -> JsonSchema:
        """The part of its JSON Schema whose keys the page lists first."""
        root = self.json_schema
        top: JsonSchema = root["$defs"]["NodeParameters"] if self.name == "nodes" else root
        return top


FILE_KINDS = (
    FileKind(
        "scenario",
        "Scenario files",
        "scenarios",
        ScenarioFile,
        "Everything that defines a flight: the team, its formations, the path, and what disturbs it. "
        "`fly.py --scenario` and `sweep.py --scenario` take one; the `config.yaml` of a run is one, too. "
        "[scenarios.md](scenarios.md) explains formations, sensing graphs and motions.",
        "paper",
    ),
    FileKind(
        "vehicle",
        "Vehicle files",
        "vehicles",
        VehicleConfig,
        "A type of quadrotor, with rotors in front, left, behind and right. All vehicles of a scenario are "
        "of one type; their true masses and moments of inertia are drawn for each flight.",
        "hummingbird",
    ),
    FileKind(
        "sensors",
        "Sensors files",
        "sensors",
        SensorsConfig,
        "What the vehicles measure, and how well. The controller knows these standard deviations.",
        "paper",
    ),
    FileKind(
        "controller",
        "Controller files",
        "controller",
        ControllerConfig,
        "The optimal control problem, its solver and the estimator. Weights can also be changed in flight "
        "([topics.md](topics.md#parameters)).",
        "team",
    ),
    FileKind(
        "sweep",
        "Sweep files",
        "sweeps",
        VariantFile,
        "Variants of a scenario that `sweep.py --variants` flies: a list of them, or a grid over parameters "
        "([sweep.md](sweep.md)).",
        "rates",
    ),
    FileKind(
        "nodes",
        "Parameters of nodes",
        "",
        NodesFile,
        "ROS parameters of the nodes of a flight that is started by hand, `--params-file config/nodes.yaml` "
        "([nodes.md](nodes.md)). Sections are called by the full name of a node; `*` is one part of a name, "
        "`**` any number. [topics.md](topics.md#parameters) lists the parameters of recorder and player, and "
        "those that can be changed in flight.",
        "nodes",
    ),
)
