"""The check rehearsed: a simulated autopilot, a hand that holds it, true poses; in simulated time, no threads."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from bridge.dialect import Encoder, Identity, make_message
from bridge.dialogue import Origin, Terms
from bridge.links import MemoryLink, open_link
from bridge.outlet import Outlet, Spout
from bridge.pack import Packer
from bridge.preflight.preflight import Given, Preflight
from bridge.preflight.verdict import Line, Mark, Section, Write
from tests.tools.check.hand import Hand
from tests.tools.check.px4_stand_in import StandIn
from tools.check.request import CheckRequest
from tools.check.script import Script
from tools.check.session import check
from tools.simulate.autopilot.imu import Imu, ImuNoise
from tools.simulate.autopilot.parameters import FOR_VISION
from tools.simulate.autopilot.vessel import Autopilot
from tools.simulate.course import Course
from tools.simulate.helicopter import State
from tools.sitl.wire import UdpWire
from tracker.maths import so3
from tracker.types import Array, Estimate, Event, Silence, Step, TrackState

START_NS = 50_000_000_000
STEP_NS = 2_000_000
ROUND, FINE_ROUND = 10, 2  # steps between two of the autopilot's rounds; its gyro's readings are means over one
TRACK_NS = 5_000_000
AS_DELAYED = {**FOR_VISION, "VISO_DELAY_MS": 35, "SERIAL1_BAUD": 921}
"""An autopilot as config/ardupilot-heli.parm has it, for a camera delay of 30 ms and 5 ms of tracking."""


@dataclass(frozen=True)
class Mistake:
    """What is wrong, nothing by default.

    parameters: of the autopilot, in place of the right ones.  mirror: (3, 3), put between truth and estimate in W.
    marker_deg: the marker's x axis turned against the nose, clockwise seen from above.  room_yaw_deg: told less true.
    late_ns: stamps later than the instant.  origin: whether the config has one.  silent: the autopilot is off.
    second: another autopilot talks on the link.  blind: nothing is tracked.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    mirror: Array = field(default_factory=lambda: np.eye(3))
    marker_deg: float = 0.0
    room_yaw_deg: float = 0.0
    late_ns: int = 0
    origin: bool = True
    silent: bool = False
    second: bool = False
    blind: bool = False


