"""Pages as single files: template, style, scripts and data in one HTML text that opens offline."""

import json
from collections.abc import Iterator
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape

from relform_analysis.flight.summary import Json
from relform_analysis.plots.palette import inks

ASSETS = files(__package__) / "assets"
UPLOT = "uplot"
"""Folder of the library that draws plots, with its licence."""
PLOT_SCRIPTS = ("base.js", "uplot/uPlot.iife.min.js", "plot_marks.js", "plot.js", "plot_group.js")
"""What a page with plots runs first."""


def render(
    template: str, scripts: tuple[str, ...], data: Json, styles: tuple[str, ...] = (), **content: Any
) -> str:
    """A page from its template.

    Args:
        template: name of the template.
        scripts: names of the scripts, in the order in which they run; they share one scope.
        data: what the scripts draw; JSON.
        styles: names of style sheets after the one that all pages have.
        content: what the template shows.
    """
    environment = Environment(
        loader=FileSystemLoader(str(ASSETS)),
        autoescape=select_autoescape(["html"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(
        style="\n".join((*_ink_rules(), *map(_asset, ("uplot/uPlot.min.css", "style.css", *styles)))),
        script="\n".join(map(_script, scripts)),
        # Inside <script>, only "</" and "<!--" would end or change what follows.
        data=json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        **content,
    )


def _ink_rules() -> Iterator[str]:
    """The palette as variables of the style, by theme."""
    for ground, selector in (("light", ":root"), ("dark", ':root[data-theme="dark"]')):
        inks_on_ground = (f"--{name}: {getattr(ink, ground)};" for name, ink in inks().items())
        yield f"{selector} {{ {' '.join(inks_on_ground)} }}"


def _script(name: str) -> str:
    """A script; that of others begins with its licence."""
    licence = f"/*\n{_asset(f'{UPLOT}/LICENSE')}*/\n" if name.startswith(UPLOT) else ""
    return licence + _asset(name)


def _asset(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")
