"""A board on the floor gives level, heading, origin and a check of the scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.tools.calibrate.boards import picture_by
from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import ring_rig
from tools.calibrate.board import BoardKind, make_board
from tools.calibrate.room.gauge import moved
from tools.calibrate.room.lying import UP, Lying, lying_board
from tools.calibrate.room.scene import Scene
from tools.cli import run_command_line
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.types import Array, Frame

FLOOR = make_board(BoardKind.CHARUCO, "4x3", 75.0)
CORNER_inW = np.array([-0.15, 0.1, -0.35])
AWAY_R, AWAY_m = so3.exp(np.array([0.3, -0.2, 1.1])), np.array([0.4, 2.0, -0.7])


def stills(cameras: Sequence[Camera], which: Sequence[int], stretched: float = 1.0) -> list[Frame]:
    """Return pictures of the board at CORNER_inW, its x axis the room's; its print may be larger than it should be."""
    printed = replace(FLOOR, square_m=stretched * FLOOR.square_m, marker_m=stretched * FLOOR.marker_m)
    grey = [(c, picture_by(cameras[c], printed, UP, CORNER_inW, seed)) for c in which for seed in (1, 2)]
    return [Frame(c, 0, np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)) for c, image in grey]


def lost(cameras: tuple[Camera, ...]) -> tuple[Camera, ...]:
    """Return cameras as they are found: right to each other, in a frame of their own."""
    nowhere: Array = np.zeros((0, 3))
    return moved(Scene(cameras, np.zeros(0), nowhere, nowhere, np.zeros((0, 3, 3))), AWAY_R, AWAY_m).cameras


def off(lying: Lying) -> tuple[float, float]:
    """Return by how much the board's corner is off in the room [m], and the room is turned [rad]."""
    R = lying.R_WtoF @ AWAY_R
    corner_inF = R @ CORNER_inW + lying.R_WtoF @ AWAY_m + lying.p_WinF
    return float(np.linalg.norm(corner_inF - CORNER_inW)), float(np.linalg.norm(so3.log(R)))


@pytest.mark.parametrize(("which", "most_mm", "most_deg"), [((0, 1), 0.5, 0.15), ((0,), 5.0, 0.5)])
def test_level_heading_and_origin_are_the_boards_and_as_well_known_as_is_said(
    which: tuple[int, ...], most_mm: float, most_deg: float
) -> None:
    cameras = paper_rig().cameras
    lying = lying_board(stills(cameras, which), lost(cameras), FLOOR, CORNER_inW)
    off_m, off_rad = off(lying)
    assert lying.names == tuple(cameras[c].name for c in which)
    assert 1e3 * off_m < most_mm
    assert np.degrees(off_rad) < min(most_deg, 3.0 * np.hypot(lying.tilt_deg, lying.heading_deg))
    if len(which) == 1:
        assert lying.larger is None
    else:
        assert lying.larger is not None
        assert abs(lying.larger) < lying.larger_sigma


def test_a_board_printed_one_per_cent_too_large_is_told_by_the_scale() -> None:
    cameras = ring_rig(3).cameras
    lying = lying_board(stills(cameras, (0, 1, 2), stretched=1.01), lost(cameras), FLOOR, CORNER_inW)
    assert lying.larger is not None
    assert lying.larger == pytest.approx(0.01, abs=lying.larger_sigma)
    assert lying.larger > 3.0 * lying.larger_sigma


def test_a_floor_without_a_board_is_refused() -> None:
    cameras = paper_rig().cameras
    bare = Frame(0, 0, np.full((480, 640, 3), 128, dtype=np.uint8))
    with pytest.raises(
        OperatorError, match="no charuco with 4 x 3 inner corners, squares of 75 mm on the floor in 1 pict"
    ):
        lying_board([bare], cameras, FLOOR, CORNER_inW)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--board", "chessboard", "--corners", "4x4"], "--corners 4x4: such a chessboard looks alike from both ends"),
        (["--apart_mm", "500"], "--apart_mm: is between spots, the frame is board; leave it out"),
        (["--square_mm", "0"], "--square_mm 0 mm: must be positive"),
    ],
)
def test_boards_that_give_no_frame_are_refused_in_one_line(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["calibrate", "room", "--frame", "board", *arguments]) == 2
    assert complaint in capsys.readouterr().err.splitlines()[-1]
