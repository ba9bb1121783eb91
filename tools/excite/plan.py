"""An excitation plan: which stick moves when, how far, and how far the vehicle will go for it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bridge.settings import Settings, rig_of
from bridge.settings.vehicle import VehicleSettings
from tools.excite.manoeuvre import Kind, Manoeuvre, Sequence
from tools.simulate.dynamics import GRAVITY
from tools.sysid.parameters import AXES, Axis
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.rig import Rig
from tracker.types import Array

BAND_HZ = {Axis.ROLL: (0.5, 4.0), Axis.PITCH: (0.5, 4.0), Axis.YAW: (0.3, 3.0), Axis.HEAVE: (0.5, 3.0)}
"""From where the loop that holds the vehicle lets the input through, to where the answer drowns in noise."""

STEP_S = {Axis.ROLL: 0.25, Axis.PITCH: 0.25, Axis.YAW: 0.3, Axis.HEAVE: 0.3}
MOST = {Axis.ROLL: 0.45, Axis.PITCH: 0.45, Axis.YAW: 0.4, Axis.HEAVE: 0.4}
"""Of full stick: the loop works against it, and both together must stay off the stops, where no model is linear."""

STEP_SHARE = 0.85
"""Of that for steps: against one that lasts the loop has gone far when the next one helps it."""

BUDGET = 0.6
"""Share of the room there is that one manoeuvre may take; gusts and the loop's own wandering get the rest."""

_YAW_BUDGET = math.radians(45.0)
_SHARE_OF_SWEEP = {Axis.ROLL: 1.0, Axis.PITCH: 1.0, Axis.YAW: 0.5, Axis.HEAVE: 0.6}
_REST_S, _STEP_REST_S = 0.5, 1.2
_LEAST = 0.1
_SAMPLE_S = 0.01


@dataclass(frozen=True, slots=True)
class Planned:
    """One manoeuvre with what is expected of it: how far it goes off, and its top speed; m and m/s, for yaw rad."""

    manoeuvre: Manoeuvre
    excursion: float
    speed: float

    @property
    def unit(self) -> str:
        """Return the unit that the excursion is shown in."""
        return "deg" if self.manoeuvre.axis is Axis.YAW else "mm"

    @property
    def shown(self) -> float:
        """Return the excursion in that unit."""
        return math.degrees(self.excursion) if self.manoeuvre.axis is Axis.YAW else 1e3 * self.excursion

    def __str__(self) -> str:
        """The manoeuvre in a line."""
        move = self.manoeuvre
        band = f"{move.low_hz:g} to {move.high_hz:g} Hz" if move.kind is Kind.SWEEP else ""
        when = f"{move.start_s:6.2f} s for {move.duration_s:5.2f} s"
        what = f"{move.axis:5} {move.kind:7} {move.amplitude:4.0%} of full"
        return f"{when}  {what}  +-{self.shown:.0f} {self.unit}  {band}".rstrip()


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """A sequence, and how far the vehicle may go from the room's origin along each of the room's axes (3,) [m]."""

    planned: tuple[Planned, ...]
    half_m: Array

    @property
    def sequence(self) -> Sequence:
        """Return the manoeuvres alone."""
        return Sequence(tuple(each.manoeuvre for each in self.planned))


def make_plan(settings: Settings, sweep_s: float) -> Plan:
    """Plan a sweep of each axis, then doublets and 3-2-1-1 steps of each, which verify what the sweeps taught.

    Args:
        settings: with the vehicle's sheet and the room's volume.
        sweep_s: length of the cyclic sweeps [s]; the others are shorter.
    Raises:
        OperatorError: no sheet, or a volume too small to excite anything in.
    """
    vehicle = settings.vehicle
    if vehicle is None:
        raise OperatorError("excite: the config holds no [vehicle] sheet; add one (see the shipped lab config)")
    half_m = seen_half_m(rig_of(settings, None).rig, np.array(settings.room.volume_mm) / 2e3)
    room = {axis: BUDGET * float(min(half_m[:2])) for axis in (Axis.ROLL, Axis.PITCH)}
    room |= {Axis.YAW: _YAW_BUDGET, Axis.HEAVE: BUDGET * float(half_m[2])}
    planned: list[Planned] = []
    t_s = 0.0
    for axis in AXES:
        sweep = Manoeuvre(axis, Kind.SWEEP, t_s, sweep_s * _SHARE_OF_SWEEP[axis], MOST[axis], *BAND_HZ[axis])
        planned.append(_fitted(sweep, vehicle, room[axis]))
        t_s = round(sweep.end_s + _REST_S, 3)
    for axis in AXES:
        wave_hz = round(0.5 / STEP_S[axis], 3)
        for kind, steps in ((Kind.DOUBLET, 2.0), (Kind.STEPS_3211, 7.0)):
            move = Manoeuvre(axis, kind, t_s, steps * STEP_S[axis], STEP_SHARE * MOST[axis], wave_hz, wave_hz)
            planned.append(_fitted(move, vehicle, room[axis]))
            t_s = round(move.end_s + _STEP_REST_S, 3)
    return Plan(tuple(planned), half_m)


