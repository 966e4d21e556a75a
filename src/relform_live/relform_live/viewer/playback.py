"""Slider and buttons for the time of a recorded flight."""

import viser

from relform_bags.timeline import Timeline
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_live.viewer.layout import Place

RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
SLIDER_EVERY = 4
"""Frames between two moves of the slider."""


class Playback:
    """Says which instant is shown; at the end it begins again when the user plays on."""

    def __init__(self, server: viser.ViserServer, start_ns: int, end_ns: int, now: float) -> None:
        """Play from the start.

        Args:
            start_ns, end_ns: first and last instant of the flight.
            now: a steady time [s], as in ``at``.
        """
        self._start_ns, self._end_ns = start_ns, end_ns
        self._timeline = Timeline(start_ns, 1.0, now, paused=False)
        self._frame = 0
        self._wanted: float | None = None
        """Where the user moved the slider [s]; None: nowhere since the last frame."""
        self._toggled = False
        with server.gui.add_folder("Playback", order=Place.PLAYBACK):
            self._slider = server.gui.add_slider(
                "time (s)",
                min=start_ns / NANOSECONDS_PER_SECOND,
                max=end_ns / NANOSECONDS_PER_SECOND,
                step=0.01,
                initial_value=start_ns / NANOSECONDS_PER_SECOND,
            )
            self._speed = server.gui.add_dropdown("speed", [f"{rate:g}" for rate in RATES], initial_value="1")
            self._button = server.gui.add_button("pause")
        self._slider.on_update(self._note_move)
        self._button.on_click(lambda _: self.toggle())

    def at(self, now: float) -> int:
        """The instant to show [ns]."""
        timeline = self._timeline
        if (rate := float(self._speed.value)) != timeline.rate:
            timeline.set_rate(rate, now)
        if self._wanted is not None:
            timeline.jump(round(self._wanted * NANOSECONDS_PER_SECOND), now)
            self._wanted = None
        if self._toggled:
            self._toggled = False
            if timeline.paused and timeline.bag_time_ns(now) >= self._end_ns:
                timeline.jump(self._start_ns, now)
            timeline.toggle_pause(now)
        if not timeline.paused and timeline.bag_time_ns(now) >= self._end_ns:
            timeline.jump(self._end_ns, now)
            timeline.toggle_pause(now)
        self._button.label = "play" if timeline.paused else "pause"
        shown_ns = timeline.bag_time_ns(now)
        if self._frame % SLIDER_EVERY == 0:
            self._slider.value = shown_ns / NANOSECONDS_PER_SECOND  # type: ignore[misc]  # as in controls
        self._frame += 1
        return shown_ns

    def toggle(self) -> None:
        """Pause or play on, at the next frame."""
        self._toggled = True

    def jump(self, time_s: float) -> None:
        """Continue at another time [s], at the next frame."""
        self._wanted = time_s

    def _note_move(self, event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        if event.client is not None:  # else the view itself moved it
            self.jump(float(self._slider.value))
