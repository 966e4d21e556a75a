"""The recorder as a process of its own: it keeps all messages, whatever ends it."""

import contextlib
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from relform_bags.reader import BagMessage, bag_files, read_bag
from relform_bags.recover import recover_bag
from support.full_disk import complete_before_ns, tiny_disk
from support.processes import wait_until

WORKSPACE = Path(__file__).parents[2]
RECORDER = WORKSPACE / "install/relform_bags/lib/relform_bags/recorder"
RECORD = WORKSPACE / "scripts/record.py"

PUBLISHER = """
import os, sys, time
import rclpy
from rclpy.duration import Duration
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from std_msgs.msg import Header

number, rate, padding = int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
rclpy.init()
node = rclpy.create_node("publisher")
late = QoSProfile(depth=5, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
latched = node.create_publisher(Header, "/latched", late)
latched.publish(Header(frame_id="before"))
publishers = [node.create_publisher(Header, f"/counted_{i}", QoSProfile(depth=1000)) for i in range(4)]
best_effort = QoSProfile(depth=1000, reliability=QoSReliabilityPolicy.BEST_EFFORT)
hasty = node.create_publisher(Header, "/hasty", best_effort)
print("ready", flush=True)
while any(each.get_subscription_count() == 0 for each in (*publishers, hasty, latched)):
    time.sleep(0.005)
begin = time.monotonic()
for index in range(number):
    time.sleep(max(0.0, begin + index / rate - time.monotonic()))
    for each in (*publishers, hasty):
        each.publish(Header(frame_id=f"{index} " + os.urandom(padding).hex()))
    if index % 20 == 0:
        print(index, flush=True)
for each in (*publishers, latched):
    each.wait_for_all_acked(Duration(seconds=10))
print("done", flush=True)
sys.stdin.readline()
"""


@contextlib.contextmanager
def process(*command: str | Path, **options: Any) -> Iterator[subprocess.Popen[str]]:
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.PIPE, **options}
    with subprocess.Popen([str(part) for part in command], text=True, **options) as running:
        try:
            yield running
        finally:
            running.kill()


def publisher(number: int, rate: float, padding: int = 0) -> Any:
    return process(sys.executable, "-c", PUBLISHER, str(number), str(rate), str(padding))


def recorder(output: Path, limit: Callable[[], None] | None = None) -> Any:
    arguments = ["--ros-args", "--log-level", "warn", "-p", f"output:={output}"]
    return process(RECORDER, *arguments, preexec_fn=limit)


def wait_for_line(running: subprocess.Popen[str], expected: str) -> None:
    assert running.stdout is not None
    for line in running.stdout:
        if line.strip() == expected:
            return
    raise AssertionError(f"the process ended without printing '{expected}'")


def messages(file: Path) -> list[BagMessage]:
    return [entry for entry in read_bag(file) if isinstance(entry, BagMessage)] if file.exists() else []


def header_numbers(folder: Path, topic: str) -> list[str]:
    """The first word of each message, as rosbags reads it."""
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(folder) as reader:
        connections = [connection for connection in reader.connections if connection.topic == topic]
        messages = reader.messages(connections=connections)
        decoded = [store.deserialize_cdr(data, connection.msgtype) for connection, _, data in messages]
    return [message.frame_id.split()[0] for message in decoded]


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_every_message_until_a_signal(tmp_path: Path, ending: signal.Signals) -> None:
    number = 500
    with publisher(number, rate=500.0) as source, recorder(tmp_path / "bag") as sink:
        wait_for_line(source, "done")
        sink.send_signal(ending)
        output, errors = sink.communicate(timeout=20.0)
    assert (sink.returncode, errors) == (0, "")
    assert str(tmp_path / "bag") in output
    for index in range(4):
        assert header_numbers(tmp_path / "bag", f"/counted_{index}") == [str(n) for n in range(number)]
    assert header_numbers(tmp_path / "bag", "/latched") == ["before"]
    assert header_numbers(tmp_path / "bag", "/hasty")[0] == "0"
    assert recover_bag(tmp_path / "bag") is False


def test_killed_recorder_loses_less_than_a_second(tmp_path: Path) -> None:
    rate = 200.0
    with publisher(2000, rate) as source, recorder(tmp_path / "bag") as sink:
        wait_for_line(source, "600")
        sink.kill()
        sink.wait()
    found = messages(tmp_path / "bag/bag_0.mcap")
    completed = subprocess.run(
        [sys.executable, RECORD, "--recover", tmp_path / "bag"], capture_output=True, text=True, check=True
    )
    assert completed.stdout == f"{tmp_path / 'bag'}: completed\n"
    numbers = header_numbers(tmp_path / "bag", "/counted_2")
    assert len(numbers) == sum(entry.topic == "/counted_2" for entry in found)
    assert numbers == [str(n) for n in range(len(numbers))]
    assert len(numbers) > 600 - rate


