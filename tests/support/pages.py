"""Reports for tests: their tables, texts and data."""

import base64
import json
from html.parser import HTMLParser
from typing import Any

import numpy as np
import numpy.typing as npt


class Page(HTMLParser):
    """The tables of a page, and the references of its tags."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.html = html
        self.tables: dict[str, list[list[str]]] = {}
        """Rows of texts by the class of the table."""
        self.references: list[str] = []
        self.scripts: list[str] = []
        self.texts: list[str] = []
        self._rows: list[list[str]] = []
        self._in_cell = self._in_script = False
        self.feed(html)

    @property
    def text(self) -> str:
        """The visible text, in one line."""
        return " ".join(" ".join(self.texts).split())

    @property
    def data(self) -> Any:
        """The data that the page's scripts draw."""
        return json.loads(self.scripts[-2])

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        self.references += [value or "" for name, value in attrs if name in ("src", "href", "action", "data")]
        match tag:
            case "table":
                self._rows = self.tables.setdefault(attributes.get("class") or "", [])
            case "tr":
                self._rows.append([])
            case "th" | "td":
                self._rows[-1].append("")
                self._in_cell = True
            case "script" | "style":
                self._in_script = True
                self.scripts += [""] if tag == "script" else []

    def handle_endtag(self, tag: str) -> None:
        if tag in ("th", "td"):
            self._in_cell = False
        if tag in ("script", "style"):
            self._in_script = False

    def handle_data(self, data: str) -> None:
        if self._in_script:
            if self.scripts:
                self.scripts[-1] += data
            return
        self.texts.append(data)
        if self._in_cell:
            self._rows[-1][-1] += data


def unpack(packed: dict[str, Any]) -> npt.NDArray[np.float32]:
    """An array of a page's data."""
    if "float32" in packed:
        return np.frombuffer(base64.b64decode(packed["float32"]), dtype="<f4").reshape(packed["shape"])
    steps = np.frombuffer(base64.b64decode(packed["int16"]), dtype="<i2").reshape(packed["shape"])
    values = packed["middle"] + packed["step"] * steps
    return np.where(steps == -32768, np.nan, values).astype(np.float32)
