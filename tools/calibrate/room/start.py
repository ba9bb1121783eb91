"""A first guess at the cameras' places, from nothing but what they saw.

Two cameras that see the same points from anywhere have an essential matrix between them; the marker's sides give it
scale. Cameras are joined one by one, each to the camera it shares most instants with.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np

from tools.calibrate.room.rigid import rigid
from tools.calibrate.room.scene import Scene, Seen
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.rig import Rig
from tracker.types import Array, frozen_array

LEAST_SHARED = 20  # instants of two cameras
INLIER_PX = 4.0
SWEEP_S = np.arange(-0.06, 0.0601, 0.01)
CLEARLY_BETTER = 0.8  # of the residual without an offset: less of a gain tells no offset
SIDES_AGREE = 0.25  # of a side: a triangle further from the marker's is none
LEAST_INLIERS = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Camera b from camera a. R_AtoB, p_AinB (3,) [m].  offset_s: of b's clock against a's."""

    R_AtoB: Array
    p_AinB: Array
    offset_s: float


def first_scene(seen: Seen, rig: Rig) -> tuple[Scene, Seen]:
    """Guess cameras, clocks and the marker's poses, in the frame of camera 0.

    Returns:
        The scene, and those instants at which it shows the marker.
    Raises:
        OperatorError: a camera that shares too few instants with any other, or whose sightings do not fit together.
    """
    there = seen.there.astype(int)
    shared = there @ there.T
    poses: dict[int, tuple[Array, Array, float]] = {0: (np.eye(3), np.zeros(3), 0.0)}
    while len(poses) < len(rig.cameras):
        count, a, b = max(
            (int(shared[a, b]), a, b) for a in poses for b in range(len(rig.cameras)) if b not in poses
        )  # fmt: skip
        if count < LEAST_SHARED:
            raise OperatorError(
                f"calibrate room: {rig.cameras[b].name} saw all balls together with another camera in {count} "
                f"instants; at least {LEAST_SHARED} are needed: wave the marker longer where two see it, or check "
                "colours with `posebridge colours`"
            )
        pair = _join(seen, rig, a, b)
        R_AtoW, p_AinW, offset_s = poses[a]
        R_BtoW = R_AtoW @ pair.R_AtoB.T
        poses[b] = R_BtoW, p_AinW - R_BtoW @ pair.p_AinB, offset_s + pair.offset_s
    cameras = tuple(placed(camera, *poses[c][:2]) for c, camera in enumerate(rig.cameras))
    return marker_way(seen, cameras, np.array([poses[c][2] for c in range(len(cameras))]), rig)


def check_shared(seen: Seen, rig: Rig) -> None:
    """Refuse a camera that sees the marker nowhere together with another.

    Raises:
        OperatorError: its sightings do not meet another's in a triangle of the marker's size.
    """
    for camera, count in zip(rig.cameras, seen.there.sum(axis=1).tolist(), strict=True):
        if count < LEAST_SHARED:
            raise OperatorError(
                f"calibrate room: what {camera.name} saw makes a marker with what the others saw in {count} instants, "
                f"at least {LEAST_SHARED} are needed; check that no picture is mirrored, the lenses, and that no "
                "camera moved meanwhile"
            )


def placed(camera: Camera, R_CtoW: Array, p_CinW: Array) -> Camera:
    """Return a camera that stands elsewhere."""
    return replace(camera, R_CtoW=frozen_array(R_CtoW), p_CinW=frozen_array(p_CinW))


def marker_way(seen: Seen, cameras: tuple[Camera, ...], offsets_s: Array, rig: Rig) -> tuple[Scene, Seen]:
    """Return the scene of given cameras, with the marker's pose at each instant that shows its triangle."""
    p, R = marker_poses(seen, cameras, offsets_s, rig)
    good = np.asarray(np.isfinite(p).all(axis=1))
    return Scene(cameras, offsets_s, np.array(rig.marker.points_inB), p[good], R[good]), seen.only(good)


def marker_poses(seen: Seen, cameras: tuple[Camera, ...], offsets_s: Array, rig: Rig) -> tuple[Array, Array]:
    """Return p_BinW (m, 3) and R_BtoW (m, 3, 3) at each instant; NaN where the balls make no such triangle."""
    return poses_of(triangulated(seen, cameras, offsets_s), rig)


def poses_of(points_inW: Array, rig: Rig) -> tuple[Array, Array]:
    """Return p_BinW (m, 3) and R_BtoW (m, 3, 3) by the places of the balls (m, balls, 3); NaN where they do not fit."""
    points_inB = rig.marker.points_inB
    R, p = rigid(np.broadcast_to(points_inB, points_inW.shape), np.nan_to_num(points_inW))
    balls_inW = points_inB @ np.swapaxes(R, 1, 2) + p[:, None, :]
    off_m = np.linalg.norm(balls_inW - points_inW, axis=2).max(axis=1)
    bad = ~(off_m < SIDES_AGREE * sides(points_inB).min())
    p[bad] = R[bad] = np.nan
    return p, R


