"""Each flight has a ROS domain of its own."""

import socket
from contextlib import ExitStack, closing, suppress
from uuid import uuid4

import pytest

from relform_core.errors import FlightError
from relform_core.ros_domain import DEFAULT_DOMAIN_ID, DOMAIN_IDS, claimed_domain, is_in_use


@pytest.fixture(autouse=True)
def no_other_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    monkeypatch.setattr("relform_core.ros_domain.CLAIM", f"\0relform-test-{uuid4()}-")


def test_concurrent_flights_have_different_domains() -> None:
    with ExitStack() as stack:
        claimed = [stack.enter_context(claimed_domain()) for _ in range(8)]
    assert len(set(claimed)) == 8
    assert set(claimed) <= {DEFAULT_DOMAIN_ID, *DOMAIN_IDS}
    with claimed_domain() as again:
        assert again == claimed[0]  # given back


def test_first_flight_has_the_domain_of_every_shell_even_if_it_is_in_use() -> None:
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as shell:
        with suppress(OSError):  # another process has it
            shell.bind(("", 7400 + 10))
        assert is_in_use(DEFAULT_DOMAIN_ID)
        with claimed_domain() as first, claimed_domain() as second:
            assert first == DEFAULT_DOMAIN_ID
            assert second in DOMAIN_IDS


def test_domain_with_a_participant_is_left_alone() -> None:
    with claimed_domain(), claimed_domain() as free:
        pass
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as stranger:
        stranger.bind(("", 7400 + 250 * free + 10 + 2 * 3))  # as the fourth participant does
        assert is_in_use(free)
        with claimed_domain(), claimed_domain() as claimed:
            assert claimed != free
    assert not is_in_use(free)


def test_domain_apart_from_shells(monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_ros_domain_id_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "0")
    with claimed_domain() as claimed:
        assert claimed == 0
        with pytest.raises(FlightError, match="another flight uses ROS_DOMAIN_ID 0"), claimed_domain():
            pass


@pytest.mark.parametrize("wanted", ["seven", "-1", "2.5", "233", "500"])
def test_impossible_domain_is_refused_with_the_bounds(wanted: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", wanted)
    message = rf"^ROS_DOMAIN_ID must be a whole number from 0 to 232 \(got '{wanted}'\); change or unset it$"
    with pytest.raises(FlightError, match=message), claimed_domain():
        pass


def test_highest_domain_is_possible(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "232")
    with claimed_domain() as claimed:
        assert claimed == 232
