"""The flight plan: wait for origin and position, arm, take off, hover, a square, a landing; a step every 20 ms."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from bridge.ned import rotation_from_room
from tools.simulate.autopilot.reports import GUIDED, LAND
from tools.simulate.mission import Mission, Phase, Reference
from tools.sitl.world import World
from tracker.errors import OperatorError

SET_MODE, ARM, TAKE_OFF, SET_INTERVAL = 176, 400, 22, 511
"""MAV_CMD numbers."""

RATES_HZ = {193: 10.0, 32: 25.0, 33: 2.0, 30: 25.0}
"""EKF_STATUS_REPORT, LOCAL_POSITION_NED, GLOBAL_POSITION_INT, ATTITUDE."""

_RETRY_S, _TARGET_S = 1.0, 0.04
_SWING_S = 6.0
_RUNS, _POSITION = 0x400, 0x33F
_TARGET_MASK = 0b1000_0000_0000  # position, velocity, acceleration and yaw count; yaw rate does not


class FlightError(OperatorError):
    """The autopilot did not do what the plan wants, within its time."""


class Flight:
    """The ground station's part of a flight, as generators that are taken up again every 20 ms.

    mission: the path in the room.  room_yaw: heading of the room's x axis [rad].
    origin: latitude, longitude [deg] and altitude [m] to tell the autopilot; None leaves that to the bridge, and it is
        only awaited.
    """

    def __init__(self, mission: Mission, room_yaw: float, origin: tuple[float, float, float] | None = None) -> None:
        self.mission = mission
        self._origin = origin
        self._room_yaw = room_yaw
        self._R_WtoN = rotation_from_room(room_yaw)
        self.rotor_on = False
        self.marks_ns: dict[str, int] = {}

    def radio(self) -> tuple[int, ...]:
        """Return the radio's channels: sticks in the middle, collective low, channel 8 the rotor."""
        return (1500, 1500, 1000, 1500, 1500, 1500, 1500, 2000 if self.rotor_on else 1000)

    def plan(self, world: World, rehearsal: Iterator[None]) -> Iterator[None]:
        """Fly; the rehearsal of faults, if any, comes after the hover."""
        yield from self.up(world)
        yield from self._follow(world, Phase.HOVER)
        yield from rehearsal
        yield from self._follow(world, Phase.SQUARE)
        yield from self._follow(world, Phase.TURN)
        yield from self._land(world)

    def up(self, world: World) -> Iterator[None]:
        """Wait for origin and position, arm, take off, and stand still at the mission's home point."""
        yield from self._prepare(world)
        yield from self._arm(world)
        yield from self._take_off(world)

    def swing(self, world: World) -> Iterator[None]:
        """Go to and fro between the home point and the one opposite, endlessly, as a pendulum does."""
        home, start_ns = self.mission.corners_inW[0], world.now_ns
        rate = 2.0 * np.pi / _SWING_S
        while True:
            angle = rate * (world.now_ns - start_ns) / 1e9
            p, v = float(np.cos(angle)) * home, -rate * float(np.sin(angle)) * home
            self._aim(world, Reference(Phase.HOVER, p, v, -(rate**2) * p, 0.0, 0.0))
            yield from _wait(world, _TARGET_S)

    def hold(self, world: World, seconds: float) -> Iterator[None]:
        """Stay at the mission's home point for a while."""
        start, _ = self.mission.span_s(Phase.HOVER)
        reference = self.mission.reference_at(start)
        until_ns = world.now_ns + round(seconds * 1e9)
        while world.now_ns < until_ns:
            self._aim(world, reference)
            yield from _wait(world, _TARGET_S)

    def _prepare(self, world: World) -> Iterator[None]:
        world.phase = "boot"
        yield from _until(world, lambda: "HEARTBEAT" in world.ground.last, 60.0, "heartbeat")
        self._mark(world, "heartbeat")
        for message, rate_hz in RATES_HZ.items():
            yield from self._command(world, SET_INTERVAL, message, 1e6 / rate_hz)
        yield from _until(world, lambda: _runs(world), 60.0, "EKF running")
        if self._origin is not None:
            self._tell_origin(world, self._origin)
        yield from _until(world, lambda: _knows_position(world), 90.0, "EKF position")
        self._mark(world, "position")

    def _tell_origin(self, world: World, origin: tuple[float, float, float]) -> None:
        latitude_deg, longitude_deg, altitude_m = origin
        world.ground.say(
            "SET_GPS_GLOBAL_ORIGIN",
            target_system=1,
            latitude=round(1e7 * latitude_deg),
            longitude=round(1e7 * longitude_deg),
            altitude=round(1e3 * altitude_m),
        )

    def _arm(self, world: World) -> Iterator[None]:
        world.phase = "arm"
        yield from self._command(world, SET_MODE, 1, GUIDED)
        for _ in range(60):
            world.ground.command(ARM, 1)
            yield from _wait(world, _RETRY_S)
            if world.ground.acks.get(ARM) == 0 and _armed(world):
                self.rotor_on = True
                self._mark(world, "armed")
                return
        reasons = "; ".join(dict.fromkeys(text for _, text in world.ground.texts if "rm:" in text))
        raise FlightError(f"sitl: it did not arm within 60 s: {reasons or 'no reason given'}")

    def _take_off(self, world: World) -> Iterator[None]:
        world.phase = Phase.TAKE_OFF
        home = self.mission.corners_inW[0]
        height_m = float(home[2] - self.mission.ground_inW[2])
        world.wanted_inW = home
        for _ in range(40):
            world.ground.command(TAKE_OFF, 0, 0, 0, 0, 0, 0, height_m)
            yield from _wait(world, _RETRY_S)
            if world.ground.acks.get(TAKE_OFF) == 0:
                break
        else:
            raise FlightError(f"sitl: take-off was refused (command 22 gives {world.ground.acks.get(TAKE_OFF)})")
        yield from _until(world, lambda: world.history[-1].p_BinW[2] > home[2] - 0.1, 60.0, "take-off height")
        self._mark(world, "up")
        yield from _wait(world, 1.0)
        yield from self.hold(world, 5.0)

    def _follow(self, world: World, phase: Phase) -> Iterator[None]:
        """Give the mission's reference as a moving target."""
        world.phase = phase
        start_s, end_s = self.mission.span_s(phase)
        start_ns = world.now_ns
        self._mark(world, phase)
        while (t_s := start_s + (world.now_ns - start_ns) / 1e9) < end_s:
            self._aim(world, self.mission.reference_at(t_s))
            yield from _wait(world, _TARGET_S)

    def _land(self, world: World) -> Iterator[None]:
        world.phase = Phase.LAND
        world.wanted_inW = self.mission.ground_inW
        self._mark(world, Phase.LAND)
        yield from self._command(world, SET_MODE, 1, LAND)
        yield from _until(world, lambda: not _armed(world), 90.0, "disarming after the landing")
        self._mark(world, "landed")
        self.rotor_on = False
        world.phase = Phase.DONE

    def _aim(self, world: World, reference: Reference) -> None:
        world.wanted_inW = reference.p
        there = reference.turned(self._R_WtoN, self._room_yaw)
        x, y, z = there.p.tolist()
        vx, vy, vz = there.v.tolist()
        afx, afy, afz = there.a.tolist()
        world.ground.say(
            "SET_POSITION_TARGET_LOCAL_NED",
            target_system=1,
            target_component=1,
            coordinate_frame=1,
            type_mask=_TARGET_MASK,
            **{"x": x, "y": y, "z": z, "vx": vx, "vy": vy, "vz": vz, "afx": afx, "afy": afy, "afz": afz},
            yaw=float(np.remainder(there.yaw + np.pi, 2.0 * np.pi) - np.pi),
        )

    def _command(self, world: World, number: int, *values: float) -> Iterator[None]:
        """Command until it is accepted."""
        for _ in range(10):
            world.ground.command(number, *values)
            yield from _wait(world, 0.2)
            if world.ground.acks.get(number) == 0:
                return
        raise FlightError(f"sitl: command {number} gives {world.ground.acks.get(number)} instead of 0 (accepted)")

    def _mark(self, world: World, what: str) -> None:
        self.marks_ns[what] = world.now_ns


def _runs(world: World) -> bool:
    flags = world.ground.field("EKF_STATUS_REPORT", "flags")
    return flags is not None and not int(flags) & _RUNS


def _knows_position(world: World) -> bool:
    """Say whether the filter has position and origin: its flags alone prove no origin."""
    flags, latitude = (
        world.ground.field(*each) for each in (("EKF_STATUS_REPORT", "flags"), ("GLOBAL_POSITION_INT", "lat"))
    )
    return flags is not None and int(flags) & _POSITION == _POSITION and latitude not in (None, 0.0)


def _armed(world: World) -> bool:
    return bool(int(world.ground.field("HEARTBEAT", "base_mode") or 0) & 128)


def _wait(world: World, seconds: float) -> Iterator[None]:
    until_ns = world.now_ns + round(seconds * 1e9)
    while world.now_ns < until_ns:
        yield


def _until(world: World, there: Callable[[], bool], seconds: float, what: str) -> Iterator[None]:
    until_ns = world.now_ns + round(seconds * 1e9)
    while not there():
        if world.now_ns >= until_ns:
            texts = "; ".join(text for _, text in world.ground.texts[-5:])
            raise FlightError(f"sitl: no {what} within {seconds:g} s; last said: {texts or 'nothing'}")
        yield
