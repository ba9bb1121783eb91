"""`posebridge place`: limits, search, what-if, and a config that flies."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.settings import Settings, load_settings, rig_of
from tools.cli import run_command_line
from tools.place.layout import COARSE, every_move, moved, survey, what_if
from tools.place.limits import Limits, Wishes, limits_of
from tools.place.search import Search
from tools.place.words import config_with, instructions, sight, snippet
from tracker.errors import OperatorError
from tracker.placement.mount import Stand
from tracker.types import frozen_array

SMALL = "-0.3,0.3,-0.15,0.15,-0.15,0.15"


@pytest.fixture(scope="module")
def settings() -> Settings:
    return load_settings("lab")


@pytest.fixture(scope="module")
def limits(settings: Settings) -> Limits:
    """A volume that two 30 deg cameras can cover."""
    return limits_of(settings, Wishes(volume=SMALL, lenses="30"))


@pytest.fixture(scope="module")
def placed(limits: Limits) -> list[Stand]:
    return Search(limits, lambda _line: None).best(2, seed=1)


def test_the_search_covers_what_can_be_covered_from_the_mounts(limits: Limits, placed: list[Stand]) -> None:
    found = survey([stand.camera(f"cam{k}") for k, stand in enumerate(placed)], limits).figures
    assert found.covered > 0.99
    mounts = {box.name: box for box in limits.mounts}
    assert all(mounts[stand.mount].holds(stand.p_CinW) for stand in placed)
    assert np.linalg.norm(placed[0].p_CinW - placed[1].p_CinW) > limits.apart_m


def test_the_search_beats_cameras_put_anywhere(limits: Limits, placed: list[Stand]) -> None:
    search, rng = Search(limits, lambda _line: None), np.random.default_rng(5)

    def cost(stands: list[Stand]) -> float:
        views = [search.view(stand) for stand in stands]
        information = np.asarray(np.sum([v.information for v in views], axis=0))
        return float(search.cost(information, np.asarray(np.sum([v.pictured for v in views], axis=0, dtype=float))))

    best = cost(placed)
    for _ in range(20):
        box = limits.mounts[rng.integers(len(limits.mounts))]
        other = replace(placed[1], p_CinW=frozen_array(box.at(rng.uniform(size=3))))
        target = limits.volume.centre - other.p_CinW
        aimed = replace(
            other,
            azimuth=math.atan2(target[1], target[0]),
            tilt=math.asin(target[2] / float(np.linalg.norm(target))),
        )
        if np.linalg.norm(aimed.p_CinW - placed[0].p_CinW) > limits.apart_m:
            assert best <= cost([placed[0], aimed]) + 1e-5


def test_the_same_seed_gives_the_same_places(limits: Limits, placed: list[Stand]) -> None:
    again = Search(limits, lambda _line: None).best(2, seed=1)
    for one, other in zip(placed, again, strict=True):
        np.testing.assert_array_equal(one.p_CinW, other.p_CinW)
        assert (one.azimuth, one.tilt) == (other.azimuth, other.tilt)


def test_the_written_config_loads_with_the_very_cameras(limits: Limits, placed: list[Stand], tmp_path: Path) -> None:
    cameras = [stand.camera(f"cam{k}") for k, stand in enumerate(placed)]
    path = tmp_path / "room.toml"
    path.write_text(config_with("lab", cameras, limits), encoding="utf-8")
    loaded = rig_of(load_settings(path), None).rig
    for ours, theirs in zip(cameras, loaded.cameras, strict=True):
        np.testing.assert_allclose(theirs.R_CtoW, ours.R_CtoW, atol=1e-9)
        np.testing.assert_allclose(theirs.p_CinW, ours.p_CinW, atol=1e-9)
        np.testing.assert_allclose(theirs.K, ours.K, atol=1e-3)
    assert len(loaded.marker) == 3


def test_the_snippet_says_in_words_where_each_camera_hangs(settings: Settings, limits: Limits) -> None:
    text = snippet(rig_of(settings, None).rig.cameras, limits)
    assert text.count("[[rig.cameras]]") == 2
    assert "not measured: calibrate before flight" in text
    first, second = instructions(rig_of(settings, None).rig.cameras[0], limits)
    assert "3.45 m above the floor, 4.09 m from wall x-" in first
    assert "looks -135.0 deg to the left of the x axis and 45.0 deg down" in second
    assert "the floor at x, y, z = -0.85, -0.85, -1.20 m" in second


def test_the_mark_to_aim_at_lies_on_the_axis_and_on_the_rooms_shell(limits: Limits) -> None:
    place = np.array([1.0, -2.0, 1.5])
    for ahead in (np.array([0.0, 0.6, -0.8]), np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])):
        mark, _ = sight(place, ahead, limits.room)
        np.testing.assert_allclose(np.cross(mark - place, ahead), 0.0, atol=1e-12)
        assert limits.room.holds(mark)
        assert np.isclose(mark, limits.room.low).any() or np.isclose(mark, limits.room.high).any()


def test_a_moved_camera_looks_at_the_same_point_and_the_table_says_what_changes(
    settings: Settings, limits: Limits
) -> None:
    cameras = rig_of(settings, None).rig.cameras
    step = np.array([0.5, 0.0, -0.2])
    after = moved(cameras[0], step, limits)
    np.testing.assert_allclose(after.p_CinW, cameras[0].p_CinW + step)
    uv_px, _ = after.project(np.zeros((1, 3)))
    np.testing.assert_allclose(uv_px[0], (319.5, 239.5), atol=1e-6)
    moves = what_if(cameras, limits, every_move(2, 0.5))
    assert len(moves) == 12
    first = moves[0]
    changed = [moved(cameras[0], first.step_m, limits), cameras[1]]
    assert first.after == survey(changed, limits, COARSE).figures
    assert first.before == survey(cameras, limits, COARSE).figures
    assert [move.leaves_room for move in moves if move.step_m[2] > 0.0] == [True, True]


def test_of_the_papers_volume_its_own_cameras_cover_a_third(settings: Settings) -> None:
    found = survey(rig_of(settings, None).rig.cameras, limits_of(settings, Wishes())).figures
    assert found.covered == pytest.approx(0.32, abs=0.02)


@pytest.mark.parametrize(
    ("wishes", "complaint"),
    [
        (Wishes(volume="-3,1,-1,1,-1,1"), "volume reaches from x = -3 to 1 m, outside the room's -2.5 to 2.5 m"),
        (Wishes(volume="1,-1,-1,1,-1,1"), "--volume x: from 1 to -1 m is no range"),
        (Wishes(room="1,2,3"), "--room: '1,2,3' holds 3 numbers, wanted 6"),
        (Wishes(room="a,b,c,d,e,f"), "must be numbers such as"),
        (Wishes(walls="north"), "no wall 'north'; known are x-, x+, y-, y+, ceiling"),
        (Wishes(walls=""), "no wall and no mount to hang a camera on"),
        (Wishes(lenses="0.5"), "each must be 1 to 150 deg"),
    ],
)
def test_bad_limits_are_one_line(settings: Settings, wishes: Wishes, complaint: str) -> None:
    with pytest.raises(OperatorError) as refused:
        limits_of(settings, wishes)
    assert complaint in str(refused.value)


def test_a_volume_that_no_camera_sees_well_enough_is_refused(settings: Settings) -> None:
    blind = limits_of(settings, Wishes(lenses="140"))
    with pytest.raises(OperatorError, match=r"from none of .* places does a camera have"):
        Search(blind, lambda _line: None).best(2, seed=1)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--cameras", "9"], "--cameras: 9 cameras must be 2 to 8"),
        (["--cameras", "1"], "--cameras: 1 cameras must be 2 to 8"),
        (["--seed", "-1"], "--seed: -1 must be 0 or more"),
        (["--move", "cam7:1,0,0"], "--move: no camera 'cam7'; known are cam0, cam1"),
        (["--move", "cam0:1,0"], "must be a camera and three metres"),
        (["--move", "cam0:9,0,0"], "outside the room; give a shorter step"),
    ],
)
def test_the_command_refuses_in_one_line_with_exit_code_2(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["place", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert complaint in captured.err.splitlines()[-1]


def test_an_unknown_key_of_place_names_the_known_ones(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lab = (Path(__file__).parents[3] / "config" / "lab.toml").read_text(encoding="utf-8")
    path = tmp_path / "room.toml"
    path.write_text(lab.replace("lenses_deg", "lens_deg", 1), encoding="utf-8")
    assert run_command_line(["place", "--config", str(path)]) == 2
    assert "[place] unknown key lens_deg; did you mean lenses_deg?" in capsys.readouterr().err


def test_judging_a_layout_writes_page_pictures_and_config(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["place", "--volume", SMALL, "--move", "cam1:0.5,0,0", "--out", str(tmp_path), "--json"]
    assert run_command_line(arguments) == 0
    page = json.loads(capsys.readouterr().out)
    assert page["good"] is True
    assert [move["camera"] for move in page["moves"]] == ["cam1"]
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in tmp_path.iterdir()} == {"map.png", "cameras.toml", "room.toml", "place.json"}
    assert load_settings(tmp_path / "room.toml").rig.calibration == ""


def test_the_papers_page_sets_its_figures_beside_ours(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["place", "--paper", "--out", str(tmp_path), "--json"]) == 0
    page = json.loads(capsys.readouterr().out)
    ours = {line["claim"]: line["ours"] for line in page["claims"]}
    assert ours["least triangulation error, mm"] == "7.07 to 7.08 on the arc"
    assert ours["best of a sweep in 5 deg steps, delta"] == "4.8783 at 45, 45, 45, -135 deg"
    assert len(page["table_1"]) == 16
    for name in ("fig3.png", "fig4.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
