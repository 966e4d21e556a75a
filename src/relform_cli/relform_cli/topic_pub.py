"""``ros2 topic pub``."""

import sys
import time
from argparse import ArgumentParser, Namespace
from itertools import count, islice
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.time import Time

from relform_cli.argument_types import non_negative_int, positive_float
from relform_cli.completion import completed_by
from relform_cli.errors import CommandError
from relform_cli.graph import add_spin_arguments, graph_node, spin
from relform_cli.interfaces import message_class
from relform_cli.message_fields import message_from_yaml
from relform_cli.message_text import to_yaml
from relform_cli.qos import add_qos_arguments, qos_profile
from relform_cli.topic_names import add_topic_argument, complete_message_type

WAIT_PERIOD_S = 0.1
POLLS_PER_NOTICE = 10

CLOCK_WAIT_S = 5.0
"""How long the first message waits for the simulation time that it is stamped with."""


def add_arguments(parser: ArgumentParser) -> None:
    add_topic_argument(parser)
    completed_by(
        complete_message_type,
        parser.add_argument("message_type", help="such as std_msgs/msg/String"),
    )
    values = parser.add_mutually_exclusive_group()
    completed_by(
        complete_values,
        values.add_argument("values", nargs="?", default="{}", help='YAML, such as "data: hello"'),
    )
    values.add_argument("--stdin", action="store_true", help="read the values from stdin")
    add = parser.add_argument
    add("-r", "--rate", type=positive_float, default=1.0, metavar="HZ", help="default: 1")
    add("-p", "--print", type=int, default=1, metavar="N", help="show every N-th message (default: 1)")
    times = parser.add_mutually_exclusive_group()
    times.add_argument("-1", "--once", action="store_true", help="publish once and exit")
    times.add_argument(
        "-t",
        "--times",
        type=non_negative_int,
        default=0,
        metavar="N",
        help="publish N times and exit",
    )
    add(
        "-w",
        "--wait-matching-subscriptions",
        type=non_negative_int,
        metavar="N",
        help="wait for this many subscriptions first (default: 1 with --once or --times, else 0)",
    )
    add(
        "--max-wait-time-secs", type=positive_float, metavar="SECONDS", help="give up waiting after this time"
    )
    add(
        "--keep-alive",
        type=positive_float,
        default=0.1,
        metavar="SECONDS",
        help="keep the node this long after the last message, so that it is sent (default: 0.1)",
    )
    add("-n", "--node-name", metavar="NAME", help="name of the publishing node")
    add_qos_arguments(parser, preset="default")
    add_spin_arguments(parser)


def complete_values(parsed_args: Namespace, **_: object) -> list[str]:
    return [to_yaml(message_class(parsed_args.message_type)())]


def publish(arguments: Namespace) -> None:
    """Publish a message once or repeatedly."""
    n_times = 1 if arguments.once else arguments.times
    wait_for = arguments.wait_matching_subscriptions
    if wait_for is None:
        wait_for = 1 if n_times else 0
    if wait_for == 0 and arguments.max_wait_time_secs is not None:
        raise CommandError(
            "--max-wait-time-secs option is only effective "
            "with --wait-matching-subscriptions, --once or --times"
        )
    type_ = message_class(arguments.message_type)
    message, times = message_from_yaml(type_, sys.stdin.read() if arguments.stdin else arguments.values)
    with graph_node(arguments, arguments.node_name) as node:
        publisher = node.create_publisher(type_, arguments.topic_name, qos_profile(arguments))
        if arguments.spin_time is not None:
            time.sleep(arguments.spin_time)
        wait_for_subscriptions(publisher, wait_for, arguments.max_wait_time_secs)
        if times and arguments.use_sim_time:
            wait_for_clock(node)
        print("publisher: beginning loop")
        numbers = count(1)
        due = 1

        def tick() -> None:
            nonlocal due
            due += 1

        def is_done() -> bool:
            nonlocal due
            for number in islice(numbers, due):
                set_times(times, node.get_clock().now())
                if arguments.print and number % arguments.print == 0:
                    print(f"publishing #{number}: {message!r}\n")
                publisher.publish(message)
                if number == n_times:
                    return True
            due = 0
            return False

        node.create_timer(1.0 / arguments.rate, tick)
        spin(node, is_done)
        time.sleep(arguments.keep_alive)


def set_times(times: list[Any], now: Time) -> None:
    sec, nanosec = now.seconds_nanoseconds()
    for stamp in times:
        stamp.sec, stamp.nanosec = sec, nanosec


def wait_for_clock(node: Node) -> None:
    """Wait until /clock has set the time of a node; after CLOCK_WAIT_S continue with time 0 and say so."""
    clock = node.get_clock()
    deadline = time.monotonic() + CLOCK_WAIT_S
    spin(node, lambda: clock.now().nanoseconds > 0 or time.monotonic() > deadline)
    if clock.now().nanoseconds == 0:
        print(f"No time on /clock within {CLOCK_WAIT_S:g} s: stamps are 0 until it arrives", file=sys.stderr)


def wait_for_subscriptions(publisher: Publisher, wanted: int, longest_s: float | None) -> None:
    """Wait until a number of subscriptions exists.

    Raises:
        CommandError: there are fewer after ``longest_s``.
    """
    start = time.monotonic()
    for poll in count():
        found = publisher.get_subscription_count()
        if found >= wanted:
            return
        if poll % POLLS_PER_NOTICE == 0:
            print(f"Waiting for at least {wanted} matching subscription(s)...")
        if longest_s is not None and time.monotonic() - start >= longest_s:
            raise CommandError(
                f"Timed out waiting for subscribers: "
                f"Expected {wanted} subscribers but only got {found} subscribers"
            )
        time.sleep(WAIT_PERIOD_S)
