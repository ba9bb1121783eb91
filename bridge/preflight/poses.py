"""The bridge's own poses while it is checked: where they say the vehicle is, how often they go, and how late."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from bridge.ned import NedFrame
from bridge.wire import Sent
from tracker.maths import so3
from tracker.standing import Health
from tracker.types import Array, Estimate, Step, TrackState

POSES = ("VISION_POSITION_ESTIMATE", "ODOMETRY", "ATT_POS_MOCAP")
CAMERA, SEND = "camera", "send"
_KEPT = 4096


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """One pose, as autopilots read it. p_N: (3,) [m].  R_FtoN: (3, 3).  euler: (3,) roll, pitch, yaw [rad]."""

    t_ns: int
    p_N: Array
    R_FtoN: Array
    euler: Array


@dataclass(frozen=True, slots=True)
class Timing:
    """How old one pose was when it left, and where the time went.

    stages_ns: by name, in order: from mid-exposure to the frame in memory, the tracker's own, packing and sending.
    """

    t_ns: int
    stages_ns: tuple[tuple[str, int], ...]

    @property
    def age_ns(self) -> int:
        """Return its age [ns]."""
        return sum(duration_ns for _, duration_ns in self.stages_ns)


class PoseWatch:
    """Watch every turn of the loop.

    poses: the newest, oldest first.  timings: of those that left.  estimates: how many there were.
    state: the track's.  health: what was last said of the cameras' stand, None before.
    """

    def __init__(self, room_yaw_deg: float) -> None:
        self._frame = NedFrame(room_yaw_deg)
        self._estimates: deque[tuple[Estimate, int]] = deque(maxlen=64)
        self.poses: deque[Pose] = deque(maxlen=_KEPT)
        self.timings: deque[Timing] = deque(maxlen=_KEPT)
        self.estimates = 0
        self.state = TrackState.SEARCHING
        self.health: Health | None = None

    def take(self, step: Step, sent: tuple[Sent, ...], now_ns: int) -> Pose | None:
        """Take one turn, and return its newest pose, None for none.

        now_ns: stream time just before the estimates were sent [ns].
        """
        self.state = step.state
        self.health = step.health or self.health
        for estimate in step.estimates:
            self.estimates += 1
            self._estimates.append((estimate, now_ns))
            self.poses.append(_pose_of(self._frame, estimate))
        for record in sent:
            if record.message in POSES:
                self._take_sending(record)
        return self.poses[-1] if step.estimates else None

    def since(self, since_ns: int) -> list[Pose]:
        """Return the kept poses stamped from an instant on [ns]."""
        return [pose for pose in self.poses if pose.t_ns >= since_ns]

    def timings_in(self, window_ns: tuple[int, int]) -> list[Timing]:
        """Return the timings of poses stamped within a window of time [ns], each once."""
        first_ns, last_ns = window_ns
        return list({each.t_ns: each for each in self.timings if first_ns <= each.t_ns <= last_ns}.values())

    def _take_sending(self, record: Sent) -> None:
        for estimate, now_ns in reversed(self._estimates):
            if estimate.t_ns == record.t_ns:
                self.timings.append(_timing(estimate, now_ns, record.sent_ns))
                return


def _timing(estimate: Estimate, now_ns: int, sent_ns: int) -> Timing:
    """Split a pose's age: stream time and stopwatch both stand at the moment before sending."""
    tracked_ns = sum(estimate.stages_ns.values())
    camera_ns = now_ns - estimate.t_ns - tracked_ns
    send_ns = max(sent_ns - estimate.available_ns - tracked_ns, 0) if estimate.available_ns else 0
    return Timing(estimate.t_ns, ((CAMERA, camera_ns), *estimate.stages_ns.items(), (SEND, send_ns)))


def _pose_of(frame: NedFrame, estimate: Estimate) -> Pose:
    ned = frame.turn(estimate)
    return Pose(estimate.t_ns, np.array(ned.p_BinN), so3.from_euler(*ned.euler), np.array(ned.euler))
