"""Helicopter, floor and an autopilot's software in lockstep: the vehicle that the simulated cameras show."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bridge.ned import rotation_from_room
from bridge.wire import Received
from tools.simulate.course import Course
from tools.simulate.helicopter import Helicopter, State, Sticks, standing, step
from tools.simulate.wind import Wind
from tools.sitl.ground import GroundStation
from tools.sitl.relay import Relay
from tracker.sources.paths import Pose
from tracker.types import Array

STEP_NS = 1_000_000
TICK_STEPS = 20
FLOOR_Z_M = -0.75
_GUST_M_S, _GUST_MEMORY_S = 0.05, 1.0
_RATIOS = ("velocity_variance", "pos_horiz_variance", "pos_vert_variance", "compass_variance")


class Pilot(Protocol):
    """An autopilot's software: it is asked at every step of the physics."""

    def sticks(self, now_ns: int, course: Course) -> Sticks:
        """Return what the servos do from now_ns on, having been told how the vehicle moved until then."""

    def close(self) -> None:
        """Let go of it."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One instant, every 20 ms: what was true, what was wanted, what the autopilot believed.

    p_BinW, R_BtoW: the truth.  wanted_inW: where the flight plan wants it [m].  phase: the plan's.
    ekf_error_mm: of its newest LOCAL_POSITION_NED against the truth at that message's own time, None if there was none.
    flags, worst_ratio: of its newest EKF_STATUS_REPORT.  mode: its custom_mode.
    """

    t_ns: int
    phase: str
    p_BinW: Array
    R_BtoW: Array
    wanted_inW: Array
    ekf_error_mm: float | None
    flags: int
    worst_ratio: float
    mode: int


class World:
    """A room in which time goes on only when asked; the Vehicle of a `SimSource`.

    phase, wanted_inW: what the script says it does, noted with the truth in `history`.
    told_aside_inW: how far aside the poses sent are on purpose [m].
    """

    def __init__(
        self,
        pilot: Pilot,
        ground: GroundStation,
        relay: Relay,
        helicopter: Helicopter,
        start_ns: int,
        place_m: tuple[float, float],
        room_yaw_deg: float,
    ) -> None:
        start = standing(helicopter, FLOOR_Z_M, place_m)
        self._start_ns = start_ns
        self._R_WtoN = rotation_from_room(math.radians(room_yaw_deg))
        self._pilot = pilot
        self._relay = relay
        self._helicopter = helicopter
        self._wind = Wind(_GUST_M_S, _GUST_MEMORY_S, STEP_NS / 1e9, np.random.default_rng(1))
        self._course = Course(start_ns, start, STEP_NS)
        self._steps = 0
        self._script: Iterator[None] = iter(())
        self.ground = ground
        self.history: list[Sample] = []
        self.phase = "boot"
        self.wanted_inW: Array = start.p_BinW
        self.told_aside_inW: Callable[[], Array] = lambda: np.zeros(3)
        self.done = False

    def start(self, script: Iterator[None]) -> None:
        """Give the ground station its script, taken up again every 20 ms until it ends."""
        self._script = script

    @property
    def now_ns(self) -> int:
        """Return the time [ns]."""
        return self._course.now_ns

    def pose_at(self, t_ns: int) -> Pose:
        """Return the true pose at t_ns [ns], simulating on to it."""
        while self._course.now_ns < t_ns:
            self._advance()
        return self._course.pose_at(t_ns)

    def _advance(self) -> None:
        now_ns, state = self._course.now_ns, self._course.back(0)
        if self._steps % TICK_STEPS == 0:
            self._tick(now_ns, state)
        self._steps += 1
        self._relay.pump()
        sticks = self._pilot.sticks(now_ns, self._course)
        wind = self._wind.blow() if state.lift_n > 0.0 else np.zeros(3)
        self._course.add(step(self._helicopter, state, sticks, wind, FLOOR_Z_M, STEP_NS / 1e9))

    def _tick(self, now_ns: int, state: State) -> None:
        heard = self.ground.tick(now_ns)
        if not self.done:
            self.done = next(self._script, self) is self
        self.history.append(
            Sample(
                now_ns,
                self.phase,
                state.p_BinW,
                state.R_BtoW,
                self.wanted_inW,
                next((self._error_mm(each) for each in heard if each.message == "LOCAL_POSITION_NED"), None),
                int(self.ground.field("EKF_STATUS_REPORT", "flags") or 0),
                max(self.ground.field("EKF_STATUS_REPORT", name) or 0.0 for name in _RATIOS),
                int(self.ground.field("HEARTBEAT", "custom_mode") or 0),
            )
        )

    def _error_mm(self, local_position: Received) -> float:
        """Return how far the autopilot is wrong about itself, at the time since boot that its message tells."""
        boot_ms, *p_BinN = (local_position.fields[name] for name in ("time_boot_ms", "x", "y", "z"))
        p_BinW, _ = self._course.pose_at(self._start_ns + 1_000_000 * int(str(boot_ms)))
        told_inW = self._R_WtoN.T @ np.array(p_BinN, dtype=np.float64) - self.told_aside_inW()
        return 1e3 * float(np.linalg.norm(told_inW - p_BinW))
