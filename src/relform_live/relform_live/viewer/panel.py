"""The side panel: numbers, a plot, the log, and what to show."""

import viser
from viser import uplot

from relform_live.scene import readout
from relform_live.scene.flight_data import FlightData
from relform_live.scene.history import LENGTH_S, History
from relform_live.scene.stage import Stage
from relform_live.viewer.layout import Place
from relform_live.viewer.world import Shown

EVERY = 4
"""Frames between two updates of the numbers and the plot."""

NO_POINTS = uplot.Series_Points(show=False)
SWITCHES = {
    "truth": "vehicles (simulated)",
    "estimate": "estimates (ghosts)",
    "trails": "trails",
    "links": "links, coloured by error",
    "targets": "references",
    "names": "names",
    "follow": "follow the team",
}


class Panel:
    """The panel of the whole view; flights come and go in it."""

    def __init__(self, server: viser.ViserServer) -> None:
        gui = server.gui
        self.shown = Shown()
        self._frame = 0
        self._numbers = gui.add_html(readout.waiting("waiting for a flight"), order=Place.NUMBERS)
        self._plot = gui.add_uplot(
            data=History(2).columns,
            series=(
                uplot.Series(label="s before now"),
                uplot.Series(label="formation (m)", stroke="#56b4e9", width=1.5, points=NO_POINTS),
                uplot.Series(label="leader (m)", stroke="#e69f00", width=1.5, points=NO_POINTS),
            ),
            scales={"x": uplot.Scale(time=False, range=(-LENGTH_S, 0.0)), "y": uplot.Scale(auto=True)},
            title="true errors over the last seconds",
            height=150,
            order=Place.PLOT,
        )
        with gui.add_folder("Events", order=Place.EVENTS):
            self._log = gui.add_html(readout.log_text(()))
        with gui.add_folder("Show", expand_by_default=False, order=Place.SHOW):
            for key, label in SWITCHES.items():
                self._add_switch(gui, key, label)
            dark = gui.add_checkbox("dark page", True)
            dark.on_update(lambda _: _theme(server, dark.value))

    def _add_switch(self, gui: viser.GuiApi, key: str, label: str) -> None:
        switch = gui.add_checkbox(label, getattr(self.shown, key))
        switch.on_update(lambda _: setattr(self.shown, key, switch.value))

    def wait(self, text: str) -> None:
        """Show a notice in place of the numbers."""
        self._numbers.content = readout.waiting(text)

    def draw(self, data: FlightData, stage: Stage, stamp_ns: int, rate: float | None) -> None:
        """Show the state of the flight."""
        if self._frame % EVERY == 0:
            self._numbers.content = readout.readout(data, stage, stamp_ns, rate)
            self._plot.data = stage.history.columns
            self._log.content = readout.log_text(data.log)
        self._frame += 1


def _theme(server: viser.ViserServer, dark: bool) -> None:
    server.gui.configure_theme(
        dark_mode=dark, show_logo=False, show_share_button=False, control_width="large"
    )
