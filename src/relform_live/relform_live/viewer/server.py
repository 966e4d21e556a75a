"""The web server of the view: it listens on this machine only."""

import io
import math
import socket
from collections.abc import Iterator
from contextlib import AbstractContextManager, closing, contextmanager, redirect_stdout

import viser

from relform_core.errors import ConfigError

HOST = "127.0.0.1"
CAMERA = (-3.2, -3.6, 2.4)
"""Where the camera is at first [m]; it looks at the origin, where the team is."""
FIELD_OF_VIEW_DEG = 50.0


@contextmanager
def serving(port: int) -> Iterator[viser.ViserServer]:
    """The server, while the block runs.

    Raises:
        ConfigError: the port is in use.
    """
    _check_free(port)
    with _silence():
        server = viser.ViserServer(host=HOST, port=port, label="relform", verbose=False)
    try:
        if server.get_port() != port:  # viser takes the next one if another program was faster
            raise ConfigError(_in_use(port))
        server.gui.configure_theme(
            dark_mode=True, show_logo=False, show_share_button=False, control_width="large"
        )
        server.initial_camera.position = CAMERA
        server.initial_camera.look_at = (0.0, 0.0, 0.0)
        server.initial_camera.fov = math.radians(FIELD_OF_VIEW_DEG)
        yield server
    finally:
        with _silence():
            server.stop()


def url(server: viser.ViserServer) -> str:
    """What to open in a browser."""
    return f"http://localhost:{server.get_port()}"


def _silence() -> AbstractContextManager[object]:
    """Within the block nothing is printed: viser always prints a box at its start, and a line at its end."""
    return redirect_stdout(io.StringIO())


def _check_free(port: int) -> None:
    with closing(socket.socket(socket.AF_INET, socket.SOCK_STREAM)) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server: ports of ended ones
        try:
            probe.bind((HOST, port))
        except OSError:
            raise ConfigError(_in_use(port)) from None


def _in_use(port: int) -> str:
    return f"port {port} is in use; choose another one with --port"
