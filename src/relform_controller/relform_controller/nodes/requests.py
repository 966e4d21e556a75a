"""Services and the trajectory topic by which a team is asked to take off, fly and land."""

import math
from collections.abc import Callable
from functools import partial

from geometry_msgs.msg import Transform
from rclpy.node import Node
from std_srvs.srv import Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory

from relform_controller.flight_director import FlightDirector
from relform_controller.ocp.frames import rpy_from_quaternion
from relform_controller.reference.timed_path import POINTS_MAX
from relform_core.errors import ConfigError, MessageError
from relform_core.flight_modes import TeamRequest
from relform_core.telemetry import RequestMade
from relform_core.units import NANOSECONDS_PER_SECOND
from relform_msgs.srv import GoTo
from relform_ros.fields import (
    WORLD_FRAME,
    check_frame,
    quaternion_from_msg,
    stamp_from_msg,
    vector_from_msg,
)
from relform_ros.rejection import Reason, RejectionError

WITH_VALUES = frozenset({TeamRequest.GO_TO, TeamRequest.FOLLOW_TRAJECTORY, TeamRequest.SET_FORMATION})
"""Requests that are no ``std_srvs/Trigger``."""


class RequestServices:
    """Takes requests for a flight director, which decides on them immediately.

    Args:
        node: of the controller. Requests without values are its private services, such as ``~/take_off``.
        next_step: gives the next control step, from which on a request applies; None: the flight is over.
        period_ns: length of a control step.
    """

    def __init__(
        self, node: Node, director: FlightDirector, next_step: Callable[[], int | None], period_ns: int
    ) -> None:
        self._director = director
        self._next_step = next_step
        self._period_ns = period_ns
        self._made: list[RequestMade] = []
        self.refused = 0
        """Number of requests that were refused."""
        for request in TeamRequest:
            if request not in WITH_VALUES:
                node.create_service(Trigger, f"~/{request.value}", partial(self._on_trigger, request))
        node.create_service(GoTo, "go_to", self._on_go_to)
        node.create_subscription(MultiDOFJointTrajectory, "trajectory", self._on_trajectory, 1)

    def take(self) -> list[RequestMade]:
        """The requests that were accepted since the last call."""
        made, self._made = self._made, []
        return made

    def _on_trigger(
        self, request: TeamRequest, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        response.success, response.message = self._answer(lambda step: RequestMade(request))
        return response

    def _on_go_to(self, request: GoTo.Request, response: GoTo.Response) -> GoTo.Response:
        def made(_: int) -> RequestMade:
            check_frame(request.frame_id, WORLD_FRAME, "frame_id")
            x, y, z = vector_from_msg(request.position, "position").tolist()
            yaw = request.yaw if request.turn else math.nan
            if request.turn and not math.isfinite(yaw):
                raise RejectionError(Reason.INVALID, f"yaw must be finite (got {yaw})")
            return RequestMade(TeamRequest.GO_TO, (x, y, z, yaw))

        response.success, response.message = self._answer(made)
        return response

    def _on_trajectory(self, msg: MultiDOFJointTrajectory) -> None:
        self._answer(partial(_followed, msg, self._period_ns))

    def _answer(self, read: Callable[[int], RequestMade]) -> tuple[bool, str]:
        """Make a request; returns whether it is accepted, and what to say about it."""
        try:
            if (step := self._next_step()) is None:
                raise ConfigError("the flight is over")
            made = read(step)
            self._director.request(made)
        except (ConfigError, MessageError) as error:
            self.refused += 1
            self._director.refused = str(error)
            return False, str(error)
        self._director.refused = ""
        self._made.append(made)
        return True, f"applies from step {step} on"


def _followed(msg: MultiDOFJointTrajectory, period_ns: int, next_step: int) -> RequestMade:
    """The request in a trajectory of the leader; its times count from its stamp, or from now if that is 0.

    Raises:
        RejectionError: it is in another frame or has too many points, a point has not exactly one transform,
            or see ``_place``.
    """
    check_frame(msg.header.frame_id, WORLD_FRAME, "header.frame_id")
    if len(msg.points) > POINTS_MAX:
        raise RejectionError(
            Reason.INVALID, f"trajectory may have at most {POINTS_MAX} points (got {len(msg.points)})"
        )
    begin_ns = stamp_from_msg(msg.header.stamp)
    since_now_ns = begin_ns - next_step * period_ns if begin_ns else 0
    values: list[float] = []
    for index, point in enumerate(msg.points):
        if len(point.transforms) != 1:
            raise RejectionError(
                Reason.INVALID, f"points[{index}] must have 1 transform (got {len(point.transforms)})"
            )
        after_ns = point.time_from_start.sec * NANOSECONDS_PER_SECOND + point.time_from_start.nanosec
        place = _place(point.transforms[0], f"points[{index}]")
        values += [(since_now_ns + after_ns) / NANOSECONDS_PER_SECOND, *place]
    return RequestMade(TeamRequest.FOLLOW_TRAJECTORY, tuple(values))


def _place(transform: Transform, what: str) -> tuple[float, float, float, float]:
    """x, y, z [m] and yaw [rad]; NaN if all elements of the quaternion are zero.

    Raises:
        RejectionError: the place is not finite, or the rotation is neither zeros nor a unit quaternion.
    """
    x, y, z = vector_from_msg(transform.translation, f"translation of {what}").tolist()
    turn, yaw = transform.rotation, math.nan
    if (turn.x, turn.y, turn.z, turn.w) != (0.0, 0.0, 0.0, 0.0):
        yaw = rpy_from_quaternion(quaternion_from_msg(turn, f"rotation of {what}"))[2]
    return x, y, z, yaw
