"""ros2 bag of this environment, on the command line."""

import contextlib
import os
import pty
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from rosbags.rosbag2 import CompressionMode

from relform_bags.reader import BagMessage, bag_files, read_bag
from support.bags import header, write_compressed_bag
from support.processes import wait_until

WORKSPACE = Path(__file__).parents[2]
ROS2 = [sys.executable, "-P", "-m", "relform_cli"]
SHORT_FLIGHT = WORKSPACE / "tests/data/short_flight"
STEPS = 40


def run(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [*ROS2, "bag", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, stdin=subprocess.DEVNULL)


@contextlib.contextmanager
def started(*arguments: str | Path, stdin: int = subprocess.DEVNULL) -> Iterator[subprocess.Popen[str]]:
    command = [*ROS2, "bag", *map(str, arguments)]
    with subprocess.Popen(command, text=True, stdin=stdin, stderr=subprocess.PIPE) as process:
        try:
            yield process
        finally:
            process.kill()


def wait_for_text(process: subprocess.Popen[str], text: str) -> None:
    """Wait until a process prints a text."""
    assert process.stderr is not None
    assert any(text in line for line in process.stderr)


def counts(bag: Path) -> dict[str, int]:
    found: dict[str, int] = {}
    for entry in read_bag(bag):
        if isinstance(entry, BagMessage):
            found[entry.topic] = found.get(entry.topic, 0) + 1
    return found


def test_info() -> None:
    result = run("info", SHORT_FLIGHT)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("\nFiles:             bag_0.mcap\nBag size: ")
    assert run("info", "-v", SHORT_FLIGHT).stdout == result.stdout
    names = run("info", "--topic-name", SHORT_FLIGHT).stdout.splitlines()
    assert "/formation/state" in names
    assert len(names) == 29


def test_played_messages_are_recorded(tmp_path: Path) -> None:
    """A bag is played and recorded again: every message, in its order, under its new name."""
    bag, chosen = tmp_path / "again", ["/follower_1/imu", "/elsewhere", "/formation/solver"]
    recording = ["record", "-o", bag, "-s", "mcap", "--max-bag-duration", "1", "--use-sim-time"]
    playing = ["-r", "2.0", "--remap", "/leader/imu:=/elsewhere", "-x", ".*(sonar|flow)"]
    with started(*recording, "--topics", "/clock", *chosen) as recorder:
        wait_for_text(recorder, "[rosbag2_recorder]: Recording...")
        # The recorder discovers the paused player; then the player publishes only the chosen topics.
        terminal, keyboard = pty.openpty()
        with started("play", SHORT_FLIGHT, "-p", *playing, stdin=keyboard) as player:
            for _ in range(4):
                wait_for_text(recorder, "Subscribed to topic")
            wait_for_text(player, "Press CURSOR_DOWN")
            os.write(terminal, b" ")
            wait_for_text(player, "[rosbag2_player]: Resuming play.")
            assert player.wait(timeout=20.0) == 0
        recorder.send_signal(signal.SIGINT)
        wait_for_text(recorder, "[rosbag2_recorder]: Recording stopped")
        assert recorder.wait(timeout=10.0) == 0
    assert counts(bag) == {
        "/clock": STEPS + 1,
        "/follower_1/imu": STEPS + 1,
        "/elsewhere": STEPS + 1,
        "/formation/solver": STEPS,
    }
    original = [entry for entry in read_bag(SHORT_FLIGHT) if isinstance(entry, BagMessage)]
    again = [entry for entry in read_bag(bag) if isinstance(entry, BagMessage)]
    for name, played in {"/leader/imu": "/elsewhere", "/formation/solver": "/formation/solver"}.items():
        sent = [entry.data for entry in original if entry.topic == name]
        assert [entry.data for entry in again if entry.topic == played] == sent
    assert len(bag_files(bag)) == 2
    assert "bag was not closed" not in run("info", bag).stderr


def test_recording_pauses(tmp_path: Path) -> None:
    terminal, keyboard = pty.openpty()
    bag = tmp_path / "bag"
    recording = [
        "record",
        "-a",
        "-e",
        "ignored",
        "--exclude-regex",
        "rosout|parameter",
        "--start-paused",
        "-o",
        bag,
    ]
    with started(*recording, stdin=keyboard) as recorder:
        wait_for_text(recorder, "Press SPACE for pausing/resuming")
        wait_for_text(recorder, "Wait for recording: Press SPACE to start.")
        playing = ["play", SHORT_FLIGHT, "--topics", "/leader/imu", "--playback-duration", "1.0", "-d", "0.5"]
        with started(*playing) as player:
            wait_for_text(recorder, "Subscribed to topic '/leader/imu'")
            assert player.wait(timeout=20.0) == 0
        os.write(terminal, b" ")
        wait_for_text(recorder, "Resuming recording.")
        with started(*playing) as player:
            assert player.wait(timeout=20.0) == 0
        wait_until(lambda: bool(counts(bag)))
        recorder.send_signal(signal.SIGINT)
        assert recorder.wait(timeout=10.0) == 0
    assert counts(bag) == {"/leader/imu": 21}


def test_ctrl_c_ends_playing_with_success() -> None:
    with started("play", SHORT_FLIGHT, "--loop", "--topics", "/clock") as player:
        wait_for_text(player, "Set rate to 1")
        player.send_signal(signal.SIGINT)
        assert player.wait(timeout=10.0) == 0


@pytest.mark.parametrize(
    ("arguments", "code", "problem"),
    [
        (["info", "nowhere"], 2, "ros2 bag info: argument bag_path: Bag path 'nowhere' does not exist!"),
        (["info", "."], 1, "[ERROR] [ros2bag]: .: not a bag: the folder has no .mcap file"),
        (["info", "file"], 1, "[ERROR] [ros2bag]: file: not an MCAP file"),
        (["info"], 2, "ros2 bag info: the following arguments are required: bag_path"),
        (
            ["info", ".", "-s", "sqlite3"],
            2,
            "ros2 bag info: argument -s/--storage: invalid choice",
        ),
        (["play", "file"], 1, "/rosbag2_player: file: not an MCAP file"),
        (["play", "."], 1, "/rosbag2_player: .: not a bag: the folder has no .mcap file"),
        (["play", ".", "-r", "0"], 2, "ros2 bag play: argument -r/--rate: 0 must be above 0"),
        (
            ["play", ".", "--start-offset", "-1"],
            2,
            "ros2 bag play: argument --start-offset: Value -1",
        ),
        (
            ["play", SHORT_FLIGHT, "--topics", "/no"],
            1,
            f"/rosbag2_player: {SHORT_FLIGHT}/bag_0.mcap: no",
        ),
        (
            ["play", SHORT_FLIGHT, "--remap", "/a=/b"],
            1,
            "[ERROR] [ros2bag]: remap rule '/a=/b' is not",
        ),
        (["record"], 1, "[ERROR] [ros2bag]: Need to specify at least one option"),
        (
            ["record", "/a", "--exclude-topics", "/b"],
            1,
            "[ERROR] [ros2bag]: --exclude-topics argument requires",
        ),
        (["record", "-a", "-o", "."], 1, "[ERROR] [ros2bag]: Output folder '.' already exists."),
        (["record", "-a", "-o", "file/bag"], 1, "/rosbag2_recorder: file/bag: cannot be created"),
        (["record", "-a", "-b", "1023"], 1, "[ERROR] [ros2bag]: max bag size must be at least 1024 bytes"),
        (["record", "-e", "("], 1, "/rosbag2_recorder: '(' is not a valid regular expression"),
        (["record", "-a", "-s", "sqlite3"], 2, "ros2 bag record: argument -s/--storage: invalid choice"),
        (["burst"], 2, "ros2 bag: argument verb: invalid choice: 'burst'"),
    ],
)
def test_bad_input_is_one_line(tmp_path: Path, arguments: list[str | Path], code: int, problem: str) -> None:
    (tmp_path / "file").write_text("no bag")
    result = run(*arguments, cwd=tmp_path)
    (line,) = result.stderr.splitlines()
    assert line.startswith(problem)
    assert result.returncode == code
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("mode", [CompressionMode.MESSAGE, CompressionMode.FILE])
@pytest.mark.parametrize(
    "command",
    [
        [*ROS2, "bag", "info"],
        [*ROS2, "bag", "play"],
        [sys.executable, WORKSPACE / "scripts/report.py"],
        [sys.executable, WORKSPACE / "scripts/replay.py"],
        [sys.executable, WORKSPACE / "scripts/record.py", "--recover"],
    ],
    ids=lambda command: str(command[-1]).rpartition("/")[2],
)
def test_bag_that_rosbag2_has_compressed_is_refused_by_one_line(
    tmp_path: Path, mode: CompressionMode, command: list[str | Path]
) -> None:
    bag = write_compressed_bag(tmp_path / "bag", mode, [(number, header(number)) for number in range(5)])
    result = subprocess.run([*command, bag], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    (line,) = result.stderr.splitlines()
    assert f"(rosbag2 compression mode {mode.name.lower()}) cannot be read; " in line
    assert result.returncode in (1, 2)


def test_truncated_bag_is_reported_and_played(tmp_path: Path) -> None:
    content = (SHORT_FLIGHT / "bag_0.mcap").read_bytes()
    file = tmp_path / "bag_0.mcap"
    file.write_bytes(content[: len(content) * 2 // 3])
    result = run("info", tmp_path)
    assert result.returncode == 0
    assert result.stderr == (
        f"{tmp_path} was not closed: complete it with scripts/record.py --recover {tmp_path}\n"
    )
    assert run("play", tmp_path, "--topics", "/clock", "-r", "100").returncode == 0
