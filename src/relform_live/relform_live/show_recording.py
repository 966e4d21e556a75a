"""Show a recorded flight until the user ends it."""

import signal
import time
from contextlib import suppress

import viser

from relform_live.recording import Recording
from relform_live.viewer.flight_page import FlightPage
from relform_live.viewer.panel import Panel
from relform_live.viewer.playback import Playback
from relform_live.viewer.rate import FRAME_S


def show_recording(server: viser.ViserServer, recording: Recording) -> None:
    """Show a flight until a signal arrives."""
    for signum in (signal.SIGINT, signal.SIGTERM):
        signal.signal(signum, signal.default_int_handler)
    with suppress(KeyboardInterrupt):
        _show(server, recording)


def _show(server: viser.ViserServer, recording: Recording) -> None:
    panel = Panel(server)
    playback = Playback(server, recording.start_ns, recording.end_ns, time.monotonic())
    page = FlightPage(server, panel, recording.data)
    next_frame = time.monotonic()
    while True:
        stamp_ns = playback.at(time.monotonic())
        recording.advance(page.stage, stamp_ns)
        page.draw(stamp_ns, rate=None)
        next_frame = max(next_frame + FRAME_S, time.monotonic())
        time.sleep(max(0.0, next_frame - time.monotonic()))
