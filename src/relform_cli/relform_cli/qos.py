"""The --qos-* options, and the profiles that they make."""

from argparse import ArgumentParser, Namespace

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import (
    QoSDurabilityPolicy,
    QoSHistoryPolicy,
    QoSLivelinessPolicy,
    QoSPolicyEnum,
    QoSPresetProfiles,
    QoSProfile,
    QoSReliabilityPolicy,
)

POLICIES = {
    "history": QoSHistoryPolicy,
    "reliability": QoSReliabilityPolicy,
    "durability": QoSDurabilityPolicy,
    "liveliness": QoSLivelinessPolicy,
}

DEPTH_OF_LISTENERS = 1000
"""One second of messages at 1000 Hz, so that a busy terminal does not lose messages."""


def add_qos_arguments(parser: ArgumentParser, preset: str) -> None:
    profile = parser.add_argument_group("quality of service")
    profile.add_argument(
        "--qos-profile",
        choices=QoSPresetProfiles.short_keys(),
        default=preset,
        help=f"preset that the other options change (default: {preset})",
    )
    profile.add_argument(
        "--qos-depth", type=int, metavar="N", help="size of the queue (below 1: as the preset)"
    )
    for name, policy in POLICIES.items():
        profile.add_argument(f"--qos-{name}", choices=policy.short_keys())
    profile.add_argument("--qos-liveliness-lease-duration-seconds", type=float, metavar="SECONDS")


def qos_profile(arguments: Namespace) -> QoSProfile:
    """The profile of the options."""
    profile: QoSProfile = QoSPresetProfiles.get_from_short_key(arguments.qos_profile)
    for name, policy in POLICIES.items():
        if key := getattr(arguments, f"qos_{name}"):
            setattr(profile, name, policy.get_from_short_key(key))
    if (arguments.qos_liveliness_lease_duration_seconds or 0.0) > 0.0:
        profile.liveliness_lease_duration = Duration(seconds=arguments.qos_liveliness_lease_duration_seconds)
    if (arguments.qos_depth or 0) > 0:
        profile.depth = arguments.qos_depth
    elif profile.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL and profile.depth == 0:
        profile.depth = 1
    return profile


def listener_profile(node: Node, topic: str, arguments: Namespace) -> QoSProfile:
    """The profile of the options; without options, a profile that connects to all publishers."""
    profile = qos_profile(arguments)
    options = {name: value for name, value in vars(arguments).items() if name.startswith("qos_")}
    if all(value is None for name, value in options.items() if name != "qos_profile"):
        offered = [publisher.qos_profile for publisher in node.get_publishers_info_by_topic(topic)]
        if offered:
            profile.reliability = common_policy(
                [offer.reliability for offer in offered],
                QoSReliabilityPolicy.RELIABLE,
                QoSReliabilityPolicy.BEST_EFFORT,
            )
            profile.durability = common_policy(
                [offer.durability for offer in offered],
                QoSDurabilityPolicy.TRANSIENT_LOCAL,
                QoSDurabilityPolicy.VOLATILE,
            )
    # On latched topics a deep queue would request more old messages.
    if arguments.qos_depth is None and profile.durability == QoSDurabilityPolicy.VOLATILE:
        profile.depth = max(profile.depth, DEPTH_OF_LISTENERS)
    return profile


def common_policy(
    offered: list[QoSPolicyEnum], strict: QoSPolicyEnum, lenient: QoSPolicyEnum
) -> QoSPolicyEnum:
    """The strict policy if all publishers offer it, else the lenient one, which connects to all."""
    n_strict = offered.count(strict)
    if n_strict == len(offered):
        return strict
    if n_strict > 0:
        kind = f"QoS{type(strict).__name__}"
        print(
            f"Some, but not all, publishers are offering {kind}.{strict.name}. "
            f"Falling back to {kind}.{lenient.name} as it will connect to all publishers"
        )
    return lenient
