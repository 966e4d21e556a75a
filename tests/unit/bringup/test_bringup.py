"""What a bring-up stands on: the run folder, a ROS domain of its own, the command line's refusals."""

import socket
from contextlib import ExitStack, closing, suppress
from datetime import datetime
from pathlib import Path
from uuid import uuid4

import pytest

from relform_bringup.command import main
from relform_bringup.create_folder import create_run_folder
from relform_core.errors import FlightError
from relform_core.load import load_scenario
from relform_core.ros_domain import DEFAULT_DOMAIN_ID, DOMAIN_IDS, claimed_domain, is_in_use
from support.scenarios import PAPER, paper_scenario

NOW = datetime(2026, 11, 21, 23, 42, 7)


@pytest.fixture
def in_tmp_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


class TestRunFolder:
    def test_name_and_effective_configuration(self, in_tmp_path: Path) -> None:
        scenario = paper_scenario("controller.horizon_steps=11", seed=3)
        folder = create_run_folder(scenario, None, NOW)
        assert folder.path == in_tmp_path / "runs/20261121-234207-paper-s3"
        again = load_scenario(folder.config)
        assert again.seed == 3
        assert again.config == scenario.config

    def test_latest_points_to_the_newest(self, in_tmp_path: Path) -> None:
        for seed in (3, 4, 5):
            folder = create_run_folder(paper_scenario(seed=seed), None, NOW)
            assert (in_tmp_path / "runs/latest").resolve() == folder.path
        names = {path.name for path in (in_tmp_path / "runs").iterdir()}
        assert names == {"latest", *(f"20261121-234207-paper-s{seed}" for seed in (3, 4, 5))}

    def test_two_flights_in_one_second(self, in_tmp_path: Path) -> None:
        names = [create_run_folder(paper_scenario(seed=3), None, NOW).path.name for _ in range(3)]
        assert names == [f"20261121-234207-paper-s3{suffix}" for suffix in ("", "-2", "-3")]

    def test_chosen_folder_leaves_latest_alone(self, in_tmp_path: Path) -> None:
        folder = create_run_folder(paper_scenario(), Path("some/where"), NOW)
        assert folder.path == in_tmp_path / "some/where"
        assert not (in_tmp_path / "runs").exists()

    def test_nothing_is_overwritten(self, in_tmp_path: Path) -> None:
        Path("there").mkdir()
        with pytest.raises(FlightError, match=r"^there exists already, not overwriting\.$"):
            create_run_folder(paper_scenario(), Path("there"), NOW)
        assert list(Path("there").iterdir()) == []

    def test_no_place_to_write(self, in_tmp_path: Path) -> None:
        Path("file").touch()
        with pytest.raises(FlightError, match=r"^file/run: cannot be written: Not a directory$"):
            create_run_folder(paper_scenario(), Path("file/run"), NOW)


class TestDomain:
    @pytest.fixture(autouse=True)
    def nobody_else(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
        monkeypatch.setattr("relform_core.ros_domain.CLAIM", f"\0relform-test-{uuid4()}-")

    def test_flights_side_by_side_have_different_ones(self) -> None:
        with ExitStack() as stack:
            claimed = [stack.enter_context(claimed_domain()) for _ in range(8)]
        assert len(set(claimed)) == 8
        assert set(claimed) <= {DEFAULT_DOMAIN_ID, *DOMAIN_IDS}
        with claimed_domain() as again:
            assert again == claimed[0]  # given back

    def test_the_first_is_where_every_shell_is_even_if_one_listens_already(self) -> None:
        with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as shell:
            with suppress(OSError):  # somebody does
                shell.bind(("", 7400 + 10))
            assert is_in_use(DEFAULT_DOMAIN_ID)
            with claimed_domain() as first, claimed_domain() as second:
                assert first == DEFAULT_DOMAIN_ID
                assert second in DOMAIN_IDS

    def test_a_domain_with_a_participant_is_left_alone(self) -> None:
        with claimed_domain(), claimed_domain() as free:
            pass
        with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as stranger:
            stranger.bind(("", 7400 + 250 * free + 10 + 2 * 3))  # as the fourth participant does
            assert is_in_use(free)
            with claimed_domain(), claimed_domain() as claimed:
                assert claimed != free
        assert not is_in_use(free)

    def test_who_wants_no_other_nodes_gets_a_domain_without_shells(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        with claimed_domain(beside_shells=False) as first, claimed_domain(beside_shells=False) as second:
            assert {first, second} <= set(DOMAIN_IDS)
            assert first != second
        with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as stranger:
            stranger.bind(("", 7400 + 250 * first + 10))
            with claimed_domain(beside_shells=False) as free:
                assert free != first
        monkeypatch.setenv("ROS_DOMAIN_ID", "0")
        with claimed_domain(beside_shells=False) as wanted:
            assert wanted == 0

    def test_the_users_wish_counts(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("ROS_DOMAIN_ID", "0")
        with claimed_domain() as claimed:
            assert claimed == 0
            with pytest.raises(FlightError, match="another flight uses ROS_DOMAIN_ID 0"), claimed_domain():
                pass

    def test_a_wish_that_is_no_number(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("ROS_DOMAIN_ID", "seven")
        with pytest.raises(FlightError, match=r"must be a number \(got 'seven'\)"), claimed_domain():
            pass


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
        (["--scenario", str(PAPER), "--out", "there"], "there exists already, not overwriting."),
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
