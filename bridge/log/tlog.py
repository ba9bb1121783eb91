"""The .tlog beside a log: every frame sent and received, as ground stations and pymavlink's tools read them.

A record is eight bytes of time, big-endian, and one MAVLink frame; nothing else is in the file. The time is the wall
clock's, microseconds since 1970, because readers of a .tlog take it for that and lay files of several computers beside
each other by it. Nothing is flown on it: the log itself has the stream's own clock and the wall clock beside it.
"""

from __future__ import annotations

import struct
from contextlib import suppress
from pathlib import Path

from bridge.log.entry import Entry
from bridge.log.stream import open_stream

_TIME = struct.Struct(">Q")


class TlogWriter:
    """Write it from the recorder's thread. error: why it ended early, in one line; None while all is well.

    What waits is written as one piece, whole records only, so that a killed process leaves no half one.

    Raises:
        OperatorError: the file exists and is to be kept, or cannot be written.
    """

    def __init__(self, path: Path, overwrite: bool) -> None:
        self._path = path
        self._stream = open_stream(path, overwrite)
        self._waiting: list[bytes] = []
        self._wall_less_stream_ns = 0
        self.error: str | None = None

    def write(self, entry: Entry) -> None:
        """Append the frames of one turn of the loop, in the order of their times.

        Those received bear their arrival; those sent the time at which the loop handed them over, or learned from a
        slow link's thread that they had left. A step of the wall clock shows when it is next read, within a second.
        """
        if entry.wall_ns is not None:
            self._wall_less_stream_ns = entry.wall_ns - entry.now_ns
        if self.error is not None:
            return
        frames = [(message.arrived_ns, message.raw) for _, message in entry.heard.received]
        frames += [(entry.now_ns, sent.raw) for sent in entry.sent]
        frames.sort(key=lambda frame: frame[0])
        self._waiting += [self._stamp(t_ns) + raw for t_ns, raw in frames]

    def flush(self) -> None:
        """Hand everything to the kernel."""
        if self.error is not None or not self._waiting:
            return
        try:
            self._stream.write(b"".join(self._waiting))
            self._stream.flush()
        except OSError as error:
            self.error = f"log {self._path}: {error.strerror or error}; it ends early"
        self._waiting.clear()

    def close(self) -> None:
        """Write the rest and close the file."""
        self.flush()
        with suppress(OSError):  # what could not be written cannot be now
            self._stream.close()

    def _stamp(self, t_ns: int) -> bytes:
        return _TIME.pack(max(0, (t_ns + self._wall_less_stream_ns) // 1000))
