"""Options of recorder and player: bounds, parameters of nodes, arguments of commands."""

import math
from argparse import ArgumentParser, Namespace
from typing import Any

import pytest
from ruamel.yaml import YAML

from relform_bags.options import Options, PlayerOptions, RecorderOptions, TopicRecorderOptions
from relform_bags.ros2bag.arguments import add_play_arguments, add_record_arguments
from relform_core.errors import BagError

S = 1_000_000_000


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"rate": 0.0}, "rate must be above 0 (got 0.0)"),
        ({"rate": -1.0}, "rate must be above 0 (got -1.0)"),
        ({"rate": math.inf}, "rate must be above 0 (got inf)"),
        ({"rate": math.nan}, "rate must be above 0 (got nan)"),
        ({"delay_s": -1.0}, "delay must be at least 0 s (got -1.0)"),
        ({"duration_s": math.nan}, "duration must be a number (got nan)"),
        ({"start_offset_s": -0.5}, "start offset must be at least 0 s (got -0.5)"),
        ({"start_offset_s": math.nan}, "start offset must be at least 0 s (got nan)"),
    ],
)
def test_option_out_of_bounds_is_refused(options: dict[str, float], problem: str) -> None:
    with pytest.raises(BagError) as error:
        PlayerOptions(**options)
    assert str(error.value) == problem


@pytest.mark.parametrize(
    ("options", "end_ns"),
    [
        ({}, None),
        ({"duration_s": 0.0}, 4 * S),
        ({"duration_s": 2.5}, 6 * S + S // 2),
        ({"until_ns": 5 * S}, 5 * S),
        ({"duration_s": 2.5, "until_ns": 5 * S}, 6 * S + S // 2),
        ({"duration_s": 0.5, "until_ns": 5 * S}, 5 * S),
        ({"duration_s": math.inf}, None),
    ],
)
def test_the_later_of_two_ends_applies(options: dict[str, float], end_ns: int | None) -> None:
    chosen = PlayerOptions(start_offset_s=1.0, **options)
    assert chosen.start_ns(3 * S) == 4 * S
    assert chosen.end_ns(3 * S) == end_ns


def parameters(options: Options) -> dict[str, Any]:
    """The parameters that rcl reads from the arguments of a node."""
    arguments = options.parameter_arguments()
    assert arguments[::2] == ["-p"] * (len(arguments) // 2)
    pairs = [argument.split(":=", 1) for argument in arguments[1::2]]
    return {name: YAML(typ="safe").load(value) for name, value in pairs}


def test_every_option_is_a_parameter_with_a_type() -> None:
    given = parameters(TopicRecorderOptions("a folder: [1]", topics=("/a", "b"), max_bag_size=2000))
    assert given["output"] == "a folder: [1]"
    assert given["topics"] == ["/a", "b"]
    assert given["exclude_topics"] == [""], "rcl cannot tell the type of an empty list"
    assert given["max_bag_size"] == 2000
    assert given["keyboard"] is True
    assert set(parameters(RecorderOptions())) < set(given)


def play(*arguments: str) -> Namespace:
    parser = ArgumentParser()
    add_play_arguments(parser)
    return parser.parse_args([".", *arguments])


def test_arguments_of_a_command_have_the_defaults_of_the_options() -> None:
    assert PlayerOptions.from_arguments(play()) == PlayerOptions()
    parser = ArgumentParser()
    add_record_arguments(parser)
    assert TopicRecorderOptions.from_arguments(parser.parse_args([])) == TopicRecorderOptions()


@pytest.mark.parametrize(
    ("arguments", "option", "value"),
    [
        (["--rate", "2"], "rate", 2.0),
        (["--topics", "/a", "/b"], "topics", ("/a", "/b")),
        (["--playback-until-sec", "1.5"], "until_ns", 3 * S // 2),
        (["--playback-until-nsec", "7"], "until_ns", 7),
        (["--wait-for-all-acked", "250"], "ack_wait_s", 0.25),
        (["--clock"], "clock_hz", 40.0),
        (["--disable-keyboard-controls"], "keyboard", False),
    ],
)
def test_an_argument_sets_its_option(arguments: list[str], option: str, value: object) -> None:
    options = PlayerOptions.from_arguments(play(*arguments))
    assert options == PlayerOptions(**{option: value})


def test_names_of_topics_become_absolute() -> None:
    options = PlayerOptions(topics=("a",), clock_hz=1.0, clock_topics=("b/c",))
    assert options.selection.names == ("/a",)
    assert options.selection.exclude_names == ("/clock",)
    assert options.has_clock_before("/b/c")
    assert not options.has_clock_before("/a")
