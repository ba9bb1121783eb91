"""The loop's parts with a stopwatch on each, for `posebridge bench speed`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import TypeVar, TypeVarTuple

from bridge.alarms import Alarm
from bridge.clock import Nanoseconds
from bridge.heard import Heard
from bridge.links import Link
from bridge.monitor import Monitor
from bridge.pack import Packer
from bridge.recorder import RecorderState
from bridge.run import Records, Steps, Watches
from bridge.telemetry.states import Surroundings
from bridge.wire import LinkState, Message, Sent
from tracker.departure import HELD
from tracker.types import Estimate, Event, Step

Ts = TypeVarTuple("Ts")
R = TypeVar("R")
IDLE = frozenset({"wait", HELD})  # of the tracker's stages those that are no work


class Stages:
    """Times calls by the stage they belong to, and sums what belongs to one pair."""

    def __init__(self, stopwatch: Nanoseconds) -> None:
        self._stopwatch = stopwatch
        self._running: defaultdict[str, int] = defaultdict(int)

    def time(self, stage: str, call: Callable[[*Ts], R], *args: *Ts) -> R:
        """Call and add the time it took to the stage's."""
        stopwatch, running = self._stopwatch, self._running
        started_ns = stopwatch()
        result = call(*args)
        running[stage] += stopwatch() - started_ns
        return result

    def add(self, stage: str, took_ns: int) -> None:
        """Add a time that was taken elsewhere."""
        self._running[stage] += took_ns

    def end_pair(self) -> dict[str, int]:
        """Return what each stage came to since the last pair [ns]."""
        ended, self._running = self._running, defaultdict(int)
        return ended


class TimedTracker:
    """Times the tracker: its own stages as its estimates give them, all else it does as `intake`."""

    def __init__(self, tracker: Steps, stages: Stages, stopwatch: Nanoseconds) -> None:
        self._tracker = tracker
        self._timed = stages
        self._stopwatch = stopwatch

    def step(self, event: Event) -> Step:
        """Take one event."""
        started_ns = self._stopwatch()
        step = self._tracker.step(event)
        rest_ns = self._stopwatch() - started_ns
        for estimate in step.estimates:
            for stage, took_ns in estimate.stages_ns.items():
                if stage not in IDLE:
                    self._timed.add(stage, took_ns)
                    rest_ns -= took_ns
        self._timed.add("intake", rest_ns)
        return step

    def finish(self) -> Step:
        """Give what was still held back."""
        return self._tracker.finish()


class TimedPacker(Packer):
    """Times turning estimates into messages, as `pack`."""

    def __init__(self, room_yaw_deg: float, stages: Stages) -> None:
        super().__init__(room_yaw_deg)
        self._timed = stages

    def messages(self, estimate: Estimate, names: Iterable[str]) -> dict[str, Message]:
        """Return the messages named by name."""
        return self._timed.time("pack", super().messages, estimate, names)


class TimedLink:
    """Times framing and sending on a link, as `link`."""

    def __init__(self, link: Link, stages: Stages) -> None:
        self.name = link.name
        self._link = link
        self._timed = stages

    def send(self, message: Message) -> None:
        """Send the message."""
        self._timed.time("link", self._link.send, message)

    def sent(self) -> list[Sent]:
        """Return what has left since the last call."""
        return self._timed.time("link", self._link.sent)

    def receive(self) -> bytes:
        """Return the bytes that came in since the last call."""
        return self._link.receive()

    def listen(self, heard: Callable[[bytes], None]) -> None:
        """Give what comes in to `heard`."""
        self._link.listen(heard)

    def replaced(self) -> int:
        """Return how many messages a newer one has replaced so far."""
        return self._link.replaced()

    def state(self) -> LinkState:
        """Return how the link fares."""
        return self._link.state()

    def close(self) -> None:
        """Close the link."""
        self._link.close()


class TimedMonitor(Monitor):
    """Times the run's figures, as `monitor`."""

    def __init__(self, camera_names: tuple[str, ...], stages: Stages) -> None:
        super().__init__(camera_names)
        self._timed = stages

    def take(self, event: Event | None, step: Step, sent: tuple[Sent, ...]) -> None:
        """Count one turn."""
        self._timed.time("monitor", super().take, event, step, sent)


class TimedRecorder:
    """Times handing the steps to the log's thread, as `record`."""

    def __init__(self, recorder: Records, stages: Stages) -> None:
        self._recorder = recorder
        self._timed = stages

    def take(self, event: Event | None, step: Step, sent: tuple[Sent, ...], now_ns: int, heard: Heard) -> None:
        """Hand over one turn."""
        self._timed.time("record", self._recorder.take, event, step, sent, now_ns, heard)

    def state(self) -> RecorderState:
        """Say how the recording stands."""
        return self._recorder.state()

    def close(self) -> None:
        """End the recording."""
        self._recorder.close()


class TimedTelemetry:
    """Times alarms and the look for who listens, as `telemetry`."""

    def __init__(self, telemetry: Watches, stages: Stages) -> None:
        self._telemetry = telemetry
        self._timed = stages

    def take(
        self, event: Event | None, step: Step, sent: tuple[Sent, ...], now_ns: int, around: Callable[[], Surroundings]
    ) -> None:
        """Enter one turn."""
        self._timed.time("telemetry", self._telemetry.take, event, step, sent, now_ns, around)

    def alarms(self) -> tuple[Alarm, ...]:
        """Return the alarms that stand."""
        return self._telemetry.alarms()

    def close(self, around: Callable[[], Surroundings]) -> None:
        """Say the last word."""
        self._telemetry.close(around)
