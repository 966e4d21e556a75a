"""Look at, record and play bags."""

import json
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path

from relform_bags.info import format_information, read_information
from relform_bags.ros2bag.arguments import add_info_arguments, add_play_arguments, add_record_arguments
from relform_bags.split_limits import SplitLimits
from relform_cli.commands import VerbParsers
from relform_cli.errors import CommandError
from relform_core.errors import RelformError

INTERRUPTED = 130
"""Of a node that a signal has ended, as one ends ``ros2 bag``: with success."""
Value = bool | int | float | str | list[str]


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs."""
    verbs = VerbParsers(parser)
    add_info_arguments(verbs.add("info", info))
    add_play_arguments(verbs.add("play", play))
    add_record_arguments(verbs.add("record", record))


def info(arguments: Namespace) -> None:
    """Say what a bag holds."""
    try:
        information = read_information(arguments.bag_path)
    except RelformError as error:
        raise _failure(error) from None
    if not information.is_closed:
        hint = f"complete it with scripts/record.py --recover {arguments.bag_path}"
        print(f"{arguments.bag_path} was not closed: {hint}", file=sys.stderr)
    if arguments.topic_name and not arguments.verbose:
        for topic in information.topics:
            print(topic["topic_metadata"]["name"])
    else:
        print(format_information(information))


def play(arguments: Namespace) -> int:
    """Publish the messages of a bag again."""
    from relform_bags.nodes.player import main

    for rule in arguments.remap:
        if not all(rule.partition(":=")):
            raise _failure(f"remap rule '{rule}' is not of the form old_topic:=new_topic")
    acks_ms = arguments.wait_for_all_acked
    until_ns = round(arguments.playback_until_sec * 1e9)
    parameters: dict[str, Value] = {
        "bag": str(arguments.bag_path),
        "rate": arguments.rate,
        "loop": arguments.loop,
        "start_paused": arguments.start_paused,
        "delay_s": arguments.delay,
        "start_offset_s": arguments.start_offset,
        "duration_s": arguments.playback_duration,
        "until_ns": until_ns if until_ns >= 0 else arguments.playback_until_nsec,
        "topics": arguments.topics,
        "regex": arguments.regex,
        "exclude_topics": arguments.exclude_topics,
        "exclude_regex": arguments.exclude_regex,
        "clock_hz": arguments.clock,
        "clock_topics": arguments.clock_topics,
        "clock_topics_all": arguments.clock_topics_all,
        "keyboard": not arguments.disable_keyboard_controls,
    }
    if acks_ms is not None:
        parameters["ack_wait_s"] = acks_ms / 1000.0
    return _run(main, "rosbag2_player", parameters, arguments.log_level, arguments.remap)


def record(arguments: Namespace) -> int:
    """Write the messages of topics into a bag."""
    topics = arguments.topics_positional or arguments.topics
    is_general = arguments.all or arguments.regex or arguments.topic_types
    if not (is_general or topics):
        raise _failure("Need to specify at least one option out of --all, --topics, --topic-types or --regex")
    for option in ("exclude_regex", "exclude_topics", "exclude_topic_types"):
        if getattr(arguments, option) and not is_general:
            name = option.replace("_", "-")
            raise _failure(f"--{name} argument requires either --all, --topic-types or --regex")
    output = arguments.output or Path(f"rosbag2_{datetime.now():%Y_%m_%d-%H_%M_%S}")
    if output.is_dir():
        raise _failure(f"Output folder '{output}' already exists.")
    try:
        SplitLimits(arguments.max_bag_size, arguments.max_bag_duration)
    except RelformError as error:
        raise _failure(error) from None
    from relform_bags.nodes.recorder import main

    parameters: dict[str, Value] = {
        "output": str(output),
        "topics": [] if arguments.all else topics,
        "regex": "" if arguments.all else arguments.regex,
        "topic_types": [] if arguments.all else arguments.topic_types,
        "exclude_topics": arguments.exclude_topics,
        "exclude_regex": arguments.exclude_regex,
        "exclude_topic_types": arguments.exclude_topic_types,
        "include_hidden_topics": arguments.include_hidden_topics,
        "max_bag_size": arguments.max_bag_size,
        "max_bag_duration": arguments.max_bag_duration,
        "start_paused": arguments.start_paused,
        "use_sim_time": arguments.use_sim_time,
        "keyboard": not arguments.disable_keyboard_controls,
    }
    return _run(main, arguments.node_name, parameters, arguments.log_level)


def _run(
    main: Callable[[], int],
    node_name: str,
    parameters: Mapping[str, Value],
    log_level: str,
    remappings: list[str] | None = None,
) -> int:
    """Run a node as its executable would with these arguments."""
    sys.argv = ["ros2 bag", "--ros-args", "--log-level", log_level, "-r", f"__node:={node_name}"]
    for rule in remappings or []:
        sys.argv += ["-r", rule]
    for name, value in parameters.items():
        # JSON is YAML; an empty list would have no type.
        sys.argv += ["-p", f"{name}:={json.dumps(value or [''] if isinstance(value, list) else value)}"]
    code = main()
    return 0 if code == INTERRUPTED else code


def _failure(problem: object) -> CommandError:
    return CommandError(f"[ERROR] [ros2bag]: {problem}")
