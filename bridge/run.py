"""The loop: frames in, poses out, everything logged.

    source -> tracker -> outlet (autopilots) -> monitor, recorder, status line

One thread, no queue between its parts: an estimate is on the wire before anything else is done with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Protocol

from bridge.alarms import Alarm
from bridge.clock import Clock
from bridge.heard import Heard, Hearer
from bridge.monitor import Monitor
from bridge.outlet import Outlet
from bridge.recorder import RecorderState
from bridge.status import Reading, StatusLine
from bridge.summary import LogSummary, Summary
from bridge.telemetry.states import LogState, Surroundings
from bridge.wire import Sent
from tracker.types import Event, Rejected, Step


class Steps(Protocol):
    """What turns events into estimates: `tracker.pipeline.Tracker`, or the paper's own method."""

    def step(self, event: Event) -> Step:
        """Take one event."""

    def finish(self) -> Step:
        """Give what was still held back when the events ended."""


class Records(Protocol):
    """What keeps every step: `bridge.recorder.Recorder`."""

    def take(self, event: Event | None, step: Step, sent: tuple[Sent, ...], now_ns: int, heard: Heard) -> None:
        """Keep one turn of the loop, and what was heard meanwhile."""

    def state(self) -> RecorderState:
        """Say how the recording stands."""

    def close(self) -> None:
        """End the recording properly."""


class Watches(Protocol):
    """What judges every turn and tells who listens: `bridge.telemetry.telemetry.Telemetry`."""

    def take(
        self, event: Event | None, step: Step, sent: tuple[Sent, ...], now_ns: int, around: Callable[[], Surroundings]
    ) -> None:
        """Enter one turn of the loop."""

    def alarms(self) -> tuple[Alarm, ...]:
        """Return the alarms that stand."""

    def close(self, around: Callable[[], Surroundings]) -> None:
        """Say the last word."""


@dataclass(frozen=True, slots=True, eq=False)
class Outlets:
    """Where a run's results go: the autopilots, the figures, and if wanted the log, the screen and who watches."""

    links: Outlet
    monitor: Monitor
    recorder: Records | None = None
    status: StatusLine | None = None
    telemetry: Watches | None = None
    hearer: Hearer = field(default_factory=Hearer)

    def log_state(self) -> str:
        """Say in a word or two how the log fares."""
        if self.recorder is None:
            return "off"
        state = self.recorder.state()
        if state.error is not None:
            return f"STOPPED: {state.error}"
        dropped = f"{state.dropped} steps dropped" if state.dropped else ""
        return ", ".join(word for word in (f"{state.size_bytes / 1e6:.1f} MB", dropped, state.frames) if word)

    def surroundings(self) -> Surroundings:
        """Return how links, their far ends and the log stand."""
        log = None
        if self.recorder is not None:
            state = self.recorder.state()
            log = LogState(str(state.path), state.size_bytes, state.written, state.dropped, state.error or "")
        return Surroundings(self.links.link_states(), log, self.links.far_ends())

    def summary(self, log_path: str | None) -> Summary:
        """Return the run's figures; log_path names the log."""
        log = None
        if self.recorder is not None and log_path is not None:
            state = self.recorder.state()
            log = LogSummary(log_path, state.written, state.dropped, state.error or "")
        return self.monitor.summary(self.links.link_states(), log, self.links.far_ends())


def run(events: Iterable[Event], tracker: Steps, clock: Clock, outlets: Outlets) -> None:
    """Take every event of a source through tracker and outlets, until there are no more, or one fails to come.

    Args:
        events: frames in the order they are to be worked on.
        clock: stream time, in the base of the frames' own.
    """
    outlets.links.listen(clock.now_ns)
    amid = False  # an event, so that the tracker holds half of it
    try:
        for event in events:
            amid = True
            if not isinstance(event, Rejected):
                clock.follow(event)
            _deliver(event, tracker.step(event), clock, outlets)
            amid = False
    finally:
        if not amid:
            _deliver(None, tracker.finish(), clock, outlets)


def close(clock: Clock, outlets: Outlets) -> None:
    """Close links and log in order, after a run however it ended; what the links still sent is logged."""
    last = outlets.links.close()
    _enter(None, Step(outlets.monitor.state), last, clock.now_ns(), outlets, last=True)
    if outlets.recorder is not None:
        outlets.recorder.close()
    if outlets.telemetry is not None:
        outlets.telemetry.close(outlets.surroundings)


def _deliver(event: Event | None, step: Step, clock: Clock, outlets: Outlets) -> None:
    """Give one step to every outlet, the autopilots first."""
    now_ns = clock.now_ns()
    sent = outlets.links.send(step, now_ns)
    _enter(event, step, sent, now_ns, outlets)
    if outlets.status is not None:
        outlets.status.show(now_ns, lambda: _reading(outlets))


def _enter(
    event: Event | None, step: Step, sent: tuple[Sent, ...], now_ns: int, outlets: Outlets, *, last: bool = False
) -> None:
    """Enter one turn into the figures and the log."""
    outlets.monitor.take(event, step, sent)
    if outlets.recorder is not None:
        outlets.recorder.take(event, step, sent, now_ns, outlets.hearer.take(outlets.links, now_ns, last=last))
    if outlets.telemetry is not None:
        outlets.telemetry.take(event, step, sent, now_ns, outlets.surroundings)


def _reading(outlets: Outlets) -> Reading:
    alarms = () if outlets.telemetry is None else outlets.telemetry.alarms()
    return outlets.monitor.reading(outlets.links.link_states(), outlets.log_state(), outlets.links.far_ends(), alarms)
