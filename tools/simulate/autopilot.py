"""An autopilot that flies on what arrives at its UDP port, and on nothing else: no simulator's truth, no gyro."""

from __future__ import annotations

import socket
from collections.abc import Callable
from enum import StrEnum

from bridge.pack import HEARTBEAT, Reader
from bridge.wire import Received
from tools.simulate.control import Cascade, PilotSticks, Tuning
from tools.simulate.mission import Phase, Reference
from tools.simulate.navigation import Navigation, vision_pose

VISION_COMPONENT = 197
"""MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY: only its heartbeat and poses count."""

_BOOT_NS = 7_654_321_000
_ARMING_POSES, _ARMING_NS = 8, 500_000_000
_HOLD_NS = 2_000_000_000
_SINK = -0.12
_DATAGRAM_BYTES = 65535


class Mode(StrEnum):
    """What the autopilot does."""

    WAITING = "waiting"  # on the ground, for a heartbeat and steady poses
    FLYING = "flying"  # the mission
    HOLDING = "holding"  # no poses: level, mission stopped
    LANDING = "landing"  # no poses for long: down, level
    LANDED = "landed"


class Autopilot:
    """Listen, navigate, fly the mission.

    mission: reference in north-east-down by the time since arming [s].
    delay_ns: what an operator would set as VISO_DELAY_MS.
    Its clock counts from its own boot; no one tells it the bridge's.
    """

    def __init__(self, mission: Callable[[float], Reference], delay_ns: int, tuning: Tuning | None = None) -> None:
        tuning = tuning or Tuning()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(("127.0.0.1", 0))
        self._reader = Reader()
        self._mission = mission
        self._cascade = Cascade(tuning)
        self._heard = False
        self._steady_since_ns: int | None = None
        self._lost_since_ns: int | None = None
        self._last_ns: int | None = None
        self.navigation = Navigation(delay_ns, tuning.drag_1_s)
        self.mode = Mode.WAITING
        self.mission_s = 0.0

    @property
    def port(self) -> int:
        """The UDP port on 127.0.0.1 it listens at."""
        return int(self._socket.getsockname()[1])

    def tick(self, world_ns: int) -> PilotSticks:
        """Do one round: read what has come, decide, and return the sticks. world_ns drives its clock [ns]."""
        now_ns = world_ns + _BOOT_NS
        dt_s = 0.0 if self._last_ns is None else (now_ns - self._last_ns) / 1e9
        self._last_ns = now_ns
        for message in self._received():
            self._take(message, now_ns)
        self._decide(now_ns)
        return self._sticks(now_ns, dt_s)

    def reference(self) -> Reference:
        """Return what the mission asks for now."""
        return self._mission(self.mission_s)

    def close(self) -> None:
        """Let go of the port."""
        self._socket.close()

    def _received(self) -> list[Received]:
        messages = []
        while True:
            try:
                messages += self._reader.feed(self._socket.recv(_DATAGRAM_BYTES))
            except BlockingIOError:
                return messages

    def _take(self, message: Received, now_ns: int) -> None:
        if message.component_id != VISION_COMPONENT:
            return
        self._heard = self._heard or message.message == HEARTBEAT
        pose = vision_pose(message)
        if pose is not None:
            self.navigation.take(pose, now_ns)

    def _decide(self, now_ns: int) -> None:
        """Go on to the mode that health and mission call for."""
        healthy = self.navigation.healthy(now_ns)
        self._steady_since_ns = (self._steady_since_ns or now_ns) if healthy else None
        self._lost_since_ns = None if healthy else (self._lost_since_ns or now_ns)
        if self.mode is Mode.WAITING:
            steady = self._steady_since_ns is not None and now_ns - self._steady_since_ns >= _ARMING_NS
            if self._heard and steady and self.navigation.accepted >= _ARMING_POSES:
                self.mode = Mode.FLYING
        elif self.mode is not Mode.LANDED:
            if self._lost_since_ns is None:
                done = self.reference().phase is Phase.DONE
                self.mode = Mode.LANDED if done else Mode.FLYING
            else:
                self.mode = Mode.LANDING if now_ns - self._lost_since_ns >= _HOLD_NS else Mode.HOLDING

    def _sticks(self, now_ns: int, dt_s: float) -> PilotSticks:
        state = self.navigation.state_at(now_ns)
        if self.mode in (Mode.WAITING, Mode.LANDED) or state is None:
            return PilotSticks()
        if self.mode is Mode.FLYING:
            self.mission_s += dt_s
            return self._cascade.fly(self.reference(), state, dt_s)
        return self._cascade.level(0.0 if self.mode is Mode.HOLDING else _SINK)
