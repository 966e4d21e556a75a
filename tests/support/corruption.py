"""Messages as no node of a flight sends them: corrupted, repeated, from the past and from the future."""

import array
import copy
import math
from collections.abc import Callable, Iterator, Sequence
from random import Random
from typing import Any

import numpy as np

from relform_ros.fields import stamp_from_msg, stamp_to_msg

NOT_FINITE = (math.nan, math.inf, -math.inf)
FUTURE_STEPS, PAST_STEPS = (25, 2000), (1, 60)
"""How far stamps are moved. One that is ahead by less may belong to a node that is ahead."""
_UNREAD = frozenset({"reason", "radiation_type", "fault", "configuration", "sent"})
"""Fields with which a message is as good as the right one, or which say nothing that could be checked."""

Changed = Callable[[Any], None]
"""Spoils a message."""


def strange_message(message: Any, period_ns: int, random: Random) -> Any:
    """What a stranger sends that has heard a message: a spoilt copy, the same, an old or an early one."""
    strange = copy.deepcopy(message)
    kind = random.choice(("spoilt", "spoilt", "same", "past", "future", "no instant"))
    if kind == "spoilt":
        random.choice(list(_changes(strange)))(strange)
    elif kind == "no instant" and not hasattr(strange, "step"):
        _move(strange, random.randint(1, period_ns - 1), 0)
    elif kind in ("past", "future"):
        steps = random.randint(*FUTURE_STEPS) if kind == "future" else -random.randint(*PAST_STEPS)
        _move(strange, steps * period_ns, steps)
    return strange


def _move(message: Any, by_ns: int, by_steps: int) -> None:
    """Move the stamp of a message; one before the flight becomes invalid."""
    stamp = _stamp(message)
    moved_ns = stamp_from_msg(stamp) + by_ns
    if moved_ns < 0:
        stamp.sec = -1
    else:
        moved = stamp_to_msg(moved_ns)
        stamp.sec, stamp.nanosec = moved.sec, moved.nanosec
    if hasattr(message, "step"):
        message.step = max(message.step + by_steps, -7)
        if message.step in (-2, -1):  # it joins, or is ready
            message.step = -7


def _stamp(message: Any) -> Any:
    return message.header.stamp if hasattr(message, "header") else message.clock


def _changes(message: Any) -> Iterator[Changed]:
    """Everything that spoils a message."""
    yield lambda msg: setattr(_stamp(msg), "nanosec", 2_000_000_000)
    yield lambda msg: setattr(_stamp(msg), "sec", -5)
    if hasattr(message, "step"):
        yield lambda msg: setattr(msg, "step", -2_000_000_000)
        yield lambda msg: msg.sent.append("/leader/imu")
    yield from _of_fields(message, ())


def _of_fields(message: Any, path: tuple[Any, ...]) -> Iterator[Changed]:
    for name in message.get_fields_and_field_types():
        value, where = getattr(message, name), (*path, name)
        if name in _UNREAD or name in ("stamp", "clock", "step", "sent_stamps", "command_stamp"):
            continue
        if name == "period":
            yield _setter((*where, "nanosec"), 7)
        elif name in ("mode", "request"):
            yield _setter(where, 99)
        elif isinstance(value, str):
            yield from (_setter(where, other) for other in ("", "ufo", "ufo/base_link"))
        elif isinstance(value, float):
            yield from (_setter(where, other) for other in _bad_numbers(name))
        elif isinstance(value, np.ndarray | array.array):
            yield from _of_numbers(value, where)
        elif isinstance(value, Sequence):
            for index, item in enumerate(value):
                yield from _of_fields(item, (*where, index))
            if value:
                yield lambda msg, where=where: _repeat_first(msg, where)
        elif hasattr(value, "get_fields_and_field_types"):
            yield from _of_fields(value, where)


def _bad_numbers(name: str) -> tuple[float, ...]:
    if name == "range":  # of a sonar, infinite ranges say that there is nothing near
        return (math.nan, -1.0)
    return (*NOT_FINITE, -1.0) if name.endswith("_range") else NOT_FINITE


def _of_numbers(values: Any, where: tuple[Any, ...]) -> Iterator[Changed]:
    is_covariance = "covariance" in where[-1]
    for index in range(len(values)):
        yield from (_setter((*where, index), other) for other in NOT_FINITE)
        if not is_covariance:
            yield from (_setter((*where, index), other) for other in (-1.0, 1e300))
    if is_covariance:
        yield _setter((*where, 0), -0.5)
    if isinstance(values, array.array) and values:
        yield lambda msg: _at(msg, where).pop()
        yield lambda msg: _at(msg, where).append(1.5)


def _repeat_first(message: Any, where: tuple[Any, ...]) -> None:
    items = _at(message, where)
    items.append(copy.deepcopy(items[0]))


def _setter(path: tuple[Any, ...], value: Any) -> Changed:
    def change(message: Any) -> None:
        parent, last = _at(message, path[:-1]), path[-1]
        if isinstance(last, int):
            parent[last] = value
        else:
            setattr(parent, last, value)

    return change


def _at(message: Any, path: tuple[Any, ...]) -> Any:
    for name in path:
        message = message[name] if isinstance(name, int) else getattr(message, name)
    return message
