"""Write docs/configuration.md and the JSON Schemas in config/schema from the schemas of the configuration."""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from relform_bringup.configuration.file_kinds import FILE_KINDS, SCHEMA_FOLDER
from relform_bringup.configuration.page import page_text
from relform_core.atomic_file import write_atomically
from relform_core.script import CommandParser, command

WORKSPACE = Path(__file__).resolve().parents[4]


def generated(workspace: Path) -> Mapping[Path, str]:
    """Text of each generated file, by its path in the workspace."""
    schemas = {
        workspace / "config" / SCHEMA_FOLDER / f"{kind.name}.json": json.dumps(
            kind.json_schema, indent=2, ensure_ascii=False
        )
        + "\n"
        for kind in FILE_KINDS
    }
    page = workspace / "docs/configuration.md"
    return {page: page_text(page.read_text(), workspace / "config"), **schemas}


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = CommandParser(
        prog="configuration", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.parse_args(arguments)
    for path, text in generated(WORKSPACE).items():
        path.parent.mkdir(exist_ok=True)
        write_atomically(path, text)
        print(path.relative_to(WORKSPACE))
    return 0
