"""Counterfactual replay: recorded measurements fed to today's controller."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.replay.command import DIFFERENT, EQUAL, TROUBLE, main
from relform_analysis.replay.figure import replay_figure
from relform_analysis.replay.from_bag import RecordedFlight, read_recorded_flight
from relform_analysis.replay.replay import replay
from relform_bags.from_bag import as_installed
from relform_bags.reader import BagAttachment, BagMessage, bag_files, read_bag
from relform_bags.split_limits import SplitLimits
from relform_bags.writer import BagWriter
from relform_core.errors import BagError
from relform_core.sensors.range_bearing import RANGE_BEARING
from relform_core.units import rpm_to_rad_s

WORKSPACE = Path(__file__).parents[2]
SHORT_FLIGHT = WORKSPACE / "tests/data/short_flight"
STEPS = 40


@pytest.fixture(scope="module")
def recorded() -> RecordedFlight:
    return read_recorded_flight(SHORT_FLIGHT)


def test_the_recording_is_read_whole(recorded: RecordedFlight) -> None:
    assert [step.measurements.step for step in recorded.steps] == list(range(STEPS))
    sight = [step.measurements.by_vehicle["follower_1"].newest(RANGE_BEARING) for step in recorded.steps]
    lost = [step for step, each in enumerate(sight) if each is None]
    assert lost
    assert 14 <= min(lost) <= max(lost) < 32, "the scenario blinds follower_1 between 0.7 and 1.6 s"
    assert all(set(step.commands) == {"leader", "follower_1", "follower_2"} for step in recorded.steps)


def test_the_controller_of_today_decides_as_recorded(recorded: RecordedFlight) -> None:
    # Another processor has other kernels in BLAS and another -march=native, so not bit for bit.
    result = replay(recorded, recorded.scenario)
    assert np.abs(result.difference).max() < rpm_to_rad_s(1e-3)


def test_two_replays_are_equal_bit_for_bit(recorded: RecordedFlight) -> None:
    first, second = (replay(recorded, recorded.scenario) for _ in range(2))
    assert np.array_equal(first.replayed, second.replayed)


def test_another_controller_decides_differently(recorded: RecordedFlight) -> None:
    overrides = ["controller.weights.formation_per_m2=12.0"]
    other = recorded.configuration.load(overrides)
    result = replay(recorded, other)
    assert not result.identical
    assert result.first_difference == 0
    assert rpm_to_rad_s(1.0) < np.abs(result.difference).max()


def test_a_bag_cut_off_gives_the_steps_before(recorded: RecordedFlight, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    whole = recorded.configuration.bag.read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    assert 0 < len(read_recorded_flight(cut).steps) < STEPS


def test_a_split_bag_is_one_flight(recorded: RecordedFlight, tmp_path: Path) -> None:
    folder = tmp_path / "run/bag"
    entries = list(read_bag(SHORT_FLIGHT))
    attachments = {entry.name: entry.text for entry in entries if isinstance(entry, BagAttachment)}
    messages = [as_installed(entry) for entry in entries if isinstance(entry, BagMessage)]
    with BagWriter(folder, attachments, SplitLimits(size=20_000)) as writer:
        for topic, type_name in {entry.topic: entry.type_name for entry in messages}.items():
            writer.add_topic(topic, type_name, [])
        for entry in messages:
            writer.write(entry.topic, entry.data, entry.log_time_ns, entry.publish_time_ns)
    assert len(bag_files(folder)) > 3
    split = read_recorded_flight(tmp_path / "run")
    assert len(split.steps) == STEPS
    replayed, expected_replay = (replay(flight, flight.scenario) for flight in (split, recorded))
    np.testing.assert_array_equal(replayed.replayed, expected_replay.replayed)
    log, expected = read_flight_log(folder), read_flight_log(SHORT_FLIGHT)
    np.testing.assert_array_equal(log.p_NB_N, expected.p_NB_N)
    np.testing.assert_array_equal(log.solver["kkt"], expected.solver["kkt"])


def test_bag_in_wall_time_and_without_attachments(recorded: RecordedFlight, tmp_path: Path) -> None:
    """As other recorders write it: log times are when messages arrived, and nothing is attached."""
    foreign = tmp_path / "recording/foreign_0.mcap"
    foreign.parent.mkdir()
    delays_ns = np.random.default_rng(3).integers(0, 40_000_000, 10_000)
    with (SHORT_FLIGHT / "bag_0.mcap").open("rb") as stream, foreign.open("wb") as copy:
        writer, ids = Writer(copy), {}
        writer.start("ros2", "another recorder")
        for index, (schema, channel, message) in enumerate(make_reader(stream).iter_messages()):
            if channel.topic not in ids:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                ids[channel.topic] = writer.register_channel(
                    channel.topic, channel.message_encoding, schema_id
                )
            wall_ns = 1_790_000_000_000_000_000 + 3 * message.log_time + int(delays_ns[index])
            writer.add_message(ids[channel.topic], wall_ns, message.data, wall_ns)
        writer.finish()

    with pytest.raises(BagError, match=r"foreign_0\.mcap: no configuration of the flight: .* --config FILE$"):
        read_recorded_flight(foreign)
    configuration = SHORT_FLIGHT.with_suffix(".yaml")
    assert main([str(foreign), "--config", str(configuration)]) in (EQUAL, DIFFERENT)
    (tmp_path / "config.yaml").write_text(configuration.read_text())
    again, log = read_recorded_flight(foreign), read_flight_log(foreign)
    assert (len(again.steps), again.gap) == (STEPS, None)
    replays = [replay(flight, flight.scenario) for flight in (again, recorded)]
    np.testing.assert_array_equal(replays[0].replayed, replays[1].replayed)
    np.testing.assert_array_equal(replays[0].recorded, replays[1].recorded)
    expected = read_flight_log(SHORT_FLIGHT)
    assert flight_metrics(log) == flight_metrics(expected)
    np.testing.assert_array_equal(log.step_ns, expected.step_ns)


@pytest.mark.parametrize(
    ("lost", "steps", "gap"),
    [
        (("/formation/events", 5), 5, "control step 5 (0.25 s) is not on /formation/events"),
        (("/leader/imu", 7), 7, "control step 7 (0.35 s) lacks the message on /leader/imu of 0.35 s"),
        (
            ("/follower_2/rotor_speeds", 9),
            9,
            "control step 9 (0.45 s) lacks the message on /follower_2/rotor_speeds of 0.45 s",
        ),
    ],
)
def test_replay_ends_at_a_lost_message_and_names_it(
    tmp_path: Path, lost: tuple[str, int], steps: int, gap: str
) -> None:
    flight = read_recorded_flight(without(tmp_path / "bag", lambda topic, step: (topic, step) == lost))
    assert (len(flight.steps), flight.gap) == (steps, gap)


@pytest.mark.parametrize(
    ("lost", "problem"),
    [
        (lambda topic, step: step < 4, "the recording starts at control step 4, and a replay at step 0"),
        (lambda topic, step: topic == "/formation/events", "there is no control step on /formation/events"),
    ],
)
def test_a_recording_without_its_first_steps_is_one_line(
    tmp_path: Path, lost: Callable[[str, int], bool], problem: str
) -> None:
    with pytest.raises(BagError) as error:
        read_recorded_flight(without(tmp_path / "bag", lost))
    assert str(error.value) == f"{tmp_path / 'bag/bag_0.mcap'}: no replay: {problem}"


def without(folder: Path, lost: Callable[[str, int], bool]) -> Path:
    """The short flight in a bag that lacks some messages, by topic and step."""
    entries = list(read_bag(SHORT_FLIGHT))
    attachments = {entry.name: entry.text for entry in entries if isinstance(entry, BagAttachment)}
    messages = [as_installed(entry) for entry in entries if isinstance(entry, BagMessage)]
    with BagWriter(folder, attachments) as writer:
        for topic, type_name in {entry.topic: entry.type_name for entry in messages}.items():
            writer.add_topic(topic, type_name, [])
        for entry in messages:
            if not lost(entry.topic, entry.log_time_ns // 50_000_000):
                writer.write(entry.topic, entry.data, entry.log_time_ns, entry.publish_time_ns)
    return folder


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "difference.png"
    changed = ["--set", "controller.horizon_steps=12", "--plot", str(picture)]
    assert main([str(SHORT_FLIGHT), *changed]) == DIFFERENT
    assert "first command that differs is in step 0" in capsys.readouterr().out
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_picture_shows_recorded_and_replayed_speeds_and_their_difference(recorded: RecordedFlight) -> None:
    other = recorded.configuration.load(["controller.weights.formation_per_m2=12.0"])
    result = replay(recorded, other)
    axes = replay_figure(result, other.config.vehicle).axes
    assert len(axes) == 2 * len(result.vehicles)
    assert axes[-1].get_xlabel() == "time (s)"
    for index, name in enumerate(result.vehicles):
        speeds, difference = axes[2 * index : 2 * index + 2]
        assert speeds.get_title(loc="left") == f"{name}: mean rotor speed (rpm)"
        lines = {line.get_label(): line.get_ydata() for line in speeds.lines}
        for label, values in (("recorded", result.recorded), ("replayed", result.replayed)):
            expected = values[:, index].mean(axis=1) / rpm_to_rad_s(1.0)
            np.testing.assert_allclose(lines[label], expected, err_msg=f"{name}, {label}")
        assert difference.get_title(loc="left").startswith("replayed minus recorded")
        (band,) = difference.collections
        heights = band.get_paths()[0].vertices[:, 1]
        change = result.difference[:, index] / rpm_to_rad_s(1.0)
        np.testing.assert_allclose((heights.min(), heights.max()), (change.min(), change.max()))


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["nowhere"], "nowhere: no such file or folder"),
        ([str(SHORT_FLIGHT), "--set", "controller.horizon=3"], "--set controller.horizon: unknown key"),
        ([str(SHORT_FLIGHT), "--controller", "nowhere.yaml"], "nowhere.yaml: no such file"),
        ([str(SHORT_FLIGHT / "metadata.yaml")], "metadata.yaml: not an MCAP file"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == TROUBLE
    (line,) = capsys.readouterr().err.splitlines()
    assert problem in line


def test_a_fresh_recording_replays_bit_for_bit(tmp_path: Path) -> None:
    """On the machine that recorded it, an unchanged controller repeats every command."""
    scenario, run = SHORT_FLIGHT.with_suffix(".yaml"), tmp_path / "run"
    command = [sys.executable, "scripts/fly.py", "--scenario", str(scenario), "--out", str(run)]
    subprocess.run(command, cwd=WORKSPACE, check=True, capture_output=True)
    assert main([str(run)]) == EQUAL
