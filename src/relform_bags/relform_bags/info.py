"""The text of ``ros2 bag info`` for a bag, in the layout of rosbag2."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from relform_bags.metadata import METADATA_FILE
from relform_bags.reader import bag_files, check_not_compressed
from relform_bags.records import MESSAGES_COMPRESSED
from relform_bags.scan import information_of, scan_bag
from relform_core.errors import BagError
from relform_core.run_folder import RunFolder
from relform_core.units import NANOSECONDS_PER_SECOND

HEADING_WIDTH = 19


@dataclass(frozen=True)
class BagInformation:
    """Content of metadata.yaml or, without that file, the same from the bag itself."""

    content: Mapping[str, Any]
    size: int
    """Bytes."""
    is_closed: bool
    """Whether its recorder has closed it."""

    @property
    def topics(self) -> list[Mapping[str, Any]]:
        """The topics of messages."""
        return [topic for topic in self._topics if not _is_service(topic["topic_metadata"])]

    @property
    def services(self) -> list[Mapping[str, Any]]:
        """The topics of the events of services."""
        return [topic for topic in self._topics if _is_service(topic["topic_metadata"])]

    @property
    def _topics(self) -> Sequence[Mapping[str, Any]]:
        topics: Sequence[Mapping[str, Any]] = self.content["topics_with_message_count"]
        return topics


def read_information(path: Path | str) -> BagInformation:
    """Summarize a bag from its metadata.yaml or, if it was not closed, from its messages.

    Args:
        path: one file, the bag's folder or the folder of a run.
    Raises:
        BagError: the bag does not exist or cannot be read.
    """
    path = Path(path)
    for folder in (path, RunFolder(path).bag):
        if (folder / METADATA_FILE).is_file():
            check_not_compressed(folder)
            size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
            return BagInformation(_read_metadata(folder / METADATA_FILE), size, is_closed=True)
    files = bag_files(path)
    scans = scan_bag(files)
    return BagInformation(
        information_of(scans),
        sum(file.stat().st_size for file in files),
        is_closed=all(scan.was_complete for scan in scans),
    )


def _read_metadata(file: Path) -> Mapping[str, Any]:
    try:
        information: Mapping[str, Any] = YAML(typ="safe", pure=True).load(file)["rosbag2_bagfile_information"]
        format_information(BagInformation(information, 0, is_closed=True))
    except OSError as error:
        raise BagError(f"{file}: cannot be read: {error.strerror}") from None
    except (YAMLError, UnicodeDecodeError, LookupError, TypeError, ValueError, AttributeError):
        raise BagError(f"{file}: not the metadata of a bag") from None
    if str(information.get("compression_mode")).lower() == "message":
        raise BagError(f"{file.parent}: {MESSAGES_COMPRESSED}")
    return information


def format_information(information: BagInformation) -> str:
    """The text, without the final line break."""
    content = information.content
    duration_ns = int(content["duration"]["nanoseconds"])
    start_ns = int(content["starting_time"]["nanoseconds_since_epoch"])
    topics, services = information.topics, information.services
    messages = content["message_count"] - sum(service["message_count"] for service in services)
    lines = [
        "",
        *_listed("Files:", content["relative_file_paths"], HEADING_WIDTH),
        _line("Bag size:", _size(information.size)),
        _line("Storage id:", content["storage_identifier"]),
        _line("ROS Distro:", content.get("ros_distro") or "unknown"),
        _line("Duration:", f"{_seconds(duration_ns)}s"),
        _line("Start:", _instant(start_ns)),
        _line("End:", _instant(start_ns + duration_ns)),
        _line("Messages:", str(messages)),
        *_listed("Topic information:", [_entry("Topic", "Count", topic) for topic in topics], HEADING_WIDTH),
        _line("Service:", str(len(services))),
        *_listed(
            "Service information:",
            [_entry("Service", "Event Count", service) for service in services],
            HEADING_WIDTH + 2,
        ),
    ]
    return "\n".join(lines)


def _line(heading: str, value: str) -> str:
    return f"{heading:{HEADING_WIDTH}}{value}"


def _listed(heading: str, values: Sequence[str], width: int) -> list[str]:
    first, *others = values or [""]
    return [f"{heading:{width}}{first}", *(" " * width + value for value in others)]


def _entry(kind: str, count: str, topic: Mapping[str, Any]) -> str:
    metadata = topic["topic_metadata"]
    return " | ".join(
        (
            f"{kind}: {metadata['name']}",
            f"Type: {metadata['type']}",
            f"{count}: {topic['message_count']}",
            f"Serialization Format: {metadata['serialization_format']}",
        )
    )


def _is_service(topic: Mapping[str, str]) -> bool:
    is_event = "/srv/" in topic["type"] and topic["type"].endswith("_Event")
    return is_event and topic["name"].endswith("/_service_event")


def _size(size: float) -> str:
    units = iter(("B", "KiB", "MiB", "GiB"))
    for unit in units:
        if size < 1024.0:
            return f"{size:.{0 if unit == 'B' else 1}f} {unit}"
        size /= 1024.0
    return f"{size:.1f} TiB"


def _seconds(time_ns: int) -> str:
    return "{}.{:09}".format(*divmod(time_ns, NANOSECONDS_PER_SECOND))


def _instant(time_ns: int) -> str:
    """Local time, and seconds since the epoch."""
    seconds, nanoseconds = divmod(time_ns, NANOSECONDS_PER_SECOND)
    return f"{datetime.fromtimestamp(seconds):%b %e %Y %H:%M:%S}.{nanoseconds:09} ({_seconds(time_ns)})"
