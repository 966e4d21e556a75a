"""One flight in the page: its scene and its numbers."""

import viser

from relform_live.scene.flight_data import FlightData
from relform_live.scene.stage import Stage
from relform_live.viewer.panel import Panel
from relform_live.viewer.world import World


class FlightPage:
    """Draws a flight."""

    def __init__(self, server: viser.ViserServer, panel: Panel, data: FlightData) -> None:
        config = data.config
        self.stage = Stage(data)
        self._server = server
        self._panel = panel
        self._data = data
        with server.atomic():
            self._world = World(server, self.stage, config.obstacles, config.vehicle.arm_length)
            self._world.shown = panel.shown

    def draw(self, stamp_ns: int, rate: float | None) -> None:
        """Show an instant.

        Args:
            stamp_ns: the instant.
            rate: simulation time by wall time; None: not known.
        """
        with self._server.atomic():
            self._world.draw(self.stage.picture(stamp_ns))
            self._panel.draw(self._data, self.stage, stamp_ns, rate)

    def remove(self) -> None:
        """Take the flight out of the page."""
        self._world.remove()
