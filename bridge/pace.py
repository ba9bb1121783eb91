"""Give recorded frames no earlier than they were taken, as a live camera would."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import chain

from bridge.clock import Clock, Nanoseconds
from tracker.types import Event, Frame, Rejected

Wait = Callable[[float], bool | None]
"""Wait for so many seconds; True says that the program is to end. time.sleep is one, Event.wait another."""


class Paced:
    """Iterate over events, each no earlier than its own time on the clock.

    Nothing is dropped: an event whose time has passed goes on at once, is counted in `late` and its lag kept in
    `worst_lag_ns`. A frame's `available_ns` becomes the instant it is handed over, since its wait is no latency.
    A `Rejected` goes on at once, in its place.
    """

    def __init__(
        self, events: Iterable[Event], clock: Clock, wait: Wait, stopwatch: Nanoseconds, delay_ns: int = 0
    ) -> None:
        """Pace the events.

        Args:
            events: in order of time.
            clock: stream time, going on by itself.
            wait: waits; the iteration ends if it returns True.
            stopwatch: stamps `Frame.available_ns`.
            delay_ns: how long after its own time an event is in memory [ns].
        """
        self._delay_ns = delay_ns
        self._events = events
        self._clock = clock
        self._wait = wait
        self._stopwatch = stopwatch
        self.late = 0
        self.worst_lag_ns = 0

    def __iter__(self) -> Iterator[Event]:
        """Yield the events on time."""
        for event in self._events:
            if isinstance(event, Rejected):
                yield event
                continue
            if not self._wait_until(event.t_ns + self._delay_ns):
                return
            yield replace(event, available_ns=self._stopwatch()) if isinstance(event, Frame) else event

    def _wait_until(self, t_ns: int) -> bool:
        """Wait for the clock to reach `t_ns`; False if the program is to end."""
        lag_ns = self._clock.now_ns() - t_ns
        if lag_ns > 0:
            self.late += 1
            self.worst_lag_ns = max(self.worst_lag_ns, lag_ns)
        while lag_ns < 0:
            if self._wait(-lag_ns / 1e9):
                return False
            lag_ns = self._clock.now_ns() - t_ns
        return True


def first_time_ns(events: Iterable[Event]) -> tuple[int | None, Iterator[Event]]:
    """Look at when a stream starts, to set a clock by it.

    Returns:
        The time of the first frame or silence [ns], None if there is none, and all the events, none lost.
    """
    rest = iter(events)
    seen: list[Event] = []
    for event in rest:
        seen.append(event)
        if not isinstance(event, Rejected):
            return event.t_ns, chain(seen, rest)
    return None, iter(seen)
