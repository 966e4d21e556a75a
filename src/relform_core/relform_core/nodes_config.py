"""Schema of ``config/nodes.yaml``: ROS parameters of nodes that are started by hand, which rclpy reads."""

import copy
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import ConfigDict, Field, GetJsonSchemaHandler, RootModel
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from relform_core.controller_config import WeightsConfig
from relform_core.schema import Name, Schema, Vector3
from relform_core.vehicle_config import FailsafeConfig, Tilt


@dataclass(frozen=True)
class _AnyKeys:
    """Annotation of a section of which a file gives the keys that it changes."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """No key is required."""
        section = copy.deepcopy(handler.resolve_ref_schema(handler(schema)))
        return {key: value for key, value in section.items() if key != "required"}


def _without_null(schema: dict[str, Any]) -> None:
    """State in the JSON Schema that no parameter is null, which ROS does not know."""
    for key, value in schema["properties"].items():
        if "anyOf" in value:
            (given,) = (each for each in value["anyOf"] if each != {"type": "null"})
            rest = {name: each for name, each in value.items() if name not in ("anyOf", "default")}
            schema["properties"][key] = {**given, **rest}


class NodeParameters(Schema):
    """Parameters of a node. A node warns of those that it does not have."""

    model_config = ConfigDict(extra="allow", json_schema_extra=_without_null)

    scenario: Annotated[str, Field(examples=["config/scenarios/paper.yaml"])] = ""
    """Path or plain name of the scenario, usually the effective configuration in a run folder; the same for
    all nodes of a flight."""
    observers: Annotated[tuple[str, ...], Field(examples=[["/recorder"]])] = ()
    """Fully qualified names of the nodes that every step waits for, beside vehicles and controllers; the same
    for all nodes of a flight."""
    start_timeout: Annotated[float, Field(alias="start_timeout_s", ge=0.1, le=3600.0, examples=[600.0])] = (
        60.0
    )
    """Of the clock: wall time that all nodes may take until they are ready."""
    weights: Annotated[WeightsConfig, _AnyKeys()] | None = None
    """Of a controller: weights of the cost that replace those of the scenario."""
    formation: Annotated[dict[Name, Vector3] | None, Field(examples=[{"follower_1": [-1.5, -1.0, 0.0]}])] = (
        None
    )
    """Of a controller: places of followers relative to the leader [m] that replace those of the scenario."""
    failsafe: Annotated[FailsafeConfig, _AnyKeys()] | None = None
    """Of a vehicle: values of its failsafe that replace those of the scenario."""
    tilt_max: Annotated[Tilt | None, Field(alias="tilt_max_deg", examples=[80.0])] = None
    """Of a vehicle: a tilt beyond this ends the flight."""


class NodeSection(Schema):
    """The parameters of the nodes that the name of the section matches."""

    model_config = ConfigDict(extra="allow")

    parameters: Annotated[NodeParameters, Field(alias="ros__parameters")]
    """The parameters."""


class NodesFile(RootModel[dict[str, NodeSection]]):
    """Sections by the full name of a node; ``*`` is one part of a name, ``**`` any number of parts."""
