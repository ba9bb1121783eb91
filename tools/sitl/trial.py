"""One mistake tried on one autopilot: a vehicle that flies to and fro on true poses, spoiled for a while."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bridge.dialect import Encoder, Identity
from bridge.pack import Packer, heartbeat
from bridge.settings import Settings
from tools.simulate.autopilot.reports import LAND
from tools.simulate.helicopter import Helicopter
from tools.simulate.mission import Mission
from tools.sitl.aboard import Conditions, close, home_of, simulated, started
from tools.sitl.flight import Flight, FlightError
from tools.sitl.mistakes import AGE_MS, Mistake, Shot
from tools.sitl.wire import UdpWire
from tools.sitl.world import FLOOR_Z_M, Sample, World
from tracker.sources.sim import START_NS
from tracker.types import Estimate, TrackState, frozen_array

RATE_HZ = 30
_QUIET_S, _WATCH_S, _FROM_THE_START_S = 6.0, 6.0, 12.0
_LONGEST_S, _MISSION_S = 240.0, 45.0
_VELOCITY_NS = 5_000_000
_POSITION = 0x33F
_LOST_M = 30.0
"""So far off its path a vehicle does not come back, and nothing more is to be learned."""


@dataclass(frozen=True, slots=True)
class Trial:
    """What came of it, from the mistake's begin until some seconds after its end.

    off_path_mm: farthest from where it was told to be.  ekf_error_mm: the autopilot's worst error of its own position.
    worst_ratio: of its EKF_STATUS_REPORT.  lost_position: whether its flags ever said it has none.
    landed: whether it left guided flight by itself.  texts: what it said.
    grounded: why it never flew, empty if it did.
    """

    mistake: str
    off_path_mm: float
    ekf_error_mm: float
    worst_ratio: float
    lost_position: bool
    landed: bool
    texts: tuple[str, ...]
    grounded: str = ""


class _Teller:
    """Send the true pose, one every 1/30 s, with the mistake while it is on.

    on: whether it is made now.
    """

    def __init__(self, mistake: Mistake, world: World, port: int, room_yaw_deg: float) -> None:
        self._mistake = mistake
        self._world = world
        self._wire = UdpWire(("127.0.0.1", port))
        self._encode = Encoder(Identity(1))
        self._packer = Packer(room_yaw_deg)
        self._rng = np.random.default_rng(7)
        self._sequence = 0
        self._first: Estimate | None = None
        self.on = mistake.lasts_s is None

    def tell(self, number: int) -> None:
        """Let the pose of this number be seen, grow as old as poses are, and be sent."""
        t_ns = START_NS + round(number * 1e9 / RATE_HZ)
        self._world.pose_at(t_ns + self._mistake.age_ms * 1_000_000)
        truth = self._truth(t_ns)
        if number % RATE_HZ == 0:
            self._send(self._encode(heartbeat(t_ns), self._sequence))
        luck = float(self._rng.random())
        if not self.on:
            self._first = None
        elif self._first is None:
            self._first = truth
        told = truth if self._first is None else self._mistake.told(Shot(truth, self._first, luck))
        if told is None:
            return
        names = self._mistake.messages if self.on else self._mistake.messages[:2]
        for message in self._packer.messages(told, names).values():
            edited = self._mistake.edit(message) if self.on else message
            self._send(self._encode(edited, self._sequence))

    def close(self) -> None:
        """Close the wire."""
        self._wire.close()

    def _truth(self, t_ns: int) -> Estimate:
        p_BinW, R_BtoW = self._world.pose_at(t_ns)
        before, _ = self._world.pose_at(t_ns - _VELOCITY_NS)
        v_BinW = frozen_array((p_BinW - before) / (_VELOCITY_NS / 1e9))
        return Estimate(t_ns, p_BinW, R_BtoW, v_BinW, np.zeros(3), 1e-6 * np.eye(12), TrackState.TRACKING, 0)

    def _send(self, raw: bytes) -> None:
        self._wire.send(raw)
        self._sequence = (self._sequence + 1) % 256


class _Script:
    """Take off, fly to and fro, and make the mistake meanwhile.

    began: how many samples and texts there were when it began.
    """

    def __init__(self, mistake: Mistake, flight: Flight, teller: _Teller) -> None:
        self._mistake = mistake
        self._flight = flight
        self._teller = teller
        self.began = 0, 0

    def run(self, world: World) -> Iterator[None]:
        """Do it, taken up again every 20 ms."""
        yield from self._flight.up(world)
        swing = self._flight.swing(world)
        lasts_s = self._mistake.lasts_s
        if lasts_s is not None:
            yield from _for(world, swing, _QUIET_S)
        self.began = len(world.history), len(world.ground.texts)
        self._teller.on = True
        yield from _for(world, swing, _FROM_THE_START_S if lasts_s is None else lasts_s)
        self._teller.on = lasts_s is None
        yield from _for(world, swing, _WATCH_S)


def attempt(mistake: Mistake, settings: Settings, binary: Path | None, out: Path) -> Trial:
    """Fly one mistake.

    Args:
        mistake: to be made.  settings: where north is and where the room lies.
        binary: ArduPilot's program, None for the simulated autopilot.  out: folder for its files.
    Raises:
        OperatorError: no program there, or a config without an origin.
    """
    room_yaw_deg = settings.room.room_yaw_deg
    mission = Mission(_MISSION_S, FLOOR_Z_M + Helicopter.skid_m)
    home = home_of(settings)
    flight = Flight(mission, math.radians(room_yaw_deg), home)
    with ExitStack() as stack:
        given = Conditions(room_yaw_deg, home, AGE_MS, START_NS)
        aboard = simulated(given) if binary is None else started(binary, out, given, flight.radio, stack)
        stack.callback(close, aboard)
        place = (float(mission.ground_inW[0]), float(mission.ground_inW[1]))
        world = World(aboard.pilot, aboard.ground, aboard.relay, aboard.helicopter, START_NS, place, room_yaw_deg)
        teller = _Teller(mistake, world, aboard.relay.bridge_port, room_yaw_deg)
        stack.callback(teller.close)
        script = _Script(mistake, flight, teller)
        world.start(script.run(world))
        return _flown(mistake, world, script, teller)


def _flown(mistake: Mistake, world: World, script: _Script, teller: _Teller) -> Trial:
    try:
        for number in range(round(_LONGEST_S * RATE_HZ)):
            teller.tell(number)
            if world.done or _is_lost(world.history):
                break
    except FlightError as error:
        return replace(_outcome(mistake, world, script), grounded=str(error))
    return _outcome(mistake, world, script)


def _outcome(mistake: Mistake, world: World, script: _Script) -> Trial:
    samples, texts = script.began
    since = world.history[samples:]
    return Trial(
        mistake.name,
        max((1e3 * _off_m(each) for each in since), default=math.nan),
        max((each.ekf_error_mm for each in since if each.ekf_error_mm is not None), default=math.nan),
        max((each.worst_ratio for each in since), default=math.nan),
        any(each.flags & _POSITION != _POSITION for each in since),
        any(each.mode == LAND for each in since),
        tuple(text for _, text in world.ground.texts[texts:]),
    )


def _is_lost(history: Sequence[Sample]) -> bool:
    return bool(history) and _off_m(history[-1]) > _LOST_M


def _off_m(sample: Sample) -> float:
    return float(np.linalg.norm(sample.p_BinW - sample.wanted_inW))


def _for(world: World, swing: Iterator[None], seconds: float) -> Iterator[None]:
    until_ns = world.now_ns + round(seconds * 1e9)
    while world.now_ns < until_ns:
        next(swing)
        yield