class Rehearsal:
    """One check.

    room_yaw_deg: heading of the room's x axis, as it truly is [deg].  autopilot: None for the simulated one.
    """

    def __init__(
        self,
        mistake: Mistake,
        room_yaw_deg: float = 30.0,
        rate_hz: float = 30.0,
        autopilot: Autopilot | StandIn | None = None,
    ) -> None:
        self._mistake = mistake
        self._rate_hz = rate_hz
        self.hand = Hand(math.radians(room_yaw_deg))  # nose to north
        p_BinW, R_BtoW = self.hand.pose_at(0.0)
        rest = State(p_BinW, R_BtoW, np.zeros(3), np.zeros(3), np.zeros(2), 0.0)
        self._course = Course(START_NS, rest, STEP_NS)
        booted_ns = START_NS - 30_000_000_000
        self.autopilot = autopilot or Autopilot(None, {**AS_DELAYED, **mistake.parameters}, booted_ns=booted_ns)
        self._imu = Imu(ImuNoise(), np.random.default_rng(1))
        self._noise = np.random.default_rng(2)
        self._wire = UdpWire(("127.0.0.1", self.autopilot.port))
        self._stranger = Encoder(Identity(2, 1))
        told_deg = room_yaw_deg + mistake.room_yaw_deg
        encoder = Encoder(Identity(1))
        link = open_link("memory:rehearsal", encoder, self.now_ns)
        assert isinstance(link, MemoryLink)
        self._link = link
        terms = Terms(origin=Origin(32.1, 34.8, 30.0) if mistake.origin else None)
        self.outlet = Outlet([Spout(link, terms, encoder)], Packer(told_deg))
        self.given = Given(told_deg, None, None, mistake.origin, False, 100.0)
        self.told: list[str] = []
        self.sections: tuple[Section, ...] = ()
        self.unchecked: tuple[str, ...] = ()
        self.asked: tuple[Write, ...] = ()
        self.answer = True
        self._steps = 0
        self._round = ROUND

    def check(self, **asked: bool) -> bool:
        """Check it all, and say whether it passed."""
        how = {"frame": False, "wiggle": False, "apply": False, "yes": False, **asked}
        self._round = FINE_ROUND if how["wiggle"] else ROUND
        request = CheckRequest("lab", "sim:hand", None, 5.0, as_json=False, **how)
        script = Script(request, Preflight(self.given), self.outlet, self)
        try:
            check(self._events(), self, self, self.outlet, script)
        finally:
            self._wire.close()
            self.autopilot.close()
        return script.passed

    def lines(self, *marks: Mark) -> dict[str, Line]:
        """Return the page's lines of these marks, by what they look at."""
        return {line.what: line for section in self.sections for line in section.lines if line.mark in marks}

    # The voice.

    def tell(self, text: str) -> None:
        """Let the hand hear."""
        self.told.append(text)
        self.hand.hear(text, self._now_s)

    def show(self, sections: tuple[Section, ...], unchecked: tuple[str, ...]) -> None:
        """Keep the page."""
        self.sections, self.unchecked = sections, unchecked

    def ask(self, wanted: tuple[Write, ...]) -> bool:
        """Answer as set."""
        self.asked = wanted
        return self.answer

    # The clock.

    def now_ns(self) -> int:
        """Return the time [ns]."""
        return self._course.now_ns

    def follow(self, event: Event) -> None:
        """Go by itself."""

    # The tracker.

    def step(self, event: Event) -> Step:
        """Give the true pose of the instant, with a tracker's noise and with the mistake."""
        assert isinstance(event, Silence)
        self._advance(self.now_ns() + TRACK_NS)
        if self._mistake.blind:
            return Step(TrackState.SEARCHING)
        p_BinW, R_BtoW = self._course.pose_at(event.t_ns)
        before, _ = self._course.pose_at(event.t_ns - STEP_NS)
        v_BinW = (p_BinW - before) / (STEP_NS / 1e9)
        M = self._mistake.mirror
        R_MtoB = so3.from_euler(0.0, 0.0, -math.radians(self._mistake.marker_deg))
        estimate = Estimate(
            event.t_ns + self._mistake.late_ns,
            M @ p_BinW + self._noise.normal(0.0, 0.001, 3),
            M @ R_BtoW @ (np.eye(3) if np.linalg.det(M) > 0 else np.diag([1.0, -1.0, 1.0])) @ R_MtoB
            @ so3.exp(self._noise.normal(0.0, 0.003, 3)),
            M @ v_BinW + self._noise.normal(0.0, 0.02, 3),
            np.zeros(3),
            1e-6 * np.eye(12),
            TrackState.TRACKING,
            0,
            available_ns=self.now_ns() - TRACK_NS,
            stages_ns={"track": TRACK_NS},
        )  # fmt: skip
        return Step(TrackState.TRACKING, estimates=(estimate,))

    def finish(self) -> Step:
        """Have nothing held back."""
        return Step(TrackState.TRACKING)

    @property
    def _now_s(self) -> float:
        return (self.now_ns() - START_NS) / 1e9

    def _events(self) -> Iterator[Event]:
        """Yield the instants of the pictures, each when it has become known."""
        frame = 0
        while True:
            t_ns = START_NS + round(frame * 1e9 / self._rate_hz)
            self._advance(t_ns + 30_000_000)
            yield Silence(t_ns)
            frame += 1

    def _advance(self, until_ns: int) -> None:
        """Let time go on: hand, autopilot, and what they say to each other."""
        while self.now_ns() < until_ns:
            t_s = self._now_s + STEP_NS / 1e9
            p_BinW, R_BtoW = self.hand.pose_at(t_s)
            last = self._course.back(0)
            v_BinW = (p_BinW - last.p_BinW) / (STEP_NS / 1e9)
            w_BinB = so3.log(last.R_BtoW.T @ R_BtoW) / (STEP_NS / 1e9)
            self._course.add(State(p_BinW, R_BtoW, v_BinW, w_BinB, np.zeros(2), 0.0))
            self._steps += 1
            if not self._mistake.silent:
                self._talk()

    def _talk(self) -> None:
        """Pass on what each has said; the autopilot does its rounds and answers in between."""
        for _ in range(len(self._link.frames)):
            self._wire.send(self._link.frames.popleft())
        if self._steps % self._round == 0:
            before, now = self._course.back(self._round), self._course.back(0)
            self.autopilot.tick(self.now_ns(), self._imu.read(before, now, self._round * STEP_NS / 1e9))
        else:
            self.autopilot.hear(self.now_ns())
        for datagram in self._wire.receive():
            self._link.deliver(datagram)
        if self._mistake.second and self._steps % 500 == 250:
            beat = make_message("HEARTBEAT", self.now_ns(), type=2, autopilot=3, mavlink_version=3)
            self._link.deliver(self._stranger(beat, 0))
