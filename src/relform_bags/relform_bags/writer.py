"""Write a bag that ros2 bag, rosbags, Foxglove and others read: a folder of MCAP files and metadata.yaml.

A message is safe when its chunk has reached the file (``flush``): the end of the process does not lose it.
A writer holds a reserve on the disk. When the disk is full, the open chunk, the messages that arrive until
``close``, and the index take the room of the reserve. A bag that was not closed needs ``recover_bag``.
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
from relform_bags.recover import recover_bag
from relform_bags.reserve import Reserve
from relform_bags.split_limits import SplitLimits
from relform_core.errors import BagError
from relform_core.units import NANOSECONDS_PER_SECOND

CHUNK_BYTES = 256 * 1024
"""A chunk that has reached this size is finished."""
TAIL_BYTES = 2 * CHUNK_BYTES
"""Room for what is written after the disk is full, beside the index: two chunks, compressed or not."""
RESERVE_BYTES = TAIL_BYTES + 64 * 1024
"""Initial size of the reserve; it grows with the index."""


class BagWriter:
    """A bag from its creation to ``close``; a context manager."""

    def __init__(
        self, folder: Path | str, attachments: Mapping[str, str], limits: SplitLimits | None = None
    ) -> None:
        """Create the bag.

        Args:
            folder: folder of the bag, must not exist.
            attachments: texts to attach to every file of the bag, by name.
            limits: when to continue in the next file; None: never.
        Raises:
            BagError: the folder exists or cannot be written.
        """
        folder = self.folder = Path(folder)
        self._attachments = attachments
        self._limits = limits or SplitLimits()
        self._chunk_bytes = min(CHUNK_BYTES, self._limits.size or CHUNK_BYTES)
        self._topics: dict[str, RecordedTopic] = {}
        self._finished: list[FileContent] = []
        self._is_open = True
        self._end_ns = 0
        self._failure: OSError | None = None
        """The error of the first write that failed."""
        self._is_stuck = False
        """Whether a write failed in spite of the reserve: the file ends before the open chunk."""
        self._first_lost_ns: int | None = None
        """Least log time of the messages that are lost."""
        try:
            folder.mkdir(parents=True)
            self._reserve = Reserve(folder, RESERVE_BYTES)
            self._file = self._new_file()
        except FileExistsError:
            raise BagError(f"{folder}: exists already; choose another folder") from None
        except OSError as error:
            raise BagError(f"{folder}: cannot be created: {error.strerror}") from None

    @property
    def file(self) -> Path:
        """The current file."""
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
            BagError: the disk is full. It is raised once; further messages are taken while the reserve has
                room, and ``close`` reports what was kept.
        """
        if self._is_stuck:
            self._lose(log_time_ns)
            return
        was_full = self._failure is not None
        try:
            if self._limits.are_reached(self._file.size, self._file.start_ns, log_time_ns):
                self._continue_in_next_file()
            self._file.write(topic, data, log_time_ns, publish_time_ns)
            self._end_ns = max(self._end_ns, log_time_ns)
        except OSError as error:
            self._give_up(error)
            self._lose(log_time_ns)
        if self._file.open_bytes > self._chunk_bytes:
            self._flush()
        self._report_full(was_full)

    def flush(self) -> None:
        """Write the open chunk into the file; the end of the process cannot lose it then.

        Raises:
            BagError: the disk is full, see ``write``.
        """
        was_full = self._failure is not None
        self._flush()
        self._report_full(was_full)

    def close(self) -> None:
        """Write the index and metadata.yaml; does nothing on a closed bag.

        Raises:
            BagError: the disk was full; it names the log time up to which all messages are kept, and the way
                to complete the bag if the index could not be written.
        """
        if not self._is_open:
            return
        was_full = self._failure is not None
        self._flush()
        self._is_open = False
        is_closed = not self._is_stuck and self._finish()
        self._reserve.release()
        if not is_closed:
            is_closed = self._recover()
        if was_full or self._first_lost_ns is not None or not is_closed:
            raise self._summary(is_closed)

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
        file = BagFileWriter(path, self._attachments, self._information_yaml(empty), self._make_room)
        for topic in self._topics.values():
            file.add_topic(topic)
        return file

    def _continue_in_next_file(self) -> None:
        self._file.finish(self._information_yaml(self._file.content))
        self._finished.append(self._file.content)
        self._file = self._new_file()

    def _information_yaml(self, last: FileContent) -> str:
        return to_yaml(bag_information(list(self._topics.values()), [*self._finished, last]))

    def _flush(self) -> None:
        if self._is_stuck or not self._is_open:
            return
        try:
            self._file.flush()
        except OSError as error:
            self._give_up(error)
            return
        try:
            self._reserve.grow_to(TAIL_BYTES + self._file.index_bytes)
        except OSError as error:
            self._make_room(error)

    def _finish(self) -> bool:
        """Write the index and metadata.yaml; returns False if that failed."""
        try:
            information_yaml = self._information_yaml(self._file.content)
            self._file.finish(information_yaml)
            self._reserve.release()
            write_metadata_yaml(self.folder, information_yaml)
        except OSError as error:
            self._give_up(error)
            return False
        return True

    def _recover(self) -> bool:
        """Complete the bag with what is in its files; returns False if that failed, too."""
        try:
            recover_bag(self.folder)
        except BagError:
            return False
        return True

    def _make_room(self, error: OSError) -> bool:
        """Release the reserve after a write that failed; returns False if that was done before."""
        self._failure = self._failure or error
        return self._reserve.release()

    def _give_up(self, error: OSError) -> None:
        """Leave the file as it is, without the open chunk."""
        self._failure = self._failure or error
        self._is_stuck = True
        self._file.abandon()
        if self._file.open_start_ns is not None:
            self._lose(self._file.open_start_ns)

    def _lose(self, log_time_ns: int) -> None:
        if self._first_lost_ns is None or log_time_ns < self._first_lost_ns:
            self._first_lost_ns = log_time_ns

    def _report_full(self, was_full: bool) -> None:
        if self._failure is not None and not was_full:
            raise BagError(self._problem())

    def _problem(self) -> str:
        reason = "" if self._failure is None else self._failure.strerror
        return f"{self.file} cannot be written any more: {reason}"

    def _summary(self, is_closed: bool) -> BagError:
        """What is kept, after the disk was full."""
        end_ns = self._end_ns if self._first_lost_ns is None else self._first_lost_ns
        kept = f"the bag holds every message before {_seconds(end_ns)}"
        way_out = "" if is_closed else f"; complete it with scripts/record.py --recover {self.folder}"
        return BagError(f"{self._problem()}; {kept}{way_out}")


def _seconds(time_ns: int) -> str:
    """A time with all its digits and no further zeros, such as ``10.55 s``."""
    seconds, nanoseconds = divmod(time_ns, NANOSECONDS_PER_SECOND)
    return f"{seconds}.{nanoseconds:09}".rstrip("0").rstrip(".") + " s"
