"""What a calibration of the cameras' stand is worth, as the room file keeps it."""

from __future__ import annotations

from dataclasses import dataclass

from tools.calibrate.grade import Grade
from tools.calibrate.room.room import Room
from tools.calibrate.room.verdict import Verdict
from tracker.types import Array

Three = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class CameraWorth:
    """One sigma of a camera's place in the room, of its turn about its own x (right), y (down), z, of its clock."""

    name: str
    position_sigma_mm: Three
    attitude_sigma_deg: Three
    clock_sigma_ms: float


@dataclass(frozen=True, slots=True)
class Worth:
    """How good the cameras are.

    reasons: why they are not good, or usable only.
    point_mm, worst_point_mm: what a point is known to by the cameras' places, one sigma, in the mean and at worst.
    spacing_mm, worst_spacing_mm: by how much distances of balls err in what was held out, median and 95 %.
    reprojection_px, epipolar_px: by how much balls miss there, rms.
    cameras: those whose stand was measured.
    """

    grade: Grade
    reasons: tuple[str, ...]
    point_mm: float
    worst_point_mm: float
    spacing_mm: float
    worst_spacing_mm: float
    reprojection_px: float
    epipolar_px: float
    cameras: tuple[CameraWorth, ...]


def worth_of(room: Room, verdict: Verdict) -> Worth:
    """Return what a calibrated room is worth."""
    held_out, volume = room.held_out, room.volume
    cameras = tuple(
        CameraWorth(camera.name, three(room.position_mm(c)), three(room.attitude_deg(c)), room.clock_ms(c))
        for c, camera in enumerate(room.cameras)
    )
    return Worth(
        verdict.grade,
        (*verdict.against, *verdict.doubts),
        volume.point_mm,
        volume.worst_point_mm,
        held_out.spacing_mm,
        held_out.worst_spacing_mm,
        held_out.reprojection_px,
        held_out.epipolar_px,
        cameras,
    )


def three(values: Array) -> Three:
    """Return an array (3,) as a tuple."""
    x, y, z = values.tolist()
    return x, y, z