def test_killed_recorder_of_a_split_bag(tmp_path: Path) -> None:
    rate, folder = 200.0, tmp_path / "bag"
    command = [sys.executable, RECORD, "--out", folder, "--wall-time", "--max-bag-duration", "1"]
    with publisher(2000, rate) as source, process(*command) as sink:
        wait_for_line(source, "600")
        sink.kill()
        sink.wait()
    assert len(bag_files(folder)) >= 3
    found = [entry for entry in read_bag(folder) if isinstance(entry, BagMessage)]
    with pytest.raises(Exception, match="metadata"):
        Reader(folder).open()  # other readers need the metadata.yaml of a closed bag
    completed = subprocess.run(
        [sys.executable, RECORD, "--recover", folder], capture_output=True, text=True, check=True
    )
    assert completed.stdout == f"{folder}: completed\n"
    for index in range(4):
        numbers = header_numbers(folder, f"/counted_{index}")
        assert len(numbers) == sum(entry.topic == f"/counted_{index}" for entry in found)
        assert numbers == [str(n) for n in range(len(numbers))]
        assert len(numbers) > 600 - rate, "at most one second is lost"
    assert header_numbers(folder, "/latched") == ["before"]


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--max-bag-size", "0"], "error: --max-bag-size must not be 0"),
        (["--max-bag-size", "1000"], "error: max bag size must be at least 1024 bytes"),
        (["--max-bag-duration", "0"], "error: --max-bag-duration must not be 0"),
        (["--max-bag-duration", "-2"], "error: max bag duration must be at least 1 s"),
        (["--out", "."], "/recorder: .: exists already; choose another folder"),
        (
            ["--out", "/proc/bag"],
            "/recorder: /proc/bag: cannot be created: No such file or directory",
        ),
        (["--recover", "nowhere"], "error: nowhere: no such file or folder"),
        (["--recover", "."], "error: .: not a bag: the folder has no .mcap file"),
    ],
)
def test_bad_input_is_one_line(tmp_path: Path, arguments: list[str], problem: str) -> None:
    run = subprocess.run([sys.executable, RECORD, *arguments], cwd=tmp_path, capture_output=True, text=True)
    (line,) = run.stderr.splitlines()
    assert line.startswith(problem)
    assert run.returncode == (2 if problem.startswith("error: ") else 1)  # a node that fails exits with 1
    assert list(tmp_path.iterdir()) == []


def test_topic_without_publisher(tmp_path: Path) -> None:
    with process(sys.executable, RECORD, "--out", tmp_path / "bag", "--topics", "/nothing") as sink:
        wait_until((tmp_path / "bag/bag_0.mcap").exists)
        time.sleep(0.5)
        sink.send_signal(signal.SIGINT)
        _, errors = sink.communicate(timeout=10.0)
    assert sink.returncode == 0
    assert errors.splitlines()[-1] == "/nothing was not published: the bag has no message of it"


def test_limit_of_the_file_size_ends_it_with_one_line(tmp_path: Path) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (700_000, 700_000))

    with publisher(4000, rate=1000.0, padding=1000), recorder(tmp_path / "bag", limit) as sink:
        _, errors = sink.communicate(timeout=30.0)
    assert sink.returncode == 1
    assert errors.startswith(
        f"/recorder: {tmp_path / 'bag/bag_0.mcap'} cannot be written any more: File too large"
    )
    assert errors.count("\n") == 1
    recover_bag(tmp_path / "bag")
    assert recover_bag(tmp_path / "bag") is False
    found = messages(tmp_path / "bag/bag_0.mcap")
    assert max(entry.log_time_ns for entry in found) < complete_before_ns(errors), "these chunks are in order"
    numbers = header_numbers(tmp_path / "bag", "/counted_0")
    assert numbers == [str(n) for n in range(len(numbers))]
    assert numbers


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    with tiny_disk(tmp_path / "disk") as folder:
        yield folder


def test_full_disk_leaves_a_complete_bag(small_disk: Path) -> None:
    with publisher(4000, rate=1000.0, padding=1000), recorder(small_disk / "bag") as sink:
        _, errors = sink.communicate(timeout=30.0)
    assert sink.returncode == 1
    assert "cannot be written any more: No space left on device; the bag holds every message before" in errors
    assert errors.count("\n") == 1
    assert recover_bag(small_disk / "bag") is False
    found = messages(small_disk / "bag/bag_0.mcap")
    assert max(entry.log_time_ns for entry in found) == complete_before_ns(errors), (
        "nothing that was received is lost"
    )
    numbers = header_numbers(small_disk / "bag", "/counted_3")
    assert numbers == [str(n) for n in range(len(numbers))]
    assert numbers


def test_output_that_cannot_be_created(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with recorder(tmp_path / "file/bag") as sink:
        _, errors = sink.communicate(timeout=20.0)
    assert sink.returncode == 1
    assert errors == f"/recorder: {tmp_path / 'file/bag'}: cannot be created: Not a directory\n"


def test_chosen_topics_and_wall_time(tmp_path: Path) -> None:
    begin_ns = time.time_ns()
    command = [
        sys.executable,
        RECORD,
        "--out",
        tmp_path / "bag",
        "--wall-time",
        "--topics",
        "/counted_1",
        "/latched",
    ]
    with publisher(50, rate=100.0) as source, process(*command) as sink:
        wait_for_line(source, "ready")
        # The publisher waits for subscribers of its other topics, so that only the latched message arrives.
        deadline = time.monotonic() + 20.0
        while not messages(tmp_path / "bag/bag_0.mcap") and time.monotonic() < deadline:
            time.sleep(0.05)
        sink.send_signal(signal.SIGINT)
        output, errors = sink.communicate(timeout=10.0)
    assert (sink.returncode, errors) == (0, "")
    assert output.splitlines()[-1] == f"{tmp_path / 'bag'}: 1 messages on 2 topics"
    with Reader(tmp_path / "bag") as reader:
        assert {connection.topic for connection in reader.connections} == {"/counted_1", "/latched"}
        assert begin_ns < reader.start_time < time.time_ns()
