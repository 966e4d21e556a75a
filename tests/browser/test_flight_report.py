"""The report of a flight in a browser: what the hand does to it, and what the eye then gets to see."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, Page
from scipy.spatial.transform import Rotation

from relform_analysis.flight.log import FlightLog
from relform_analysis.flight.tracking_errors import formation_errors, scored_pairs
from relform_analysis.report.flight_page import write_flight_report
from relform_analysis.report.flight_source import summary_of
from relform_core.telemetry import Event, ParametersSet, PerStep
from support.logs import perfect_builder
from support.scenarios import paper_scenario

from .conftest import LAPTOP, Tab, settle

PHASES = ["A"] * 20 + ["B"] * 80
END = 5.0
PERIOD = 0.05


@pytest.fixture(scope="module")
def log() -> FlightLog:
    """Five seconds along an arc, with errors that grow."""
    builder = perfect_builder(paper_scenario(), PHASES)
    change = ParametersSet({"weights.formation_per_m2": 12.0})
    builder.add_event(PerStep(45, 2_250_000_000, Event("/formation/controller", change)))
    log = builder.build()
    time = log.tick_ns / 1e9
    arc = np.stack([6.0 * np.sin(0.3 * time), 6.0 - 6.0 * np.cos(0.3 * time), 0.2 * time], axis=-1)
    log.p_NB_N[:] += arc[:, None, :]
    log.p_NB_N[:, 2] += 0.03 * time[:, None]
    log.leader_p_NB_N__ref[:] += arc[:-1]
    log.rotor_speeds[:] += 60.0 * np.sin(7.0 * time[:-1, None, None])
    log.solver["kkt"][:] = np.geomspace(1e-2, 30.0, len(PHASES))
    return log


@pytest.fixture(scope="module")
def report(log: FlightLog, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_flight_report(path, log, summary_of(log, versions={"relform": "0.1.0"}))
    return path


@pytest.fixture
def page(tab: Tab, report: Path) -> Page:
    tab.open(report)
    return tab.page


def wait_until(page: Page, condition: str) -> None:
    """Wait for a condition on the page, whose security policy lets it evaluate none by itself."""
    for _ in range(200):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(25)
    raise AssertionError(f"did not happen: {condition}")


def time_of(page: Page) -> float:
    return float(page.locator("#now").inner_text().removesuffix(" s"))


def seats(page: Page) -> Any:
    """Where the vehicles are on the screen, shape (n, 2)."""
    return np.array(page.evaluate("relform.scene.drawing.onScreen"))


def rgb(colour: str) -> tuple[int, ...]:
    """Of #rrggbb; the last two bits are left to rounding."""
    return tuple(int(colour[at : at + 2], 16) // 4 for at in (1, 3, 5))


def colours_around(page: Page, place: Any, opacity: int = 255) -> set[tuple[int, ...]]:
    """Colours in the scene near a place in it that are at least so opaque."""
    code = """([x, y]) => {
        const {canvas, ratio} = relform.scene;
        const copy = new OffscreenCanvas(12, 12).getContext("2d");
        copy.drawImage(canvas, (x - 6) * ratio, (y - 6) * ratio, 12 * ratio, 12 * ratio, 0, 0, 12, 12);
        return [...copy.getImageData(0, 0, 12, 12).data];
    }"""
    data = np.array(page.evaluate(code, [float(value) for value in place])).reshape(-1, 4)
    return {tuple(int(channel) // 4 for channel in pixel[:3]) for pixel in data if pixel[3] >= opacity}


def cursors(page: Page) -> list[float]:
    """Place of the cursor in each plot that is in sight, in seconds."""
    return [
        float(value)
        for value in page.evaluate(
            """relform.plots.plots.filter(plot => plot.visible).map(plot => {
                const at = Number(plot.now.style.transform.match(/\\(([-0-9.]+)/)[1]);
                return plot.chart.posToVal(at, "x");
            })"""
        )
    ]


def windows(page: Page) -> set[tuple[float, float]]:
    """What the time axes of the drawn plots show."""
    scales = page.evaluate("relform.plots.plots.filter(plot => plot.chart).map(({chart}) => chart.scales.x)")
    return {(scale["min"], scale["max"]) for scale in scales}


def plot(page: Page, name: str) -> Locator:
    """A plot by its title; it is drawn when this returns."""
    found = page.locator(".plot").filter(has=page.get_by_role("heading", name=name))
    found.scroll_into_view_if_needed()
    found.locator(".u-over").wait_for()
    settle(page)
    return found


def drawn_near(page: Page, name: str, time: float, value: float) -> set[tuple[int, ...]]:
    """Colours in a plot within two pixels of a point, given in its units."""
    code = """([name, time, value]) => {
        const {chart} = relform.plots.plots.find(({panel}) => panel.title === name);
        const x = chart.valToPos(time, "x", true), y = chart.valToPos(value, "y", true);
        const copy = new OffscreenCanvas(5, 5).getContext("2d");
        copy.drawImage(chart.ctx.canvas, x - 2, y - 2, 5, 5, 0, 0, 5, 5);
        return [...copy.getImageData(0, 0, 5, 5).data];
    }"""
    data = np.array(page.evaluate(code, [name, time, float(value)])).reshape(-1, 4)
    return {tuple(int(channel) // 4 for channel in pixel[:3]) for pixel in data}


def box(locator: Locator) -> dict[str, float]:
    found = locator.bounding_box()
    assert found is not None
    return dict(found)


def background(page: Page) -> int:
    colour = page.evaluate("getComputedStyle(document.body).backgroundColor")
    return sum(map(int, re.findall(r"\d+", colour)))


def test_loads_within_a_second(page: Page, report: Path) -> None:
    assert report.stat().st_size < 1_000_000
    times = []
    for _ in range(3):  # the best of them: the machine may be busy
        page.reload()
        times.append(page.evaluate("performance.getEntriesByType('navigation')[0].loadEventEnd"))
    assert 0.0 < min(times) < 1000.0
    assert page.locator("canvas#scene").count() == 1
    sections = page.evaluate("relform.flight.data.sections")
    assert page.locator(".plot").count() == sum(len(section["panels"]) for section in sections)


def test_first_screen_of_a_laptop_has_numbers_scene_and_playback(page: Page) -> None:
    for part in (".tiles", "#scene", "#play", "#timeline"):
        place = box(page.locator(part))
        assert place["y"] + place["height"] <= LAPTOP["height"], part
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_slider_moves_the_vehicles(page: Page, log: FlightLog) -> None:
    before = seats(page)
    picture = page.evaluate("relform.scene.canvas.toDataURL()")
    line = box(page.locator("#timeline"))
    page.mouse.click(line["x"] + 0.7 * line["width"], line["y"] + 10)
    settle(page)
    assert time_of(page) == pytest.approx(0.7 * END, abs=0.05)
    assert np.linalg.norm(seats(page) - before, axis=-1).min() > 20.0
    assert page.evaluate("relform.scene.canvas.toDataURL()") != picture
    np.testing.assert_allclose(cursors(page), time_of(page), atol=0.02)


def test_vehicles_are_where_the_truth_says(page: Page, log: FlightLog) -> None:
    for tick in (0, 33, 100):
        page.evaluate(f"relform.playback.seek({tick * PERIOD})")
        poses = page.evaluate(f"relform.flight.poses({tick * PERIOD})")
        np.testing.assert_allclose([pose["position"] for pose in poses], log.p_NB_N[tick], atol=1e-4)
    between = page.evaluate(f"relform.flight.poses({40.25 * PERIOD})")
    expected = 0.75 * log.p_NB_N[40] + 0.25 * log.p_NB_N[41]
    np.testing.assert_allclose([pose["position"] for pose in between], expected, atol=1e-4)


def test_vehicles_are_drawn_with_their_colours_and_attitude(page: Page) -> None:
    page.keyboard.press("f")
    page.evaluate("relform.playback.seek(2.0)")
    settle(page)
    colours = page.evaluate("relform.scene.drawing.vehicleColours")
    for place, colour in zip(seats(page), colours, strict=True):
        assert rgb(colour) in colours_around(page, place)
    axes = np.array(page.evaluate("relform.flight.poses(2.0)[0].axes"))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-6)
    # Roll -4 deg, pitch 7 deg: body x points down by 7 deg, body y down by 4 deg.
    np.testing.assert_allclose(
        axes[:2, 2], [-np.sin(np.radians(7)), -np.cos(np.radians(7)) * np.sin(np.radians(4))], atol=1e-5
    )


def test_camera_is_a_pinhole(page: Page, log: FlightLog) -> None:
    page.evaluate("relform.playback.seek(3.0)")
    settle(page)
    camera = page.evaluate("relform.scene.cameras.overview")
    azimuth, elevation = camera["azimuth"], camera["elevation"]
    back = Rotation.from_euler("ZY", [azimuth, -elevation]).apply([1.0, 0.0, 0.0])
    eye = np.array(camera["target"]) + camera["distance"] * back
    right = np.cross(-back, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    seen = (log.p_NB_N[60] - eye) @ np.stack([right, np.cross(right, -back), -back], axis=-1)
    scene = box(page.locator("#scene"))
    focal = scene["height"] / 2.0 / np.tan(0.3)  # half of the field of view [rad]
    expected = np.array([scene["width"], scene["height"]]) / 2.0 + focal * seen[:, :2] / seen[:, 2:] * [1, -1]
    np.testing.assert_allclose(seats(page), expected, atol=0.5)


def test_paths_stay_where_the_vehicles_were(page: Page) -> None:
    page.evaluate("relform.playback.seek(2.3)")
    settle(page)
    earlier = seats(page)
    page.evaluate("relform.playback.seek(4.5)")
    settle(page)
    colours = page.evaluate("relform.scene.drawing.vehicleColours")
    for follower in (1, 2):  # the leader's path lies under its reference
        assert rgb(colours[follower]) in colours_around(page, earlier[follower], opacity=100)


def test_play_goes_on_in_real_time_and_stops_at_the_end(page: Page) -> None:
    page.locator("#play").click()
    wait_until(page, "relform.playback.time > 0.3")
    assert page.locator("#play").get_attribute("aria-label") == "Pause"
    page.keyboard.press(" ")
    held = time_of(page)
    page.wait_for_timeout(100)
    assert time_of(page) == held
    page.locator("#speed").select_option("8")
    page.keyboard.press(" ")
    wait_until(page, "!relform.playback.playing")
    assert time_of(page) == END
    page.keyboard.press(" ")  # once more from the start
    wait_until(page, "relform.playback.playing && relform.playback.time < 4")


def test_speed_is_that_of_the_clock(page: Page) -> None:
    page.locator("#speed").select_option("0.5")
    elapsed = page.evaluate(
        """() => new Promise(done => {
            let first = null;
            relform.playback.play();
            const frame = now => {
                const time = relform.playback.time;
                if (time > 0.1 && first === null) first = [now, time];
                if (first !== null && now - first[0] > 600) done((time - first[1]) / (now - first[0]) * 1000);
                else requestAnimationFrame(frame);
            };
            requestAnimationFrame(frame);
        })"""
    )
    assert elapsed == pytest.approx(0.5, rel=0.25)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        (["ArrowRight"], 2.05),
        (["ArrowLeft", "ArrowLeft"], 1.9),
        (["Shift+ArrowRight"], 3.0),
        (["Home"], 0.0),
        (["End"], END),
        (["2"], 1.0),
        (["Home", "ArrowLeft"], 0.0),
    ],
)
def test_keys_set_the_time(page: Page, keys: list[str], expected: float) -> None:
    page.evaluate("relform.playback.seek(2.0)")
    for key in keys:
        page.keyboard.press(key)
    assert time_of(page) == pytest.approx(expected)
    assert page.locator("#phase").inner_text().startswith("B" if expected >= 1.0 else "A")


def test_keys_when_the_slider_has_the_focus(page: Page) -> None:
    page.locator("#time").focus()
    page.keyboard.press("ArrowRight")
    assert time_of(page) == pytest.approx(PERIOD)


def test_speeds_by_key(page: Page) -> None:
    page.keyboard.press("]")
    assert page.locator("#speed").input_value() == "2"
    for _ in range(9):
        page.keyboard.press("[")
    assert page.locator("#speed").input_value() == "0.1"


def test_help_names_the_keys(page: Page) -> None:
    page.keyboard.press("?")
    assert page.locator("#keys").is_visible()
    page.keyboard.press("Escape")
    assert not page.locator("#keys").is_visible()


def drag(page: Page, locator: Locator, first: float, second: float) -> None:
    """Across a plot, from one part of its width to another."""
    place = box(locator)
    y = place["y"] + 0.5 * place["height"]
    page.mouse.move(place["x"] + first * place["width"], y)
    page.mouse.down()
    page.mouse.move(place["x"] + second * place["width"], y, steps=5)
    page.mouse.up()
    settle(page)


def test_zoom_in_one_plot_is_zoom_in_all(page: Page) -> None:
    second = page.locator(".u-over").nth(1)
    second.scroll_into_view_if_needed()
    whole = windows(page)
    assert whole == {(0.0, END)}
    drag(page, second, 0.4, 0.7)
    ((low, high),) = windows(page)
    assert (low, high) == pytest.approx((0.4 * END, 0.7 * END), abs=0.02)
    page.locator("#unzoom").click()
    assert windows(page) == whole
    drag(page, second, 0.4, 0.7)
    second.dblclick()
    assert windows(page) == whole
    assert page.locator("#unzoom").is_hidden()


def test_click_on_a_plot_sets_the_time(page: Page) -> None:
    chart = page.locator(".u-over").nth(1)
    place = box(chart)
    chart.click(position={"x": 0.5 * place["width"], "y": 60.0})
    assert time_of(page) == pytest.approx(0.5 * END, abs=0.02)
    assert windows(page) == {(0.0, END)}


def test_legends_tell_the_values_at_the_cursor(page: Page, log: FlightLog) -> None:
    pairs = scored_pairs(log.scenario.config.team)
    errors = formation_errors(log, pairs)
    step = 77
    page.evaluate(f"relform.playback.seek({step * PERIOD})")
    expected = [f"{error:.3f}" for error in errors[step]]
    values = page.locator(".plot").first.locator(".u-series:not(:first-child) .u-value")
    assert values.all_inner_texts() == expected
    worst = " → ".join(pairs[int(errors[step].argmax())])
    assert page.locator("#worst").inner_text() == f"{worst} {errors[step].max():.3f} m"
    chart = page.locator(".u-over").first  # what the mouse points at goes before
    chart.hover(position={"x": 0.301 * box(chart)["width"], "y": 60.0})
    settle(page)
    assert values.all_inner_texts() == [f"{error:.3f}" for error in errors[30]]
    page.mouse.move(5.0, 5.0)
    settle(page)
    assert values.all_inner_texts() == expected


def test_lines_can_be_hidden(page: Page) -> None:
    name = "Leader position error"
    label = plot(page, name).get_by_role("button", name="position")
    shown = (
        "relform.plots.plots.find(({panel}) => panel.title === 'Leader position error').chart.series[1].show"
    )
    label.click()
    assert page.evaluate(shown) is False
    label.focus()
    page.keyboard.press("Enter")
    assert page.evaluate(shown) is True


def test_lines_are_drawn_to_scale(page: Page, log: FlightLog) -> None:
    """The logarithmic plot of the KKT value: its line is where its axes say."""
    plot(page, "Solver: KKT value")

    def darkest(step: int, value: float) -> int:
        """The line is nearly black, its rim blends into the ground."""
        return min(map(sum, drawn_near(page, "Solver: KKT value", step * PERIOD, value)))

    for step in (3, 40, 90):
        value = log.solver["kkt"][step]
        assert darkest(step, value) < 80
        assert darkest(step, 1.5 * value) > 150


def test_bands_are_drawn_to_scale(page: Page) -> None:
    """Two standard deviations of 10, 20 and 30 mm: the widest band ends at 60 mm."""
    name = "Estimate − truth: leader → follower_1, 2σ"
    found = plot(page, name)
    background_colour = drawn_near(page, name, 2.0, 62.5)
    for inside in (58.5, -58.5):
        assert drawn_near(page, name, 2.0, inside) - background_colour
    found.get_by_role("button", name="z").click()
    settle(page)
    low, high = page.evaluate(
        "name => { const {y} = relform.plots.plots.find(({panel}) => panel.title === name).chart.scales;"
        " return [y.min, y.max]; }",
        name,
    )
    assert (low, high) == pytest.approx((-1.06 * 40.0, 1.06 * 40.0), rel=1e-3)


def test_what_happened_is_marked_and_a_click_moves_the_time(page: Page) -> None:
    marked = drawn_near(page, "Formation error", 2.25, 0.01)
    assert marked != drawn_near(page, "Formation error", 2.35, 0.01)
    page.get_by_text("set weights.formation_per_m2 = 12").click()
    assert time_of(page) == 2.25


def test_a_plot_takes_lines_with_instants_of_their_own(page: Page) -> None:
    """As of several flights that are compared."""
    page.evaluate("""() => relform.plots.add(document.getElementById("plots"), {
        title: "two flights", unit: "m", digits: 2, sets: [
            { x: [0, 1, 2], lines: [{ name: "first", colour: "vehicle-1", values: [1, 2, 3] }] },
            { x: [0.5, 1.5], lines: [{ name: "second", colour: "vehicle-2", dash: [4, 2], values: [4, 5] }] },
        ],
    })""")
    page.evaluate("relform.playback.seek(1.7)")
    values = plot(page, "two flights").locator(".u-series:not(:first-child) .u-value")
    assert values.all_inner_texts() == ["2.00", "5.00"]


def test_rare_values_leave_the_plot_and_are_marked(page: Page) -> None:
    """The formation error of this flight grows; what is far above the steady values is shown on request."""
    page.evaluate("""() => {
        const plot = relform.plots.plots[0];
        for (const {values} of plot.lines) values[30] = 5.0;
        plot.rescale();
    }""")
    settle(page)
    top = "relform.plots.plots[0].chart.scales.y.max"
    assert page.evaluate(top) < 2.5
    button = page.locator(".plot").first.get_by_role("button", name="▲ up to 5.000 m: show all")
    button.click()
    settle(page)
    assert page.evaluate(top) > 5.0


def test_views_can_be_exchanged_and_turned(page: Page) -> None:
    far = seats(page)
    page.keyboard.press("f")
    settle(page)
    assert page.locator("#follow").get_attribute("aria-pressed") == "true"
    near = seats(page)
    assert np.ptp(near, axis=0).max() > 2.0 * np.ptp(far, axis=0).max()
    scene = box(page.locator("#scene"))
    page.mouse.move(scene["x"] + 300.0, scene["y"] + 300.0)
    page.mouse.down()
    page.mouse.move(scene["x"] + 400.0, scene["y"] + 320.0, steps=4)
    page.mouse.up()
    settle(page)
    assert np.abs(seats(page) - near).max() > 20.0
    page.keyboard.press("r")
    settle(page)
    np.testing.assert_allclose(seats(page), near, atol=0.01)


def test_follow_keeps_the_team_in_the_middle(page: Page) -> None:
    page.keyboard.press("f")
    middles = []
    for time in (0.5, 2.5, 4.5):
        page.evaluate(f"relform.playback.seek({time})")
        settle(page)
        middles.append(seats(page).mean(axis=0))
    scene = box(page.locator("#scene"))
    np.testing.assert_allclose(middles, [[scene["width"] / 2, scene["height"] / 2]] * 3, atol=25.0)


@pytest.mark.parametrize("tab", ["light", "dark"], indirect=True)
def test_dark_and_light_as_preferred_and_by_hand(page: Page) -> None:
    preferred = page.evaluate("matchMedia('(prefers-color-scheme: dark)').matches")
    assert (background(page) < 200) is preferred
    ink = page.evaluate("relform.scene.drawing.colours.ink")
    page.locator("#theme").click()
    assert (background(page) < 200) is not preferred
    assert page.evaluate("relform.scene.drawing.colours.ink") != ink
    page.keyboard.press("t")
    assert (background(page) < 200) is preferred


def test_playback_is_smooth(page: Page) -> None:
    """A frame of the scene and all cursors takes a small part of the 16 ms that a screen gives it."""
    median = page.evaluate(
        """() => {
            const times = Array.from({length: 40}, (_, index) => {
                const begin = performance.now();
                relform.playback.seek(index * 0.1);
                relform.scene.draw();
                return performance.now() - begin;
            });
            return times.sort((a, b) => a - b)[20];
        }"""
    )
    assert median < 16.0


@pytest.mark.parametrize("width", [2560, 1024, 360])
def test_every_width_has_its_layout(page: Page, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 768})
    settle(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert box(page.locator("#scene"))["width"] > 0.4 * min(width, 1600)


def test_one_step_is_a_flight_too(tab: Tab, tmp_path: Path) -> None:
    log = perfect_builder(paper_scenario(), ["A"]).build()
    write_flight_report(tmp_path / "report.html", log, summary_of(log))
    tab.open(tmp_path / "report.html")
    assert tab.page.get_by_role("alert").inner_text().startswith("Interrupted at 0.05 s of 27 s, in phase A.")
    tab.page.keyboard.press("End")
    assert time_of(tab.page) == PERIOD
