"""The room's frame, its verdict and its file, from one footage that is watched once."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.settings import RigOrigin, load_settings, rig_of
from tests.tools.calibrate.room.test_lying import FLOOR, CORNER_inW, stills
from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import ring_rig
from tools.bench.waved import watched
from tools.calibrate.grade import Grade
from tools.calibrate.room.bundle import zoomed
from tools.calibrate.room.file import Record, with_room
from tools.calibrate.room.footage import Footage
from tools.calibrate.room.inspect import inspect
from tools.calibrate.room.radius import measured_sizes
from tools.calibrate.room.report import to_json, to_text
from tools.calibrate.room.room import Room, Terms, calibrate_room
from tools.calibrate.room.sides import Side, refuse_swapped
from tools.calibrate.room.spots import Stand, find_stands, floor_of
from tools.calibrate.room.tracks import Track
from tools.calibrate.room.verdict import judge
from tools.calibrate.room.worth import worth_of
from tools.cli import run_command_line
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.rig import Rig, make_marker, make_rig
from tracker.scene import Look
from tracker.sources.waving import APART_M, SPOTS_inW
from tracker.types import Array, frozen_array

TERMS = Terms(True, SPOTS_inW[0], APART_M, np.array([1.2, 0.8, 0.8]), lenses=False)
LAB = (Path(__file__).parents[4] / "config" / "lab.toml").read_text(encoding="utf-8")
ADA = Record("2026-01-31", "Ada", "camera:0,1", "spots")
CAMERAS_inW = np.array([[1.6, 1.6, 2.2], [-1.6, -1.6, 2.2]])


@pytest.fixture(scope="module")
def footage() -> tuple[Rig, Footage]:
    return watched(paper_rig(), 3, Look(), 16.0, (0, 4_000_000))


@pytest.fixture(scope="module")
def room(footage: tuple[Rig, Footage]) -> Room:
    rig, seen = footage
    return calibrate_room(seen, rig, TERMS)


def with_places(rig: Rig, places: Array) -> Rig:
    """Return a rig with the marker's balls elsewhere, (balls, 3) [m]."""
    balls = (replace(ball, p_inB=frozen_array(p)) for ball, p in zip(rig.marker.balls, places, strict=True))
    return make_rig(rig.cameras, make_marker(tuple(balls)))


def test_three_spots_put_the_cameras_where_they_are_in_the_room_and_the_verdict_is_good(room: Room) -> None:
    for camera, truth in zip(room.cameras, paper_rig().cameras, strict=True):
        assert np.linalg.norm(camera.p_CinW - truth.p_CinW) < 0.006
        assert np.degrees(np.linalg.norm(so3.log(truth.R_CtoW.T @ camera.R_CtoW))) < 0.15
    assert room.floor_sigmas is not None
    turns = [
        so3.log(found.R_CtoW @ truth.R_CtoW.T) for found, truth in zip(room.cameras, paper_rig().cameras, strict=True)
    ]
    tilt_x, tilt_y, heading = np.abs(np.degrees(np.mean(turns, axis=0))).tolist()
    assert max(tilt_x, tilt_y) < 3.0 * room.floor_sigmas.tilt_deg < 0.1
    assert heading < 3.0 * room.floor_sigmas.heading_deg < 0.1
    verdict = judge(room)
    assert (verdict.grade, verdict.against) == (Grade.GOOD, ())
    assert to_text(room, verdict).splitlines()[-1].startswith("Good: points are known to ")
    assert json.loads(to_json(room, verdict))["grade"] == "good"


def test_a_board_on_the_floor_stands_in_for_the_spots(footage: tuple[Rig, Footage]) -> None:
    rig, seen = footage
    cameras = paper_rig().cameras
    lain = replace(seen, stills=tuple(stills(cameras, (0, 1))))
    room = calibrate_room(lain, rig, replace(TERMS, by_spots=False, board=FLOOR, origin_m=CORNER_inW, apart_m=None))
    for camera, truth in zip(room.cameras, cameras, strict=True):
        assert np.linalg.norm(camera.p_CinW - truth.p_CinW) < 0.010
        assert np.degrees(np.linalg.norm(so3.log(truth.R_CtoW.T @ camera.R_CtoW))) < 0.2
    verdict = judge(room)
    assert verdict.grade is Grade.GOOD
    assert "frame: board seen by cam" in to_text(room, verdict)
    assert len(json.loads(to_json(room, verdict))["board"]["cameras"]) == 2
    assert room.lying is not None
    doubled = replace(room, lying=replace(room.lying, larger=0.01, larger_sigma=0.002))
    assert any("the board came out 1.00 % too large" in reason for reason in judge(doubled).against)


