"""A recorded flight: what is known at each time, after going on and after jumps."""

import time
from functools import partial

import numpy as np
import pytest
import viser

from relform_core.telemetry import Event, FaultReported, PerStep
from relform_live.recording import Recording, Series
from relform_live.scene.channel import Channel
from relform_live.scene.flight_data import FlightData
from relform_live.scene.stage import Stage
from relform_live.viewer.playback import Playback
from relform_live.viewer.server import serving
from support.live_flights import nanoseconds, odometry, paper_config, place_of, reference, solver, state
from support.ports import free_port

LENGTH_S = 40.0


@pytest.fixture
def recording() -> Recording:
    """40 s at 20 Hz, with a fault at 12.3 s."""
    data = FlightData(paper_config())
    times = [step / 20.0 for step in range(round(20 * LENGTH_S) + 1)]
    stamps = [nanoseconds(time) for time in times]
    fault = PerStep(246, nanoseconds(12.3), Event("follower_2", FaultReported("hit the ground")))
    channels = {name: Channel(partial(data.take_truth, name), kept=8) for name in data.truths}
    series = {name: Series(stamps, [odometry(name, time) for time in times]) for name in data.truths}
    channels["state"] = Channel(data.take_state)
    series["state"] = Series(stamps, [state(time) for time in times])
    channels["reference"] = Channel(data.take_reference)
    series["reference"] = Series(stamps, [reference(time) for time in times])
    channels["solver"] = Channel(data.take_solver)
    series["solver"] = Series(stamps, [solver(time) for time in times])
    channels["events"] = Channel(data.take_event, kept=200, keeps_all=True)
    series["events"] = Series([fault.stamp_ns], [fault])
    return Recording(data, channels, series)


def play(recording: Recording, stage: Stage, start: float, end: float) -> None:
    for time_s in np.arange(start, end + 1e-9, 1.0 / 15.0):
        recording.advance(stage, nanoseconds(float(time_s)))
        stage.picture(nanoseconds(float(time_s)))


def test_begins_and_ends_with_the_messages(recording: Recording) -> None:
    assert (recording.start_ns, recording.end_ns) == (0, nanoseconds(LENGTH_S))


def test_poses_between_two_messages_are_interpolated(recording: Recording) -> None:
    stage = Stage(recording.data)
    play(recording, stage, 0.0, 1.0)
    recording.advance(stage, nanoseconds(1.015))
    picture = stage.picture(nanoseconds(1.015))
    assert picture.truth is not None
    assert picture.truth.p_NB_N[1] == pytest.approx(place_of("follower_1", 1.015))


def test_an_event_is_shown_when_its_time_has_come(recording: Recording) -> None:
    stage = Stage(recording.data)
    play(recording, stage, 10.0, 12.25)
    assert [line.text for line in recording.data.log] == ["phase B"]
    recording.advance(stage, nanoseconds(12.3))
    assert [line.text for line in recording.data.log] == ["phase B", "follower_2: hit the ground"]


@pytest.mark.parametrize("before", [2.0, 38.0])
def test_after_a_jump_all_is_as_if_played_until_there(recording: Recording, before: float) -> None:
    stage = Stage(recording.data)
    play(recording, stage, before, before + 0.5)
    recording.advance(stage, nanoseconds(25.0))
    picture = stage.picture(nanoseconds(25.0))
    assert picture.truth is not None
    assert picture.truth.p_NB_N[2] == pytest.approx(place_of("follower_2", 25.0))
    trail = stage.trails["follower_2"].segments
    assert trail[-1, 1] == pytest.approx(place_of("follower_2", 25.0), abs=0.15)  # 0.1 s of flight
    assert trail[0, 0] == pytest.approx(place_of("follower_2", 25.0 - 14.9), abs=0.2)
    assert np.linalg.norm(trail[:, 1] - trail[:, 0], axis=1).max() < 0.2  # no line from the place before
    assert stage.history.columns[0][0] == pytest.approx(-14.9, abs=0.2)
    assert "follower_2: hit the ground" in [line.text for line in recording.data.log]


def test_a_jump_back_forgets_what_comes_later(recording: Recording) -> None:
    stage = Stage(recording.data)
    play(recording, stage, 12.0, 12.5)
    recording.advance(stage, nanoseconds(3.0))
    assert "follower_2: hit the ground" not in [line.text for line in recording.data.log]


class Clock:
    """A playback with a clock that the test moves."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.now = time.monotonic()
        self.playback = Playback(server, nanoseconds(2.0), nanoseconds(10.0), self.now)

    def after(self, duration: float) -> float:
        self.now += duration
        return self.playback.at(self.now) / 1e9


def test_playback_pauses_changes_speed_and_ends() -> None:
    with serving(free_port()) as server:
        clock = Clock(server)
        assert clock.after(0.0) == pytest.approx(2.0)
        assert clock.after(1.5) == pytest.approx(3.5)
        clock.playback.toggle()
        assert clock.after(0.0) == pytest.approx(3.5)
        assert clock.after(60.0) == pytest.approx(3.5)
        clock.playback.jump(4.0)
        assert clock.after(0.0) == pytest.approx(4.0)
        clock.playback.toggle()
        assert clock.after(0.0) == pytest.approx(4.0)
        assert clock.after(2.0) == pytest.approx(6.0)
        assert clock.after(60.0) == 10.0  # the end
        assert clock.after(60.0) == 10.0
        clock.playback.toggle()
        assert clock.after(0.0) == pytest.approx(2.0)  # from the start again
