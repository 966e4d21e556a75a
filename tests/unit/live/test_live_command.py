"""The command, before it shows anything."""

import socket
from pathlib import Path

import pytest

from relform_core.errors import ConfigError
from relform_live.command import main
from relform_live.viewer.server import HOST, serving, url
from support.ports import free_port


def test_port_in_use_is_one_line_and_nothing_else(capfd: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as other:
        other.bind((HOST, 0))
        other.listen()
        port = other.getsockname()[1]
        assert main(["--port", str(port)]) == 2
    printed = capfd.readouterr()
    assert printed.out == ""
    assert printed.err == f"error: port {port} is in use; choose another one with --port\n"


def test_port_of_the_system_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["--port", "70000"])
    assert capfd.readouterr().err.startswith("error: argument --port: must be from 1024 to 65535")


def test_serves_this_machine_only_and_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    port = free_port()
    with serving(port) as server:
        assert url(server) == f"http://localhost:{port}"
        assert server.get_host() == HOST
        with pytest.raises(ConfigError, match=f"port {port} is in use"), serving(port):
            pass
    printed = capfd.readouterr()
    assert (printed.out, printed.err) == ("", "")


def test_a_bag_and_a_flight_exclude_each_other(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["runs/latest", "--fly", "--scenario", "paper"])
    assert capfd.readouterr().err.startswith("error: a bag and --fly exclude each other")


def test_what_is_no_bag_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["--port", str(free_port()), str(tmp_path)]) == 2
    printed = capfd.readouterr()
    assert printed.out == ""
    assert printed.err == f"error: {tmp_path}: not a bag: the folder has no .mcap file\n"
