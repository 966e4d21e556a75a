"""The node ``visualization``: it draws a flight, live or played from a bag, for RViz and other tools of ROS.

It only listens: no step waits for it, and what it misses is gone. So it can neither stop nor change a flight.
"""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

import rclpy
from nav_msgs.msg import Odometry as OdometryMsg
from nav_msgs.msg import Path as PathMsg
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from relform_bringup.nodes.scene_messages import marker_to_msg, path_to_msg, transform_to_msg
from relform_bringup.scene.path_ahead import PathAhead
from relform_bringup.scene.poses import Pose, estimated_poses, upright, wanted_places
from relform_bringup.scene.shapes import obstacle_shapes, target_shapes, team_shapes, vehicle_colour
from relform_bringup.scene.trail import Due, Trail
from relform_bringup.scene.urdf import robot_description, rotor_frame, rotor_places
from relform_core.arrays import Array
from relform_core.load import LoadedScenario
from relform_core.names import (
    GROUND_TRUTH,
    MARKERS,
    PATH,
    REFERENCE_PATH,
    ROBOT_DESCRIPTION,
    TF,
    TF_STATIC,
    VISUALIZATION_NODE,
    split_node_name,
    vehicle_topic,
)
from relform_core.roster import Roster
from relform_core.sensors.imu import IMU
from relform_core.telemetry import PerStep, TeamReference
from relform_core.units import seconds_to_ns
from relform_msgs.msg import FormationReference, FormationState
from relform_ros.fields import body_frame
from relform_ros.odometry import odometry_from_msg
from relform_ros.parameters import read_scenario
from relform_ros.qos import LATCHED, LOCKSTEP
from relform_ros.raw import decoded, raw_stamp_ns, subscribe_raw
from relform_ros.rejection import RejectionError
from relform_ros.run_node import run_node
from relform_ros.sensors.wire import wire
from relform_ros.spinner import Spinner, StopRequestedError
from relform_ros.telemetry import reference_from_msg, state_from_msg

DEPTH = 10
"""Messages of a topic that wait until this node has time for them."""
BESIDE = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
"""A writer does not wait for such a reader."""
TRUTH_PREFIX = "truth/"
"""Of the frames of the true poses."""
FRAMES_NS, MARKERS_NS, PATHS_NS = seconds_to_ns(0.05), seconds_to_ns(0.1), seconds_to_ns(0.5)
"""Simulation time from one message to the next."""
SPACING_NS, LENGTH = seconds_to_ns(0.1), 600
"""Of the poses of a path: a minute behind, and a minute ahead."""


