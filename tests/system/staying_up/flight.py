"""The real loop on real links and the real clock; a plan does with the far end what it will between two frames."""

from __future__ import annotations

import select
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic, monotonic_ns, perf_counter_ns

import numpy as np

from bridge.alarms import Limits
from bridge.clock import HostClock
from bridge.dialogue import DialogueState, Terms
from bridge.monitor import Monitor
from bridge.outlet import Outlet, open_outlet
from bridge.run import Outlets, close, run
from bridge.telemetry.gauges import Names
from bridge.telemetry.snapshot import About
from bridge.telemetry.telemetry import Telemetry
from bridge.wire import LinkState
from tests.bridge.estimates import estimate
from tests.bridge.recordings import recorder
from tracker.types import Event, Frame, Silence, Step, TrackState

PATIENCE_S = 60.0
IMAGE = np.zeros((2, 2, 3), np.uint8)
NAMES = Names(("cam0",), ("ball0",), (0.0,))

Plan = Iterator[None]
"""What happens at the far end, a frame of the cameras at each `yield`."""


class EveryFrame:
    """A tracker that is always right: an estimate for each frame, at once."""

    def step(self, event: Event) -> Step:
        made = (estimate(event.t_ns, available_ns=event.available_ns),) if isinstance(event, Frame) else ()
        return Step(TrackState.TRACKING, estimates=made)

    def finish(self) -> Step:
        return Step(TrackState.TRACKING)


@dataclass(eq=False)
class Flight:
    """One bridge. links: URI and terms of each.  log: recorded there, None for no log.  rate_hz: of the frames.

    alarms: names of all that were raised.  frames_us: stamps of the frames.
    """

    links: Sequence[tuple[str, Terms]] = ()
    log: Path | None = None
    rate_hz: float = 100.0
    alarms: set[str] = field(default_factory=set, init=False)
    frames_us: list[int] = field(default_factory=list, init=False)

    def fly(self, plan: Callable[[Flight], Plan], outlet: Outlet | None = None) -> None:
        """Run the loop until the plan has come to its end; outlet: in place of one with the flight's links."""
        outlet = outlet or open_outlet(self.links, component_id=197, room_yaw_deg=0.0, stopwatch=perf_counter_ns)
        monitor = Monitor(NAMES.cameras)
        self.telemetry = Telemetry(About("test"), NAMES, Limits(), monitor, None, perf_counter_ns)
        log = None if self.log is None else recorder(self.log, tlog=self.log.with_suffix(".tlog"))
        self.outlets = Outlets(outlet, monitor, log, None, self.telemetry)
        clock = HostClock(monotonic_ns)
        try:
            run(self._frames(plan(self)), EveryFrame(), clock, self.outlets)
        finally:
            close(clock, self.outlets)

    @property
    def outlet(self) -> Outlet:
        return self.outlets.links

    def far(self) -> DialogueState:
        """Return what is known of the first link's far end."""
        return self.outlet.far_ends()[0]

    def link(self) -> LinkState:
        """Return how the first link fares."""
        return self.outlet.link_states()[0]

    def stands(self, name: str) -> bool:
        """Say whether an alarm stands."""
        return name in {alarm.name for alarm in self.telemetry.alarms()}

    def status_line(self) -> str:
        """Return what the status line says of far ends and of alarms."""
        outlets = self.outlets
        reading = outlets.monitor.reading(
            outlets.links.link_states(), outlets.log_state(), outlets.links.far_ends(), self.telemetry.alarms()
        )
        return f"{reading.alarm} {' '.join(reading.far_ends)}"

    def _frames(self, plan: Plan) -> Iterator[Event]:
        """Give a frame for each step of the plan; one that takes a frame's time is paced by that alone."""
        for _ in plan:
            self.alarms |= {alarm.name for alarm in self.telemetry.alarms()}
            t_ns = monotonic_ns()
            self.frames_us.append(t_ns // 1000)
            yield Frame(0, t_ns, IMAGE, perf_counter_ns())
            select.select([], [], [], 1.0 / self.rate_hz)
            yield Silence(monotonic_ns())


def until(condition: Callable[[], bool], turn: Callable[[], object] = lambda: None) -> Plan:
    """Fly on, with a turn of the far end after each frame, until it is so; fail after a minute."""
    deadline = monotonic() + PATIENCE_S
    while not condition():
        assert monotonic() < deadline, "still not so after a minute"
        yield
        turn()
