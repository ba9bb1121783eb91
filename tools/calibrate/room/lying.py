"""Gravity, heading and origin from a calibration board that lies on the floor, its x axis along the room's."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tools.calibrate.board import Board
from tools.calibrate.find import Finder
from tools.calibrate.room.scene import Indices
from tools.calibrate.room.start import normalised
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.types import Array, Frame

SIGMA_PX = 0.1  # of a corner, however well the others fit: blur, print, a sheet that is not flat
FLAT_M = 0.0005  # by which a sheet on a floor is not flat, and so leans
PRINT = 0.002  # by which a print errs as a share: 0.4 mm of 200
UP = np.diag([1.0, -1.0, -1.0])  # the board's y runs down the sheet, its z into the floor


@dataclass(frozen=True, slots=True, eq=False)
class Lying:
    """A board on the floor, and the room's frame by it: x along its own, z up, the origin at its first corner.

    names: of the cameras that saw it.  R_WtoF (3, 3), p_WinF (3,): take the frame that the cameras were found in to it.
    rms_px: what its corners miss by.  tilt_deg, heading_deg: one sigma of the level and of the x axis' heading.
    larger: by which share it came out larger than its squares say, None where one camera alone saw it.
    larger_sigma: one sigma of that.
    """

    names: tuple[str, ...]
    R_WtoF: Array
    p_WinF: Array
    rms_px: float
    tilt_deg: float
    heading_deg: float
    larger: float | None
    larger_sigma: float


@dataclass(frozen=True, slots=True, eq=False)
class _Corners:
    """What one camera saw of the board. ids (n,): of the corners.  uv_px (n, 2): where, the median of its pictures."""

    camera: Camera
    ids: Indices
    uv_px: Array


def lying_board(stills: Sequence[Frame], cameras: Sequence[Camera], board: Board, origin_m: Array) -> Lying:
    """Find the board and make the room's frame of it.

    Args:
        stills: whole pictures, in which the board lies where it lies.
        cameras: as found, in a frame W of their own.
        origin_m (3,): where in the room the board's first inner corner is.
    Raises:
        OperatorError: no camera saw it.
    Source: least squares of the corners' pixels over the board's pose and, where two cameras see it, its size.
    """
    seen = _corners(stills, cameras, board)
    if not seen:
        raise OperatorError(
            f"calibrate room: no {board} on the floor in {len(stills)} pictures: it must lie there, face up, from the "
            "start, its squares 15 px or more wide, white paper round it; check --corners; a ChArUco is not found in "
            "mirrored pictures; or give --frame spots"
        )
    scaled = len(seen) > 1
    R_0, p_0 = _first_pose(seen[0], board)
    start = np.concatenate((np.zeros(3), p_0, np.zeros(int(scaled))))
    fit = least_squares(lambda x: _misses(x, R_0, seen, board), start, x_scale="jac")
    R_DtoW = Rotation.from_rotvec(fit.x[:3]).as_matrix() @ R_0
    rms_px = float(np.sqrt(np.mean(fit.fun**2)))
    covariance = max(SIGMA_PX, rms_px) ** 2 * np.linalg.inv(fit.jac.T @ fit.jac)
    turn_inD = R_DtoW.T @ covariance[:3, :3] @ R_DtoW  # small turns in W, seen along the board's axes
    R = UP @ R_DtoW.T
    side_m = board.square_m * min(board.columns - 1, board.rows - 1)
    lean_deg = float(np.degrees(FLAT_M / side_m))
    return Lying(
        tuple(each.camera.name for each in seen),
        R,
        origin_m - R @ fit.x[3:6],
        rms_px,
        float(np.hypot(np.degrees(np.sqrt(np.diag(turn_inD)[:2].max())), lean_deg)),
        float(np.degrees(np.sqrt(turn_inD[2, 2]))),
        float(np.expm1(fit.x[6])) if scaled else None,
        float(np.hypot(np.sqrt(covariance[6, 6]), PRINT)) if scaled else float("nan"),
    )


def _corners(stills: Sequence[Frame], cameras: Sequence[Camera], board: Board) -> list[_Corners]:
    """Return what each camera saw of the board, those that saw most corners first."""
    finder = Finder(board)
    places: dict[int, dict[int, list[Array]]] = defaultdict(lambda: defaultdict(list))
    for still in stills:
        view = finder.find(still.image, "")
        for corner, uv_px in () if view is None else zip(view.ids.tolist(), view.uv_px, strict=True):
            places[still.camera][corner].append(uv_px)
    found = []
    for c, corners in places.items():
        ids = np.array(sorted(corners), dtype=np.int64)
        found.append(_Corners(cameras[c], ids, np.array([np.median(corners[k], axis=0) for k in ids.tolist()])))
    return sorted(found, key=lambda each: -len(each.ids))


def _first_pose(seen: _Corners, board: Board) -> tuple[Array, Array]:
    """Return the board's R_DtoW (3, 3) and p_DinW (3,) as one camera sees them.

    Source: Collins, Bartoli, "Infinitesimal plane-based pose estimation", IJCV 109 (2014); of its two poses the better.
    """
    rays = normalised(seen.camera, seen.uv_px)
    points = np.ascontiguousarray(board.corners_m[seen.ids])
    _, turns, shifts, _ = cv2.solvePnPGeneric(points, rays, np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_IPPE)
    R = seen.camera.R_CtoW @ Rotation.from_rotvec(np.asarray(turns[0], dtype=np.float64).reshape(3)).as_matrix()
    p = seen.camera.R_CtoW @ np.asarray(shifts[0], dtype=np.float64).reshape(3) + seen.camera.p_CinW
    return np.asarray(R), np.asarray(p)


def _misses(x: Array, R_0: Array, seen: Sequence[_Corners], board: Board) -> Array:
    """Return by how much the corners miss [px]; x: a turn on top of R_0, the place in W, the logarithm of the size."""
    R, size = Rotation.from_rotvec(x[:3]).as_matrix() @ R_0, np.exp(x[6]) if len(x) > 6 else 1.0
    off = [one.camera.project(size * board.corners_m[one.ids] @ R.T + x[3:6])[0] - one.uv_px for one in seen]
    return np.concatenate(off).reshape(-1)
