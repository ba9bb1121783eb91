"""How well `calibrate room` finds cameras in drawn rooms, and whether it says so."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bridge.settings import Settings, rig_of
from tools.bench.crew import side_by_side
from tools.bench.ring import ring_rig
from tools.bench.waved import watched
from tools.calibrate.room.certainty import camera_covariance
from tools.calibrate.room.gauge import aligned
from tools.calibrate.room.jacobian import CAMERA
from tools.calibrate.room.solve import Found, find_cameras
from tracker.maths import so3
from tracker.rig import Rig
from tracker.scene import Look
from tracker.types import Array

WAVE_S, LATEST_NS = 20.0, 12_000_000  # how long the marker is waved; how much later a camera may see than the first
COUNTS = (2, 3, 4, 8)
CLAIM_MM, CLAIM_DEG, CLAIM_MS = 2.0, 0.05, 0.5  # what a calibration is to keep to


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """A room to be calibrated. rig: its cameras as they are.  jpeg_quality: 0 for none."""

    rig: Rig
    seed: int
    jpeg_quality: int


@dataclass(frozen=True, slots=True)
class Missed:
    """What came of one room: its worst camera's errors, and over their own one sigma as it was said.

    longer: by which share distances from the middle of the cameras came out too long.
    """

    place_mm: float
    turn_deg: float
    clock_ms: float
    place_sigmas: float
    turn_sigmas: float
    clock_sigmas: float
    longer: float


@dataclass(frozen=True, slots=True)
class Rooms:
    """Rooms of one kind. beyond: how many of them miss a claim in place, turn or clock."""

    cameras: int
    jpeg_quality: int
    rooms: tuple[Missed, ...]

    @property
    def beyond(self) -> tuple[int, int, int]:
        """Return how many miss each claim."""
        return (
            sum(room.place_mm > CLAIM_MM for room in self.rooms),
            sum(room.turn_deg > CLAIM_DEG for room in self.rooms),
            sum(room.clock_ms > CLAIM_MS for room in self.rooms),
        )


def measure_calibration(settings: Settings, seeds: int, qualities: Sequence[int]) -> list[Rooms]:
    """Calibrate so many drawn rooms of each kind."""
    kinds = [(count, quality) for quality in qualities for count in COUNTS]
    rooms = [room for kind in kinds for room in _drawn(settings, seeds, *kind)]
    missed = side_by_side(calibrated, rooms)
    return [Rooms(*kind, tuple(missed[k * seeds : (k + 1) * seeds])) for k, kind in enumerate(kinds)]


def _drawn(settings: Settings, seeds: int, cameras: int, jpeg_quality: int) -> Iterator[Drawn]:
    rig = ring_rig(rig_of(settings, None).rig.marker, cameras)
    yield from (Drawn(rig, seed, jpeg_quality) for seed in range(1, seeds + 1))


def calibrated(room: Drawn) -> Missed:
    """Wave the marker through a room, calibrate it, and hold the result against the truth."""
    rng = np.random.default_rng((room.seed, 5))
    late_ns = (0, *rng.integers(-LATEST_NS, LATEST_NS, len(room.rig.cameras) - 1).tolist())
    said, footage = watched(room.rig, room.seed, Look(jpeg_quality=room.jpeg_quality), WAVE_S, late_ns)
    found = find_cameras(footage, said)
    off_m, off_rad = errors_of(found, room.rig)
    off_s = 1e-9 * np.abs(np.array([camera.clock_offset_ns for camera in found.cameras]) - np.array(late_ns))
    sigmas = np.sqrt(np.diag(camera_covariance(found.adjusted))).reshape(-1, CAMERA)
    place_m, turn_rad = np.linalg.norm(off_m, axis=1), np.linalg.norm(off_rad, axis=1)
    return Missed(
        1e3 * float(place_m.max()),
        float(np.degrees(turn_rad.max())),
        1e3 * float(off_s.max()),
        float((place_m / np.linalg.norm(sigmas[:, :3], axis=1)).max()),
        float((turn_rad / np.linalg.norm(sigmas[:, 3:6], axis=1)).max()),
        float((off_s[1:] / sigmas[1:, 6]).max()),
        _longer(off_m, np.array([camera.p_CinW for camera in room.rig.cameras])),
    )


def errors_of(found: Found, true: Rig) -> tuple[Array, Array]:
    """Return each camera's error in place (n, 3) [m] and turn (n, 3) [rad], all cameras' common one taken off."""
    pairs = list(zip(aligned(found.scene, true.cameras).cameras, true.cameras, strict=True))
    turns = np.array([so3.log(truth.R_CtoW.T @ camera.R_CtoW) for camera, truth in pairs])
    return np.array([camera.p_CinW - truth.p_CinW for camera, truth in pairs]), turns


def _longer(off_m: Array, places_m: Array) -> float:
    arms_m = places_m - places_m.mean(axis=0)
    return float((off_m * arms_m).sum() / (arms_m**2).sum())
