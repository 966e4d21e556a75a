"""The link of a vehicle: the link decides when a message arrives, and the message keeps its stamp."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from relform_core.events_config import LinkFault
from relform_core.measurements import RotorCommand
from relform_core.randomness import Stream, Streams
from relform_core.sensors.applied_rotor_speeds import APPLIED_ROTOR_SPEEDS
from relform_core.sensors.registry import SENSORS
from relform_core.sensors.sonar import SONAR, Sonar
from relform_sim.link import RadioChannel, radio_link
from relform_sim.loss import Loss
from relform_sim.packets import Bursts, Packets
from relform_sim.vehicle import Vehicle
from support.scenarios import FROM_GROUND, paper_scenario

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


DELAY_STEPS = 2
DELAYED = "links={up: {delay_s: 0.08}, down: {delay_s: 0.1}}"
"""Override: both are two control periods, the first one rounded up."""


def test_a_vehicle_with_a_delayed_link() -> None:
    """Measurements arrive two steps later with their own stamps; commands are placed in time by theirs."""
    config = paper_scenario(DELAYED).config
    delayed = {name: Vehicle(config, 5, name) for name in config.team.vehicles}
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
            continue
        stamps_ns = {each.stamp_ns for sensor in arrived.by_sensor.values() for each in sensor}
        assert stamps_ns == {(step - DELAY_STEPS) * PERIOD_NS}
        applied = arrived.newest(APPLIED_ROTOR_SPEEDS)
        assert arrived.by_sensor.keys() - {APPLIED_ROTOR_SPEEDS.name} == measured[0].by_sensor.keys()
        assert (applied is None) == (step == DELAY_STEPS)  # nothing has been flown at the first instant
        if applied is not None and step > 2 * DELAY_STEPS:
            assert list(applied.starts_ns) == [k * PERIOD_NS for k in range(step - DELAY_STEPS)]
            np.testing.assert_array_equal(applied.speeds[DELAY_STEPS], np.full(4, 502.0))
            assert applied.command_stamp_ns == (step - 2 * DELAY_STEPS - 1) * PERIOD_NS
    # The first command arrives two intervals late, and its plan holds the speeds of the commands after it.
    assert delayed["leader"].counts.missing == DELAY_STEPS
    assert delayed["leader"].counts.rejected == 0
    assert delayed["leader"].counts.replayed == 11 - DELAY_STEPS


def test_only_a_link_that_can_fail_is_acknowledged() -> None:
    sent = [source.name for source in paper_scenario().config.sources_of("follower_1")]
    event = "target: leader, start_s: 1, end_s: 2"
    for override in (
        "links={up: {loss_probability: 0.1}}",
        f"events=[{{kind: link, {event}, direction: up, delay_s: 0.1}}]",
        f"events=[{{kind: command_loss, {event}, probability: 0.1}}]",
    ):
        config = paper_scenario(override).config
        assert [each.name for each in config.sources_of("follower_1")] == [*sent, "applied_rotor_speeds"]
    config = paper_scenario(FROM_GROUND).config
    reports = ["applied_rotor_speeds", "flight_status"]
    assert [each.name for each in config.sources_of("follower_1")] == [*sent, *reports]


def packets(overrides: Sequence[str], generator: np.random.Generator) -> Packets:
    """Of the direction up of a link."""
    config = paper_scenario(*overrides).config
    faults = [event for event in config.events if isinstance(event, LinkFault)]
    return Packets(config.links.up, faults, generator)


def test_a_message_is_delivered_at_the_first_instant_after_its_delay() -> None:
    late = packets(["links={up: {delay_s: 0.07}}"], np.random.default_rng(1))
    channel = RadioChannel[str](lambda message: None, late)
    channel.send(0, "first")
    channel.send(PERIOD_NS, "second")
    assert [channel.deliver(step * PERIOD_NS) for step in range(5)] == [[], [], ["first"], ["second"], []]


def test_messages_of_one_instant_share_one_packet() -> None:
    lossy = packets(["links={up: {loss_probability: 0.5, jitter_s: 0.3}}"], np.random.default_rng(1))
    channel = RadioChannel[tuple[int, int]](lambda message: None, lossy)
    arrived: list[set[tuple[int, int]]] = []
    for step in range(100):
        for part in range(4):
            channel.send(step * PERIOD_NS, (step, part))
        arrived.append(set(channel.deliver(step * PERIOD_NS)))
    for step in range(90):
        parts = [{part for sent, part in each if sent == step} for each in arrived]
        assert [each for each in parts if each] in ([], [{0, 1, 2, 3}])


def test_packets_overtake_and_are_delivered_in_order_of_arrival() -> None:
    """The jitter is the draw of the delay, uniform between 0 and 1, times its bound."""
    jittery = ["links={up: {delay_s: 0.02, jitter_s: 0.5}}"]
    _, _, of_delay = np.random.default_rng(8).spawn(3)
    shares = of_delay.uniform(size=8)
    late = packets(jittery, np.random.default_rng(8))
    arrivals = [late.arrival_ns(step * PERIOD_NS) for step in range(8)]
    expected = [step * PERIOD_NS + 20_000_000 + 500_000_000 * share for step, share in enumerate(shares)]
    assert arrivals == pytest.approx(expected, abs=1.0)
    order = sorted(range(8), key=expected.__getitem__)
    assert order != list(range(8))
    channel = RadioChannel[int](lambda message: None, packets(jittery, np.random.default_rng(8)))
    for step in range(8):
        channel.send(step * PERIOD_NS, step)
    assert channel.deliver(10**9) == order


def test_an_event_acts_on_one_direction_of_one_link_while_it_lasts() -> None:
    span = "start_s: 0.05, end_s: 0.15, target: leader"
    config = paper_scenario(f"events=[{{kind: link, direction: down, {span}, delay_s: 0.05}}]").config
    link, others = (radio_link(config, name, Streams(3, 0)) for name in ("leader", "follower_1"))
    for step in range(4):
        for each in (link, others):
            each.up.send(step * PERIOD_NS, sonar(step * PERIOD_NS))
            assert len(each.up.deliver(step * PERIOD_NS)) == 1
            each.down.send(step * PERIOD_NS, command(step))
        arrived = [each.stamp_ns // PERIOD_NS for each in link.down.deliver(step * PERIOD_NS)]
        assert arrived == {0: [0], 1: [], 2: [1], 3: [2, 3]}[step]
        assert len(others.down.deliver(step * PERIOD_NS)) == 1


def test_an_event_changes_no_other_packet() -> None:
    links = "links={up: {loss_probability: 0.3, jitter_s: 0.2}}"
    event = "{kind: link, target: leader, start_s: 1, end_s: 2, loss_probability: 0.9, jitter_s: 0.3}"
    usual = packets([links], np.random.default_rng(4))
    disturbed = packets([links, f"events=[{event}]"], np.random.default_rng(4))
    for step in range(60):
        arrivals = usual.arrival_ns(step * PERIOD_NS), disturbed.arrival_ns(step * PERIOD_NS)
        assert arrivals[0] == arrivals[1] or 20 <= step < 40


def test_bursts_alternate_with_gaps_of_exponential_length() -> None:
    config = paper_scenario("links={up: {burst_s: 0.4, burst_interval_s: 2}}").config.links.up
    gaps = np.random.default_rng(6).exponential(2.0, size=3)
    starts = np.cumsum(gaps) + 0.4 * np.arange(3)
    bursts = Bursts(config, np.random.default_rng(6))
    for time in np.arange(0.0, starts[-1] + 0.3, 0.01):
        assert bursts.covers(time) == any(start <= time < start + 0.4 for start in starts)
