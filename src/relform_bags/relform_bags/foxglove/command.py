"""The command line that copies a bag for 3D views, with poses and paths that they can draw."""

from collections.abc import Sequence
from pathlib import Path

from relform_bags.reader import BagAttachment, BagMessage, find_bag, read_bag
from relform_bags.writer import BagWriter
from relform_core.errors import BagError
from relform_core.names import GROUND_TRUTH
from relform_core.script import CommandParser, command

FOLDER = "foxglove"


@command
def main(arguments: Sequence[str] | None = None) -> int:
    """Write the bag; returns the exit code."""
    parser = CommandParser(
        prog="foxglove",
        description="Copy a recorded flight into a bag that Foxglove draws in 3D as well, by adding pose and "
        "path of each vehicle. Open it with the layout config/foxglove_layout.json.",
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="bag, or folder of a run")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help=f"new bag (default: {FOLDER}/ beside the old)"
    )
    options = parser.parse_args(arguments)
    source = find_bag(options.bag)
    folder = source if source.is_dir() else source.parent
    out = options.out or folder.parent / FOLDER
    write_drawable_bag(source, out)
    print(out)
    return 0


def write_drawable_bag(source: Path, out: Path) -> None:
    """Copy a bag, by log time, with poses and paths added.

    Raises:
        BagError: the source cannot be read or has nothing to draw, or the copy cannot be written.
    """
    from relform_bags.foxglove.from_bag import drawable_poses  # needs ROS, the help does not
    from relform_bags.from_bag import as_installed

    entries = list(read_bag(source))
    messages = [as_installed(entry) for entry in entries if isinstance(entry, BagMessage)]
    poses = list(drawable_poses(messages))
    if not poses:
        raise BagError(f"{source}: nothing to draw: the bag has no topic <vehicle>/{GROUND_TRUTH}")
    messages += poses
    messages.sort(key=lambda message: message.log_time_ns)
    attachments = {entry.name: entry.text for entry in entries if isinstance(entry, BagAttachment)}
    with BagWriter(out, attachments) as writer:
        for topic, type_name in {message.topic: message.type_name for message in messages}.items():
            writer.add_topic(topic, type_name, [])
        for message in messages:
            writer.write(message.topic, message.data, message.log_time_ns, message.publish_time_ns)