class Visualization:
    """Publishes what tools of ROS draw, from the messages of a flight."""

    def __init__(self, node: Node, spinner: Spinner, scenario: LoadedScenario) -> None:
        self._node = node
        self._spinner = spinner
        self._config = config = scenario.config
        self._vehicles = config.team.vehicles
        self._leader = config.team.leader
        self._imus = {name: deque[bytes](maxlen=DEPTH) for name in self._vehicles}
        """The newest messages of each vehicle, the oldest first."""
        self._reference: PerStep[TeamReference] | None = None
        self._ahead = PathAhead(config)
        self._followed = Trail(SPACING_NS, LENGTH)
        """What the leader's reference was."""
        self._flown = {name: Trail(SPACING_NS, LENGTH) for name in self._vehicles}
        self._frames_due, self._markers_due, self._paths_due = map(Due, (FRAMES_NS, MARKERS_NS, PATHS_NS))
        self._truth_due = {name: Due(FRAMES_NS) for name in self._vehicles}
        self._latched = [self._describe(name) for name in self._vehicles]
        self._latched.append(self._publish_rotor_frames())
        self._tf = node.create_publisher(TFMessage, TF, LOCKSTEP)
        self._markers = node.create_publisher(MarkerArray, MARKERS, LOCKSTEP)
        self._paths = {name: self._path_publisher(name, PATH) for name in self._vehicles}
        self._reference_path = self._path_publisher(self._leader, REFERENCE_PATH)
        controller = Roster.of(config).commander(self._leader)
        self._listen(FormationState, controller.state, self._on_state)
        self._listen(FormationReference, controller.reference, self._on_reference)
        for name in self._vehicles:
            imus, truths = vehicle_topic(name, IMU.name), vehicle_topic(name, GROUND_TRUTH)
            self._listen(wire(IMU).MESSAGE, imus, self._imus[name].append)
            self._listen(OdometryMsg, truths, partial(self._on_truth, name))

    async def run(self) -> None:
        """Draw until a signal arrives."""
        with suppress(StopRequestedError):
            while True:
                self._spinner.once()

    def _describe(self, vehicle: str) -> Publisher:
        publisher = self._node.create_publisher(String, vehicle_topic(vehicle, ROBOT_DESCRIPTION), LATCHED)
        colour = vehicle_colour(self._config, vehicle)
        model = robot_description(vehicle, body_frame(vehicle), self._config.vehicle, colour)
        publisher.publish(String(data=model))
        return publisher

    def _publish_rotor_frames(self) -> Publisher:
        publisher = self._node.create_publisher(TFMessage, TF_STATIC, LATCHED)
        transforms = [
            transform_to_msg(0, place, rotor_frame(name, rotor), parent=body_frame(name))
            for name in self._vehicles
            for rotor, place in rotor_places(self._config.vehicle).items()
        ]
        publisher.publish(TFMessage(transforms=transforms))
        return publisher

    def _path_publisher(self, vehicle: str, name: str) -> Publisher:
        return self._node.create_publisher(PathMsg, vehicle_topic(vehicle, name), LOCKSTEP)

    def _listen(self, type_: type[Any], topic: str, take: Callable[[bytes], None]) -> None:
        def take_it(data: bytes, publish_time_ns: int) -> None:
            try:
                take(data)
            except RejectionError as rejected:
                self._node.get_logger().warning(f"{topic}: {rejected}", once=True)

        subscribe_raw(self._node, type_, topic, take_it, BESIDE)

    def _on_state(self, data: bytes) -> None:
        stamp_ns = raw_stamp_ns(data)
        if not self._frames_due(stamp_ns):
            return
        state = state_from_msg(decoded(data, FormationState), self._vehicles).value
        poses = estimated_poses(state, self._attitudes(stamp_ns), self._leader)
        frames = [transform_to_msg(stamp_ns, pose, body_frame(name)) for name, pose in poses.items()]
        self._tf.publish(TFMessage(transforms=frames))
        for name, pose in poses.items():
            self._flown[name].add(stamp_ns, pose)
        if self._markers_due(stamp_ns):
            self._publish_markers(stamp_ns, poses)
        if self._paths_due(stamp_ns):
            self._publish_paths(stamp_ns)

    def _on_reference(self, data: bytes) -> None:
        self._reference = reference_from_msg(decoded(data, FormationReference), self._vehicles)
        reference = self._reference.value
        self._followed.add(self._reference.stamp_ns, upright(reference.p_NB_N, reference.yaw_NB))

    def _on_truth(self, vehicle: str, data: bytes) -> None:
        if not self._truth_due[vehicle](raw_stamp_ns(data)):
            return
        truth = odometry_from_msg(decoded(data, OdometryMsg), vehicle)
        frame = TRUTH_PREFIX + body_frame(vehicle)
        transform = transform_to_msg(truth.stamp_ns, Pose(truth.p_NB_N, truth.q_NB), frame)
        self._tf.publish(TFMessage(transforms=[transform]))

    def _attitudes(self, stamp_ns: int) -> dict[str, Array]:
        """By the IMUs at an instant, or the last one before it that arrived."""
        wired = wire(IMU)
        attitudes = {}
        for name, readings in self._imus.items():
            if readings:
                until_then = (data for data in reversed(readings) if raw_stamp_ns(data) <= stamp_ns)
                message = decoded(next(until_then, readings[-1]), wired.MESSAGE)
                attitudes[name] = wired.from_msg(message, name, self._vehicles).q_NB
        return attitudes

    def _publish_markers(self, stamp_ns: int, poses: dict[str, Pose]) -> None:
        shapes = [*obstacle_shapes(self._config), *team_shapes(self._config, poses)]
        if self._reference is not None:
            places = wanted_places(self._reference.value, self._leader)
            shapes += target_shapes(self._config, places)
        self._markers.publish(MarkerArray(markers=[marker_to_msg(stamp_ns, shape) for shape in shapes]))

    def _publish_paths(self, stamp_ns: int) -> None:
        for name, trail in self._flown.items():
            self._paths[name].publish(path_to_msg(stamp_ns, trail))
        if (reference := self._reference) is not None:
            ahead = self._ahead.after(reference.step, reference.value, SPACING_NS, LENGTH)
            self._reference_path.publish(path_to_msg(stamp_ns, [*self._followed, *ahead]))


def build_visualization(node: Node, spinner: Spinner) -> Visualization:
    """The logic of the node, by its parameters.

    Raises:
        ConfigError: the parameter ``scenario`` is missing or not usable.
    """
    return Visualization(node, spinner, read_scenario(node))


def main() -> int:
    """Run the node."""
    name = split_node_name(VISUALIZATION_NODE)[1]
    return run_node(lambda: rclpy.create_node(name, enable_rosout=False), build_visualization)
