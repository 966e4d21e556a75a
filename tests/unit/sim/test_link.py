"""The link of a vehicle: the link decides when a message arrives, and the message keeps its stamp."""

from typing import Any

import numpy as np
import pytest

from relform_core.measurements import RotorCommand
from relform_core.randomness import Stream, Streams
from relform_core.sensors.registry import SENSORS
from relform_core.sensors.sonar import SONAR, Sonar
from relform_sim.link import RadioChannel, radio_link
from relform_sim.loss import Loss
from relform_sim.vehicle import Vehicle
from support.links import DELAY_STEPS, DelayedChannel, delayed_link
from support.scenarios import paper_scenario

CONFIG = paper_scenario().config
PERIOD_NS = CONFIG.period_ns


def command(step: int) -> RotorCommand:
    """For [t_step, t_{step + 1}]; every interval has its own speed, in the plan as well."""
    speeds = [np.full(4, 500.0 + step + later) for later in range(8)]
    return RotorCommand(step * PERIOD_NS, PERIOD_NS, speeds[0], np.array(speeds[1:]))


def sonar(stamp_ns: int) -> tuple[Any, Sonar]:
    return SONAR, Sonar(stamp_ns, 2.0, 0.2, 10.0, 0.5)


def test_without_loss_every_message_arrives_once_and_without_delay() -> None:
    channel = RadioChannel[str](lambda message: Loss(np.random.default_rng(1)))
    for now_ns in (0, PERIOD_NS):
        for message in ("first", "second"):
            channel.send(now_ns, message)
        assert channel.deliver(now_ns) == ["first", "second"]
        assert channel.deliver(now_ns) == []


def test_each_message_is_lost_by_its_own_loss() -> None:
    generator = np.random.default_rng(1)
    losses = {"kept": Loss(generator), "lost": Loss(generator, probability=1.0)}
    channel = RadioChannel[str](losses.__getitem__)
    for message in ("kept", "lost", "kept"):
        channel.send(0, message)
    assert channel.deliver(0) == ["kept", "kept"]


def test_losses_draw_from_the_stream_of_the_sensor_and_of_the_commands() -> None:
    streams, untouched = Streams(3, 0), Streams(3, 0)
    link = radio_link(CONFIG, "leader", streams)
    link.up.send(0, sonar(0))
    link.down.send(0, command(0))
    for stream in (*Stream, *(sensor.stream for sensor in SENSORS)):
        is_used = stream in (SONAR.stream, Stream.LINK)
        assert (streams[stream].integers(2**62) != untouched[stream].integers(2**62)) == is_used


@pytest.mark.parametrize(("time_ns", "arrives"), [(0, True), (PERIOD_NS, False), (3 * PERIOD_NS, True)])
def test_events_act_while_they_last(time_ns: int, arrives: bool) -> None:
    span = "start_s: 0.05, end_s: 0.15, target: leader, probability: 1"
    config = paper_scenario(
        f"events=[{{kind: dropout, sensor: sonar, {span}}}, {{kind: command_loss, {span}}}]"
    ).config
    link, others = (radio_link(config, name, Streams(3, 0)) for name in ("leader", "follower_1"))
    for each in (link, others):
        each.up.send(time_ns, sonar(time_ns))
        each.down.send(time_ns, command(0))
    assert len(link.up.deliver(time_ns)) == len(link.down.deliver(time_ns)) == arrives
    assert len(others.up.deliver(time_ns)) == len(others.down.deliver(time_ns)) == 1


def test_a_vehicle_with_a_delayed_link() -> None:
    """Measurements arrive two steps later with their own stamps; commands are placed in time by theirs."""
    delayed = {name: Vehicle(CONFIG, 5, name, delayed_link) for name in CONFIG.team.vehicles}
    instant = {name: Vehicle(CONFIG, 5, name) for name in CONFIG.team.vehicles}
    measured = []
    for step in range(12):
        arriving = command(step - 1) if step > 0 else None
        truth = {name: vehicle.advance(step, arriving) for name, vehicle in delayed.items()}
        reference = {name: vehicle.advance(step, arriving) for name, vehicle in instant.items()}
        arrived = delayed["leader"].measure(step, truth)
        measured.append(instant["leader"].measure(step, reference))
        for name in CONFIG.team.followers:
            delayed[name].measure(step, truth)
            instant[name].measure(step, reference)
        if step < DELAY_STEPS:
            assert arrived.by_sensor == {}
        else:
            stamps_ns = {each.stamp_ns for sensor in arrived.by_sensor.values() for each in sensor}
            assert stamps_ns == {(step - DELAY_STEPS) * PERIOD_NS}
            assert arrived.by_sensor.keys() == measured[0].by_sensor.keys()
    # The first command arrives two intervals late, and its plan holds the speeds of the commands after it.
    assert delayed["leader"].counts.missing == DELAY_STEPS
    assert delayed["leader"].counts.rejected == 0
    assert delayed["leader"].counts.replayed == 11 - DELAY_STEPS


def test_a_channel_that_delays_keeps_the_order() -> None:
    channel = DelayedChannel[int](2)
    for now in range(3):
        channel.send(now, now)
    assert channel.deliver(2) == [0]
    assert channel.deliver(4) == [1, 2]
