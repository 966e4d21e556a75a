"""Pictures of pages, for the documentation: what Chromium shows at a width, in light or dark."""

from collections.abc import Sequence
from pathlib import Path

from relform_analysis.report.chromium import launched
from relform_core.errors import RelformError
from relform_core.script import CommandParser, command, positive


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Make a picture; returns 0, or 2 after an error."""
    parser = CommandParser(
        prog="screenshot", description="Make a picture of a report, for the documentation."
    )
    parser.add_argument("page", type=Path, metavar="HTML", help="the report")
    parser.add_argument("out", type=Path, metavar="PNG", help="the picture")
    parser.add_argument("--width", type=positive, default=1366, help="of the page in pixels (default 1366)")
    parser.add_argument("--height", type=positive, help="in pixels (default: the whole page)")
    parser.add_argument("--dark", action="store_true", help="dark instead of light")
    parser.add_argument(
        "--press", action="append", default=[], metavar="NAME", help="press the button with this name before"
    )
    chosen = parser.parse_args(arguments)
    take(chosen.page, chosen.out, chosen.width, chosen.height, chosen.dark, chosen.press)
    print(chosen.out)
    return 0


def take(
    page: Path,
    out: Path,
    width: int,
    height: int | None = None,
    dark: bool = False,
    press: Sequence[str] = (),
    time: float | None = None,
) -> None:
    """Write the picture of a page as PNG.

    Args:
        page: its file.
        out: the picture.
        width, height: in pixels; without a height the whole page.
        dark: whether the reader prefers dark pages.
        press: names of buttons that are pressed before, in this order.
        time: of the flight that the page shows [s]; None: as it opens.
    Raises:
        RelformError: one line: there is no such page, no browser, or no such button.
    """
    if not page.is_file():
        raise RelformError(f"{page}: no such file")
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError:
        raise RelformError("playwright is not installed: run make setup") from None
    with sync_playwright() as playwright:
        try:
            browser = launched(playwright)
            tab = browser.new_page(
                viewport={"width": width, "height": height or 800}, color_scheme="dark" if dark else "light"
            )
            tab.goto(page.resolve().as_uri())
            for name in press:
                tab.get_by_role("button", name=name).first.click(timeout=2000)
            if time is not None:
                tab.evaluate(f"relform.playback.seek({time})")
                tab.wait_for_timeout(500)  # until it is drawn
            tab.screenshot(path=out, full_page=height is None)
            browser.close()
        except Error as error:
            raise RelformError(f"{page}: no picture: {error.message.splitlines()[0]}") from None
