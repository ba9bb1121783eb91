"""Helicopter, wind, floor and autopilot in lockstep: the vehicle that a simulated source shows."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from bridge.ned import rotation_from_room
from tools.simulate.autopilot.imu import Imu, ImuNoise
from tools.simulate.autopilot.origins import Origin
from tools.simulate.autopilot.parameters import FOR_VISION
from tools.simulate.autopilot.vessel import Autopilot, Mode
from tools.simulate.control import PilotSticks
from tools.simulate.course import Course
from tools.simulate.helicopter import Helicopter, State, Sticks, standing, step
from tools.simulate.mission import Phase, Reference
from tools.simulate.wind import Wind
from tracker.sources.paths import Pose
from tracker.types import Array

STEP_NS = 2_500_000
TICK_STEPS = 8


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What is given: the room and how late the autopilot hears of it.

    floor_z_m: the floor in W: the volume of 1.5 m height has the room's origin in its middle.
    room_yaw_deg: heading of the room's x axis, as the bridge is told it [deg].
    gust_m_s, gust_memory_s: light draught, one sigma, and how long a gust lasts.
    delay_ns: from mid-exposure until the frame is with the tracker; the autopilot is told it as its VISO_DELAY_MS.
    origin: what a ground station tells the autopilot of where it is; None leaves that to the bridge.
    """

    floor_z_m: float = -0.75
    room_yaw_deg: float = 0.0
    gust_m_s: float = 0.05
    gust_memory_s: float = 1.0
    delay_ns: int = 30_000_000
    origin: Origin | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One autopilot tick as it truly was. p_BinW, commanded_inW: (3,) [m]."""

    t_ns: int
    phase: Phase
    mode: Mode
    p_BinW: Array
    R_BtoW: Array
    commanded_inW: Array
    commanded_yaw: float


class Flown(Protocol):
    """What the vehicle is to fly: `mission.Mission`, or a hover for excitation."""

    ground_inW: Array
    """Where it stands before (3,) [m]."""

    def reference_at(self, t_s: float) -> Reference:
        """Return the reference at t_s since arming."""


@dataclass(slots=True, eq=False)
class World:
    """A room in which time goes on only when asked.

    `pose_at` simulates on to the time asked for: physics at 400 Hz, the autopilot at 50 Hz. Between two calls whatever
    is sent to the autopilot's port waits there and is heard at its next tick. The seed sets the gusts; the same seed
    and datagrams give the same flight. excitation: see `Autopilot`.
    """

    mission: Flown
    start_ns: int
    surroundings: Surroundings = field(default_factory=Surroundings)
    helicopter: Helicopter = field(default_factory=Helicopter)
    seed: int = 0
    excitation: Callable[[float], PilotSticks] | None = None
    history: list[Moment] = field(default_factory=list, init=False)
    autopilot: Autopilot = field(init=False)
    _wind: Wind = field(init=False)
    _imu: Imu = field(init=False)
    _sticks: Sticks = field(default_factory=Sticks, init=False)
    _course: Course = field(init=False)
    _steps: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Stand the vehicle on the floor and switch the autopilot on."""
        given = self.surroundings
        room_yaw = math.radians(given.room_yaw_deg)
        R_WtoN = rotation_from_room(room_yaw)
        self.autopilot = Autopilot(
            lambda t_s: self.mission.reference_at(t_s).turned(R_WtoN, room_yaw),
            {**FOR_VISION, "VISO_DELAY_MS": round(given.delay_ns / 1e6)},
            origin=given.origin,
            excitation=self.excitation,
        )
        self._imu = Imu(ImuNoise(), np.random.default_rng((self.seed, 2)))
        self._wind = Wind(given.gust_m_s, given.gust_memory_s, STEP_NS / 1e9, np.random.default_rng((self.seed, 1)))
        place = self.mission.ground_inW
        start = standing(self.helicopter, given.floor_z_m, (float(place[0]), float(place[1])))
        self._course = Course(self.start_ns, start, STEP_NS)

    def pose_at(self, t_ns: int) -> Pose:
        """Return the true pose at t_ns [ns], simulating on to it; before the start it stands."""
        while self._course.now_ns < t_ns:
            self._advance()
        return self._course.pose_at(t_ns)

    def hear(self, now_ns: int) -> None:
        """Let the autopilot read what has come by now_ns [ns], with no step between."""
        self.autopilot.hear(now_ns)

    def close(self) -> None:
        """Let go of the autopilot's port."""
        self.autopilot.close()

    def _advance(self) -> None:
        """Move on by one step of the physics."""
        now_ns, state = self._course.now_ns, self._course.back(0)
        if self._steps % TICK_STEPS == 0:
            increment = self._imu.read(self._course.back(TICK_STEPS), state, TICK_STEPS * STEP_NS / 1e9)
            self._sticks = wired(self.autopilot.tick(now_ns, increment))
            self._note(now_ns, state)
        self._steps += 1
        floor_z_m = self.surroundings.floor_z_m
        self._course.add(step(self.helicopter, state, self._sticks, self._wind.blow(), floor_z_m, STEP_NS / 1e9))

    def _note(self, now_ns: int, state: State) -> None:
        pilot = self.autopilot
        wanted = self.mission.reference_at(pilot.mission_s)
        self.history.append(Moment(now_ns, wanted.phase, pilot.mode, state.p_BinW, state.R_BtoW, wanted.p, wanted.yaw))


def wired(pilot: PilotSticks) -> Sticks:
    """Wire a pilot's sticks to the servos: the body's y is left and its z is up, so two of them turn about."""
    return Sticks(pilot.right, -pilot.nose_up, -pilot.nose_right, pilot.up, pilot.motor)
