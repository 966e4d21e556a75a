"""Read the attachments and messages of a bag, closed or not."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Message, Schema
from mcap.well_known import SchemaEncoding

from relform_bags.records import MAGIC, RawRecord, data_records, raw_records, read_errors
from relform_core.errors import BagError
from relform_core.run_folder import BAG
from relform_core.suggestions import path_meant

COMPRESSED_SUFFIXES = (".zstd", ".lz4")
"""Of files that rosbag2 has compressed as a whole."""


@dataclass(frozen=True)
class BagMessage:
    """A serialized message with the times of its recording and publication [ns]."""

    topic: str
    type_name: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int
    definition: str = field(default="", repr=False, compare=False)
    """The .msg text and those of all types that it contains, as recorded; empty: recorded in another form."""


@dataclass(frozen=True)
class BagAttachment:
    """A text that is attached to a bag."""

    name: str
    text: str


def find_bag(path: Path | str) -> Path:
    """The path of a bag: its file or, if it has several, its folder.

    Args:
        path: that file, the bag's folder or the folder of a run.
    Raises:
        BagError: see ``bag_files``.
    """
    first, *others = bag_files(path)
    return first.parent if others else first


def bag_files(path: Path | str) -> tuple[Path, ...]:
    """The MCAP files of a bag, in the order in which they were written.

    Args:
        path: one file, the bag's folder or the folder of a run.
    Raises:
        BagError: no MCAP file exists, one is missing in between, they belong to several bags, or one is
            compressed as a whole.
    """
    path = Path(path)
    if path.is_file():
        _check_not_compressed(path)
        return (path,)
    if not path.exists():
        raise BagError(f"{path}: no such file or folder{path_meant(path)}")
    for folder in (path, path / BAG):
        check_not_compressed(folder)
        if files := list(folder.glob("*.mcap")):
            # A file may be empty because its recorder was killed just before it wrote the first bytes.
            begun = [file for file in files if file.stat().st_size >= len(MAGIC)]
            return _in_order(folder, begun or files)
    raise BagError(f"{path}: not a bag: the folder has no .mcap file")


def check_not_compressed(folder: Path) -> None:
    """Check that rosbag2 has not compressed the files of a bag as a whole.

    Raises:
        BagError: a file is compressed.
    """
    for file in sorted(folder.glob("*.mcap.*")):
        _check_not_compressed(file)


def _check_not_compressed(file: Path) -> None:
    if file.suffix in COMPRESSED_SUFFIXES:
        problem = "a file compressed as a whole (rosbag2 compression mode file) cannot be read"
        raise BagError(f"{file}: {problem}; decompress it")


def _in_order(folder: Path, files: list[Path]) -> tuple[Path, ...]:
    """Sort files by the numbers at the end of their names.

    Raises:
        BagError: they belong to several bags, or one is missing in between.
    """
    if len(files) == 1:
        return tuple(files)
    parts = {file: file.stem.rpartition("_") for file in files}
    names = {name for name, _, _ in parts.values()}
    if len(names) > 1 or not all(number.isdecimal() for _, _, number in parts.values()):
        raise BagError(
            f"{folder}: its {len(files)} .mcap files belong to several bags, name the file to read"
        )
    numbered = {int(number): file for file, (_, _, number) in parts.items()}
    for index in range(min(numbered), max(numbered)):
        if index not in numbered:
            raise BagError(f"{folder}: {names.pop()}_{index}.mcap is missing, name a file to read it alone")
    return tuple(numbered[index] for index in sorted(numbered))


def read_bag(path: Path | str, topics: Collection[str] | None = None) -> Iterator[BagAttachment | BagMessage]:
    """The content of a bag in the order of writing, up to its end or to the first damage.

    Args:
        path: one file, the bag's folder or the folder of a run.
        topics: read only messages of these; None: of all.
    Raises:
        BagError: the bag does not exist, is not MCAP, or rosbag2 has compressed its messages or files.
    """
    attached: set[str] = set()
    for file in bag_files(path):
        reading = _FileReading(file)
        for entry in reading.entries():
            match entry:
                case BagAttachment(name) if name in attached:
                    continue  # every file of a split bag repeats the attachments
                case BagAttachment(name):
                    attached.add(name)
                case BagMessage(topic) if topics is not None and topic not in topics:
                    continue
            yield entry
        if not reading.reached_end:
            return  # the files behind a damaged one would leave a gap


def read_attachments(path: Path | str) -> dict[str, str]:
    """The texts that are attached to a bag, by name, up to the end of its first file or its first damage.

    Args:
        path: one file, the bag's folder or the folder of a run.
    Raises:
        BagError: see ``read_bag``.
    """
    first = bag_files(path)[0]  # every file of a split bag repeats the attachments
    texts: dict[str, str] = {}
    has_message = False
    with read_errors(first), first.open("rb") as stream:
        for record in raw_records(stream, first):
            if record.opcode == Opcode.ATTACHMENT:
                for attachment in _text_attachment(Attachment.read(record.stream)):
                    texts[attachment.name] = attachment.text
            elif not has_message:  # the first message shows whether all are compressed
                has_message = any(isinstance(entry, Message) for entry in data_records(record))
    return texts


class _FileReading:
    """One pass through a file."""

    def __init__(self, file: Path) -> None:
        self.reached_end = False
        """Whether the end of the data was found, which only a closed file has."""
        self._file = file
        self._schemas: dict[int, Schema] = {}
        self._definitions: dict[int, str] = {}
        self._channels: dict[int, Channel] = {}

    def entries(self) -> Iterator[BagAttachment | BagMessage]:
        with read_errors(self._file), self._file.open("rb") as stream:
            for record in raw_records(stream, self._file):
                if record.opcode == Opcode.DATA_END:
                    self.reached_end = True
                    return
                if record.opcode == Opcode.ATTACHMENT:
                    yield from _text_attachment(Attachment.read(record.stream))
                else:
                    yield from self._messages(record)

    def _messages(self, record: RawRecord) -> Iterator[BagMessage]:
        for entry in data_records(record):
            match entry:
                case Schema():
                    self._schemas[entry.id] = entry
                    if entry.encoding == SchemaEncoding.ROS2:
                        self._definitions[entry.id] = entry.data.decode(errors="replace")
                case Channel():
                    self._channels[entry.id] = entry
                case Message():
                    channel = self._channels[entry.channel_id]
                    schema = self._schemas.get(channel.schema_id)
                    type_name = "" if schema is None else schema.name
                    yield BagMessage(
                        channel.topic,
                        type_name,
                        entry.data,
                        entry.log_time,
                        entry.publish_time,
                        self._definitions.get(channel.schema_id, ""),
                    )


def _text_attachment(attachment: Attachment) -> Iterator[BagAttachment]:
    """An attachment if it is a text; other recorders attach images, too."""
    try:
        text = attachment.data.decode()
    except UnicodeDecodeError:
        return
    yield BagAttachment(attachment.name, text)
