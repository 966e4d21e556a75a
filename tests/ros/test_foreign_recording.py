"""A flight recorded from outside, in wall time: report and replay are those of the flight's own bag."""

import os
import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import domain_coordinator
import numpy as np
import pytest

from relform_analysis.flight.from_bag import read_flight_log
from relform_analysis.flight.metrics import flight_metrics
from relform_analysis.replay.command import EQUAL
from relform_analysis.replay.command import main as replay
from relform_analysis.report.command import main as report
from relform_bags.reader import BagMessage, read_attachments, read_bag
from relform_core.load import load_scenario
from relform_core.names import CLOCK, CONFIG_ATTACHMENT, MEMBERS, RECORDER_NODE
from relform_core.roster import Roster
from relform_ros.topics import topic_table
from support.nodes import INSTALL, Nodes
from support.observer import Observer
from support.pages import Page

SHORT_FLIGHT = Path(__file__).parents[1] / "data/short_flight.yaml"
LISTENER = "listener"
STEPS = 40


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a flight with two bags: its own, and that of a recorder that it does not know."""
    folder = tmp_path_factory.mktemp("run")
    scenario = load_scenario(SHORT_FLIGHT)
    roster = Roster.of(scenario.config, [RECORDER_NODE])
    with (
        domain_coordinator.domain_id() as domain,
        Observer.running(domain) as observer,
        listening(domain, folder / "foreign") as listener,
        Nodes(scenario, folder, domain, observers=[RECORDER_NODE]) as nodes,
    ):
        nodes.start("recorder", f"output:={folder / 'bag'}")
        for name in (*scenario.config.team.vehicles, "controller"):
            nodes.start(name)
        for topic in topic_table(scenario.config, roster).keys() - {CLOCK, MEMBERS}:
            observer.until(lambda topic=topic: listens(observer, topic))
        nodes.start("clock")
        for name in ("clock", "recorder"):
            exit_code, errors = nodes.end(name)
            assert exit_code == 0, errors
        listener.send_signal(signal.SIGINT)
        assert listener.wait(60.0) == 0
    return folder


@contextmanager
def listening(domain_id: int, bag: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A recorder of everything that is published."""
    command = [str(INSTALL / "relform_bags/lib/relform_bags/recorder"), "--ros-args", "--log-level", "warn"]
    parameters = ["-r", f"__node:={LISTENER}", "-p", f"output:={bag}"]
    environment = os.environ | {"ROS_DOMAIN_ID": str(domain_id)}
    with subprocess.Popen([*command, *parameters], env=environment) as listener:
        try:
            yield listener
        finally:
            listener.kill()


def listens(observer: Observer, topic: str) -> bool:
    return any(info.node_name == LISTENER for info in observer.node.get_subscriptions_info_by_topic(topic))


def test_the_foreign_bag_is_in_wall_time(run: Path) -> None:
    assert CONFIG_ATTACHMENT not in read_attachments(run / "foreign")
    times = [entry.log_time_ns for entry in read_bag(run / "foreign") if isinstance(entry, BagMessage)]
    assert min(times) > 1_600_000_000_000_000_000


def test_same_numbers_in_the_report(run: Path) -> None:
    own, foreign = (read_flight_log(run / bag) for bag in ("bag", "foreign"))
    assert flight_metrics(foreign) == flight_metrics(own)
    np.testing.assert_array_equal(foreign.p_NB_N, own.p_NB_N)
    assert len(foreign.phase) == STEPS
    tables = []
    for bag in ("bag", "foreign"):
        out = run / f"{bag}.html"
        assert report([str(run / bag), "--out", str(out), "--no-figures"]) == 0
        tables.append(Page(out.read_text()).tables)
    assert tables[0]["phases"] == tables[1]["phases"]
    assert tables[0]["compared"] == tables[1]["compared"]


def test_same_replay(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for bag in ("bag", "foreign"):
        assert replay([str(run / bag)]) == EQUAL
        assert re.match(f"{STEPS} control steps: every command is equal", capsys.readouterr().out)


def test_configuration_may_be_given(run: Path, tmp_path: Path) -> None:
    moved = tmp_path / "alone.mcap"
    moved.write_bytes(next((run / "foreign").glob("*.mcap")).read_bytes())
    assert replay([str(moved)]) == 2
    assert replay([str(moved), "--config", str(SHORT_FLIGHT)]) == EQUAL
