"""Completions of the ros2 command in bash, requested as Tab does."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from support.ros2_command import Answer, ask_all

WORKSPACE = Path(__file__).parents[2]
SCRIPT = WORKSPACE / ".venv/ros2-completion.sh"

# Words on the line, and the completions of the last one.
CASES = {
    "to": ["topic"],
    "param d": ["delete", "describe", "dump"],
    "daemon st": ["start", "status", "stop"],
    "topic echo --qos-rel": ["--qos-reliability"],
    "topic echo /alpha/c": ["/alpha/chatter"],
    "topic echo /alpha/chatter --fie": ["--field"],
    "topic pub /beta std_msgs/msg/Strin": ["std_msgs/msg/String"],
    "topic pub /alpha/pose ": ["geometry_msgs/msg/PoseStamped"],
    "topic echo /alpha/pose ": ["geometry_msgs/msg/PoseStamped"],
    "topic find geometry_msgs/msg/PoseS": ["geometry_msgs/msg/PoseStamped"],
    "node info /al": ["/alpha/listener", "/alpha/talker"],
    "param get /alpha/talker name.": ["name.first", "name.last"],
    "service call /alpha/se": ["/alpha/set"],
    "service call /alpha/set ": ["std_srvs/srv/SetBool"],
    "service call /alpha/set std_srvs/srv/S": ["std_srvs/srv/SetBool"],
    "interface show std_srvs/srv/T": ["std_srvs/srv/Trigger"],
    "interface package relform_m": ["relform_msgs"],
    "pkg executables relform_ba": ["relform_bags"],
    "run relform_sim ": ["clock", "quadrotor"],
    "run relform_bringup f": ["fly"],
    "run relform_analysis sw": ["sweep"],
    "topic echo /nope/": [],
}


def tab(line: str) -> str:
    """A command of bash that prints the completions, without the space after a whole word."""
    words = ["ros2", *line.split(" ")]
    typed = f"COMP_LINE='ros2 {line}' COMP_POINT={len(line) + 5} COMP_TYPE=9"
    in_words = f"COMP_WORDS=({' '.join(words)}) COMP_CWORD={len(words) - 1}"
    return (
        f"source '{SCRIPT}'; {typed} {in_words}; "
        "_python_argcomplete ros2; printf '%s\\n' \"${COMPREPLY[@]% }\""
    )


@pytest.fixture(scope="module")
def answers(live_nodes: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Answer]:
    return ask_all([[tab(line)] for line in CASES], live_nodes, tmp_path_factory.mktemp("shell"))


@pytest.mark.parametrize("line", CASES)
def test_completion(answers: dict[str, Answer], line: str) -> None:
    answer = answers[tab(line)]
    assert sorted(answer.stdout.split()) == CASES[line]
    assert answer.stderr == ""


@pytest.mark.parametrize(
    ("shell", "before", "ask_shell"),
    [("bash", "", "complete -p ros2"), ("zsh", "autoload -U compinit; compinit -D", "echo $_comps[ros2]")],
)
def test_sourcing_the_workspace_turns_completions_on(shell: str, before: str, ask_shell: str) -> None:
    if shutil.which(shell, path="/usr/bin:/bin") is None:
        pytest.skip(f"no {shell} on this machine")
    script = f'{before}\n. "$1/install/setup.{shell}"\n{ask_shell}; command -v ros2'
    run = subprocess.run(
        [shell, "-c", script, shell, WORKSPACE],
        env={"HOME": os.environ["HOME"], "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
    )
    function, command = run.stdout.splitlines()
    assert "_python_argcomplete" in function
    assert Path(command).is_file()
