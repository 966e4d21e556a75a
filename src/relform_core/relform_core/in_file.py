"""Sections of a scenario that may be in a file of their own, and how the JSON Schema states it."""

import copy
from dataclasses import dataclass

from pydantic import GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema


@dataclass(frozen=True)
class InFile:
    """Annotation of such a section: a scenario gives the file, the file with some keys replaced, or all keys.

    ``load`` reads the file before the scenario is validated.
    """

    example: str
    """A file as a scenario names it."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """The three forms."""
        whole = handler(schema)
        section = copy.deepcopy(handler.resolve_ref_schema(whole))
        name = {
            "description": "Path of the file, relative to the scenario, or name of an installed one.",
            "examples": [self.example],
            "type": "string",
        }
        replaced = {
            "description": "A file, and keys that replace those in it.",
            "type": "object",
            "properties": {"file": name, **section["properties"]},
            "required": ["file"],
            "additionalProperties": False,
        }
        return {"anyOf": [name, replaced, whole]}
