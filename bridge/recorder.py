"""Record the flight without ever delaying it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from bridge.backlog import Backlog
from bridge.heard import NOTHING, Heard
from bridge.log.entry import Entry, make_entry
from bridge.log.film import FILM_METADATA, Film, FilmTerms
from bridge.log.stream import open_stream
from bridge.log.tlog import TlogWriter
from bridge.log.writer import Cover, LogWriter
from bridge.wire import Sent
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.rig import Marker
from tracker.types import Event, Step

# An entry waits at most 0.25 s in the backlog, then for a flush: 0.5 s of stream time, or 0.25 s without another entry.
FLUSH_NS = 500_000_000
CLOCK_NS = 1_000_000_000
CAPACITY = 1024
CAPACITY_WITH_FRAMES = 32  # where the loop waits for the log: each may hold an image
CLOSE_S = 10.0
STALL_S = 0.5


@dataclass(frozen=True, slots=True)
class RecorderState:
    """How the recording stands.

    path: the log's, as given.
    written: steps handed to the kernel.  dropped: steps that are not in the log and never will be.
    size_bytes: of the log.  error: why recording stopped, in one line; None while all is well.
    frames: what is wrong with the frames in it, "" for nothing.
    """

    path: Path
    written: int
    dropped: int
    size_bytes: int
    error: str | None
    frames: str = ""


class Recorder:
    """Write every step to an MCAP file from a thread of its own.

    `take` only puts the step on a bounded queue. Where the disk is slower than the flight, steps are dropped and
    counted; where it fails, recording stops, `state` says why, and the flight goes on.

    Args:
        path: a new file; or a pipe or device, written as it is.
        attachments: whole files by name, such as the config as used.
        metadata: names and values by topic, such as versions, source URI and command line.
        cameras, marker: as tracked with, drawn into the log.
        wall_clock: reads the wall clock [ns since 1970]; noted once a second beside stream time.
        tlog: a new file for the MAVLink frames alone, numbered ones where there are several links; None for none.
        links: their names, in the order of those numbers.
        overwrite: replace files that exist.
        block_when_full: wait for the disk instead of dropping, for input that is not live.
        capacity: steps the queue holds; 1024 are some 17 s of two cameras at 30 Hz.
        film: keep the frames too, and how; None for no frames.
    Raises:
        OperatorError: the file exists, or the path cannot be opened.
    """

    def __init__(
        self,
        path: Path,
        *,
        attachments: Mapping[str, bytes],
        metadata: Mapping[str, Mapping[str, str]],
        cameras: tuple[Camera, ...],
        marker: Marker,
        wall_clock: Callable[[], int],
        tlog: Path | None = None,
        links: Sequence[str] = (),
        overwrite: bool = False,
        block_when_full: bool = False,
        capacity: int = CAPACITY,
        film: FilmTerms | None = None,
    ) -> None:
        self._path = path
        self._wall_clock = wall_clock
        self._block = block_when_full
        self._stream = open_stream(path, overwrite)
        self._tlog = self._open_tlog(tlog, links, overwrite)
        self._film = None if film is None else Film(film)
        if film is not None:
            metadata = {**metadata, FILM_METADATA: {"format": film.format.value}}
        self._cover = Cover(attachments, metadata, cameras, marker, wall_clock())
        waits_with_images = film is not None and block_when_full
        self._backlog = Backlog(min(capacity, CAPACITY_WITH_FRAMES) if waits_with_images else capacity)
        self._clock_due_ns: int | None = None
        self._closed = False
        self._error: str | None = None
        self._refused = 0  # counted by the loop's thread, the next three by the writing one
        self._lost = 0
        self._pending = 0
        self._written = 0
        self._writer = self._begin()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def take(
        self, event: Event | None, step: Step, sent: tuple[Sent, ...], now_ns: int, heard: Heard = NOTHING
    ) -> None:
        """Queue one turn of the loop at stream time `now_ns` [ns]; returns at once unless `block_when_full`.

        event: None at the end of all events.
        """
        film = None if self._film is None else self._film.admit(event, wait=self._block)
        entry = make_entry(event, step, sent, now_ns, self._wall_time_if_due(now_ns), heard, film)
        if self._closed or not self._put(entry):
            self._refused += 1

    def state(self) -> RecorderState:
        """Say how the recording stands."""
        error = self._error or (None if self._tlog is None else self._tlog.error)
        if error is None and not self._closed and not self._thread.is_alive():
            error = f"log {self._path}: the recorder's thread is gone, which is a bug; its traceback is on stderr"
        dropped, frames = self._refused + self._lost, "" if self._film is None else self._film.trouble()
        return RecorderState(self._path, self._written, dropped, self._stream.size_bytes, error, frames)

    def close(self) -> None:
        """Write what is queued, end the file properly and wait for it, at most 10 s. A second call does nothing."""
        if self._closed:
            return
        self._closed = True
        self._backlog.close()
        self._thread.join(CLOSE_S)
        if self._thread.is_alive():
            waiting = self._pending + len(self._backlog)
            self._error = f"log {self._path}: the disk did not take the last {waiting} steps; the log has no end"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _wall_time_if_due(self, now_ns: int) -> int | None:
        if self._clock_due_ns is not None and now_ns < self._clock_due_ns:
            return None
        self._clock_due_ns = now_ns + CLOCK_NS
        return self._wall_clock()

    def _put(self, entry: Entry) -> bool:
        """Queue an entry; say whether it went in."""
        while not self._backlog.put(entry):
            if not self._block or not self._thread.is_alive():
                return False
            self._backlog.wait_for_room(STALL_S)
        return True

    def _open_tlog(self, path: Path | None, links: Sequence[str], overwrite: bool) -> TlogWriter | None:
        try:
            return None if path is None else TlogWriter(path, overwrite, links)
        except OperatorError:
            self._stream.close()
            if not overwrite and self._path.is_file():  # begun a moment ago, with nothing in it
                self._path.unlink()
            raise

    def _begin(self) -> LogWriter | None:
        try:
            return LogWriter(self._stream, self._cover, self._film)
        except OSError as error:
            self._stop(error)
            return None

    def _run(self) -> None:
        if self._writer is not None:
            try:
                self._record(self._writer)
            except OSError as error:
                self._stop(error)
        if self._error is not None:
            self._discard()
        if self._tlog is not None:
            self._tlog.close()

    def _record(self, writer: LogWriter) -> None:
        """Write entries until the last."""
        flushed_ns: int | None = None
        warned = 0
        for entry in self._backlog.entries():
            if entry is None:
                self._flush(writer)
                continue
            self._pending += 1
            writer.write(entry)
            if self._tlog is not None:
                self._tlog.write(entry)
            if self._refused > warned:
                writer.warn(entry.now_ns, f"{self._refused - warned} steps dropped: the disk is too slow")
                warned = self._refused
            if flushed_ns is None or abs(entry.now_ns - flushed_ns) >= FLUSH_NS:
                self._flush(writer)
                flushed_ns = entry.now_ns
        self._flush(writer)
        writer.finish({"steps_written": str(self._written), "steps_dropped": str(self._refused)} | self._film_counts())

    def _film_counts(self) -> dict[str, str]:
        if self._film is None:
            return {}
        state = self._film.state()
        counts = {"stored": state.stored, "missed": state.missed, "bytes": state.size_bytes}
        return {f"frames_{name}": str(count) for name, count in counts.items()}

    def _flush(self, writer: LogWriter) -> None:
        writer.flush()
        if self._tlog is not None:
            self._tlog.flush()
        self._written += self._pending
        self._pending = 0

    def _stop(self, error: OSError) -> None:
        """Give the recording up, keeping what is on the disk."""
        self._error = f"log {self._path}: {error.strerror or error}; recording stopped after {self._written} steps"
        self._lost += self._pending
        self._pending = 0
        with suppress(OSError):  # its buffer cannot be written either
            self._stream.close()

    def _discard(self) -> None:
        """Empty the backlog until the end, so that nobody waits for a disk that failed."""
        self._lost += sum(entry is not None for entry in self._backlog.entries())
