"""Stream time: the one monotonic clock that frames, messages and the log share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from tracker.types import Frame, Silence

Nanoseconds = Callable[[], int]


class Clock(Protocol):
    """Give the time in the base of `Frame.t_ns`, and learn that base from the events that pass."""

    def now_ns(self) -> int:
        """Return stream time now [ns]."""

    def follow(self, event: Frame | Silence) -> None:
        """Take note of an event's own time."""


class StreamClock:
    """Time stands at the newest frame: with `--pace fast` the same input gives the same bytes.

    delay_ns: how long after its own time a frame is in memory, where the far end's clock goes on meanwhile [ns].
    """

    def __init__(self, delay_ns: int = 0) -> None:
        self._delay_ns = delay_ns
        self._now_ns = 0

    def now_ns(self) -> int:
        """Return the time at which the newest event is in memory [ns]."""
        return self._now_ns

    def follow(self, event: Frame | Silence) -> None:
        """Move on to the event's time; late frames do not turn the clock back."""
        self._now_ns = max(self._now_ns, event.t_ns + self._delay_ns)


class Timed(Protocol):
    """What knows the stream time at which its newest event was taken."""

    now_ns: int


class ReplayClock:
    """Time stands where it stood when the flight's loop took the event that a replay takes now."""

    def __init__(self, source: Timed) -> None:
        self._source = source

    def now_ns(self) -> int:
        """Return the flight's stream time then [ns]."""
        return self._source.now_ns

    def follow(self, event: Frame | Silence) -> None:
        """Ignore the event: the source knows."""


class HostClock:
    """The host's monotonic clock, shifted so that `origin_ns` of the stream is the instant this object is made.

    monotonic: reads the host's monotonic clock [ns].
    origin_ns: stream time now; None for live sources, whose stream time is the monotonic clock itself.
    """

    def __init__(self, monotonic: Nanoseconds, origin_ns: int | None = None) -> None:
        self._monotonic = monotonic
        self._shift_ns = 0 if origin_ns is None else origin_ns - monotonic()

    def now_ns(self) -> int:
        """Return stream time now [ns]."""
        return self._monotonic() + self._shift_ns

    def follow(self, event: Frame | Silence) -> None:
        """Ignore the event: the host's clock goes by itself."""
