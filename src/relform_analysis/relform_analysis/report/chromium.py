"""The Chromium of the distribution, without a window: for pictures of pages, and to measure and test them."""

from __future__ import annotations

import os
import shutil
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # users of reports do not need it
    from playwright.sync_api import Browser, Playwright

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
"""Its program; None: there is none."""


def launched(playwright: Playwright, *arguments: str) -> Browser:
    """The browser; root, as which containers run, may not use its sandbox.

    Raises:
        playwright.sync_api.Error: it does not start.
    """
    sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []
    return playwright.chromium.launch(executable_path=CHROMIUM, args=[*sandbox, *arguments])
