"""The node ``live``: it shows the flight that runs in its ROS domain, as an observer outside the barrier."""

import time
from collections.abc import Callable
from pathlib import Path

import rclpy
import viser
from rclpy.node import Node

from relform_core.errors import ConfigError
from relform_core.exit_codes import NodeExit
from relform_core.load import LoadedScenario, load_scenario
from relform_live.nodes.attachment import Reading, ScenarioQuestion, load_answer
from relform_live.nodes.intake import channels
from relform_live.nodes.services import Services
from relform_live.requests import Offer
from relform_live.scene.flight_data import FlightData
from relform_live.scene.shown_time import ShownTime
from relform_live.viewer.controls import Controls
from relform_live.viewer.flight_page import FlightPage
from relform_live.viewer.panel import Panel
from relform_live.viewer.rate import FRAME_S
from relform_ros.run_node import run_node
from relform_ros.spinner import Spinner, until

LOOK_S = 0.5
"""How often the view looks whether a flight has started."""
NODE = "live"


class ShownFlight:
    """One flight in the view."""

    def __init__(
        self,
        node: Node,
        server: viser.ViserServer,
        panel: Panel,
        scenario: LoadedScenario,
        services: Services,
    ) -> None:
        self._data = FlightData(scenario.config)
        self._time = ShownTime()
        self._reading = Reading(node, scenario, channels(self._data))
        self._page = FlightPage(server, panel, self._data)
        self.controls = Controls(server, scenario.config, services.submit)
        services.team = scenario.config.team

    def frame(self) -> None:
        """Take in what has arrived, and draw."""
        self._reading.take_in()
        now = time.monotonic()
        if (newest_ns := self._data.newest_ns) is not None:
            self._time.arrived(newest_ns, now)
        if (stamp_ns := self._time.at(now)) is not None:
            self._page.draw(stamp_ns, self._time.rate(now))

    def close(self) -> None:
        """Take the flight out of the view."""
        self._reading.close()
        self._page.remove()
        self.controls.remove()


class Live:
    """Shows one flight after the other."""

    def __init__(
        self,
        node: Node,
        server: viser.ViserServer,
        config: Path | str | None,
        has_failed: Callable[[], bool],
    ) -> None:
        """Wait for flights.

        Args:
            config: path or plain name of the scenario of all flights; None: the controller says it.
            has_failed: whether there will be no flight; the view ends then.
        """
        self._has_failed = has_failed
        self._node = node
        self._server = server
        self._given = None if config is None else load_scenario(config)
        self._panel = Panel(server)
        self._question = ScenarioQuestion(node)
        self._services = Services(node)
        self._flight: ShownFlight | None = None
        self._running = False
        """Whether a controller was running at the last look."""
        self._next_look = self._next_frame = 0.0

    async def run(self) -> None:
        """Show flights until a signal arrives."""
        while not self._has_failed():
            await until(self._is_frame_due, poll_s=0.01)
            self._next_frame = max(self._next_frame + FRAME_S, time.monotonic())
            self._look()
            self._services.work()
            if self._flight is not None:
                self._flight.frame()

    def _is_frame_due(self) -> bool:
        return time.monotonic() >= self._next_frame

    def _look(self) -> None:
        """Notice the start of a flight."""
        now = time.monotonic()
        if now < self._next_look:
            return
        self._next_look = now + LOOK_S
        is_running = self._question.is_answerable
        if self._flight is not None:
            self._flight.controls.offer(self._services.offer() if is_running else Offer())
        if not is_running:
            self._running = False
        elif not self._running and (path := self._question.answer(now)) is not None:
            self._running = True
            self._attach(path)

    def _attach(self, path: str) -> None:
        try:
            scenario = self._given or load_answer(path)
        except ConfigError as error:
            self._panel.wait(str(error))
            return
        if self._flight is not None:
            self._flight.close()
        self._flight = ShownFlight(self._node, self._server, self._panel, scenario, self._services)


def run_live(
    server: viser.ViserServer, config: Path | str | None, has_failed: Callable[[], bool] = lambda: False
) -> int:
    """Show flights until a signal arrives; returns the exit code. Arguments: see ``Live``."""

    def build(node: Node, spinner: Spinner) -> Live:
        return Live(node, server, config, has_failed)

    code = run_node(lambda: rclpy.create_node(NODE, enable_rosout=False), build, arguments=[])
    return 0 if code == NodeExit.INTERRUPTED else code  # nothing else ends a view
