"""The whole check of one autopilot: takes every turn of the loop, says what is due, and gives the page.

messages in, poses out -> hearing, poses, parameters -> lines, section by section
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from bridge.dialogue import PROFILES, DialogueState
from bridge.dialogue.peer import Autopilot, Peer
from bridge.preflight import ardupilot, px4
from bridge.preflight.budget import Budget, budget_of, delay_lines
from bridge.preflight.delay import Delay, TooLittle
from bridge.preflight.far_end import origin_line, port_line, port_note, who_lines
from bridge.preflight.frame_check import judge_frames, measured_rows
from bridge.preflight.fusion import fusion_lines
from bridge.preflight.guide import Guide
from bridge.preflight.hearing import Hearing
from bridge.preflight.parameters import ParameterClient
from bridge.preflight.poses import PoseWatch
from bridge.preflight.requests import ATTITUDE, GYRO, POSITION, STATUS, Requests, rates
from bridge.preflight.rules import Rule, judge, names_of
from bridge.preflight.said import said
from bridge.preflight.streams import camera_lines, link_line, pose_lines, time_line, track_line
from bridge.preflight.verdict import Line, Mark, Section
from bridge.preflight.wiggle import gyro_lag_s, wiggled
from bridge.wire import LinkState, Message, Received, Sent
from tracker.types import Step

WITH_VELOCITY = ("VISION_SPEED_ESTIMATE", "ODOMETRY")
FRAMES = "Frames"
BY_ARRIVAL = (
    "PX4 goes by the stamps once its TIMESYNC has had 500 answers, ten a second. Until then each pose counts as of its "
    "arrival, later by all of this: give the bridge a minute on the link before take-off."
)
_COMMAND_CHECKS, _ACCEPTED = 401, 0
_WOULD_ARM = 0x1000_0000  # MAV_SYS_STATUS_PREARM_CHECK


@dataclass(frozen=True, slots=True)
class Given:
    """What the config says that the check needs.

    messages: what the link is sent in place of its profile's messages, None for those.  system_id: the vehicle's, None
    for the first heard.  origin: one is configured.  serial: the link is a serial port.  poses: there are any to send.
    """

    room_yaw_deg: float
    messages: tuple[str, ...] | None
    system_id: int | None
    origin: bool
    serial: bool
    max_age_ms: float
    poses: bool = True


class Preflight:
    """Check the autopilot at the end of one link. It sends nothing itself: it says what is due.

    wiggle: what the wiggle showed, None before one.  guide: leads through the frame check, None before one.
    """

    def __init__(self, given: Given) -> None:
        self._given = given
        self._requests: Requests | None = None
        self._far: DialogueState | None = None
        self._asked_checks_ns: int | None = None
        self._gyro_since_ns = 0
        self.hearing = Hearing((POSITION, ATTITUDE, *STATUS.values(), *GYRO.values(), "COMMAND_ACK"))
        self.watch = PoseWatch(given.room_yaw_deg)
        self.parameters: ParameterClient | None = None
        self.wiggle: Delay | TooLittle | None = None
        self.guide: Guide | None = None

    @property
    def peer(self) -> Peer | None:
        """The autopilot, once heard."""
        return None if self._far is None else self._far.peer

    def take(
        self, step: Step, sent: tuple[Sent, ...], received: Iterable[Received], far: DialogueState, now_ns: int
    ) -> None:
        """Take one turn of the loop. far: what the link's talk knows.  now_ns: stream time before sending [ns]."""
        self._far = far
        pose = self.watch.take(step, sent, now_ns)
        if self.guide is not None and pose is not None:
            self.guide.take_bridge(pose.t_ns, pose.p_N, pose.euler)
        if far.peer is None:
            return
        if self._requests is None or self.parameters is None:
            self._requests, self.parameters = self._begin(far.peer)
        for message in received:
            if not self.hearing.take(message, far.peer):
                continue
            self.parameters.take(message)
            self._requests.take(message.message)
            if message.message == POSITION and self.guide is not None:
                self._show_guide(message, self.guide)

    def due(self, now_ns: int) -> list[Message]:
        """Return what is to be sent now, at most one of either kind [ns]."""
        asked = None if self._requests is None else self._requests.due(now_ns)
        read = None if self.parameters is None else self.parameters.due(now_ns)
        return [message for message in (asked, read) if message is not None]

    def farewell(self, now_ns: int) -> list[Message]:
        """Return what gives the autopilot's messages their usual rates back."""
        return [] if self._requests is None else self._requests.farewell(now_ns)

    def ask_checks(self, now_ns: int) -> None:
        """Let the autopilot run its own checks."""
        self._asked_checks_ns = now_ns
        if self._requests is not None:
            self._requests.want_checks()

    def begin_wiggle(self, now_ns: int) -> None:
        """Ask for the gyro, and count poses and gyro from now on [ns]."""
        self._gyro_since_ns = now_ns
        if self._requests is not None and self.peer is not None:
            self._requests.want(rates(self.peer.autopilot, gyro=True))

    def end_wiggle(self) -> None:
        """Find the delay in what came since the wiggle began."""
        self.wiggle = wiggled(self.hearing, self.watch.since(self._gyro_since_ns), self._far, self._gyro_since_ns)
        if self._requests is not None and self.peer is not None:
            self._requests.want(rates(self.peer.autopilot, gyro=False))

    def sections(self, link: LinkState, window_ns: tuple[int, int]) -> tuple[Section, ...]:
        """Return the page's sections. Only once there is a peer.

        window_ns: first and last instant by which the poses are judged; all else is judged from the first on [ns].
        """
        far, peer = self._far, self.peer
        if far is None or peer is None:
            return ()
        return (
            Section("Autopilot", (*who_lines(self.hearing, peer, self._given.system_id), self._origin(far))),
            Section("Parameters", tuple(self._parameter_lines(peer)), self._port_notes()),
            *(self._pose_sections(link, window_ns, far, peer) if self._given.poses else ()),
            self._said(window_ns[0]),
            *([self._frames()] if self.guide is not None else ()),
        )

    def _pose_sections(
        self, link: LinkState, window_ns: tuple[int, int], far: DialogueState, peer: Peer
    ) -> Iterator[Section]:
        profile, since_ns = PROFILES[far.profile], window_ns[0]
        sent = (f"sent: {', '.join(self._given.messages or profile.messages)} (profile {profile.name})",)
        poses = pose_lines(self.watch, profile, far.holding, window_ns, self._given.max_age_ms)
        lines = (track_line(self.watch), *camera_lines(self.watch), *poses, link_line(link), time_line(far.sync))
        yield Section("Poses", lines, sent)
        ours = self.watch.since(since_ns)
        yield Section("Fusion", tuple(fusion_lines(self.hearing, ours, far.sync, peer.autopilot, since_ns)))
        budget = self.budget(window_ns)
        known = {} if self.parameters is None else self.parameters.known
        delays = delay_lines(budget, peer.autopilot, far.sync, self.wiggle, self._lag_s(), known)
        notes = (*(() if budget is None else budget.rows()), *((BY_ARRIVAL,) if far.by_arrival else ()))
        yield Section("Delay", tuple(delays), notes)

    def _said(self, since_ns: int) -> Section:
        asked_ns = self._asked_checks_ns
        texts = [text for text in self.hearing.texts if text.arrived_ns >= (asked_ns or since_ns)]
        return said(texts, asked_ns is not None, self._checks_ran(asked_ns), self._ready())

    def _frames(self) -> Section:
        """Judge the guided moves."""
        if self.guide is None or not self.guide.done:
            waiting = "" if self.guide is None else self.guide.prompt
            line = Line(Mark.UNKNOWN, "frame check", "not finished", "four moves", f"it waited for you to: {waiting}")
            return Section(FRAMES, (line,))
        bridge, autopilot = self.guide.witnesses()
        return Section(
            FRAMES, judge_frames(bridge, autopilot, self._given.room_yaw_deg), tuple(measured_rows(bridge, autopilot))
        )

    def budget(self, window_ns: tuple[int, int]) -> Budget | None:
        """Return where the time goes, of poses stamped within a window of time [ns]."""
        sync = None if self._far is None else self._far.sync
        late_ms = 1e3 * (self.wiggle.late_s + self._lag_s()) if isinstance(self.wiggle, Delay) else None
        return budget_of(self.watch.timings_in(window_ns), sync, late_ms)

    def _begin(self, peer: Peer) -> tuple[Requests, ParameterClient]:
        """Begin to ask, knowing whom."""
        requests = Requests(peer)
        requests.want(rates(peer.autopilot, gyro=False))
        client = ParameterClient(peer.system_id, peer.component_id, peer.autopilot is Autopilot.PX4)
        client.read((*names_of(self._rules(peer)), *_more_names(peer.autopilot)))
        return requests, client

    def _show_guide(self, position: Received, guide: Guide) -> None:
        """Give the guide the autopilot's own position and its newest attitude."""
        attitude = self.hearing.last.get(ATTITUDE)
        if attitude is not None:
            p_N = np.array([position.number(axis) for axis in ("x", "y", "z")])
            angles = np.array([attitude.number(angle) for angle in ("roll", "pitch", "yaw")])
            guide.take_autopilot(position.arrived_ns, p_N, angles)

    def _rules(self, peer: Peer) -> tuple[Rule, ...]:
        profile = "generic" if self._far is None else self._far.profile
        messages = self._given.messages or PROFILES[profile].messages
        velocity = any(name in WITH_VELOCITY for name in messages)
        made = {Autopilot.ARDUPILOT: ardupilot.rules, Autopilot.PX4: px4.rules}.get(peer.autopilot)
        return () if made is None else made(velocity)

    def _parameter_lines(self, peer: Peer) -> Iterator[Line]:
        if self.parameters is None:
            return
        yield from judge(self._rules(peer), self.parameters.known)
        ports = port_line(self.parameters.known)
        if ports is not None:
            yield ports

    def _port_notes(self) -> tuple[str, ...]:
        note = "" if self.parameters is None or self._given.serial else port_note(self.parameters.known)
        return (note,) if note else ()

    def _origin(self, far: DialogueState) -> Line:
        return origin_line(far, self.hearing, self._given.origin)

    def _checks_ran(self, asked_ns: int | None) -> bool:
        acks = [] if asked_ns is None else self.hearing.since("COMMAND_ACK", asked_ns)
        return any(ack.whole("command") == _COMMAND_CHECKS and ack.whole("result") == _ACCEPTED for ack in acks)

    def _ready(self) -> bool | None:
        """Say whether a PX4 says that it would arm; ArduPilot says it in words."""
        status = self.hearing.last.get("SYS_STATUS")
        if status is None or self.peer is None or self.peer.autopilot is not Autopilot.PX4:
            return None
        return bool(status.whole("onboard_control_sensors_health") & _WOULD_ARM)

    def _lag_s(self) -> float:
        return 0.0 if self.parameters is None else gyro_lag_s(self.parameters.known)


def _more_names(autopilot: Autopilot) -> tuple[str, ...]:
    """Return the parameters that are read without a rule."""
    if autopilot is Autopilot.ARDUPILOT:
        return (ardupilot.DELAY, ardupilot.GYRO_FILTER, *ardupilot.port_names())
    return (px4.DELAY, *px4.port_names()) if autopilot is Autopilot.PX4 else ()
