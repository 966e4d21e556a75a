"""Read the attachments and messages of a bag, whether it was finished or cut off."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Message, Schema

from relform_core.errors import BagError
from relform_tools.mcap_scan import TORN, chunk_records, raw_records


@dataclass(frozen=True)
class BagMessage:
    """A serialized message and when it was recorded and published [ns]."""

    topic: str
    type_name: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int


@dataclass(frozen=True)
class BagAttachment:
    """A text that is kept in a bag."""

    name: str
    text: str


def find_bag_file(path: Path) -> Path:
    """The MCAP file of a bag, which is named by that file, by the bag's folder or by the folder of a run.

    Raises:
        BagError: there is none.
    """
    if path.is_file():
        return path
    if not path.exists():
        raise BagError(f"{path}: no such file or folder")
    for folder in (path, path / "bag"):
        files = sorted(folder.glob("*.mcap"))
        if len(files) > 1:
            raise BagError(f"{folder}: holds {len(files)} .mcap files, name the one to read")
        if files:
            return files[0]
    raise BagError(f"{path}: no bag: there is no .mcap file in it")


def read_bag(file: Path, topics: Collection[str] | None = None) -> Iterator[BagAttachment | BagMessage]:
    """What a bag holds, in the order in which it was written, up to where the file ends or is damaged.

    Args:
        file: the MCAP file.
        topics: whose messages to read; None: all.
    Raises:
        BagError: the file cannot be read, or is not MCAP.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    try:
        with file.open("rb") as stream:
            for record in raw_records(stream, file):
                match record.opcode:
                    case Opcode.ATTACHMENT:
                        attachment = Attachment.read(record.stream)
                        yield BagAttachment(attachment.name, attachment.data.decode())
                    case Opcode.CHUNK:
                        for _, entry in chunk_records(Chunk.read(record.stream)):
                            match entry:
                                case Schema():
                                    schemas[entry.id] = entry
                                case Channel():
                                    channels[entry.id] = entry
                                case Message():
                                    channel = channels[entry.channel_id]
                                    if topics is None or channel.topic in topics:
                                        yield BagMessage(
                                            channel.topic,
                                            schemas[channel.schema_id].name,
                                            entry.data,
                                            entry.log_time,
                                            entry.publish_time,
                                        )
    except OSError as error:
        raise BagError(f"{file}: cannot be read: {error.strerror}") from None
    except TORN:
        return  # whatever follows a damaged record cannot be trusted
