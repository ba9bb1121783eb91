"""Lenses found again, with honest uncertainty, and verdicts that say what is wrong."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.tools.calibrate.boards import DISTORTION, SIZE_PX, K, picture_of, poses, view_of
from tests.tools.test_cli import posebridge, refusal
from tools.calibrate.board import Board, BoardKind, make_board
from tools.calibrate.find import Finder, View
from tools.calibrate.intrinsics import Intrinsics, calibrate_camera
from tools.calibrate.result import Calibration, calibrate_all
from tools.calibrate.verdict import judge
from tools.calibrate.views import Gathering
from tracker.errors import OperatorError
from tracker.types import Array

BOARD = make_board(BoardKind.CHARUCO, "9x6", 25.0)
TRUE = np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2]])
NOISE_PX = 0.15


def calibrated(seen: list[tuple[Array, Array]], seed: int = 0, coefficients: int = 5) -> Intrinsics:
    views = [view_of(BOARD, pose, NOISE_PX, 1000 * seed + k) for k, pose in enumerate(seen)]
    return calibrate_camera("cam0", views, BOARD, SIZE_PX, coefficients)


@pytest.fixture(scope="module")
def pairs(chessboard_pairs: Path) -> Calibration:
    """Return the 13 real pairs calibrated, as the command does it."""
    board = make_board(BoardKind.CHESSBOARD, "9x6", 1000.0)
    finder, gathering = Finder(board), Gathering({0: SIZE_PX, 1: SIZE_PX}, chosen=True)
    for left in sorted(chessboard_pairs.glob("left*.jpg")):
        files = left, left.with_name(left.name.replace("left", "right"))
        found: dict[int, View | None] = {}
        for camera, path in enumerate(files):
            image = cv2.imread(str(path))
            assert image is not None
            found[camera] = finder.find(np.asarray(image, dtype=np.uint8), path.name)
        gathering.take(found)
    return calibrate_all(("left", "right"), gathering, board, 5, 3.2)


def test_opencvs_own_pairs_give_opencvs_own_figures(pairs: Calibration) -> None:
    """Mono RMS 0.195 and 0.207 px, stereo RMS 0.215 px, baseline 3.327 squares, focal length 533.4 px."""
    assert [camera.lens.rms_px for camera in pairs.cameras] == pytest.approx([0.195, 0.207], abs=0.0006)
    ((pair, verdict),) = pairs.pairs
    assert verdict.good
    assert pair.joint
    assert len(pair.errors_px) == 13
    assert (pair.rms_px, pair.baseline_m) == pytest.approx((0.215, 3.327), abs=0.0006)
    assert pair.K[0][0, 0] == pytest.approx(533.4, abs=0.06)


def test_real_pairs_that_leave_a_third_of_the_picture_empty_are_not_good(pairs: Calibration) -> None:
    left, right = pairs.verdicts
    assert left.good, left.against
    assert [reason[:13] for reason in right.against] == ["coverage 67 %"]
    for camera in pairs.cameras:
        assert 1.0 < camera.held_out.rms_px / camera.lens.rms_px < 1.1


def test_the_stated_sigma_of_the_lens_holds_over_many_calibrations() -> None:
    """Errors over sigma: mean square 1 for an honest one; that the larger of two sigmas counts makes it less."""
    ratios = []
    for seed in range(20):
        camera = calibrated(poses(BOARD, 12, seed), seed)
        ratios.append((camera.lens.intrinsics - TRUE) / camera.sigmas_px)
    assert 0.25 < np.mean(np.square(ratios)) < 1.6


def test_a_board_bent_by_a_millimetre_widens_the_stated_sigma() -> None:
    """The fit's own sigma takes corners for independent: it hardly feels that whole views err together."""
    flat = [view_of(BOARD, pose, 0.03, k) for k, pose in enumerate(poses(BOARD, 16, 3))]
    bent = []
    for k, pose in enumerate(poses(BOARD, 16, 3)):
        x, y = BOARD.corners_m[:, :2].T / BOARD.outline_m[2].max() - 0.5
        lifted_m = BOARD.corners_m + np.column_stack((0 * x, 0 * x, 0.004 * (x**2 + y**2)))
        uv_px = cv2.projectPoints(lifted_m, cv2.Rodrigues(pose[0])[0], pose[1], K, DISTORTION)[0].reshape(-1, 2)
        noise = flat[k].uv_px - view_of(BOARD, pose, 0.0, k).uv_px
        bent.append(View(f"{k}", 0, flat[k].ids, np.asarray(uv_px + noise), flat[k].outline_px, 2.0))
    one, other = (calibrate_camera("cam0", views, BOARD, SIZE_PX, 5) for views in (flat, bent))
    assert other.sigmas_px[0] > 2.0 * one.sigmas_px[0]


