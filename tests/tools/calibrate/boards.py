"""Boards seen by a camera whose lens is known: as corners alone, and as pictures."""

from __future__ import annotations

import cv2
import numpy as np

from tools.calibrate.board import Board, charuco_of
from tools.calibrate.find import View
from tracker.camera import Camera
from tracker.types import Array, Image

SIZE_PX = (640, 480)
K = np.array([[610.0, 0.0, 325.0], [0.0, 612.0, 236.0], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.22, 0.06, 0.0006, -0.0004, 0.0])
PIXELS_PER_SQUARE, MARGIN_SQUARES = 64, 1


def poses(
    board: Board, count: int, seed: int, tilt_deg: float = 35.0, reach: float = 0.85
) -> list[tuple[Array, Array]]:
    """Return so many poses (R, t) of the board in the camera, all of whose corners are in the picture.

    tilt_deg: at most, about either axis.  reach: share of the picture the board's middle may go to.
    """
    rng = np.random.default_rng(seed)
    found: list[tuple[Array, Array]] = []
    middle = board.outline_m.mean(axis=0)
    while len(found) < count:
        lean = np.radians(rng.uniform(-tilt_deg, tilt_deg, 2))
        R = cv2.Rodrigues(np.append(lean, rng.uniform(-0.4, 0.4)))[0]
        z_m = board.columns * board.square_m * rng.uniform(1.2, 2.6)
        u, v = np.array(SIZE_PX) / 2 + reach * rng.uniform(-0.5, 0.5, 2) * SIZE_PX
        t = z_m * np.array([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], 1.0]) - R @ np.append(middle, 0.0)
        uv_px = cv2.projectPoints(board.corners_m, cv2.Rodrigues(R)[0], t, K, DISTORTION)[0].reshape(-1, 2)
        if (uv_px > 12).all() and (uv_px < np.array(SIZE_PX) - 13).all():
            found.append((np.asarray(R, dtype=np.float64), t))
    return found


def view_of(board: Board, pose: tuple[Array, Array], noise_px: float, seed: int) -> View:
    """Return what a perfect detector would see, with noise."""
    rng = np.random.default_rng(seed)
    turn = cv2.Rodrigues(pose[0])[0]
    uv_px = cv2.projectPoints(board.corners_m, turn, pose[1], K, DISTORTION)[0].reshape(-1, 2)
    outline_m = np.column_stack((board.outline_m, np.zeros(4)))
    outline_px = cv2.projectPoints(outline_m, turn, pose[1], K, DISTORTION)[0].reshape(-1, 2)
    seen_px = np.asarray(uv_px + rng.normal(0.0, noise_px, uv_px.shape))
    return View(f"{seed}", 0, np.arange(len(uv_px), dtype=np.int64), seen_px, np.asarray(outline_px), 2.0)


def picture_of(board: Board, pose: tuple[Array, Array], seed: int, blur_px: float = 0.7) -> Image:
    """Draw a ChArUco board through the lens."""
    pixels = _pixels(SIZE_PX)
    flat: Array = np.asarray(cv2.undistortPoints(pixels[:, None], K, DISTORTION), dtype=np.float64).reshape(-1, 2)
    rays = np.column_stack((flat, np.ones(len(flat))))
    return _drawn(board, rays, pose, SIZE_PX, seed, blur_px)


def picture_by(camera: Camera, board: Board, R_DtoW: Array, p_DinW: Array, seed: int) -> Image:
    """Draw a ChArUco board that lies in the room, as one of its cameras sees it."""
    size_px = camera.width_px, camera.height_px
    pose = np.asarray(camera.R_CtoW.T @ R_DtoW), camera.in_camera(p_DinW[None])[0]
    return _drawn(board, camera.bearings(_pixels(size_px)), pose, size_px, seed, 0.7)


def _pixels(size_px: tuple[int, int]) -> Array:
    columns, rows = np.meshgrid(np.arange(size_px[0]), np.arange(size_px[1]))
    return np.column_stack((columns.ravel(), rows.ravel())).astype(np.float64)


def _drawn(
    board: Board, rays: Array, pose: tuple[Array, Array], size_px: tuple[int, int], seed: int, blur_px: float
) -> Image:
    """Draw a board (R, t) in the camera: each pixel's ray meets its plane."""
    squares = np.array([board.columns + 1, board.rows + 1])
    drawn = charuco_of(board).generateImage(tuple(int(n) for n in squares * PIXELS_PER_SQUARE))
    margin = MARGIN_SQUARES * PIXELS_PER_SQUARE
    paper = cv2.copyMakeBorder(drawn, margin, margin, margin, margin, cv2.BORDER_CONSTANT, value=(255,))
    R, t = pose
    depth = (R[:, 2] @ t) / (rays @ R[:, 2])
    on_board_m = (rays * depth[:, None] - t) @ R
    # The first inner corner is the board's origin here; OpenCV draws from the outer corner, pixel centres at integers.
    on_paper = (on_board_m[:, :2] / board.square_m + 1 + MARGIN_SQUARES) * PIXELS_PER_SQUARE - 0.5
    maps = on_paper.reshape(size_px[1], size_px[0], 2).astype(np.float32)
    image = cv2.remap(paper, maps[..., 0], maps[..., 1], cv2.INTER_AREA, borderValue=(90,))
    image = cv2.GaussianBlur(image, (0, 0), blur_px)
    noise = np.random.default_rng(seed).normal(0.0, 2.0, image.shape)
    return np.asarray(np.clip(0.8 * image + 20 + noise, 0, 255), dtype=np.uint8)
