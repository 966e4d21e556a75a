"""Topics: list them, show and publish messages, measure rates."""

from argparse import ArgumentParser, Namespace

from relform_cli import topic_echo, topic_pub, topic_rates
from relform_cli.commands import VerbParsers
from relform_cli.discovery import discover, discover_all
from relform_cli.errors import CommandError
from relform_cli.graph import add_graph_arguments, graph_node, topics
from relform_cli.listing import (
    add_find_arguments,
    add_hidden_argument,
    add_list_arguments,
    print_found,
    print_list,
)
from relform_cli.topic_names import add_topic_argument, topic_types


def add_arguments(parser: ArgumentParser) -> None:
    add_hidden_argument(parser, "topics", default=False)
    verbs = VerbParsers(parser)

    verb = verbs.add("list", list_topics)
    add_list_arguments(verb, "topics")
    verb.add_argument(
        "-v", "--verbose", action="store_true", help="show the numbers of publishers and subscribers"
    )

    verb = verbs.add("info", info)
    add_graph_arguments(verb)
    add_topic_argument(verb)
    verb.add_argument(
        "-v", "--verbose", action="store_true", help="show every publisher and subscriber with its QoS"
    )

    verb = verbs.add("type", print_type)
    add_graph_arguments(verb)
    add_topic_argument(verb)

    add_find_arguments(verbs.add("find", find), "topics", "msg")
    topic_echo.add_arguments(verbs.add("echo", topic_echo.echo))
    topic_pub.add_arguments(verbs.add("pub", topic_pub.publish))
    topic_rates.add_hz_arguments(verbs.add("hz", topic_rates.hz))
    topic_rates.add_bw_arguments(verbs.add("bw", topic_rates.bw))
    topic_rates.add_delay_arguments(verbs.add("delay", topic_rates.delay))


def list_topics(arguments: Namespace) -> None:
    """List the topics."""
    with graph_node(arguments) as node:
        discover_all(node, arguments)
        found = topics(node, arguments.include_hidden)
        if arguments.verbose and not arguments.count:
            publishers = [(name, types, node.count_publishers(name)) for name, types in found]
            subscribers = [(name, types, node.count_subscribers(name)) for name, types in found]
            print_counts("Published", "publisher", publishers)
            print_counts("Subscribed", "subscriber", subscribers)
        else:
            print_list(found, arguments)


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
        types = dict(topics(node, arguments.include_hidden)).get(name, [])
    for type_ in types:
        print(type_)
    return 0 if types else 1


def find(arguments: Namespace) -> None:
    """List the topics of a type."""
    with graph_node(arguments) as node:
        discover_all(node, arguments)
        print_found(topics(node, arguments.include_hidden), arguments)