@pytest.mark.parametrize(
    ("seen", "reason"),
    [
        (poses(BOARD, 6, 1), "too few views: 6"),
        (poses(BOARD, 14, 2, tilt_deg=2.0), "no tilt: 0 views"),
        (poses(BOARD, 14, 3, reach=0.1), "coverage"),
    ],
)
def test_views_that_are_too_few_flat_on_or_in_one_place_are_told(seen: list[tuple[Array, Array]], reason: str) -> None:
    camera = calibrated(seen)
    against = judge(camera, 3.2).against
    assert any(line.startswith(reason) for line in against), against


def test_tilt_about_one_axis_alone_is_told() -> None:
    seen = []
    for k, (_, t) in enumerate(poses(BOARD, 14, 4)):
        lean = np.radians(30.0 if k % 2 else -30.0)
        seen.append((np.asarray(cv2.Rodrigues(np.array([lean, 0.0, 0.0]))[0], dtype=np.float64), t))
    against = judge(calibrated(seen), 3.2).against
    assert any(line.startswith("tilt about one axis only") for line in against), against


def test_an_uncertain_focal_length_is_told_in_millimetres_at_the_flight_distance() -> None:
    camera = calibrated(poses(BOARD, 14, 5))
    near, far = (judge(camera, distance_m).against for distance_m in (1.0, 100.0))
    assert not any("focal length" in line for line in near)
    assert any("mm at 100 m" in line for line in far)


def test_good_views_are_called_good_and_a_wrong_one_is_left_out() -> None:
    views = [view_of(BOARD, pose, NOISE_PX, k) for k, pose in enumerate(poses(BOARD, 20, 6, reach=1.0))]
    wrong = View("wrong", 0, views[7].ids, views[7].uv_px + 4.0 * (views[7].ids < 9)[:, None], views[7].outline_px, 2.0)
    camera = calibrate_camera("cam0", [*views, wrong], BOARD, SIZE_PX, 5)
    assert camera.dropped == ("wrong",)
    verdict = judge(camera, 3.2)
    assert verdict.good, verdict.against
    assert "wrong" in verdict.notes[0]


def test_a_board_seen_by_few_is_refused_with_how_many() -> None:
    with pytest.raises(OperatorError, match="cam0: 3 sharp views of the board, at least 4"):
        calibrated(poses(BOARD, 3, 1))


def film(board: Board, path: Path, count: int) -> None:
    """Write a video of a board in so many places, two frames a second."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 2.0, SIZE_PX)
    for k, pose in enumerate(poses(board, count, 8)):
        writer.write(cv2.cvtColor(picture_of(board, pose, k), cv2.COLOR_GRAY2BGR))
    writer.release()


def test_a_video_of_one_camera_gives_its_lens_a_picture_and_tables_for_the_config(tmp_path: Path) -> None:
    """Drawn through a known lens, blurred, with noise, and compressed: what the command says must hold by its sigma."""
    film(BOARD, tmp_path / "a.avi", 16)
    done = posebridge(
        "calibrate", "intrinsics", "--source", f"video:{tmp_path / 'a.avi'}", "--json",
        "--out", tmp_path / "a.toml", "--picture", tmp_path / "a.png",
    )  # fmt: skip
    assert done.returncode in (0, 1), done.stderr
    figures = json.loads(done.stdout)
    (camera,) = figures["cameras"]
    assert camera["rms_px"] < 0.3
    off = (np.array(camera["intrinsics_px"]) - TRUE) / np.array(camera["sigmas_px"])
    assert np.abs(off).max() < 4.0
    (table,) = tomllib.loads((tmp_path / "a.toml").read_text())["rig"]["cameras"]
    assert [table[key] for key in ("fx_px", "fy_px", "cx_px", "cy_px")] == pytest.approx(camera["intrinsics_px"])
    assert cv2.imread(str(tmp_path / "a.png")) is not None


def test_pictures_without_the_board_of_two_sizes_or_none_are_one_line(tmp_path: Path) -> None:
    assert "no such files" in refusal("calibrate", "intrinsics", "--source", f"images:{tmp_path}/*.png")
    for k in range(2):
        cv2.imwrite(str(tmp_path / f"{k}.png"), np.full((480, 640), 90 + k, np.uint8))
    line = refusal("calibrate", "intrinsics", "--source", f"images:{tmp_path}", "--out", tmp_path / "a.toml")
    assert "no sharp view of a charuco with 9 x 6 inner corners" in line
    assert not (tmp_path / "a.toml").exists()
    cv2.imwrite(str(tmp_path / "2.png"), np.full((240, 320), 90, np.uint8))
    assert "320 x 240 px, those before it 640 x 480 px" in refusal(
        "calibrate", "intrinsics", "--source", f"images:{tmp_path}"
    )
