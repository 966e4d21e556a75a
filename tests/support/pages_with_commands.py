"""Commands and files in the fenced blocks of a documentation page, and a folder to run them in."""

import re
from dataclasses import dataclass
from pathlib import Path

WORKSPACE = Path(__file__).parents[2]
_FENCE = re.compile(r"^```(\S+)?[ \t]*(.*?)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_HEADING = re.compile(r"^## ", re.MULTILINE)
_COMMENT = re.compile(r"(^|\s\s+)#.*$", re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A fenced block."""

    language: str
    note: str
    """What stands behind the language: the name of a file, ``background`` or ``fails``."""
    text: str

    @property
    def commands(self) -> list[str]:
        """The commands of a block of the language ``sh``, without comments, each on one line."""
        joined = _COMMENT.sub("", self.text).replace("\\\n", " ")
        return [" ".join(line.split()) for line in joined.splitlines() if line.strip()]


def sections(page: Path) -> list[list[Block]]:
    """The blocks of each section of a page that has some, the part before the first heading included."""
    parts = _HEADING.split(page.read_text())
    blocks = [[Block(*match) for match in _FENCE.findall(part)] for part in parts]
    return [section for section in blocks if section]


def blocks(page: Path) -> list[Block]:
    """All blocks of a page."""
    return [block for section in sections(page) for block in section]


def make_room(folder: Path) -> Path:
    """A folder in which the commands of a page find what they need, and leave their files."""
    for name in (".venv", "config", "examples", "install", "scripts", "src"):
        (folder / name).symlink_to(WORKSPACE / name)
    return folder
