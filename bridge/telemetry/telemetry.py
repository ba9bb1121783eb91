"""Telemetry of a running bridge: watched by alarms all the time, published while somebody listens."""

from __future__ import annotations

from collections.abc import Callable

from bridge.alarms import Alarm, Limits, Readings, Standing, advance, standing_alarms
from bridge.alarms.watch import NOTHING
from bridge.clock import Nanoseconds
from bridge.monitor import Monitor
from bridge.telemetry.compose import readings_of, snapshot_of
from bridge.telemetry.gauges import Gauges, Names
from bridge.telemetry.post import Post
from bridge.telemetry.snapshot import MAX_BYTES, About, Snapshot, to_bytes
from bridge.telemetry.states import Surroundings
from bridge.wire import Sent
from tracker.types import Event, Step

WATCH_NS = 250_000_000  # of stream time: alarms are the same for a flight and for its log
TOGETHER = 8  # readings that are judged at once where nobody asks meanwhile: in code at hand each takes a quarter
CHECK_NS = 100_000_000  # of the stopwatch
CHECKS_PER_SNAPSHOT = 2

Around = Callable[[], Surroundings]


class Telemetry:
    """Take every turn of the loop after it was sent and counted.

    monitor: the run's own figures, which it reads.  post: where to publish, None for nowhere.
    stopwatch: reads a running time [ns].
    """

    def __init__(
        self, about: About, names: Names, limits: Limits, monitor: Monitor, post: Post | None, stopwatch: Nanoseconds
    ) -> None:
        self._about = about
        self._limits = limits
        self._monitor = monitor
        self._post = post
        self._stopwatch = stopwatch
        self._gauges = Gauges(names)
        self._standing: Standing = NOTHING
        self._unjudged: list[Readings] = []
        self._watch_due_ns: int | None = None
        self._check_due_ns = 0
        self._checks = 0
        self._sequence = 0

    @property
    def port(self) -> int | None:
        """Return the port that it answers on."""
        return None if self._post is None else self._post.port

    def take(self, event: Event | None, step: Step, sent: tuple[Sent, ...], now_ns: int, around: Around) -> None:
        """Enter one turn at stream time now_ns [ns]; around: tells how links and log stand, called only when needed."""
        self._gauges.take(event, step, sent, now_ns)
        self._watch(around)
        if self._post is not None:
            self._publish(self._post, around)

    def move_on(self, now_ns: int, around: Around) -> None:
        """Enter that time went on and nothing happened."""
        self._gauges.move_on(now_ns)
        self._watch(around)

    def alarms(self) -> tuple[Alarm, ...]:
        """Return the alarms that stand."""
        self._judge()
        return standing_alarms(self._standing, self._gauges.now_ns)

    def snapshot(self, around: Around, *, ended: bool = False) -> Snapshot:
        """Return the state of the run."""
        self._sequence += 1
        return snapshot_of(
            self._about, self._sequence, ended, self._gauges, self._monitor, around(), self._limits, self.alarms()
        )

    def close(self, around: Around) -> None:
        """Say the last word and let go of the port. Twice is once."""
        if self._post is not None:
            if self._post.anybody(self._stopwatch()):
                self._send(self._post, self.snapshot(around, ended=True))
            self._post.close()
            self._post = None

    def _watch(self, around: Around) -> None:
        """Take readings a few times a second of stream time, and judge them in a turn without: no pose waits for both.

        What is judged late comes out as if it had been judged at once, by its own time.
        """
        now_ns, waiting = self._gauges.now_ns, len(self._unjudged)
        due = self._watch_due_ns is None or now_ns >= self._watch_due_ns
        if waiting >= TOGETHER and (waiting >= 2 * TOGETHER or not due):
            self._judge()
        if due:
            self._watch_due_ns = now_ns + WATCH_NS
            self._unjudged.append(readings_of(self._gauges, around(), self._limits))

    def _judge(self) -> None:
        """Judge the readings that wait for it."""
        for readings in self._unjudged:
            self._standing = advance(self._standing, readings)
        self._unjudged.clear()

    def _publish(self, post: Post, around: Around) -> None:
        """Look for listeners ten times a second, and give those there are every second time a snapshot."""
        now_ns = self._stopwatch()
        if now_ns < self._check_due_ns:
            return
        self._check_due_ns = now_ns + CHECK_NS
        self._checks += 1
        if post.anybody(now_ns) and self._checks % CHECKS_PER_SNAPSHOT == 0:
            self._send(post, self.snapshot(around))

    def _send(self, post: Post, snapshot: Snapshot) -> None:
        data = to_bytes(snapshot)
        if len(data) <= MAX_BYTES:
            post.send(data)
