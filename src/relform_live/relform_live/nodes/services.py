"""The services of a flight as requests of the view: which ones there are, and their answers."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
from rclpy.client import Client
from rclpy.node import Node
from std_srvs.srv import Trigger

from relform_core.flight_modes import TeamRequest
from relform_core.names import FORMATION
from relform_core.team_config import TeamConfig
from relform_live.requests import Answer, ChangeFormation, Command, GoTo, Offer, Reply, Request
from relform_msgs.srv import GoTo as GoToSrv
from relform_msgs.srv import SetFormation
from relform_ros.events import formation_to_msgs
from relform_ros.fields import WORLD_FRAME, point_to_msg

SET_FORMATION = f"/{FORMATION}/{TeamRequest.SET_FORMATION.value}"
GO_TO = f"/{FORMATION}/{TeamRequest.GO_TO.value}"
TRIGGER = "std_srvs/srv/Trigger"
ANSWER_S = 5.0
"""Longest time to an answer."""
ORDER = [request.value for request in TeamRequest]


def offer_of(services: Mapping[str, list[str]]) -> Offer:
    """The requests that services stand for.

    Args:
        services: types by name, of the whole graph.
    """
    commands = [
        Command(name)
        for name, types in services.items()
        if name.startswith(f"/{FORMATION}/") and TRIGGER in types
    ]
    return Offer(tuple(sorted(commands, key=_rank)), SET_FORMATION in services, GO_TO in services)


def _rank(command: Command) -> tuple[int, str]:
    """The known requests in their order, then others by name."""
    name = command.service.rpartition("/")[2]
    return (ORDER.index(name) if name in ORDER else len(ORDER)), command.service


@dataclass(eq=False)
class _Asked:
    reply: Reply
    client: Client
    message: Any
    deadline: float
    future: Any = None
    """None: the server is not found yet."""

    def answer(self) -> Answer | None:
        """The answer; None: there is none yet."""
        if self.future is None and self.client.service_is_ready():
            self.future = self.client.call_async(self.message)
        if self.future is not None and self.future.done():
            return Answer(self.future.result().success, self.future.result().message)
        if time.monotonic() > self.deadline:
            return Answer(False, f"{self.client.srv_name} does not answer within {ANSWER_S:g} s")
        return None


class Services:
    """Sends requests and hands on the answers; ``submit`` may be called from any thread."""

    def __init__(self, node: Node) -> None:
        self.team: TeamConfig | None = None
        """Of the flight that is shown; None: there is none."""
        self._node = node
        self._clients: dict[str, Client] = {}
        self._submitted: SimpleQueue[tuple[Request, Reply]] = SimpleQueue()
        self._asked: list[_Asked] = []

    def offer(self) -> Offer:
        """What the running nodes take now."""
        return offer_of(dict(self._node.get_service_names_and_types()))

    def submit(self, request: Request, reply: Reply) -> None:
        """Make a request; ``work`` sends it."""
        self._submitted.put((request, reply))

    def work(self) -> None:
        """Send what was submitted, and hand on what was answered."""
        while (submitted := self._next()) is not None:
            self._send(*submitted)
        waiting = []
        for asked in self._asked:
            if (answer := asked.answer()) is None:
                waiting.append(asked)
            else:
                asked.reply(answer)
        self._asked = waiting

    def _next(self) -> tuple[Request, Reply] | None:
        try:
            return self._submitted.get_nowait()
        except Empty:
            return None

    def _send(self, request: Request, reply: Reply) -> None:
        if self.team is None:
            reply(Answer(False, "no flight is running"))
            return
        name, type_, message = _call_of(request, self.team)
        if name not in self._clients:
            self._clients[name] = self._node.create_client(type_, name)
        self._asked.append(_Asked(reply, self._clients[name], message, time.monotonic() + ANSWER_S))


def _call_of(request: Request, team: TeamConfig) -> tuple[str, Any, Any]:
    """Name, type and message of the service call that makes a request."""
    match request:
        case Command(service):
            return service, Trigger, Trigger.Request()
        case ChangeFormation(places):
            formation = formation_to_msgs(places, team)
            return SET_FORMATION, SetFormation, SetFormation.Request(formation=formation)
        case GoTo(place, yaw):
            message = GoToSrv.Request(frame_id=WORLD_FRAME, position=point_to_msg(np.array(place)))
            if yaw is not None:
                message.turn, message.yaw = True, yaw
            return GO_TO, GoToSrv, message