def triangulated(seen: Seen, cameras: tuple[Camera, ...], offsets_s: Array) -> Array:
    """Return the balls' places (m, balls, 3) [m], nearest the rays of all cameras that saw; NaN with fewer than two.

    Source: `tracker.start.triangulate`, eq. 1.
    """
    uv = seen.at(offsets_s)
    cameras_count, instants, balls, _ = uv.shape
    return triangulated_from(uv.reshape(cameras_count, instants * balls, 2), cameras).reshape(instants, balls, 3)


def triangulated_from(uv_px: Array, cameras: tuple[Camera, ...]) -> Array:
    """Return the places (n, 3) [m] of points seen at uv_px (cameras, n, 2), NaN where not; see `triangulated`."""
    shape = uv_px.shape[1:2]
    A, b, count = np.zeros((*shape, 3, 3)), np.zeros((*shape, 3)), np.zeros(shape)
    for c, camera in enumerate(cameras):
        there = np.isfinite(uv_px[c]).all(axis=1)
        if not there.any():
            continue
        rays = camera.bearings(uv_px[c][there]) @ camera.R_CtoW.T
        M = np.eye(3) - rays[:, :, None] * rays[:, None, :]
        A[there] += M
        b[there] += M @ camera.p_CinW
        count[there] += 1
    enough = count >= 2
    points = np.full((*shape, 3), np.nan)
    points[enough] = np.linalg.solve(A[enough], b[enough][..., None])[..., 0]
    return points


def sides(points: Array) -> Array:
    """Return the distances of all pairs of points (..., n, 3) as (..., pairs) [m]."""
    pairs = list(combinations(range(points.shape[-2]), 2))
    first, second = [a for a, _ in pairs], [b for _, b in pairs]
    return np.asarray(np.linalg.norm(points[..., first, :] - points[..., second, :], axis=-1))


def _join(seen: Seen, rig: Rig, a: int, b: int) -> _Pair:
    """Find camera b from camera a, and about how their clocks differ: as their rays meet best."""
    both = seen.only(seen.there[a] & seen.there[b])
    fits = []
    for offset_s in SWEEP_S.tolist():
        offsets_s = both.offsets_s.copy()
        offsets_s[b] += offset_s
        uv = both.at(offsets_s)
        x = [normalised(rig.cameras[c], uv[c].reshape(-1, 2)) for c in (a, b)]
        focal_px = min(rig.cameras[c].focal_px for c in (a, b))
        E, _ = cv2.findEssentialMat(x[0], x[1], np.eye(3), cv2.RANSAC, 0.999, INLIER_PX / focal_px)
        if E is not None and E.shape == (3, 3):
            essential: Array = np.asarray(E, dtype=np.float64)
            miss = epipolar(essential, x[0], x[1])
            fits.append((float(np.median(miss)), abs(offset_s), offset_s, essential, miss * focal_px < INLIER_PX, x))
    if not fits:
        raise OperatorError(_unjoined(rig, a, b))
    still = min(fits, key=lambda fit: fit[1])
    best = min(fits, key=lambda fit: fit[:2])
    _, _, offset_s, E, inlier, x = best if best[0] < CLEARLY_BETTER * still[0] else still
    if inlier.mean() < LEAST_INLIERS:
        raise OperatorError(_unjoined(rig, a, b))
    turn, shift = cv2.recoverPose(E, x[0][inlier], x[1][inlier], np.eye(3))[1:3]
    R, t = np.asarray(turn, dtype=np.float64), np.asarray(shift, dtype=np.float64)[:, 0]
    unit = placed(rig.cameras[a], np.eye(3), np.zeros(3)), placed(rig.cameras[b], R.T, -R.T @ t)
    pair = Seen(both.t_s, both.offsets_s[[a, b]], both.uv_px[[a, b]], both.speed[[a, b]], both.sigma_px[[a, b]])
    points = triangulated(pair, unit, pair.offsets_s + np.array([0.0, offset_s]))
    scale = float(np.median(sides(rig.marker.points_inB) / sides(points)))
    return _Pair(R, scale * t, offset_s)


def _unjoined(rig: Rig, a: int, b: int) -> str:
    return (
        f"calibrate room: what {rig.cameras[a].name} and {rig.cameras[b].name} saw does not fit together from any two "
        "places; check the intrinsics, that no camera moved meanwhile, and the balls' colours (`posebridge colours`)"
    )


def normalised(camera: Camera, uv_px: Array) -> Array:
    rays = camera.bearings(uv_px)
    return np.asarray(rays[:, :2] / rays[:, 2:])


def epipolar(E: Array, x_a: Array, x_b: Array) -> Array:
    """Return how far points miss each other's epipolar lines (n,), to first order. Source: Sampson's distance."""
    a, b = (np.column_stack((x, np.ones(len(x)))) for x in (x_a, x_b))
    Ea, Eb = a @ E.T, b @ E
    below = np.sqrt((Ea[:, :2] ** 2).sum(axis=1) + (Eb[:, :2] ** 2).sum(axis=1))
    return np.asarray(np.abs((b * Ea).sum(axis=1)) / below)
