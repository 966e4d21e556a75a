"""The pipe from a node to the process that has started it."""

from collections.abc import Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection

import pytest

from relform_ros.spinner import StopRequestedError
from relform_ros.step_pipe import StepPipe, read_step_pipe
from support.ros_nodes import node_maker

STEP = [("/leader/imu", b"\x00\x01\x00\x00" + bytes(range(256))), ("/clock", b"")]


@pytest.fixture
def ends() -> Iterator[tuple[Connection, Connection]]:
    reader, writer = Pipe(duplex=False)
    with reader, writer:
        yield reader, writer


def test_steps_arrive_whole_and_then_the_end(ends: tuple[Connection, Connection]) -> None:
    reader, writer = ends
    with StepPipe(writer) as pipe:
        for step in (STEP, [], STEP[:1]):
            pipe.send(step)
    assert [reader.recv(), reader.recv(), reader.recv()] == [STEP, [], STEP[:1]]
    with pytest.raises(EOFError):
        reader.recv()


def test_nobody_reads_any_more(ends: tuple[Connection, Connection]) -> None:
    reader, writer = ends
    reader.close()
    with pytest.raises(StopRequestedError):
        StepPipe(writer).send(STEP)


def test_a_node_that_was_started_by_hand_has_no_pipe() -> None:
    with node_maker() as make:
        assert read_step_pipe(make("/recorder")) is None
