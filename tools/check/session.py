"""One `posebridge check`, put together: cameras and link as in `run`, and the check beside the loop."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack

from rich.console import Console

from bridge.clock import Clock, HostClock
from bridge.outlet import Outlet
from bridge.pace import Paced, first_time_ns
from bridge.preflight.preflight import Given, Preflight
from bridge.preflight.rules import figure
from bridge.preflight.verdict import Section, Write
from bridge.run import Steps
from bridge.settings import Settings, load_settings
from tools.check.page import to_json, to_text
from tools.check.request import CheckRequest
from tools.check.script import Script
from tools.open_source import open_source
from tools.request import Clocks
from tools.screen import screen
from tools.session import links_of, tracker_of
from tools.steady import steady
from tracker.errors import OperatorError
from tracker.types import Event, Rejected, Silence, Step, TrackState

SERIAL = "serial:"
TICK_S = 0.02


def run_check(request: CheckRequest, clocks: Clocks) -> bool:
    """Check, show the page on stdout, and say whether it passed.

    Raises:
        OperatorError: a source or link that cannot be opened, no autopilot, or a source that ends before the check.
    """
    settings = _settings(request)
    console = screen(stderr=True)
    with ExitStack() as stack:
        events, clock, tracker = _sight(request, settings, clocks, console, stack)
        outlet = links_of(settings, clocks)
        stack.callback(outlet.close)
        script = Script(request, Preflight(given(settings, request)), outlet, Terminal(console, request.as_json))
        stack.enter_context(steady())
        check(events, tracker, clock, outlet, script)
    return script.passed


def check(events: Iterable[Event], tracker: Steps, clock: Clock, outlet: Outlet, script: Script) -> None:
    """Run the loop until the check is done.

    Raises:
        OperatorError: the source ended before.
    """
    outlet.listen(clock.now_ns)
    for event in events:
        if not isinstance(event, Rejected):
            clock.follow(event)
        step = tracker.step(event)
        now_ns = clock.now_ns()
        sent = outlet.send(step, now_ns)
        script.take(step, sent, now_ns)
        if script.done:
            return
    raise OperatorError("check: the source ended before the check did; give a longer one, or a shorter --duration_s")


def given(settings: Settings, request: CheckRequest) -> Given:
    """Return what the check needs of the config."""
    (link,) = settings.links
    return Given(
        room_yaw_deg=settings.room.room_yaw_deg,
        messages=link.messages,
        system_id=settings.mavlink.system_id,
        origin=settings.origin is not None,
        serial=link.uri.startswith(SERIAL),
        max_age_ms=settings.mavlink.max_age_ms,
        poses=request.has_poses,
    )


class Blind:
    """No tracker: nothing is seen."""

    def step(self, _event: Event) -> Step:
        """Take one event."""
        return Step(TrackState.SEARCHING)

    def finish(self) -> Step:
        """Have nothing held back."""
        return Step(TrackState.SEARCHING)


class Terminal:
    """Speak on stderr, show the page on stdout, ask on the terminal."""

    def __init__(self, console: Console, as_json: bool) -> None:
        self._console = console
        self._as_json = as_json

    def tell(self, text: str) -> None:
        """Say what is being done, or what to do."""
        self._console.print(f"posebridge: {text}", soft_wrap=True)

    def show(self, sections: tuple[Section, ...], unchecked: tuple[str, ...]) -> None:
        """Show the page."""
        if self._as_json:
            sys.stdout.write(to_json(sections, unchecked) + "\n")
            return
        page = screen()
        for row in to_text(sections, unchecked):
            page.print(row, soft_wrap=True)

    def ask(self, wanted: tuple[Write, ...]) -> bool:
        """Ask whether these may be written.

        Raises:
            OperatorError: nobody is there to be asked.
        """
        if not sys.stdin.isatty():
            raise OperatorError("--apply: no terminal to ask on; add --yes to write without asking")
        for write in wanted:
            self.tell(f"would set {write.name} {figure(write.value)}" + (", reboot needed" if write.reboot else ""))
        return self._console.input("posebridge: write these? [y/N] ", markup=False).strip().lower() in ("y", "yes")


def _settings(request: CheckRequest) -> Settings:
    settings = load_settings(request.config).with_links(() if request.link is None else (request.link,))
    if len(settings.links) != 1:
        raise OperatorError(
            f"check: the config has {len(settings.links)} links; one autopilot is checked at a time, name it by --link"
        )
    return settings


def _sight(
    request: CheckRequest, settings: Settings, clocks: Clocks, console: Console, stack: ExitStack
) -> tuple[Iterable[Event], Clock, Steps]:
    """Open the source, if there is to be one, with the clock it goes by and the tracker."""
    if not request.has_poses:
        return _ticks(clocks), HostClock(clocks.monotonic), Blind()
    opened = open_source(request.source, settings, clocks)
    stack.enter_context(opened.source)
    for warning in opened.warnings:
        console.print(f"posebridge: warning: {warning}", style="yellow", soft_wrap=True)
    tracker = tracker_of(settings, opened.chosen.rig, clocks)
    if opened.live:
        return iter(opened.source), HostClock(clocks.monotonic), tracker
    start_ns, events = first_time_ns(opened.source)
    clock = HostClock(clocks.monotonic, start_ns)
    return Paced(events, clock, clocks.sleep_s, clocks.stopwatch), clock, tracker


def _ticks(clocks: Clocks) -> Iterator[Event]:
    """Let time go on with no camera."""
    while True:
        clocks.sleep_s(TICK_S)
        yield Silence(clocks.monotonic())
