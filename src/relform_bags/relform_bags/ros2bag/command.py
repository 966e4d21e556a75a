"""Look at, record and play bags."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, TypeVar

from relform_bags.options import Options, PlayerOptions, TopicRecorderOptions
from relform_bags.ros2bag.arguments import add_info_arguments, add_play_arguments, add_record_arguments
from relform_cli.commands import VerbParsers
from relform_cli.errors import CommandError
from relform_core.errors import RelformError
from relform_core.exit_codes import EXIT_INTERRUPTED


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs."""
    verbs = VerbParsers(parser)
    add_info_arguments(verbs.add("info", info))
    add_play_arguments(verbs.add("play", play))
    add_record_arguments(verbs.add("record", record))


def info(arguments: Namespace) -> None:
    """Print what a bag holds."""
    from relform_bags.info import format_information, read_information  # slow; only this verb needs it

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
    for rule in arguments.remap:
        if not all(rule.partition(":=")):
            raise _failure(f"remap rule '{rule}' is not of the form old_topic:=new_topic")
    options = _options(PlayerOptions, arguments, bag=str(arguments.bag_path))
    remappings = [argument for rule in arguments.remap for argument in ("-r", rule)]
    from relform_bags.nodes.player import main

    return _run(main, "rosbag2_player", arguments.log_level, options, remappings)


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
    output = arguments.output or f"rosbag2_{datetime.now():%Y_%m_%d-%H_%M_%S}"
    if Path(output).is_dir():
        raise _failure(f"Output folder '{output}' already exists.")
    options = _options(TopicRecorderOptions, arguments, output=output, topics=tuple(topics))
    if arguments.all:
        options = replace(options, topics=(), regex="", topic_types=())
    from relform_bags.nodes.recorder import main

    clock = ["-p", f"use_sim_time:={str(arguments.use_sim_time).lower()}"]
    return _run(main, arguments.node_name, arguments.log_level, options, clock)


OptionsT = TypeVar("OptionsT", bound=Options)


def _options(kind: type[OptionsT], arguments: Namespace, **others: Any) -> OptionsT:
    """The options of a node from a command line, some replaced by others."""
    try:
        return replace(kind.from_arguments(arguments), **others)
    except RelformError as error:
        raise _failure(error) from None


def _run(
    main: Callable[[Sequence[str]], int],
    node_name: str,
    log_level: str,
    options: Options,
    further: Sequence[str],
) -> int:
    """Run a node as its executable would with these options and further arguments of ROS."""
    ros_arguments = ["--log-level", log_level, "-r", f"__node:={node_name}", *further]
    code = main(["--ros-args", *ros_arguments, *options.parameter_arguments()])
    return 0 if code == EXIT_INTERRUPTED else code  # a signal is the usual end of ros2 bag


def _failure(problem: object) -> CommandError:
    return CommandError(f"[ERROR] [ros2bag]: {problem}")
