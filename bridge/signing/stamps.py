"""Timestamps of signatures: they only ever grow, over restarts, crashes and steps of the calendar too."""

from __future__ import annotations

import threading
from contextlib import suppress
from pathlib import Path

from bridge.clock import Nanoseconds
from tracker.errors import OperatorError

EPOCH_S = 1_420_070_400  # 2015-01-01 00:00 UTC, where MAVLink's timestamps begin
TICK_NS = 10_000
AHEAD = 60 * 100_000  # so many ticks are reserved on disk at a time: a minute
RENEW = AHEAD // 2
MOST = (1 << 48) - 1


class Stamps:
    """Give each signature a timestamp of its own, in ticks of 10 us.

    The calendar is read once, at the start; from there the stopwatch goes on, so a step of the calendar changes
    nothing. What may be used is reserved on disk before it is, a minute ahead: after a crash the next run begins above
    all that was sent. An orderly end leaves exactly the last one. The write is not synced: it survives the process's
    death, and the power's only where the calendar went on.

    Args:
        path: holds the reserved one.  first: where to begin.  stopwatch: reads a running time [ns].
    """

    def __init__(self, path: Path, first: int, stopwatch: Nanoseconds) -> None:
        self._path = path
        self._stopwatch = stopwatch
        self._lock = threading.Lock()
        self._base, self._started_ns = first, stopwatch()
        self._last = first - 1
        self._reserved = 0
        self._reserve(first + AHEAD)

    @property
    def newest(self) -> int:
        """Return the newest timestamp known: given, or heard in a signature that was right."""
        return self._last

    def take(self) -> int:
        """Return the next timestamp. Any thread may ask."""
        with self._lock:
            passed = (self._stopwatch() - self._started_ns) // TICK_NS
            self._last = min(max(self._last + 1, self._base + passed), MOST)
            if self._last > self._reserved - RENEW:
                with suppress(OperatorError):  # a full disk ends no flight; it is tried again in half a minute
                    self._reserve(self._last + AHEAD)
            return self._last

    def heard(self, timestamp: int) -> None:
        """Begin above a far end's timestamp from now on. Source: the protocol asks for the larger of both."""
        with self._lock:
            self._last = max(self._last, timestamp)

    def close(self) -> None:
        """Leave the last timestamp for the next run. Twice is once."""
        with self._lock, suppress(OperatorError):  # what stands there is above all that was sent
            self._reserve(self._last + 1)

    def _reserve(self, timestamp: int) -> None:
        """Write it in one go: whoever reads sees the old one or the new one, never half of it."""
        self._reserved = timestamp
        beside = self._path.with_name(self._path.name + ".new")
        try:
            beside.write_text(f"{timestamp}\n", encoding="ascii")
            beside.replace(self._path)
        except OSError as error:
            raise OperatorError(
                f"signing timestamps {self._path}: cannot be written ({error.strerror}); the key's folder must be yours"
            ) from error


def open_stamps(path: Path, wall: Nanoseconds, stopwatch: Nanoseconds) -> Stamps:
    """Begin at the calendar's time, or above what an earlier run reserved if that is later.

    Args:
        path: the file that an earlier run left, or that is to be.
        wall: reads the calendar, since 1970-01-01 UTC [ns].  stopwatch: reads a running time [ns].
    Raises:
        OperatorError: a file that holds no timestamp, or cannot be written.
    """
    now = max(0, wall() - EPOCH_S * 1_000_000_000) // TICK_NS
    return Stamps(path, max(now, _left(path)), stopwatch)


def _left(path: Path) -> int:
    try:
        timestamp = int(path.read_text(encoding="ascii"))
    except FileNotFoundError:
        return 0
    except (OSError, ValueError) as error:
        raise OperatorError(
            f"signing timestamps {path}: cannot be read; if this computer's calendar is right, remove the file"
        ) from error
    if not 0 <= timestamp <= MOST:
        raise OperatorError(
            f"signing timestamps {path}: {timestamp} is none; if the calendar is right, remove the file"
        )
    return timestamp
