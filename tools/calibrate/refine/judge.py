"""Whether mended cameras are good enough to fly by, judged by stretches of the flight that they were not fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tools.calibrate.grade import Grade
from tools.calibrate.refine.equations import equations
from tools.calibrate.refine.evidence import Instant
from tools.calibrate.refine.solve import Refined, with_offsets
from tools.calibrate.room.worth import CameraWorth, Three, Worth, three
from tracker.health.rays import residuals
from tracker.health.sample import MOTION
from tracker.maths import so3
from tracker.rig import Rig, make_rig

GOOD_MM, USABLE_MM = 2.0, 5.0  # one sigma of the vehicle's place, of the whole distance
GOOD_PX, USABLE_PX = 0.5, 1.5  # held out


@dataclass(frozen=True, slots=True)
class HeldOut:
    """What some cameras make of stretches held out.

    reprojection_px: of balls off their places, on an axis, rms.  epipolar_px: of rays that miss each other, rms, see
    `tracker.standing`.  spacing_mm, worst_spacing_mm: by how much distances of balls err, median and 95 % of them.
    """

    reprojection_px: float
    epipolar_px: float
    spacing_mm: float
    worst_spacing_mm: float


@dataclass(frozen=True, slots=True)
class Move:
    """How one camera moved: its turn about its own axes x (right), y (down), z (ahead) [deg], its shift along them.

    rays_mm: how far its rays may miss the vehicle now, one sigma.
    """

    name: str
    turn_deg: Three
    shift_mm: Three
    rays_mm: float


@dataclass(frozen=True, slots=True)
class Clock:
    """By how much later than its stamps a camera sees by the first one's clock, all told, and one sigma of it."""

    name: str
    offset_ms: float
    sigma_ms: float


@dataclass(frozen=True, slots=True)
class Judged:
    """The result. clocks: none where they are known.  instants: held out.  off_mm, sigma_mm: see `Refined`.

    worth: for the room file.
    """

    moves: tuple[Move, ...]
    clocks: tuple[Clock, ...]
    instants: int
    before: HeldOut
    after: HeldOut
    off_mm: float
    sigma_mm: float
    worth: Worth

    @property
    def grade(self) -> Grade:
        """Return how good the mended cameras are."""
        return self.worth.grade

    @property
    def reason(self) -> str:
        """Say why in words."""
        known = f"The vehicle stood {self.off_mm:.1f} mm off; its place is known to {self.sigma_mm:.2f} mm now."
        if self.after.reprojection_px > GOOD_PX:
            return f"{known} But balls still miss by {self.after.reprojection_px:.2f} px: something else moved too."
        return known if self.sigma_mm <= GOOD_MM else f"{known} Fly through more of the room, or calibrate it anew."


def judge(rig: Rig, refined: Refined, held_out: Sequence[Instant]) -> Judged:
    """Hold what was held out against the cameras as they were, and as they are now."""
    mended = make_rig(refined.cameras, rig.marker)
    timed = with_offsets(held_out, refined.offsets_s) if refined.unknowns.clock_s > 0.0 else held_out
    before, after = _held_out(rig, held_out, refined), _held_out(mended, timed, refined)
    moves = tuple(_move(rig, refined, k) for k in range(len(refined.unknowns.bumped)))
    return Judged(
        moves, _clocks(refined), len(held_out), before, after, refined.off_mm, refined.sigma_mm,
        _worth(refined, after),
    )  # fmt: skip


def _grade(sigma_mm: float, reprojection_px: float) -> Grade:
    """Grade what the vehicle's place is known to, and what was held out."""
    if sigma_mm <= GOOD_MM and reprojection_px <= GOOD_PX:
        return Grade.GOOD
    return Grade.USABLE if sigma_mm <= USABLE_MM and reprojection_px <= USABLE_PX else Grade.NOT_GOOD


def _worth(refined: Refined, after: HeldOut) -> Worth:
    grade = _grade(refined.sigma_mm, after.reprojection_px)
    reasons = () if grade is Grade.GOOD else (
        f"the vehicle's place is known to {refined.sigma_mm:.2f} mm, good is {GOOD_MM:g} mm; balls miss by "
        f"{after.reprojection_px:.2f} px, good is {GOOD_PX:g} px",
    )  # fmt: skip
    return Worth(
        grade, reasons, refined.sigma_mm / math.sqrt(3.0), float(refined.places_mm.max()) / math.sqrt(3.0),
        after.spacing_mm, after.worst_spacing_mm, after.reprojection_px, after.epipolar_px,
        tuple(_camera_worth(refined, k) for k in range(len(refined.unknowns.bumped))),
    )  # fmt: skip


def _camera_worth(refined: Refined, k: int) -> CameraWorth:
    """Return what a mended camera is known to, its turn about its own axes."""
    index, start = refined.unknowns.bumped[k], MOTION * k
    camera, P = refined.cameras[index], refined.covariance
    turn = camera.R_CtoW.T @ P[start + 3 : start + 6, start + 3 : start + 6] @ camera.R_CtoW
    position_mm = 1e3 * np.sqrt(np.diag(P)[start : start + 3])
    clock_ms = 1e3 * refined.clock_sigma_s(index)
    return CameraWorth(camera.name, three(position_mm), three(np.degrees(np.sqrt(np.diag(turn)))), clock_ms)


def _clocks(refined: Refined) -> tuple[Clock, ...]:
    if not refined.unknowns.clock_s:
        return ()
    return tuple(
        Clock(camera.name, camera.clock_offset_ns / 1e6, 1e3 * refined.clock_sigma_s(c))
        for c, camera in enumerate(refined.cameras[1:], 1)
    )


def _held_out(rig: Rig, instants: Sequence[Instant], refined: Refined) -> HeldOut:
    off_px: list[float] = []
    longer_mm: list[float] = []
    for instant in instants:
        off, longer = residuals(instant.sightings, rig)
        off_px, longer_mm = off_px + off, longer_mm + [1e3 * abs(x) for x in longer]
    rest_px = [rest for each in equations(instants, rig, refined.unknowns) for rest in each.rest() / each.one.weight]
    middle, worst = np.quantile(longer_mm, (0.5, 0.95)).tolist() if longer_mm else (math.nan, math.nan)
    return HeldOut(_rms(rest_px), _rms(off_px), middle, worst)


def _move(rig: Rig, refined: Refined, k: int) -> Move:
    index = refined.unknowns.bumped[k]
    old, new = rig.cameras[index], refined.cameras[index]
    turn_deg = np.degrees(so3.log(old.R_CtoW.T @ new.R_CtoW))
    shift_mm = 1e3 * old.R_CtoW.T @ (new.p_CinW - old.p_CinW)
    return Move(old.name, three(turn_deg), three(shift_mm), refined.rays_mm[k])


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan
