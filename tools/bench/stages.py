"""The loop's parts with a stopwatch on each, for `posebridge bench speed`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import ParamSpec, TypeVar

from bridge.clock import Nanoseconds
from bridge.histogram import Histogram
from bridge.links import Link
from bridge.monitor import Monitor
from bridge.pack import Packer
from bridge.summary import Percentiles
from bridge.wire import LinkState, Message, Sent
from tracker.types import Estimate, Event, Step

P = ParamSpec("P")
R = TypeVar("R")


class Stages:
    """Times calls by the stage they belong to, and sums what belongs to one pair."""

    def __init__(self, stopwatch: Nanoseconds) -> None:
        self._stopwatch = stopwatch
        self._running: dict[str, int] = {}
        self._histograms: dict[str, Histogram] = {}

    def time(self, stage: str, call: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Call and add the time it took to the stage's."""
        started_ns = self._stopwatch()
        result = call(*args, **kwargs)
        self._running[stage] = self._running.get(stage, 0) + self._stopwatch() - started_ns
        return result

    def end_pair(self) -> None:
        """Count what the stages came to since the last pair."""
        for stage, took_ns in self._running.items():
            self._histograms.setdefault(stage, Histogram()).add(took_ns)
        self._running.clear()

    def percentiles(self) -> dict[str, Percentiles]:
        """Return each stage's spread over the pairs [ms]."""
        return {stage: histogram.percentiles() for stage, histogram in self._histograms.items()}


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