def _fitted(wanted: Manoeuvre, vehicle: VehicleSettings, room: float) -> Planned:
    """Return the manoeuvre with as much amplitude as room, tilt and speed allow.

    Raises:
        OperatorError: too little of it is left to see an answer.
    """
    unit = Manoeuvre(wanted.axis, wanted.kind, wanted.start_s, wanted.duration_s, 1.0, wanted.low_hz, wanted.high_hz)
    way, speed = expected(unit, vehicle)
    limits = [wanted.amplitude, room / way]
    if wanted.axis in (Axis.ROLL, Axis.PITCH):
        limits.append(0.8 * vehicle.max_tilt_deg / vehicle.full_tilt_deg)
    if wanted.axis is not Axis.YAW:
        limits.append(vehicle.max_speed_m_s / speed)
    amplitude = math.floor(100.0 * min(limits)) / 100.0
    if amplitude < _LEAST:
        raise OperatorError(
            f"excite: a {wanted.axis} {wanted.kind} within {room:.2g} {'rad' if wanted.axis is Axis.YAW else 'm'} "
            f"leaves {amplitude:.0%} of full stick, at least {_LEAST:.0%} are needed; give it a larger [room] volume_mm"
        )
    fitted = Manoeuvre(
        wanted.axis, wanted.kind, wanted.start_s, wanted.duration_s, amplitude, wanted.low_hz, wanted.high_hz
    )
    return Planned(fitted, amplitude * way, amplitude * speed)


def expected(manoeuvre: Manoeuvre, vehicle: VehicleSettings) -> tuple[float, float]:
    """Return the excursion and the top speed with no drag and no loop against it: both are less in flight.

    Each is half of the way from one end to the other, its steady part taken out, as the loop does.
    Roll, pitch and heave in m and m/s; yaw in rad and rad/s.
    """
    count = math.ceil(manoeuvre.duration_s / _SAMPLE_S)
    sticks = np.array([manoeuvre.stick_at(manoeuvre.start_s + k * _SAMPLE_S) for k in range(count)])
    if manoeuvre.axis is Axis.YAW:
        rate = math.radians(vehicle.full_yaw_rate_deg_s) * sticks
        return _half_range(np.cumsum(rate) * _SAMPLE_S), float(np.abs(rate).max())
    full = vehicle.full_climb_m_s2
    if manoeuvre.axis is not Axis.HEAVE:
        full = GRAVITY * math.tan(math.radians(vehicle.full_tilt_deg))
    speed = np.cumsum(full * sticks) * _SAMPLE_S
    speed -= np.linspace(speed[0], speed[-1], count)
    return _half_range(np.cumsum(speed - speed.mean()) * _SAMPLE_S), float(np.abs(speed).max())


def _half_range(values: Array) -> float:
    return float(np.ptp(values)) / 2.0


def seen_half_m(rig: Rig, half_m: Array) -> Array:
    """Return how far the vehicle may go from the room's origin along each axis, both ways, and be seen whole (3,) [m].

    half_m: (3,) where the volume ends [m]. One axis at a time: so are the manoeuvres.

    Raises:
        OperatorError: not even in the middle is it seen.
    """
    reach_m = max(float(np.linalg.norm(ball.p_inB)) + ball.radius_m for ball in rig.marker.balls)
    return np.array([_seen_along(rig, axis, reach_m) for axis in np.diag(half_m)])


def _seen_along(rig: Rig, way_m: Array, reach_m: float) -> float:
    """Return how much of the way (3,) [m] from the origin, there and back, every camera sees a ball of reach_m on."""
    for share in np.linspace(1.0, 0.05, 39):
        if all(_sees(camera, sign * share * way_m, reach_m) for camera in rig.cameras for sign in (1.0, -1.0)):
            return float(share * np.linalg.norm(way_m))
    raise OperatorError("excite: the cameras do not see the room's origin; correct the config's [rig]")


def _sees(camera: Camera, p_inW: Array, reach_m: float) -> bool:
    p_inC = camera.R_CtoW.T @ (p_inW - camera.p_CinW)
    if p_inC[2] <= reach_m:
        return False
    u, v, _ = camera.K @ (p_inC / p_inC[2])
    edge_px = camera.K[0, 0] * reach_m / p_inC[2]
    return bool(edge_px <= u <= camera.width_px - edge_px and edge_px <= v <= camera.height_px - edge_px)
