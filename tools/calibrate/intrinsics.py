"""One camera's lens, fitted to views of a board, with how well it is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tools.calibrate.board import Board
from tools.calibrate.find import View
from tracker.errors import OperatorError
from tracker.types import Array, frozen_array

FOLDS = 5
FEWEST_VIEWS = 4  # below this nothing is left to hold out
OUTLIER, OUTLIER_PX, OUTLIER_SHARE = 3.0, 0.5, 0.2
MOST_COEFFICIENTS = 14  # that OpenCV may return
FLAGS = {4: cv2.CALIB_FIX_K3, 5: 0, 8: cv2.CALIB_RATIONAL_MODEL}

SingleArray = NDArray[np.float32]
"""OpenCV's calibration takes corners in single precision only."""


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """What calibrateCamera finds.

    K: (3, 3) [px].  distortion: (4,), (5,) or (8,) in OpenCV's order.
    rms_px: over all corners, both coordinates together.  sigmas_px: (4,) one sigma of fx, fy, cx, cy by the fit [px].
    errors_px: (views,) rms of each view [px].  normals: (views, 3) the board's normal in the camera.
    residuals_px: by view (n, 2), seen less predicted [px].
    """

    K: Array
    distortion: Array
    rms_px: float
    sigmas_px: Array
    errors_px: Array
    normals: Array
    residuals_px: tuple[Array, ...]

    @property
    def intrinsics(self) -> Array:
        """fx, fy, cx, cy [px]."""
        return np.array([self.K[0, 0], self.K[1, 1], self.K[0, 2], self.K[1, 2]])

    @property
    def tilts_deg(self) -> Array:
        """Angle of each view's board to the image plane (views,)."""
        return np.asarray(np.degrees(np.arccos(np.clip(np.abs(self.normals[:, 2]), 0.0, 1.0))))


@dataclass(frozen=True, slots=True, eq=False)
class HeldOut:
    """What views tell that the fit has not seen.

    errors_px: (views,) rms of each view under the lens fitted without it; its own pose is fitted [px].
    sigmas_px: (4,) one sigma of fx, fy, cx, cy by leaving groups of views out [px].
    """

    errors_px: Array
    sigmas_px: Array

    @property
    def rms_px(self) -> float:
        """Over all views, each counting the same [px]."""
        return float(np.sqrt(np.mean(self.errors_px**2)))


@dataclass(frozen=True, slots=True, eq=False)
class Intrinsics:
    """One camera's calibration. views: those used.  dropped: names of those that did not fit the others."""

    name: str
    size_px: tuple[int, int]
    views: tuple[View, ...]
    lens: Lens
    held_out: HeldOut
    dropped: tuple[str, ...]

    @property
    def sigmas_px(self) -> Array:
        """One sigma of fx, fy, cx, cy: the larger of the fit's own and that of the hold-out.

        The fit's takes every corner's error for its own; a bent board or a lens beyond the model errs by whole views.
        """
        return np.maximum(self.lens.sigmas_px, self.held_out.sigmas_px)


def calibrate_camera(
    name: str, views: Sequence[View], board: Board, size_px: tuple[int, int], coefficients: int
) -> Intrinsics:
    """Fit one camera's lens, leave out views that contradict the others, and hold views out.

    Args:
        coefficients: of distortion, 4, 5 or 8.
    Raises:
        OperatorError: fewer than 4 views, or views that determine nothing.
    """
    if len(views) < FEWEST_VIEWS:
        raise OperatorError(
            f"{name}: {len(views)} sharp views of the board, at least {FEWEST_VIEWS} are needed and 15 are good; "
            "show it to the camera in more places, held still"
        )
    lens = fit_lens(name, views, board, size_px, coefficients)
    used = _consistent(views, lens)
    dropped = tuple(view.name for view in views if view not in used)
    if dropped:
        lens = fit_lens(name, used, board, size_px, coefficients)
    held_out = _hold_out(name, used, board, size_px, coefficients)
    return Intrinsics(name, size_px, tuple(used), lens, held_out, dropped)


