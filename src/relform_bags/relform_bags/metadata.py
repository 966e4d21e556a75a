"""The metadata of a bag, for metadata.yaml and for records in its files, as rosbag2 of ROS 2 Jazzy has it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from textwrap import indent

from ruamel.yaml import YAML

from relform_core.atomic_file import written_atomically
from relform_core.units import NANOSECONDS_PER_SECOND

METADATA_FILE = "metadata.yaml"
FORMAT_VERSION = 9
ROS_DISTRO = "jazzy"
NO_TIME_NS = 2**63 - 1
"""Starting time of a bag without messages."""


@dataclass(frozen=True)
class QosDuration:
    """A duration of a QoS policy; the default is infinite."""

    sec: int = NO_TIME_NS // NANOSECONDS_PER_SECOND
    nsec: int = NO_TIME_NS % NANOSECONDS_PER_SECOND


@dataclass(frozen=True)
class OfferedQos:
    """Quality of service of a publisher, in the words of rosbag2 (``reliable``, ``transient_local``, ...)."""

    history: str = "unknown"
    depth: int = 0
    reliability: str = "reliable"
    durability: str = "volatile"
    deadline: QosDuration = field(default_factory=QosDuration)
    lifespan: QosDuration = field(default_factory=QosDuration)
    liveliness: str = "automatic"
    liveliness_lease_duration: QosDuration = field(default_factory=QosDuration)
    avoid_ros_namespace_conventions: bool = False


@dataclass(frozen=True)
class RecordedTopic:
    """A topic of a bag."""

    name: str
    type_name: str
    type_hash: str
    offered_qos: Sequence[Mapping[str, object]]
    """Of each of its publishers, see ``OfferedQos``."""


@dataclass(frozen=True)
class FileContent:
    """Content of one file of a bag; times are log times [ns]."""

    name: str
    message_counts: Mapping[str, int]
    """By topic name."""
    start_ns: int = NO_TIME_NS
    end_ns: int = NO_TIME_NS

    @property
    def message_count(self) -> int:
        """Number of messages on all topics."""
        return sum(self.message_counts.values())


def bag_information(topics: Sequence[RecordedTopic], files: Sequence[FileContent]) -> dict[str, object]:
    """Content of ``rosbag2_bagfile_information`` for a bag of one or more MCAP files."""
    filled = [file for file in files if file.message_count]
    start_ns = min((file.start_ns for file in filled), default=NO_TIME_NS)
    end_ns = max((file.end_ns for file in filled), default=NO_TIME_NS)
    return {
        "version": FORMAT_VERSION,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": end_ns - start_ns},
        "starting_time": {"nanoseconds_since_epoch": start_ns},
        "message_count": sum(file.message_count for file in files),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": list(topic.offered_qos),
                    "type_description_hash": topic.type_hash,
                },
                "message_count": sum(file.message_counts.get(topic.name, 0) for file in files),
            }
            for topic in topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file.name for file in files],
        "files": [
            {
                "path": file.name,
                "starting_time": {"nanoseconds_since_epoch": file.start_ns},
                "duration": {"nanoseconds": file.end_ns - file.start_ns},
                "message_count": file.message_count,
            }
            for file in files
        ],
        "custom_data": None,
        "ros_distro": ROS_DISTRO,
    }


def write_metadata_yaml(folder: Path, information_yaml: str) -> None:
    """Write metadata.yaml atomically.

    Raises:
        OSError: it cannot be written.
    """
    text = "rosbag2_bagfile_information:\n" + indent(information_yaml, "  ")
    with written_atomically(folder / METADATA_FILE) as stream:
        stream.write(text.encode())


def to_yaml(tree: object) -> str:
    """YAML text in block style."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.width = 1000
    yaml.representer.sort_base_mapping_type_on_output = False
    stream = StringIO()
    yaml.dump(tree, stream)
    return stream.getvalue()
