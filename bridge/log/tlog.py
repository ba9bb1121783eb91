"""The .tlog beside a log: every frame sent and received, as ground stations and pymavlink's tools read them.

Each link has a file of its own, since each end counts its frames a link: from two links in one file every reader would
take a loss at nearly every frame.

A record is eight bytes of time, big-endian, and one MAVLink frame; nothing else is in the file. The time is the wall
clock's, microseconds since 1970, because readers of a .tlog take it for that and lay files of several computers beside
each other by it. Its two lowest bits are the link's number: so MAVProxy writes it and pymavlink reads it
(`mavlogdump.py --link N`), and files that are laid together can be told apart again. Nothing is flown on it: the log
itself has the stream's own clock and the wall clock beside it.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from contextlib import suppress
from itertools import groupby
from operator import itemgetter
from pathlib import Path

from bridge.log.entry import Entry
from bridge.log.stream import open_stream
from tracker.errors import OperatorError

_TIME = struct.Struct(">Q")
_LINK_BITS = 3


def stamp(wall_ns: int, link: int) -> bytes:
    """Return the head of a record: when [ns since 1970], on which link of how many ever."""
    return _TIME.pack(max(0, wall_ns // 1000) & ~_LINK_BITS | link & _LINK_BITS)


def tlog_paths(path: Path, links: int) -> tuple[Path, ...]:
    """Return a file for each link: the path itself for one, numbered ones (`flight.0.tlog`) for several."""
    if links <= 1:
        return (path,)
    return tuple(path.with_suffix(f".{number}{path.suffix}") for number in range(links))


class TlogWriter:
    """Write a file a link from the recorder's thread.

    path: see `tlog_paths`.  links: their names in the order of their numbers; none for one link of any name.
    error: why one of them ended early, in one line; None while all is well.

    Raises:
        OperatorError: a file exists and is to be kept, or cannot be written; none is begun then.
    """

    def __init__(self, path: Path, overwrite: bool, links: Sequence[str] = ()) -> None:
        self._numbers = {link: number for number, link in enumerate(links)}
        self._files: list[_File] = []
        self._wall_less_stream_ns = 0
        try:
            for each in tlog_paths(path, len(links)):
                self._files.append(_File(each, overwrite))
        except OperatorError:
            self._undo(overwrite)
            raise

    @property
    def error(self) -> str | None:
        """Say why a file ended early."""
        return next((file.error for file in self._files if file.error is not None), None)

    def write(self, entry: Entry) -> None:
        """Append the frames of one turn of the loop, in the order of their times.

        Those received bear their arrival; those sent the time at which the loop handed them over, or learned from a
        slow link's thread that they had left. A step of the wall clock shows when it is next read, within a second.
        """
        if entry.wall_ns is not None:
            self._wall_less_stream_ns = entry.wall_ns - entry.now_ns
        if not (entry.sent or entry.heard.received):
            return
        frames = [(entry.now_ns, sent.link, sent.raw) for sent in entry.sent]
        if entry.heard.received:
            heard = [(message.arrived_ns, link, message.raw) for link, message in entry.heard.received]
            frames = sorted(heard + frames, key=itemgetter(0))
        for (t_ns, link), together in groupby(frames, key=itemgetter(0, 1)):
            number = self._numbers.get(link, 0)
            head = stamp(t_ns + self._wall_less_stream_ns, number)
            self._files[number].put(b"".join([head + raw for _, _, raw in together]))

    def flush(self) -> None:
        """Hand everything to the kernel."""
        for file in self._files:
            file.flush()

    def close(self) -> None:
        """Write the rest and close the files."""
        for file in self._files:
            file.close()

    def _undo(self, overwrite: bool) -> None:
        """Close what was begun a moment ago, and leave none of it where nothing was before."""
        for file in self._files:
            file.close()
            if not overwrite and file.path.is_file():
                file.path.unlink()


class _File:
    """One file. What waits is written as one piece, whole records only: a killed process leaves no half one."""

    def __init__(self, path: Path, overwrite: bool) -> None:
        self.path = path
        self._stream = open_stream(path, overwrite)
        self._waiting: list[bytes] = []
        self.error: str | None = None

    def put(self, records: bytes) -> None:
        """Append whole records, unless the file has ended early."""
        if self.error is None:
            self._waiting.append(records)

    def flush(self) -> None:
        """Hand everything to the kernel."""
        if self.error is not None or not self._waiting:
            return
        try:
            self._stream.write(b"".join(self._waiting))
            self._stream.flush()
        except OSError as error:
            self.error = f"log {self.path}: {error.strerror or error}; it ends early"
        self._waiting.clear()

    def close(self) -> None:
        """Write the rest and close the file."""
        self.flush()
        with suppress(OSError):  # what could not be written cannot be now
            self._stream.close()
