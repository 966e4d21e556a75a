"""Frames of /tf and /tf_static, as their messages give them."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from relform_core.arrays import Array


def parents(messages: Iterable[Any]) -> dict[str, str]:
    """The parent of each frame; fails if a frame has two, or if frames form a loop."""
    found: dict[str, str] = {}
    for transform in (each for message in messages for each in message.transforms):
        parent = found.setdefault(transform.child_frame_id, transform.header.frame_id)
        assert parent == transform.header.frame_id, f"{transform.child_frame_id} has two parents"
    for frame in found:
        ancestors, above = {frame}, found.get(frame)
        while above is not None:
            assert above not in ancestors, f"{frame} is in a loop"
            ancestors.add(above)
            above = found.get(above)
    return found


def by_stamp(messages: Iterable[Any], frame: str) -> dict[int, tuple[Array, Array]]:
    """Translation and quaternion of a frame, by stamp [ns]."""
    return {
        transform.header.stamp.sec * 1_000_000_000 + transform.header.stamp.nanosec: (
            np.array([getattr(transform.transform.translation, axis) for axis in "xyz"]),
            np.array([getattr(transform.transform.rotation, axis) for axis in "xyzw"]),
        )
        for message in messages
        for transform in message.transforms
        if transform.child_frame_id == frame
    }
