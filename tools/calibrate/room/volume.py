"""What the calibration is worth where the vehicle flies: the part of the room that the config says it may use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tools.calibrate.room.certainty import point_sigmas_m, seen_px
from tracker.camera import Camera
from tracker.types import Array

CELLS = 5  # along each side of the volume


@dataclass(frozen=True, slots=True)
class Volume:
    """cells: those that two cameras see, of CELLS cubed.  visited: share of them in which the marker was.

    point_mm, worst_point_mm: one sigma on an axis of a point's place by the cameras' errors, median and worst cell.
    """

    cells: int
    visited: float
    point_mm: float
    worst_point_mm: float


def surveyed(cameras: tuple[Camera, ...], covariance: Array, p_BinW: Array, size_m: Array) -> Volume:
    """Go through the volume, a cell at a time.

    Args:
        cameras: in the room's frame.  covariance (7 cameras, 7 cameras): see `certainty.camera_covariance`.
        p_BinW (m, 3): where the marker was [m].  size_m (3,): of the volume, its middle the room's origin.
    """
    middles = _middles(size_m)
    seen = np.isfinite([seen_px(camera, middles)[:, 0] for camera in cameras]).sum(axis=0) >= 2
    if not seen.any():
        return Volume(0, 0.0, float("nan"), float("nan"))
    inside = (np.abs(p_BinW) <= size_m / 2.0).all(axis=1)
    visited = np.zeros((CELLS,) * 3, dtype=bool)
    at = np.clip(((p_BinW[inside] / size_m + 0.5) * CELLS).astype(np.int64), 0, CELLS - 1)
    visited[at[:, 0], at[:, 1], at[:, 2]] = True
    sigmas_mm = 1e3 * point_sigmas_m(cameras, covariance, middles[seen])
    share = float(visited.reshape(-1)[seen].mean())
    return Volume(int(seen.sum()), share, float(np.median(sigmas_mm)), float(sigmas_mm.max()))


def _middles(size_m: Array) -> Array:
    """Return the middles of the volume's cells (CELLS cubed, 3) [m]."""
    steps = (np.arange(CELLS) + 0.5) / CELLS - 0.5
    return np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3) * size_m
