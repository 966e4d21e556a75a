"""The view of a running flight in a browser: the team moves, and nothing goes wrong in the page."""

import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, Playwright

from relform_analysis.report.chromium import launched
from relform_core.names import EVENTS, EventKind
from relform_msgs.msg import FormationEvent
from relform_ros.qos import LATCHED
from support.domains import domain_of_tests
from support.observer import Observer
from support.ports import free_port
from support.processes import wait_until

WORKSPACE = Path(__file__).parents[2]
SOFTWARE_WEBGL = ["--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader"]
"""Headless Chromium on a machine without a graphics card."""
SMALL = {"width": 800, "height": 500}
"""Software draws each pixel, so few of them."""
HARMLESS = ("THREE.Clock: This module has been deprecated",)
"""A warning of a library in the page of viser."""


@pytest.fixture(scope="module")
def environment() -> Iterator[dict[str, str]]:
    with domain_of_tests():
        yield dict(os.environ)


@pytest.fixture(scope="module")
def flight(environment: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A long flight, all nodes in one process, at the pace of this machine."""
    out = tmp_path_factory.mktemp("live") / "flight"
    changes = ["--set", "controller=team", "--set", "phases.4.duration_s=3000"]
    arguments = ["--scenario", "paper", *changes, "--composed", "--no-record", "--out", str(out)]
    with script(environment, "fly", *arguments):
        yield


@pytest.fixture(scope="module")
def address(environment: dict[str, str], flight: None) -> Iterator[str]:
    port = free_port()
    with script(environment, "live", "--port", str(port)) as live:
        assert live.stdout is not None
        assert live.stdout.readline() == f"open http://localhost:{port} in a browser, Ctrl-C ends the view\n"
        yield f"http://localhost:{port}"


@contextmanager
def script(environment: dict[str, str], name: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A script in the background; it ends by Ctrl-C and has nothing to complain about."""
    command = [sys.executable, f"scripts/{name}.py", *arguments]
    process = subprocess.Popen(
        command, cwd=WORKSPACE, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    yield process
    process.send_signal(signal.SIGINT)
    _, complaints = process.communicate(timeout=60.0)
    assert "error" not in complaints.lower(), complaints


@pytest.fixture(scope="module")
def page(playwright: Playwright, address: str) -> Iterator[Page]:
    complaints, requests = [], []
    browser = launched(playwright, *SOFTWARE_WEBGL)
    page = browser.new_page(viewport=SMALL)
    page.on("console", lambda message: complaints.append((message.type, message.text)))
    page.on("pageerror", lambda error: complaints.append(("error", str(error))))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(address)
    yield page
    browser.close()
    trouble = [text for kind, text in complaints if kind != "log" and not text.startswith(HARMLESS)]
    assert trouble == []
    assert [url for url in requests if not url.startswith((address, "data:", "blob:"))] == []


def text(page: Page) -> str:
    return page.locator("body").inner_text()


def shown_time(page: Page) -> float:
    """The time in the panel [s]."""
    found: Any = page.evaluate(r"() => document.body.innerText.match(/([\d.]+) s\s*phase/)?.[1] ?? '-1'")
    return float(found)


def test_numbers_of_the_flight_go_on(page: Page) -> None:
    wait_until(lambda: shown_time(page) > 0.0, timeout_s=60.0)
    before = shown_time(page)
    wait_until(lambda: shown_time(page) > before + 1.0)
    for part in ("formation error", "follower_2", "solved", "measured"):
        assert part in text(page)


def test_the_scene_moves(page: Page) -> None:
    canvas = page.locator("canvas").first
    pictures = {canvas.screenshot()}

    def has_moved() -> bool:
        page.wait_for_timeout(300)
        pictures.add(canvas.screenshot())
        return len(pictures) >= 3

    wait_until(has_moved, timeout_s=60.0)


def test_a_button_changes_the_formation(page: Page, environment: dict[str, str]) -> None:
    with Observer.running(int(environment["ROS_DOMAIN_ID"])) as observer:
        events = observer.collect(FormationEvent, EVENTS, LATCHED)
        page.get_by_role("button", name="fly this shape").click()
        page.get_by_text("set formation: accepted").wait_for()
        observer.until(lambda: any(event.kind == EventKind.SET_FORMATION for event in events))
    changed = next(event for event in events if event.kind == EventKind.SET_FORMATION)
    half = 1.2 / math.sqrt(2.0)  # a V of 90 degrees
    places = {
        pair.target_id: (pair.position.x, pair.position.y, pair.position.z) for pair in changed.formation
    }
    assert places["follower_1"] == pytest.approx((-half, -half, 0.0), abs=1e-4)
    assert places["follower_2"] == pytest.approx((-half, half, 0.0), abs=1e-4)


def test_a_refusal_is_shown_with_its_reason(page: Page) -> None:
    page.get_by_label("spacing (m)").fill("0.2")
    page.get_by_role("button", name="fly this shape").click()
    page.get_by_text("set formation: refused").wait_for()
    assert "is impossible: 'leader' and 'follower_1' are 0.200 m apart" in text(page)
