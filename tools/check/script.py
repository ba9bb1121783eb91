"""The check from its beginning to its end, taken up again at every turn of the loop.

heard? -> parameters -> watch the poses -> its own checks -> frames -> wiggle -> page -> apply
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Protocol

from bridge.outlet import Outlet
from bridge.preflight.delay import Delay
from bridge.preflight.guide import Guide
from bridge.preflight.preflight import Preflight
from bridge.preflight.rules import figure
from bridge.preflight.verdict import Line, Section, Write, good, writes
from bridge.wire import Sent
from tools.check.request import CheckRequest
from tracker.errors import OperatorError
from tracker.types import Step

HEARD_S, READ_S, FIRST_POSE_S, CHECKS_S, ORIGIN_S = 6.0, 30.0, 20.0, 2.5, 20.0
FRAME_S, WIGGLE_S, LEAST_WIGGLE_S, TRY_S = 300.0, 45.0, 10.0, 3.0


class Voice(Protocol):
    """How the check speaks with the operator."""

    def tell(self, text: str) -> None:
        """Say what is being done, or what to do."""

    def show(self, sections: tuple[Section, ...], unchecked: tuple[str, ...]) -> None:
        """Show the page."""

    def ask(self, wanted: tuple[Write, ...]) -> bool:
        """Ask whether these may be written."""


class Script:
    """Check one autopilot.

    done: it is over.  passed: nothing failed and nothing stayed unseen.
    """

    def __init__(self, request: CheckRequest, preflight: Preflight, outlet: Outlet, voice: Voice) -> None:
        self._request = request
        self._preflight = preflight
        self._outlet = outlet
        self._voice = voice
        self._now_ns = 0
        self._window_ns = (0, 0)
        self._steps = self._run()
        self.done = False
        self.passed = False

    def take(self, step: Step, sent: tuple[Sent, ...], now_ns: int) -> None:
        """Take one turn of the loop, just after its poses went. now_ns: stream time before they did [ns].

        Raises:
            OperatorError: no autopilot is heard, or it is armed while parameters are to be written.
        """
        self._now_ns = now_ns
        received = [message for _, message in self._outlet.received()]
        (far,) = self._outlet.far_ends()
        self._preflight.take(step, sent, received, far, now_ns)
        if next(self._steps, self) is self:
            self.done = True
        self._outlet.say(self._preflight.due(now_ns))

    def _run(self) -> Iterator[None]:
        """Do it all, one turn at a time."""
        yield from self._meet()
        self._voice.tell("reading its parameters")
        yield from self._until(lambda: not self._busy, READ_S)
        yield from self._watch()
        if self._request.frame:
            yield from self._frame()
        if self._request.wiggle:
            yield from self._wiggle()
        self._outlet.say(self._preflight.farewell(self._now_ns))
        lines = self._page()
        if self._request.apply:
            yield from self._apply(lines)

    def _meet(self) -> Iterator[None]:
        yield from self._until(lambda: self._preflight.peer is not None, HEARD_S)
        peer = self._preflight.peer
        if peer is None:
            (link,) = self._outlet.link_states()
            why = f" ({link.reason})" if link.reason else ""
            raise OperatorError(
                f"link {link.name}: no autopilot heard within {HEARD_S:g} s{why}; check power, cable or address, "
                "the baud, and that its port speaks MAVLink (ArduPilot: SERIALn_PROTOCOL 2; PX4: MAV_n_CONFIG)"
            )
        self._voice.tell(f"{peer.autopilot} heard, system {peer.system_id}")

    def _watch(self) -> Iterator[None]:
        """Watch poses and autopilot while it stands, then let it run its own checks."""
        duration_s = self._request.duration_s
        if self._request.has_poses:
            yield from self._until(lambda: bool(self._preflight.watch.timings), FIRST_POSE_S)
            self._voice.tell(f"watching for {duration_s:g} s; leave the vehicle where it stands")
        since_ns = self._now_ns
        yield from self._for(duration_s if self._request.has_poses else 0.0)
        self._window_ns = (since_ns, self._now_ns)
        self._preflight.ask_checks(self._now_ns)
        yield from self._for(CHECKS_S)

    def _frame(self) -> Iterator[None]:
        """Lead through the four moves."""
        guide = self._preflight.guide = Guide()
        prompt, end_ns = "", self._now_ns + round(FRAME_S * 1e9)
        while not guide.done and self._now_ns < end_ns:
            if guide.prompt != prompt:
                prompt = guide.prompt
                self._voice.tell(f"frame check: {prompt}")
            yield
        self._voice.tell("frame check: done" if guide.done else "frame check: given up")

    def _wiggle(self) -> Iterator[None]:
        """Wait until the wiggle shows the delay, or for as long as a hand bears it."""
        self._voice.tell("wiggle: take it in your hands and turn it briskly to and fro about all axes, in sight")
        self._preflight.begin_wiggle(self._now_ns)
        end_ns = self._now_ns + round(WIGGLE_S * 1e9)
        yield from self._for(LEAST_WIGGLE_S)
        self._preflight.end_wiggle()
        while not isinstance(self._preflight.wiggle, Delay) and self._now_ns < end_ns:
            yield from self._for(TRY_S)
            self._preflight.end_wiggle()
        self._voice.tell("wiggle: done" if isinstance(self._preflight.wiggle, Delay) else "wiggle: given up")

    def _page(self) -> tuple[Line, ...]:
        (link,) = self._outlet.link_states()
        sections = self._preflight.sections(link, self._window_ns)
        lines = tuple(line for section in sections for line in section.lines)
        self.passed = good(lines)
        self._voice.show(sections, self._unchecked())
        return lines

    def _unchecked(self) -> tuple[str, ...]:
        """Return what this run did not look at."""
        asked = self._request
        left = (
            (not asked.has_poses, "poses, fusion and delay (name a --source)"),
            (not asked.frame, "axes and yaw (--frame)"),
            (not asked.wiggle, "the stamps' truth (--wiggle)"),
        )
        return tuple(what for lacking, what in left if lacking)

    def _apply(self, lines: tuple[Line, ...]) -> Iterator[None]:
        """Write what is wrong, after asking, and read it back."""
        wanted, parameters = writes(lines), self._preflight.parameters
        if not wanted or parameters is None:
            self._voice.tell("apply: there is nothing to write")
            return
        if self._preflight.hearing.armed:
            raise OperatorError("--apply: the autopilot is armed; disarm it first")
        if not self._request.yes and not self._voice.ask(wanted):
            self._voice.tell("apply: nothing was written")
            return
        for write in wanted:
            parameters.write(write.name, write.value)
        yield from self._until(lambda: not parameters.busy, READ_S)
        self._tell_written(wanted, parameters.refused)
        self.passed = False  # what was written is proved by the next check alone

    def _tell_written(self, wanted: tuple[Write, ...], refused: tuple[str, ...]) -> None:
        for write in wanted:
            outcome = "REFUSED: it holds another value, or did not answer" if write.name in refused else "read back"
            self._voice.tell(f"apply: {write.name} {figure(write.value)}: {outcome}")
        reboot = any(write.reboot for write in wanted if write.name not in refused)
        self._voice.tell("apply: reboot the autopilot, then check again" if reboot else "apply: check again")

    @property
    def _busy(self) -> bool:
        return self._preflight.parameters is None or self._preflight.parameters.busy

    def _until(self, over: Callable[[], bool], at_most_s: float) -> Iterator[None]:
        yield  # the clock is known from the first turn on
        end_ns = self._now_ns + round(at_most_s * 1e9)
        while not over() and self._now_ns < end_ns:
            yield

    def _for(self, seconds: float) -> Iterator[None]:
        end_ns = self._now_ns + round(seconds * 1e9)
        while self._now_ns < end_ns:
            yield
