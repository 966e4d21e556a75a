"""The ros2 command on live nodes: the examples of docs/ros2_command.md, bad input, signals."""

import os
import re
import signal
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from relform_core.exit_codes import EXIT_INTERRUPTED
from support.processes import wait_until
from support.ros2_command import Answer, ask, ask_all

WORKSPACE = Path(__file__).parents[2]
PROMPT = "$ "


def shown() -> list[list[tuple[str, str]]]:
    """The commands of each block of docs/ros2_command.md, with the output that it shows."""
    text = (WORKSPACE / "docs/ros2_command.md").read_text()
    blocks = re.findall(r"^```console\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return [
        [(command, output) for command, _, output in (step.partition("\n") for step in steps)]
        for steps in (f"\n{block}".split(f"\n{PROMPT}")[1:] for block in blocks)
    ]


SHOWN = shown()
STEPS = [step for steps in SHOWN for step in steps]

# Command, exit code, and how the only line on stderr begins.
BAD_INPUT = [
    ("nope", 2, "ros2: argument command: invalid choice: 'nope' (choose from 'bag', 'daemon', "),
    (
        "topic nope",
        2,
        "ros2 topic: argument verb: invalid choice: 'nope' (choose from 'list', 'info', ",
    ),
    ("topic info /nope", 1, "Unknown topic '/nope'"),
    ("topic type /nope", 1, ""),
    ("topic hz -w 0 /alpha/pose", 2, "ros2 topic hz: argument -w/--window: 0 must be above 0"),
    ("topic echo --once /nope", 1, "Could not determine the type for the passed topic"),
    ("topic echo --once '/a b'", 1, "topic name '/a b' is invalid: topic name must not contain characters"),
    ("topic echo --once /a//b", 1, "Invalid topic name: topic name must not contain repeated '/': '/a//b'"),
    ("topic echo --once /alpha/pose nope", 1, "The passed message type is invalid: 'nope'; an example is "),
    ("topic echo --field . /alpha/pose", 1, "Invalid field value '.'"),
    ("topic echo --field nope /alpha/pose", 1, "Invalid field 'nope': 'PoseStamped' object has no attribute"),
    ("topic echo --filter 'm.' /alpha/pose", 1, "Invalid filter 'm.': invalid syntax"),
    ("topic echo --filter m.x /alpha/pose", 1, "Invalid filter 'm.x': 'PoseStamped' object has no attribute"),
    (
        "topic echo --qos-reliability nope /a",
        2,
        "ros2 topic echo: argument --qos-reliability: invalid",
    ),
    ("topic delay /alpha/chatter", 1, "msg does not have header"),
    ("topic pub -1 /beta std_msgs/msg/Nope", 1, "The passed message type is invalid: 'std_msgs/msg/Nope'"),
    (
        "topic pub -1 /beta std_msgs/msg/String hi",
        1,
        "The passed value needs to be a dictionary",
    ),
    (
        "topic pub -w 1 --max-wait-time-secs 0.2 /nobody std_msgs/msg/String",
        1,
        "Timed out waiting for subscribers: Expected 1 subscribers but only got 0 subscribers",
    ),
    ("node info /nope", 1, "Unable to find node '/nope'"),
    ("param list /nope", 1, "Node not found"),
    (
        "param list --filter '[' /alpha/talker",
        1,
        "'[' is not a regular expression: unterminated",
    ),
    ("param get /nope gain", 1, "Node not found"),
    ("param get /alpha/talker nope", 1, "Parameter not set"),
    ("param set /alpha/talker count 10", 0, "Setting parameter failed: Parameter count out of range"),
    (
        "param set /alpha/talker count 'a: b: c'",
        1,
        "The passed value is not YAML: mapping values",
    ),
    (
        "param set /alpha/talker count 9999999999999999999",
        1,
        "9999999999999999999 is not an integer of",
    ),
    (
        "param set /alpha/talker steps [9999999999999999999]",
        1,
        "[9999999999999999999] has an integer of ",
    ),
    (
        "param delete /alpha/talker flag",
        0,
        "Deleting parameter failed: Static parameter",
    ),
    ("param load /alpha/talker nope.yaml", 1, "nope.yaml: No such file or directory"),
    (
        "param load --no-use-wildcard /alpha/talker <(echo '/**: {ros__parameters: {gain: 1.0}}')",
        1,
        "Param file does not contain selected parameters",
    ),
    ("service type /nope", 1, ""),
    (
        "service call /alpha/set std_srvs/srv/Nope",
        1,
        "The passed service type is invalid: 'std_srvs/srv/N",
    ),
    (
        "service call /alpha/set std_srvs/srv/SetBool 'data: x'",
        1,
        "Failed to populate field: data: 'x'",
    ),
    ("interface show std_msgs/String", 1, "Invalid name 'std_msgs/String'. Expected three parts"),
    ("interface show std_msgs/msg/Nope", 1, "Could not find the interface '"),
    ("interface package nope", 1, "Unknown package 'nope'"),
    ("pkg prefix nope", 1, "Package not found"),
    ("pkg executables nope", 1, "Package 'nope' not found"),
    (
        "topic list --spin-time nan",
        2,
        "ros2 topic list: argument --spin-time: nan must be finite",
    ),
    ("topic pub -n 'a b' /beta std_msgs/msg/String", 1, "Invalid node name: node name must not contain"),
    ('run --prefix "\'" relform_sim clock', 1, "--prefix ': No closing quotation"),
    ("pkg list >/dev/full", 1, "[Errno 28] No space left on device"),
    ("run nope talker", 1, "Package 'nope' not found"),
    ("run relform_sim nope", 1, "No executable found"),
    ("run --prefix ./nope relform_sim clock", 1, "./nope cannot be run: No such file or directory"),
]


