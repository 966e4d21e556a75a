"""The command ``fly`` refuses what it cannot fly, and then leaves no files."""

from pathlib import Path
from uuid import uuid4

import pytest

from relform_bringup.command import main
from relform_core.ros_domain import claimed_domain
from support.scenarios import PAPER


@pytest.fixture
def in_tmp_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--scenario", "nowhere.yaml"], "nowhere.yaml: no such file"),
        (["--scenario", str(PAPER), "--set", "controller.speed=1"], "controller.speed: unknown key"),
        (["--scenario", str(PAPER), "--seed", "-1"], "seed"),
        (
            ["--scenario", str(PAPER), "--set", "formations_m.wide.follower_1=[0.1, 0.0, 0.0]"],
            "formation 'wide' is impossible",
        ),
        (["--scenario", str(PAPER), "--out", "there"], "there exists already; choose another folder"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    arguments: list[str], says: str, in_tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("there").mkdir()
    assert main(arguments) == 2
    output = capsys.readouterr()
    assert says in output.err
    assert output.err.count("\n") == 1
    assert output.out == ""
    assert [path.name for path in in_tmp_path.rglob("*")] == ["there"]


@pytest.mark.parametrize(
    ("variable", "value", "says"),
    [
        ("ROS_DOMAIN_ID", "500", "ROS_DOMAIN_ID must be a whole number from 0 to 232 (got '500')"),
        ("PATH", "/nowhere", "setpriv is not installed: apt install util-linux"),
        ("AMENT_PREFIX_PATH", "/nowhere", "package relform_sim is not installed: run make setup"),
    ],
)
def test_refused_flight_leaves_nothing(
    variable: str,
    value: str,
    says: str,
    in_tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv(variable, value)
    assert main(["--scenario", str(PAPER)]) == 2
    assert capsys.readouterr().err.startswith(f"error: {says}")
    assert list(in_tmp_path.iterdir()) == []


def test_flight_beside_another_in_the_same_domain_leaves_nothing(
    in_tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("relform_core.ros_domain.CLAIM", f"\0relform-test-{uuid4()}-")
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    with claimed_domain():
        assert main(["--scenario", str(PAPER)]) == 2
    assert capsys.readouterr().err.startswith("error: another flight uses ROS_DOMAIN_ID 7")
    assert list(in_tmp_path.iterdir()) == []