def fit_lens(name: str, views: Sequence[View], board: Board, size_px: tuple[int, int], coefficients: int) -> Lens:
    """Fit by OpenCV.

    Raises:
        OperatorError: views that determine no lens.
    """
    points, pixels = corners_of(views, board)
    try:
        rms_px, K, distortion, turns, shifts, sigmas, _, errors = cv2.calibrateCameraExtended(
            points, pixels, size_px, np.eye(3), np.zeros(MOST_COEFFICIENTS), flags=FLAGS[coefficients]
        )
    except cv2.error as error:
        raise OperatorError(f"{name}: the views determine no lens; show the board tilted, in other places") from error
    if not (np.isfinite(K).all() and np.isfinite(sigmas).all() and K[0, 0] > 0 and K[1, 1] > 0):
        raise OperatorError(f"{name}: the views determine no lens; show the board tilted, in other places")
    distortion = np.ravel(distortion)[:coefficients]
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    residuals = tuple(
        np.asarray(seen - cv2.projectPoints(point, turn, shift, K, distortion)[0], dtype=np.float64).reshape(-1, 2)
        for seen, point, turn, shift in zip(pixels, points, turns, shifts, strict=True)
    )
    K, distortion, sigmas = frozen_array(K), frozen_array(distortion), frozen_array(np.ravel(sigmas)[:4])
    return Lens(K, distortion, float(rms_px), sigmas, frozen_array(np.ravel(errors)), normals, residuals)


def corners_of(views: Sequence[View], board: Board) -> tuple[list[SingleArray], list[SingleArray]]:
    """Return the corners seen, on the board (n, 3) [m] and in the picture (n, 1, 2) [px], as OpenCV takes them."""
    points = [board.corners_m[view.ids].astype(np.float32) for view in views]
    pixels = [view.uv_px.astype(np.float32).reshape(-1, 1, 2) for view in views]
    return points, pixels


def _consistent(views: Sequence[View], lens: Lens) -> list[View]:
    """Return the views without the worst, if they stand out: a wrong corner, a board that moved or was bent."""
    limit_px = max(OUTLIER * float(np.median(lens.errors_px)), OUTLIER_PX)
    most = int(OUTLIER_SHARE * len(views))
    worst = [k for k in np.argsort(-lens.errors_px)[:most] if lens.errors_px[k] > limit_px]
    return [view for k, view in enumerate(views) if k not in worst]


def _hold_out(name: str, views: Sequence[View], board: Board, size_px: tuple[int, int], coefficients: int) -> HeldOut:
    """Fit without each fold in turn.

    Source: delete-a-group jackknife, variance (g - 1) / g sum (theta_i - mean)^2 over the g groups.
    """
    folds = min(FOLDS, len(views))
    errors = np.zeros(len(views))
    found = []
    for fold in range(folds):
        lens = fit_lens(name, [v for k, v in enumerate(views) if k % folds != fold], board, size_px, coefficients)
        found.append(lens.intrinsics)
        for k in range(fold, len(views), folds):
            errors[k] = _error_px(views[k], board, lens)
    spread = np.array(found) - np.mean(found, axis=0)
    return HeldOut(errors, np.sqrt((folds - 1) / folds * (spread**2).sum(axis=0)))


def _error_px(view: View, board: Board, lens: Lens) -> float:
    """Return the rms of a view under a lens, the board's pose fitted [px]."""
    points = board.corners_m[view.ids]
    _, turn, shift = cv2.solvePnP(points, view.uv_px.reshape(-1, 1, 2), lens.K, lens.distortion)
    predicted = cv2.projectPoints(points, turn, shift, lens.K, lens.distortion)[0].reshape(-1, 2)
    return float(np.sqrt(((predicted - view.uv_px) ** 2).sum(axis=1).mean()))