@pytest.fixture(scope="module")
def answers(live_nodes: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Answer]:
    """Answers to the commands that the docs show, and to bad input."""
    listing, *blocks = [[all_output_of(command) for command, _ in steps] for steps in SHOWN]
    others = [[f"ros2 {command}"] for command, _, _ in BAD_INPUT]
    for block in blocks:
        in_turn = any(" param set " in command for command in block)
        others[:0] = [block] if in_turn else [[command] for command in block]
    folder = tmp_path_factory.mktemp("shell")
    # Alone, because the other commands publish and subscribe as well.
    return ask_all([listing], live_nodes, folder) | ask_all(others, live_nodes, folder)


def all_output_of(command: str) -> str:
    return f"{{ {command}; }} 2>&1"


@pytest.mark.parametrize(("command", "expected"), STEPS, ids=[command for command, _ in STEPS])
def test_prints_what_the_docs_show(answers: dict[str, Answer], command: str, expected: str) -> None:
    answer = answers[all_output_of(command)]
    pattern = re.escape(expected.strip()).replace("…", ".*")
    assert re.fullmatch(pattern, answer.stdout.strip()), answer.stdout
    assert answer.code == 0


@pytest.mark.parametrize(("command", "code", "line"), BAD_INPUT, ids=[command for command, *_ in BAD_INPUT])
def test_reports_bad_input_in_one_line(
    answers: dict[str, Answer], command: str, code: int, line: str
) -> None:
    answer = answers[f"ros2 {command}"]
    assert answer.stderr.startswith(line), answer.stderr
    assert answer.stderr.count("\n") == (1 if line else 0)
    assert answer.code == code


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_verbs_without_output(live_nodes: dict[str, str], number: signal.Signals) -> None:
    commands = (
        "topic echo /alpha/chatter",
        "topic hz /alpha/pose",
        "topic pub /beta std_msgs/msg/String",
        "service call -r 9 /alpha/set std_srvs/srv/SetBool",
    )
    running = [
        subprocess.Popen(
            ["ros2", *command.split()],
            env=live_nodes,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for command in commands
    ]
    for process in running:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(number)
    for process in running:
        _, errors = process.communicate(timeout=30)
        assert (process.returncode, errors) == (number, "")


@pytest.mark.parametrize(
    "command",
    [
        "topic echo /alpha/chatter",
        "topic hz /alpha/pose",
        "topic bw /alpha/pose",
        "topic delay /alpha/pose",
        "topic pub /beta std_msgs/msg/String",
        "service call -r 9 /alpha/set std_srvs/srv/SetBool",
    ],
)
def test_sigint_ends_background_jobs_of_scripts(
    live_nodes: dict[str, str], tmp_path: Path, command: str
) -> None:
    """A shell starts such jobs with SIGINT ignored."""
    script = f"ros2 {command} >out & until [ -s out ]; do sleep 0.1; done; kill -INT $!; wait $!"
    with subprocess.Popen(
        ["sh", "-c", script], env=live_nodes, cwd=tmp_path, start_new_session=True
    ) as shell:
        try:
            assert shell.wait(30) == signal.SIGINT
        finally:
            with suppress(ProcessLookupError):
                os.killpg(shell.pid, signal.SIGKILL)


@pytest.mark.parametrize("depth", [-1, 0])
def test_depths_below_one_mean_the_preset(live_nodes: dict[str, str], tmp_path: Path, depth: int) -> None:
    answer = ask(f"ros2 topic echo --once --qos-depth {depth} /alpha/chatter", live_nodes, tmp_path)
    assert answer == Answer("data: 'it''s 5 o''clock: #1'\n---\n", "", 0)


@pytest.mark.parametrize(
    ("verb", "count"), [("topic find -c std_msgs/msg/String", 3), ("service find -c std_srvs/srv/SetBool", 1)]
)
def test_find_counts(live_nodes: dict[str, str], tmp_path: Path, verb: str, count: int) -> None:
    assert ask(f"ros2 {verb}", live_nodes, tmp_path) == Answer(f"{count}\n", "", 0)


PUBLISH_NOW = "ros2 topic pub --once -w 0 -s /stamped std_msgs/msg/Header 'stamp: now'"


def test_pub_waits_for_the_first_clock(live_nodes: dict[str, str], tmp_path: Path) -> None:
    clock = "ros2 topic pub -r 20 /clock rosgraph_msgs/msg/Clock 'clock: {sec: 7}' >/dev/null"
    answer = ask(f"{clock} & {PUBLISH_NOW}; kill $!", live_nodes, tmp_path)
    assert "std_msgs.msg.Header(stamp=builtin_interfaces.msg.Time(sec=7, nanosec=0)" in answer.stdout
    assert (answer.stderr, answer.code) == ("", 0)


def test_pub_reports_a_missing_clock(live_nodes: dict[str, str], tmp_path: Path) -> None:
    answer = ask(PUBLISH_NOW, live_nodes, tmp_path)
    assert "std_msgs.msg.Header(stamp=builtin_interfaces.msg.Time(sec=0, nanosec=0)" in answer.stdout
    assert answer.stderr == "No time on /clock within 5 s: stamps are 0 until it arrives\n"
    assert answer.code == 0


@pytest.mark.parametrize(
    ("number", "send"),
    [(signal.SIGTERM, os.kill), (signal.SIGINT, os.killpg)],
    ids=["SIGTERM to ros2 run", "SIGINT to its group, as Ctrl-C"],
)
def test_run_ends_with_its_executable(
    live_nodes: dict[str, str], tmp_path: Path, number: signal.Signals, send: Callable[[int, int], None]
) -> None:
    scenario = WORKSPACE / "config/scenarios/paper.yaml"
    process = subprocess.Popen(
        ["ros2", "run", "relform_sim", "quadrotor"]
        + ["--ros-args", "-r", "__ns:=/follower_1", "-p", f"scenario:={scenario}"],
        env=live_nodes,
        start_new_session=True,
    )
    wait_until(lambda: "/follower_1/quadrotor\n" in ask("ros2 node list", live_nodes, tmp_path).stdout)
    send(process.pid, number)
    assert process.wait(30) == EXIT_INTERRUPTED  # of the node
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)  # the node has ended as well


