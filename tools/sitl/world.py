"""Helicopter, floor and an autopilot's software in lockstep: the vehicle that the simulated cameras show."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tools.simulate.course import Course
from tools.simulate.helicopter import Helicopter, State, Sticks, standing, step
from tools.simulate.wind import Wind
from tools.sitl.ground import GroundStation
from tracker.sources.paths import Pose
from tracker.types import Array

STEP_NS = 1_000_000
TICK_STEPS = 20
FLOOR_Z_M = -0.75
_GUST_M_S, _GUST_MEMORY_S = 0.05, 1.0


class Pilot(Protocol):
    """An autopilot's software: it is asked at every step of the physics."""

    def sticks(self, now_ns: int, course: Course) -> Sticks:
        """Return what the servos do from now_ns on, having been told how the vehicle moved until then."""

    def close(self) -> None:
        """Let go of it."""


class Script(Protocol):
    """What the ground station does, taken up again every 20 ms until it ends."""

    def __call__(self, world: World) -> Iterator[None]:
        """Go on."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One instant, every 20 ms: what was true, what was wanted, what the autopilot believed.

    p_BinW, v_BinW, R_BtoW: the truth.  wanted_inW: where the flight plan wants it [m].  phase: the plan's.
    """

    t_ns: int
    phase: str
    p_BinW: Array
    v_BinW: Array
    R_BtoW: Array
    wanted_inW: Array


class World:
    """A room in which time goes on only when asked; the Vehicle of a `SimSource`.

    phase, wanted_inW: what the script says it does, noted with the truth in `history`.
    rc_us: the radio's channels 1 to 8.
    """

    def __init__(
        self, pilot: Pilot, ground: GroundStation, helicopter: Helicopter, start_ns: int, place_m: tuple[float, float]
    ) -> None:
        start = standing(helicopter, FLOOR_Z_M, place_m)
        self._pilot = pilot
        self._helicopter = helicopter
        self._wind = Wind(_GUST_M_S, _GUST_MEMORY_S, STEP_NS / 1e9, np.random.default_rng(1))
        self._course = Course(start_ns, start, STEP_NS)
        self._steps = 0
        self._script: Iterator[None] = iter(())
        self.ground = ground
        self.history: list[Sample] = []
        self.phase = "boot"
        self.wanted_inW: Array = start.p_BinW
        self.done = False

    def start(self, script: Iterator[None]) -> None:
        """Give the ground station its script."""
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

    def velocity_at(self, t_ns: int) -> Array:
        """Return the true velocity at a time gone by."""
        return self._course.velocity_at(t_ns)

    def close(self) -> None:
        """Let go of autopilot and ground station."""
        self._pilot.close()
        self.ground.close()

    def _advance(self) -> None:
        now_ns, state = self._course.now_ns, self._course.back(0)
        if self._steps % TICK_STEPS == 0:
            self._tick(now_ns, state)
        self._steps += 1
        sticks = self._pilot.sticks(now_ns, self._course)
        wind = self._wind.blow() if state.lift_n > 0.0 else np.zeros(3)
        self._course.add(step(self._helicopter, state, sticks, wind, FLOOR_Z_M, STEP_NS / 1e9))

    def _tick(self, now_ns: int, state: State) -> None:
        self.ground.tick(now_ns)
        if not self.done:
            self.done = next(self._script, self) is self
        sample = Sample(now_ns, self.phase, state.p_BinW, state.v_BinW, state.R_BtoW, self.wanted_inW)
        self.history.append(sample)
