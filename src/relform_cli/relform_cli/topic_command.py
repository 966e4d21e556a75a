"""Topics: list them, show and publish messages, measure rates."""

from argparse import SUPPRESS, ArgumentParser, Namespace
from typing import Any

from relform_cli import topic_echo, topic_pub, topic_rates
from relform_cli.commands import VerbParsers
from relform_cli.completion import completed_by
from relform_cli.discovery import discover, discover_all
from relform_cli.errors import CommandError
from relform_cli.graph import NamesAndTypes, add_graph_arguments, graph_node, topics
from relform_cli.interfaces import all_interfaces
from relform_cli.topic_names import add_topic_argument, topic_types


def add_arguments(parser: ArgumentParser) -> None:
    add_hidden_argument(parser, default=False)
    verbs = VerbParsers(parser)

    verb = verbs.add("list", list_topics)
    add_graph_arguments(verb)
    verb.add_argument("-t", "--show-types", action="store_true", help="show the types as well")
    verb.add_argument("-c", "--count-topics", action="store_true", help="show only the number of topics")
    verb.add_argument(
        "-v", "--verbose", action="store_true", help="show the numbers of publishers and subscribers"
    )
    add_hidden_argument(verb)

    verb = verbs.add("info", info)
    add_graph_arguments(verb)
    add_topic_argument(verb)
    verb.add_argument(
        "-v", "--verbose", action="store_true", help="show every publisher and subscriber with its QoS"
    )

    verb = verbs.add("type", print_type)
    add_graph_arguments(verb)
    add_topic_argument(verb)

    verb = verbs.add("find", find)
    add_graph_arguments(verb)
    completed_by(
        lambda **_: all_interfaces("msg"), verb.add_argument("topic_type", help="such as std_msgs/msg/String")
    )
    verb.add_argument("-c", "--count-topics", action="store_true", help="show only the number of topics")
    add_hidden_argument(verb)

    topic_echo.add_arguments(verbs.add("echo", topic_echo.echo))
    topic_pub.add_arguments(verbs.add("pub", topic_pub.publish))
    topic_rates.add_hz_arguments(verbs.add("hz", topic_rates.hz))
    topic_rates.add_bw_arguments(verbs.add("bw", topic_rates.bw))
    topic_rates.add_delay_arguments(verbs.add("delay", topic_rates.delay))


def add_hidden_argument(parser: ArgumentParser, default: Any = SUPPRESS) -> None:
    parser.add_argument(
        "--include-hidden-topics", action="store_true", default=default, help="hidden topics as well"
    )


def discovered_topics(arguments: Namespace) -> NamesAndTypes:
    with graph_node(arguments) as node:
        discover_all(node, arguments)
        return topics(node, arguments.include_hidden_topics)


def list_topics(arguments: Namespace) -> None:
    """List the topics."""
    with graph_node(arguments) as node:
        discover_all(node, arguments)
        found = topics(node, arguments.include_hidden_topics)
        if arguments.count_topics:
            print(len(found))
        elif arguments.verbose:
            publishers = [(name, types, node.count_publishers(name)) for name, types in found]
            subscribers = [(name, types, node.count_subscribers(name)) for name, types in found]
            print_counts("Published", "publisher", publishers)
            print_counts("Subscribed", "subscriber", subscribers)
        else:
            for name, types in found:
                print(f"{name} [{', '.join(types)}]" if arguments.show_types else name)


def print_counts(participle: str, noun: str, counts: list[tuple[str, list[str], int]]) -> None:
    print(f"{participle} topics:")
    for name, types, count in counts:
        if count:
            print(f" * {name} [{', '.join(types)}] {count} {noun}{'s' if count > 1 else ''}")
    print()


def info(arguments: Namespace) -> None:
    """Show the type, the publishers and the subscribers of a topic."""
    name = arguments.topic_name
    with graph_node(arguments) as node:
        discover(node, arguments, wanted=lambda: bool(topic_types(node, name)))
        types = topic_types(node, name)
        if not types:
            raise CommandError(f"Unknown topic '{name}'")
        end = "\n\n" if arguments.verbose else "\n"
        print("Type:", types[0] if len(types) == 1 else types, end=end)
        for noun, count, endpoints in (
            ("Publisher", node.count_publishers(name), node.get_publishers_info_by_topic(name)),
            ("Subscription", node.count_subscribers(name), node.get_subscriptions_info_by_topic(name)),
        ):
            print(f"{noun} count:", count, end=end)
            for endpoint in endpoints if arguments.verbose else []:
                print(endpoint, end=end)


def print_type(arguments: Namespace) -> int:
    """Print the type of a topic."""
    name = arguments.topic_name
    with graph_node(arguments) as node:
        discover(node, arguments, wanted=lambda: bool(topic_types(node, name)), quiet_s=0.0)
        types = dict(topics(node, arguments.include_hidden_topics)).get(name, [])
    for type_ in types:
        print(type_)
    return 0 if types else 1


def find(arguments: Namespace) -> None:
    """List the topics of a type."""
    found = [name for name, types in discovered_topics(arguments) if arguments.topic_type in types]
    if arguments.count_topics:
        print(len(found))
        return
    for name in found:
        print(name)
