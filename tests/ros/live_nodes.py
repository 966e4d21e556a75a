"""Two nodes with known messages, for tests of the ros2 command. Run it as a program."""

from contextlib import suppress
from typing import Any

import rclpy
from geometry_msgs.msg import PoseStamped
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String, UInt8MultiArray
from std_srvs.srv import SetBool
from test_msgs.msg import UnboundedSequences, WStrings

PERIOD_S = 0.05


def declare_parameters(talker: Node) -> None:
    bounded = ParameterDescriptor(
        description="How much.",
        floating_point_range=[FloatingPointRange(from_value=0.5, to_value=10.0, step=0.5)],
    )
    talker.declare_parameter("gain", 1.5, bounded)
    digits = ParameterDescriptor(
        integer_range=[IntegerRange(from_value=0, to_value=9, step=1)], additional_constraints="a digit"
    )
    talker.declare_parameter("count", 3, digits)
    talker.declare_parameter("name.first", "Ada", ParameterDescriptor(read_only=True))
    talker.declare_parameter("name.last", "x: y")
    talker.declare_parameter("anything", descriptor=ParameterDescriptor(dynamic_typing=True))
    for name, value in (("flag", True), ("weights", [1.0, 2.5]), ("steps", [1, 2]), ("words", ["a", "b c"])):
        talker.declare_parameter(name, value)


def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
    response.success, response.message = request.data, f"set to {request.data}"
    return response


def main() -> None:
    rclpy.init()
    talker = rclpy.create_node("talker", namespace="alpha")
    listener = rclpy.create_node("listener", namespace="alpha")
    declare_parameters(talker)
    talker.create_service(SetBool, "set", answer)
    listener.create_client(SetBool, "set")

    latched = QoSProfile(depth=7, durability=DurabilityPolicy.TRANSIENT_LOCAL, deadline=Duration(seconds=1))
    best_effort = QoSProfile(depth=7, reliability=ReliabilityPolicy.BEST_EFFORT)
    pose = PoseStamped()
    pose.header.frame_id = "B1"
    pose.pose.position.x, pose.pose.position.y = 1.25, -1e-17
    lists = UnboundedSequences(string_values=["", "null", "- x", "a\nb"], float32_values=[0.5, 1e20])
    outgoing: list[tuple[Any, Any]] = [
        (talker.create_publisher(PoseStamped, "pose", latched), pose),
        (talker.create_publisher(String, "chatter", 10), String(data="it's 5 o'clock: #1")),
        (talker.create_publisher(UInt8MultiArray, "bytes", best_effort), UInt8MultiArray(data=range(200))),
        (talker.create_publisher(WStrings, "wide", 10), WStrings(wstring_value="grüße 日本")),
        (talker.create_publisher(UnboundedSequences, "lists", 10), lists),
        (talker.create_publisher(String, "_secret", 10), String(data="hidden")),
    ]
    listener.create_publisher(String, "mixed", best_effort)
    talker.create_publisher(String, "mixed", 10)
    for topic in ("chatter", "heard_only"):
        listener.create_subscription(String, topic, lambda _: None, 10)

    def publish() -> None:
        pose.header.stamp = talker.get_clock().now().to_msg()
        for publisher, message in outgoing:
            publisher.publish(message)

    talker.create_timer(PERIOD_S, publish)
    executor = SingleThreadedExecutor()
    executor.add_node(talker)
    executor.add_node(listener)
    print("ready", flush=True)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    main()
