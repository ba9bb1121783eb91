"""Our yaw against the vehicle's motion, watched while it flies: a wrong one flies it away without any failsafe."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from bridge.dialect import enum, make_message, message_id
from bridge.dialogue.peer import Peer
from bridge.dialogue.yaw_watch import NOTHING, YawReading, YawWatch
from bridge.wire import Message, Received
from tracker.types import Array

ATTITUDE = "ATTITUDE"
RATE_HZ = 10.0
ASK_NS = 5_000_000_000
FRESH_NS = 300_000_000
KEPT = 256  # tilts: five seconds of them at 50 Hz
LOOK_NS = 500_000_000


class HeadingWatch:
    """Watch one link's vehicle. reading: what is known, nothing while it is disarmed."""

    def __init__(self) -> None:
        self._armed = False
        self._tilt_ns: int | None = None
        self._tilts: deque[tuple[int, float, float]] = deque(maxlen=KEPT)  # when each came, roll and pitch
        self._asked_ns: int | None = None
        self._begin()

    def _begin(self) -> None:
        """Know nothing."""
        self._watch = YawWatch()
        self._look_ns: int | None = None
        self.reading: YawReading = NOTHING

    def take(self, attitude: Received) -> None:
        """Take the autopilot's own attitude; one without numbers teaches nothing, now or ever."""
        roll, pitch = attitude.number("roll"), attitude.number("pitch")
        if not (math.isfinite(roll) and math.isfinite(pitch)):
            return
        self._tilt_ns = attitude.arrived_ns
        self._tilts.append((self._tilt_ns, roll, pitch))

    def take_pose(self, t_ns: int, v_N: Sequence[float] | Array, yaw: float, armed: bool) -> None:
        """Take our velocity, north first [m/s], and yaw [rad] at t_ns; a vehicle in the hand proves nothing.

        It is held against the tilt of its own instant, since a pose may have waited for later rounds: in a circle a
        later tilt looks like a wrong yaw.

        armed: whether it may be flying.
        """
        if armed != self._armed:
            self._begin()
            self._armed = armed
        tilts = self._tilts
        while len(tilts) > 1 and abs(tilts[1][0] - t_ns) <= abs(tilts[0][0] - t_ns):
            tilts.popleft()
        if not armed or not tilts or abs(tilts[0][0] - t_ns) > FRESH_NS:
            return
        self._watch.take_tilt(*tilts[0][1:])
        self._watch.take_pose(t_ns, v_N, yaw)
        if self._look_ns is None or t_ns - self._look_ns >= LOOK_NS:
            self._look_ns = t_ns
            self.reading = self._watch.reading()

    def due(self, peer: Peer, now_ns: int, rate_hz: float = RATE_HZ) -> Message | None:
        """Return the question for its attitude, while that does not come by itself; None for nothing.

        rate_hz: at which others want it too; no less than RATE_HZ is asked for [Hz].
        """
        fresh = self._tilt_ns is not None and now_ns - self._tilt_ns <= FRESH_NS
        if fresh or (self._asked_ns is not None and now_ns - self._asked_ns < ASK_NS):
            return None
        self._asked_ns = now_ns
        return make_message(
            "COMMAND_LONG", now_ns, ATTITUDE, target_system=peer.system_id, target_component=peer.component_id,
            command=enum("MAV_CMD_SET_MESSAGE_INTERVAL"), param1=float(message_id(ATTITUDE)),
            param2=1e6 / max(rate_hz, RATE_HZ),
        )  # fmt: skip
