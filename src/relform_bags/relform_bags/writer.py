"""Write a bag that ros2 bag, rosbags, Foxglove and others read: a folder of MCAP files and metadata.yaml.

A message is safe when its chunk has reached the file (``flush``): a process that dies afterwards does not
lose it, and a write that fails leaves the file as it was. A bag that was not closed needs ``recover_bag``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Self

from relform_bags.file_writer import BagFileWriter
from relform_bags.message_types import message_type
from relform_bags.metadata import (
    FileContent,
    OfferedQos,
    RecordedTopic,
    bag_information,
    to_yaml,
    write_metadata_yaml,
)
from relform_bags.recover import RESERVE_FILE, recover_bag
from relform_bags.split_limits import SplitLimits
from relform_core.errors import BagError

CHUNK_BYTES = 256 * 1024
RESERVE_BYTES = 256 * 1024
"""Kept free beside the bag, so that a full disk leaves room for the index."""


class BagWriter:
    """One bag, from its creation to ``close``; a context manager."""

    def __init__(
        self, folder: Path, attachments: Mapping[str, str], limits: SplitLimits | None = None
    ) -> None:
        """Create the bag.

        Args:
            folder: folder of the bag, must not exist.
            attachments: texts to keep in every file of the bag, by name.
            limits: when to go on in the next file; None: never.
        Raises:
            BagError: the folder exists or cannot be written.
        """
        self.folder = folder
        self._attachments = attachments
        self._limits = limits or SplitLimits()
        self._chunk_bytes = min(CHUNK_BYTES, self._limits.size or CHUNK_BYTES)
        self._reserve = folder / RESERVE_FILE
        self._topics: dict[str, RecordedTopic] = {}
        self._finished: list[FileContent] = []
        self._is_open = True
        try:
            folder.mkdir(parents=True)
            self._reserve.write_bytes(bytes(RESERVE_BYTES))
            self._file = self._new_file()
        except FileExistsError:
            raise BagError(f"{folder} exists already, not overwriting; choose another folder") from None
        except OSError as error:
            raise BagError(f"{folder}: no bag can be written there: {error.strerror}") from None

    @property
    def file(self) -> Path:
        """The file that is being written."""
        return self._file.path

    def add_topic(self, name: str, type_name: str, offered_qos: Sequence[OfferedQos]) -> None:
        """Declare a topic before its first message.

        Raises:
            BagError: its type is not installed.
        """
        type_hash = message_type(type_name).type_hash
        self._topics[name] = RecordedTopic(name, type_name, type_hash, [asdict(qos) for qos in offered_qos])
        self._file.add_topic(self._topics[name])

    def write(self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int) -> None:
        """Add a serialized message.

        Raises:
            BagError: a chunk was due and could not be written; the bag is closed.
        """
        if self._limits.are_reached(self._file.size, self._file.start_ns, log_time_ns):
            self._go_on_in_next_file()
        self._file.write(topic, data, log_time_ns, publish_time_ns)
        if self._file.open_bytes > self._chunk_bytes:
            self.flush()

    def flush(self) -> None:
        """Finish the open chunk, so that it outlives the process.

        Raises:
            BagError: it could not be written; the bag is closed.
        """
        try:
            self._file.flush()
        except OSError as error:
            raise self._give_up(error) from None

    def close(self) -> None:
        """Write the index and metadata.yaml; does nothing on a closed bag.

        Raises:
            BagError: they could not be written.
        """
        if not self._is_open:
            return
        self.flush()
        try:
            information_yaml = self._information_yaml(self._file.content)
            self._file.finish(information_yaml)
            write_metadata_yaml(self.folder, information_yaml)
        except OSError as error:
            raise self._give_up(error) from None
        self._is_open = False
        self._reserve.unlink()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _new_file(self) -> BagFileWriter:
        """The next file, with all topics of those before."""
        path = self.folder / f"{self.folder.name}_{len(self._finished)}.mcap"
        empty = FileContent(path.name, {})
        file = BagFileWriter(path, self._attachments, self._information_yaml(empty))
        for topic in self._topics.values():
            file.add_topic(topic)
        return file

    def _go_on_in_next_file(self) -> None:
        try:
            self._file.finish(self._information_yaml(self._file.content))
            self._finished.append(self._file.content)
            self._file = self._new_file()
        except OSError as error:
            raise self._give_up(error) from None

    def _information_yaml(self, last: FileContent) -> str:
        return to_yaml(bag_information(list(self._topics.values()), [*self._finished, last]))

    def _give_up(self, error: OSError) -> BagError:
        """Close the bag with what is safe in it, and say so."""
        self._is_open = False
        self._file.abandon()
        self._reserve.unlink(missing_ok=True)
        try:
            recover_bag(self.folder)
            consequence = "the bag is complete up to there"
        except BagError:
            consequence = (
                f"what was written before is kept, complete it with scripts/record.py --recover {self.folder}"
            )
        return BagError(f"{self.file} cannot be written any more: {error.strerror}; {consequence}")