def test_a_distance_that_is_not_what_the_tape_says_is_told_in_millimetres(room: Room) -> None:
    verdict = judge(replace(room, apart_m=APART_M + 0.02))
    assert verdict.grade is Grade.NOT_GOOD
    assert any("came out 2" in reason or "came out 19" in reason for reason in verdict.against)
    assert judge(replace(room, apart_m=None)).grade is Grade.USABLE


def test_a_marker_with_its_places_in_another_order_makes_a_mirrored_room_which_is_refused(
    footage: tuple[Rig, Footage],
) -> None:
    rig, seen = footage
    swapped = with_places(rig, rig.marker.points_inB[[1, 0, 2]])
    for by_spots in (True, False):
        with pytest.raises(OperatorError, match="MIRRORED: by the order of its colours"):
            calibrate_room(seen, swapped, replace(TERMS, by_spots=by_spots))


def test_a_marker_built_otherwise_than_the_config_says_is_named_with_its_length(footage: tuple[Rig, Footage]) -> None:
    rig, seen = footage
    places = rig.marker.points_inB.copy()
    places[2, 1] += 0.003
    verdict = judge(calibrate_room(seen, with_places(rig, places), TERMS))
    assert verdict.grade is Grade.NOT_GOOD
    assert any(reason.startswith("marker: yellow to green is 16") for reason in verdict.against)


def test_balls_that_are_swapped_are_named_where_the_sides_tell(footage: tuple[Rig, Footage]) -> None:
    rig, _ = footage
    told = [Side(("a", "b"), 0.0, side_mm, 0.1) for side_mm in (140.0, 166.5, 157.9)]
    places = np.array([[0.06, -0.046, 0.0], [0.0, 0.1, 0.0], [-0.08, -0.046, 0.0]])
    with pytest.raises(OperatorError, match="yellow is where it has orange, green is where it has yellow, orange is"):
        refuse_swapped(tuple(told), with_places(rig, places))
    refuse_swapped(tuple(told), with_places(rig, places[[2, 0, 1]]))


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_a_ball_radius_of_the_config_that_is_wrong_is_told(footage: tuple[Rig, Footage], share: float) -> None:
    rig, seen = footage
    balls = tuple(replace(ball, radius_m=share * ball.radius_m) for ball in rig.marker.balls)
    sizes = measured_sizes(seen, make_rig(paper_rig().cameras, make_marker(balls)))
    for size, truth in zip(sizes, rig.marker.balls, strict=True):
        assert abs(size.found_mm - 1e3 * truth.radius_m) < 3.0 * size.sigma_mm
        assert size.sigma_mm < 0.01 * size.found_mm


def test_a_wrong_radius_is_told_once_for_all_balls_and_a_single_one_by_its_name(room: Room) -> None:
    wrong = [replace(size, said_mm=1.05 * size.found_mm) for size in room.sizes]
    for sizes, names in ((wrong, "yellow, green, orange"), ([room.sizes[0], wrong[1], room.sizes[2]], "green")):
        (doubt,) = judge(replace(room, sizes=tuple(sizes))).doubts
        assert doubt.startswith(f"ball radius: {names} measured 7.")


def test_refined_lenses_come_nearer_to_the_true_ones(footage: tuple[Rig, Footage]) -> None:
    rig, seen = footage
    longer = tuple(zoomed(camera, 1.004, (0.0, 0.0)) for camera in rig.cameras)
    room = calibrate_room(seen, make_rig(longer, rig.marker), replace(TERMS, lenses=True))
    for camera, truth in zip(room.cameras, rig.cameras, strict=True):
        assert abs(camera.focal_px / truth.focal_px - 1.0) < 0.002


def test_the_room_file_is_the_config_with_measured_cameras_and_runs(room: Room, tmp_path: Path) -> None:
    path = tmp_path / "room.toml"
    text = with_room(LAB, room.cameras, worth_of(room, judge(room)), ADA)
    path.write_text(text, encoding="utf-8")
    settings = load_settings(path)
    chosen = rig_of(settings, paper_rig().cameras)
    assert (chosen.origin, chosen.nominal) == (RigOrigin.MEASURED, False)
    for camera, found in zip(chosen.rig.cameras, room.cameras, strict=True):
        np.testing.assert_allclose(camera.p_CinW, found.p_CinW, atol=1e-9)
        assert abs(camera.clock_offset_ns - found.clock_offset_ns) <= 1
    assert settings.rig.measured is not None
    assert (settings.rig.measured.by, settings.rig.measured.verdict) == ("Ada", "good")
    assert "# Fix exposure, white balance and focus" in text
    assert "Nominal cameras" not in text
    assert with_room(text, room.cameras, worth_of(room, judge(room)), ADA) == text


