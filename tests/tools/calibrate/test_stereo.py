"""Two cameras placed to each other by a board they saw together."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.tools.calibrate.boards import SIZE_PX, poses, view_of
from tools.calibrate.board import Board, BoardKind, make_board
from tools.calibrate.find import View
from tools.calibrate.result import Calibration, calibrate_all
from tools.calibrate.views import Gathering

BOARD = make_board(BoardKind.CHARUCO, "9x6", 25.0)
R_C0toC1 = cv2.Rodrigues(np.array([0.02, -0.08, 0.05]))[0]
P_C0INC1 = np.array([-0.05, 0.004, 0.01])


def partly(view: View, seed: int) -> View:
    """Leave a third of the corners out, as hidden markers do."""
    kept = np.sort(np.random.default_rng(seed).permutation(len(view.ids))[: 2 * len(view.ids) // 3])
    return replace(view, ids=view.ids[kept], uv_px=view.uv_px[kept])


def calibrated(board: Board, count: int, moved_m: float = 0.0) -> Calibration:
    """Calibrate by views of two equal cameras. moved_m: how far the board goes between their exposures."""
    gathering = Gathering({0: SIZE_PX, 1: SIZE_PX}, chosen=True)
    for k, (R, t) in enumerate(poses(board, count, 31)):
        later = t + moved_m * np.array([np.cos(k), np.sin(k), 0.0])
        other = np.asarray(R_C0toC1 @ R, dtype=np.float64), np.asarray(R_C0toC1 @ later + P_C0INC1)
        views = view_of(board, (R, t), 0.1, k), view_of(board, other, 0.1, 500 + k)
        gathering.take({camera: partly(view, 1000 * camera + k) for camera, view in enumerate(views)})
    return calibrate_all(("left", "right"), gathering, board, 5, 3.2)


def test_views_that_share_some_corners_only_give_the_pose_of_one_camera_to_the_other() -> None:
    result = calibrated(BOARD, 24)
    ((pair, verdict),) = result.pairs
    assert verdict.good
    np.testing.assert_allclose(pair.p_C0inC1, P_C0INC1, atol=0.5e-3)
    assert np.degrees(np.linalg.norm(cv2.Rodrigues(pair.R_C0toC1 @ R_C0toC1.T)[0])) < 0.15
    left, right = result.rig()
    np.testing.assert_allclose(left.p_CinW, 0.0)
    p_inW = np.array([[0.1, 0.2, 2.0]])
    np.testing.assert_allclose(right.in_camera(p_inW), p_inW @ pair.R_C0toC1.T + pair.p_C0inC1, atol=1e-9)


def test_a_board_that_moved_between_the_two_pictures_is_told() -> None:
    ((_, verdict),) = calibrated(BOARD, 24, moved_m=0.002).pairs
    assert "not of the same instants" in verdict.against[0]


@pytest.mark.parametrize(("corners", "count"), [("9x7", 16), ("9x6", 4)])
def test_a_board_without_a_top_or_too_few_pairs_give_no_pose(corners: str, count: int) -> None:
    result = calibrated(make_board(BoardKind.CHESSBOARD, corners, 25.0), count)
    assert result.pairs == ()
    for camera in result.rig():
        np.testing.assert_array_equal(camera.R_CtoW, np.eye(3))
