"""The option ``--list`` of ``fly``: names and titles of the installed scenarios."""

import argparse
from typing import Any

from relform_core.config_files import PACKAGE, installed_configs
from relform_core.yaml_files import read_mapping


class ListScenarios(argparse.Action):
    """Print the table and end, as ``--help`` does."""

    def __init__(self, option_strings: list[str], dest: str, **kwargs: Any) -> None:
        super().__init__(option_strings, dest, nargs=0, **kwargs)

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        """Print and end."""
        print(scenario_table())
        parser.exit()


def scenario_table() -> str:
    """A line for each installed scenario: its plain name and its title.

    Raises:
        ConfigError: a file cannot be read.
    """
    files = installed_configs("scenario")
    if not files:
        return f"no scenarios: {PACKAGE} is not installed"
    width = max(map(len, files))
    return "\n".join(f"{name:{width}}  {read_mapping(path)['title']}" for name, path in files.items())
