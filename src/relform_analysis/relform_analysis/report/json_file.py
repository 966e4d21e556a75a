"""Files that hold one JSON object."""

import json
from pathlib import Path

from relform_analysis.flight.summary import Json
from relform_core.errors import RelformError


def read_json(file: Path) -> Json:
    """Read a file.

    Raises:
        RelformError: one line: it is not there, or holds something else.
    """
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise RelformError(f"{file}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise RelformError(f"{file}: cannot be read: {error}") from None
    if not isinstance(content, dict):
        raise RelformError(f"{file}: cannot be used: it holds no JSON object")
    return content