def test_run_passes_arguments_and_the_exit_code(live_nodes: dict[str, str], tmp_path: Path) -> None:
    answer = ask("ros2 run relform_analysis sweep --nonsense", live_nodes, tmp_path)
    assert answer.stderr.startswith("error: ")
    assert (answer.stdout, answer.code) == ("[ros2run]: Process exited with failure 2\n", 2)
    answer = ask("ros2 run relform_bringup fly --help", live_nodes, tmp_path)
    assert answer.stdout.startswith("usage: fly ")
    assert (answer.stderr, answer.code) == ("", 0)


def test_echo_of_a_type_that_is_not_installed(live_nodes: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "test_msgs").mkdir()
    (tmp_path / "test_msgs/__init__.py").touch()  # hides the installed package
    environment = live_nodes | {"PYTHONPATH": str(tmp_path)}
    answer = ask("ros2 topic echo --once /alpha/lists", environment, tmp_path)
    reason = "The message type 'test_msgs/msg/UnboundedSequences' is invalid: it is not installed here\n"
    assert answer == Answer("", reason, 1)


@pytest.mark.parametrize("command", ["ros2", "ros2 run", "ros2 topic", "ros2 topic echo"])
def test_help(live_nodes: dict[str, str], tmp_path: Path, command: str) -> None:
    answer = ask(f"{command} --help", live_nodes, tmp_path)
    assert (answer.stderr, answer.code) == ("", 0)
    assert answer.stdout.startswith(f"usage: {command} ")
    if "verb ..." in answer.stdout or "command ..." in answer.stdout:
        assert ask(command, live_nodes, tmp_path) == answer


def test_commands_of_other_packages(live_nodes: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "greeting.py").write_text(
        '"""Greets."""\ndef add_arguments(parser):\n    parser.set_defaults(run=lambda _: print("hello"))\n'
    )
    metadata = tmp_path / "greeting-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: greeting\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[relform_cli.commands]\ngreet = greeting\n")
    environment = live_nodes | {"PYTHONPATH": str(tmp_path)}
    assert ask("ros2 greet", environment, tmp_path) == Answer("hello\n", "", 0)
    assert re.search(r"^ +greet +Greets\.$", ask("ros2 --help", environment, tmp_path).stdout, re.MULTILINE)
