"""A board found in a picture: which corners, where, and how sharp."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tools.calibrate.board import Board, BoardKind, charuco_of
from tracker.types import Array, Image

Ids = NDArray[np.int64]

FEWEST_CORNERS = 8  # a pose and a homography need 4; with twice as many they can be wrong visibly
LARGEST_WINDOW_PX, SMALLEST_WINDOW_PX = 5, 2  # half a side, of the refinement of a corner
REACH_PX = 5  # round a corner, of the part in which sharpness is read
_STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
_CHESSBOARD = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A board in one camera's picture.

    name: the picture's.  t_ns: when it was taken, for footage [ns].
    ids: (n,) numbers of the corners found, rising.  uv_px: (n, 2) where they are, pixel centres at integers.
    outline_px: (4, 2) the board's outermost corners, by the homography of those found.
    edge_px: width of the edges at the corners, the less the sharper [px].
    """

    name: str
    t_ns: int
    ids: Ids
    uv_px: Array
    outline_px: Array
    edge_px: float


class Finder:
    """Finds one board."""

    def __init__(self, board: Board) -> None:
        """Prepare the detector of the board's kind."""
        self.board = board
        self._charuco = None
        if board.kind is BoardKind.CHARUCO:
            self._charuco = cv2.aruco.CharucoDetector(charuco_of(board))

    def find(self, image: Image, name: str, t_ns: int = 0) -> View | None:
        """Return the board's view in a picture (h, w) or (h, w, 3), None if it shows none or too little of it."""
        grey = image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        found = self._chessboard(grey) if self._charuco is None else self._with_markers(grey)
        if found is None or len(found[0]) < FEWEST_CORNERS:
            return None
        ids, uv_px = found
        grid_m = self.board.corners_m[ids, :2]
        if np.linalg.matrix_rank(grid_m - grid_m.mean(axis=0)) < 2:
            return None
        homography, _ = cv2.findHomography(grid_m, uv_px)
        outline = np.asarray(cv2.perspectiveTransform(self.board.outline_m[:, None], homography), dtype=np.float64)[
            :, 0
        ]
        return View(name, t_ns, ids, uv_px, outline, edge_width_px(grey, uv_px, outline))

    def _chessboard(self, grey: Image) -> tuple[Ids, Array] | None:
        size = (self.board.columns, self.board.rows)
        found, corners = cv2.findChessboardCorners(grey, size, flags=_CHESSBOARD)
        if not found:
            return None
        half = _window_px(np.asarray(corners, dtype=np.float64).reshape(self.board.rows, self.board.columns, 2))
        refined = cv2.cornerSubPix(grey, corners, (half, half), (-1, -1), _STOP)
        uv_px = np.asarray(refined, dtype=np.float64).reshape(-1, 2)
        if self.board.tells_its_top and not _begins_dark(grey, uv_px, self.board):
            uv_px = uv_px[::-1].copy()
        return np.arange(len(uv_px), dtype=np.int64), uv_px

    def _with_markers(self, grey: Image) -> tuple[Ids, Array] | None:
        assert self._charuco is not None
        corners, ids, _, _ = self._charuco.detectBoard(grey)
        if ids is None or len(ids) == 0:
            return None
        numbers = np.asarray(ids, dtype=np.int64).ravel()
        order = np.argsort(numbers)
        return numbers[order], np.asarray(corners, dtype=np.float64).reshape(-1, 2)[order]


def edge_width_px(grey: Image, uv_px: Array, outline_px: Array) -> float:
    """Return how wide the edges at corners (n, 2) are [px]: contrast by steepest slope, in the worse direction.

    A motion along one set of edges leaves those sharp, hence both directions. A step through a lens and pixels of one
    pixel each measures about 2 px. NaN if no corner lies well inside.

    Args:
        outline_px: (4, 2) the board's outermost corners, which tell how its edges run.
    """
    along = np.array([outline_px[1] - outline_px[0], outline_px[3] - outline_px[0]])
    normals = along[:, ::-1] * (-1.0, 1.0) / np.linalg.norm(along, axis=1, keepdims=True)
    widths = []
    for u, v in np.rint(uv_px).astype(int):
        part = grey[max(v - REACH_PX, 0) : v + REACH_PX + 1, max(u - REACH_PX, 0) : u + REACH_PX + 1].astype(np.float64)
        if part.shape != (2 * REACH_PX + 1, 2 * REACH_PX + 1):
            continue
        down, right = np.gradient(part)
        slopes = np.abs(np.column_stack((right.ravel(), down.ravel())) @ normals.T)
        contrast = float(np.ptp(np.percentile(part, (5, 95))))
        widths.append(contrast / np.maximum(np.percentile(slopes, 95, axis=0), 1e-9))
    return float(np.median(widths, axis=0).max()) if widths else float("nan")


def _window_px(grid: Array) -> int:
    """Return half the side of the refinement's window: a quarter of the least spacing of corners (rows, columns, 2).

    A window that reaches the neighbours' edges pulls corners aside by more than their noise.
    """
    steps = (np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1))
    return int(np.clip(round(float(min(steps)) / 4.0), SMALLEST_WINDOW_PX, LARGEST_WINDOW_PX))


def _begins_dark(grey: Image, uv_px: Array, board: Board) -> bool:
    """Say whether the square inside the first corner is darker than its neighbour.

    The board turned by 180 deg swaps the two: it is what tells its top, and two cameras must agree on it.
    """
    grid = uv_px.reshape(board.rows, board.columns, 2)
    first, second = (grid[:2, k : k + 2].reshape(4, 2).mean(axis=0).round().astype(int) for k in (0, 1))
    return int(grey[first[1], first[0]]) < int(grey[second[1], second[0]])