def stands(places: list[tuple[float, float, float]], up: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> list[Stand]:
    unseen = np.full((2, 3, 2), np.nan)
    return [Stand(float(k), k + 2.0, np.array(place), np.array(up), unseen) for k, place in enumerate(places)]


def test_a_camera_that_sees_the_vehicle_come_but_not_stand_does_not_put_the_spot_aside() -> None:
    rig, t_s = ring_rig(3), np.arange(0.0, 4.0, 1.0 / 15.0)
    places_m = np.outer(np.minimum(t_s - 1.0, 0.0), [0.3, 0.3, 0.0])  # it comes for a second, then it stands
    balls_inW = places_m[:, None] + rig.marker.points_inB
    uv_px = [camera.project(balls_inW.reshape(-1, 3))[0].reshape(-1, 3, 2) for camera in rig.cameras]
    seen = [len(t_s), len(t_s), 15]
    tracks = [Track(t_s[:n], uv[:n], np.full((n, 3), 0.1)) for n, uv in zip(seen, uv_px, strict=True)]
    (stand,) = find_stands(tracks, np.zeros(3), rig.cameras, rig)
    np.testing.assert_allclose(stand.p_BinW, np.zeros(3), atol=1e-3)


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        (stands([(0, 0, 0), (1, 0, 0)]), "stood still in 2 places, three are needed"),
        (stands([(0, 0, 0), (1, 0, 0), (2, 0.1, 0)]), "the third 100 mm from their line"),
        (stands([(0, 0, 0), (1, 0, 0), (0, 1, 0.6)]), "leans 31 deg, at most 20 deg"),
        (stands([(0, 0, 0), (1, 0, 0), (0, 1, 0)], (0.0, 0.0, -1.0)), "MIRRORED"),
    ],
)
def test_spots_that_make_no_frame_are_refused(given: list[Stand], complaint: str) -> None:
    with pytest.raises(OperatorError, match=complaint):
        floor_of(given, CAMERAS_inW, np.zeros(3))


def test_the_last_three_spots_count_and_a_third_on_either_side_gives_the_same_floor() -> None:
    for side in (1.0, -1.0):
        floor = floor_of(stands([(5, 5, 0), (1, 1, 0.2), (1, 2, 0.2), (1 - side, 1, 0.2)]), CAMERAS_inW, np.zeros(3))
        np.testing.assert_allclose(floor.R_WtoF @ [1.0, 2.0, 0.2] + floor.p_WinF, [1.0, 0.0, 0.0], atol=1e-12)
        np.testing.assert_allclose(floor.R_WtoF[2], [0.0, 0.0, 1.0], atol=1e-12)


def track(instants: int, sway_px: float) -> Track:
    """Return a marker that goes to and fro in a picture."""
    t_s: Array = 0.1 * np.arange(instants, dtype=np.float64)
    middles = 300.0 + sway_px * np.sin(20.0 * t_s)
    return Track(t_s, np.tile(middles[:, None, None], (1, 3, 2)), np.full((instants, 3), 0.1))


@pytest.mark.parametrize(
    ("tracks", "frames", "complaint"),
    [
        ((track(0, 0.0), track(0, 0.0)), (90, 90), "no marker in 180 pictures: all 3 balls must be seen at once"),
        ((track(90, 80.0), track(4, 80.0)), (90, 90), "cam1 saw all 3 balls in 4 of 90 pictures"),
        ((track(40, 80.0), track(40, 80.0)), (40, 40), "the marker was seen for 3.9 s, at least 5 s are needed"),
        ((track(90, 80.0), track(0, 0.0)), (90, 0), "cam1 gave no picture"),
        ((track(90, 80.0), track(90, 2.0)), (90, 90), r"hardly moved before cam1 \(2 px rms, at least 15 px\)"),
    ],
)
def test_footage_that_tells_no_room_is_refused_before_anything_is_solved(
    tracks: tuple[Track, ...], frames: tuple[int, ...], complaint: str
) -> None:
    with pytest.raises(OperatorError, match=complaint):
        inspect(Footage(0, frames, tracks, ()), paper_rig(), "video:A,B")


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--frame", "floor"], "--frame 'floor': unknown; known: spots, board, config"),
        (["--apart_mm", "0.8"], "--apart_mm 0.8 mm: must be 100 to 20000 mm"),
        (["--origin_mm", "0,0"], "--origin_mm '0,0': must be three millimetres"),
        (["--seconds", "1"], "--seconds 1 s: must be 5 to 600 s"),
        (["--source", "sim:hover", "--seconds", "5"], "the marker hardly moved before cam0"),
    ],
)
def test_the_command_refuses_in_one_line_with_exit_code_2(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["calibrate", "room", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert complaint in captured.err.splitlines()[-1]


def test_the_command_writes_a_room_file_of_simulated_footage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "room.toml"
    arguments = ["--source", "sim:waved", "--apart_mm", "500", "--origin_mm", "0,0,-350", "--out", str(out), "--json"]
    assert run_command_line(["calibrate", "room", *arguments]) == 0
    assert json.loads(capsys.readouterr().out)["against"] == []
    assert rig_of(load_settings(out), None).origin is RigOrigin.MEASURED
