"""Whether mended cameras are good enough to fly by, judged by stretches of the flight that they were not fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tools.calibrate.grade import Grade
from tools.calibrate.refine.evidence import Instant
from tools.calibrate.refine.solve import SIGMA_PX, Refined
from tracker.health.rays import residuals
from tracker.health.sample import linearised
from tracker.maths import so3
from tracker.rig import Rig, make_rig

GOOD_MM, USABLE_MM = 2.0, 5.0  # one sigma of the vehicle's place
GOOD_PX, USABLE_PX = 0.5, 1.5  # held out


@dataclass(frozen=True, slots=True)
class HeldOut:
    """What some cameras make of stretches held out, rms.

    reprojection_px: of balls off their places, on an axis.  epipolar_px, spacing_mm: see `tracker.standing`.
    """

    reprojection_px: float
    epipolar_px: float
    spacing_mm: float


@dataclass(frozen=True, slots=True)
class Move:
    """How one camera moved: its turn about its own axes x (right), y (down), z (ahead) [deg], its shift along them."""

    name: str
    turn_deg: tuple[float, float, float]
    shift_mm: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Judged:
    """The result. instants: held out.  off_mm, sigma_mm: see `Refined`."""

    moves: tuple[Move, ...]
    instants: int
    before: HeldOut
    after: HeldOut
    off_mm: float
    sigma_mm: float

    @property
    def grade(self) -> Grade:
        """Return how good the mended cameras are."""
        if self.sigma_mm <= GOOD_MM and self.after.reprojection_px <= GOOD_PX:
            return Grade.GOOD
        well = self.sigma_mm <= USABLE_MM and self.after.reprojection_px <= USABLE_PX
        return Grade.USABLE if well else Grade.NOT_GOOD

    @property
    def reason(self) -> str:
        """Say why in words."""
        known = f"The vehicle stood {self.off_mm:.1f} mm off; its place is known to {self.sigma_mm:.1f} mm now."
        if self.after.reprojection_px > GOOD_PX:
            return f"{known} But balls still miss by {self.after.reprojection_px:.2f} px: something else moved too."
        return known if self.sigma_mm <= GOOD_MM else f"{known} Fly through more of the room, or calibrate it anew."


def judge(rig: Rig, refined: Refined, bumped: Sequence[int], held_out: Sequence[Instant]) -> Judged:
    """Hold what was held out against the cameras as they were, and as they are now."""
    after = make_rig(refined.cameras, rig.marker)
    moves = tuple(_move(rig, after, index) for index in bumped)
    return Judged(
        moves, len(held_out), _held_out(rig, held_out), _held_out(after, held_out), refined.off_mm, refined.sigma_mm
    )


def _held_out(rig: Rig, instants: Sequence[Instant]) -> HeldOut:
    off_px: list[float] = []
    longer_mm: list[float] = []
    rest_px: list[float] = []
    for instant in instants:
        off, longer = residuals(instant.sightings, rig)
        off_px, longer_mm = off_px + off, longer_mm + [1e3 * x for x in longer]
        one = linearised(instant.sightings, instant.state, rig, SIGMA_PX)
        if one is not None:
            rest_px += ((one.r - one.J @ np.linalg.lstsq(one.J, one.r)[0]) / one.weight).tolist()
    return HeldOut(_rms(rest_px), _rms(off_px), _rms(longer_mm))


def _move(before: Rig, after: Rig, index: int) -> Move:
    old, new = before.cameras[index], after.cameras[index]
    x, y, z = np.degrees(so3.log(old.R_CtoW.T @ new.R_CtoW)).tolist()
    right, down, ahead = (1e3 * old.R_CtoW.T @ (new.p_CinW - old.p_CinW)).tolist()
    return Move(old.name, (x, y, z), (right, down, ahead))


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan
