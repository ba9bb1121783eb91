"""One image to sightings: near the track, or everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.drawing import frame
from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import covariance, perturbed, seen_px, state
from tracker.image.album import Album
from tracker.image.appearance import Appearance
from tracker.image.hiding import SHARE
from tracker.image.look import Look, gaze_of, look_everywhere, look_near
from tracker.image.mounting import Mounting
from tracker.image.patch import Response
from tracker.image.sight import SHOWN
from tracker.state import State
from tracker.types import BallSighting, Frame, Reason, Rejected

RIG = paper_rig()
FLYING = state(0, (0.2, -0.1, 0.1), (12.0, -8.0, 130.0), (0.5, 0.5, 0.2), (0.3, 0.2, 1.0))
SHARP = Appearance(Response(0.25, 0.25, detail=1.0))


def look(image: Frame, expected: State) -> tuple[list[BallSighting], list[Rejected]]:
    found = whole_look(image, expected)
    return found.sightings, found.rejections


def whole_look(image: Frame, expected: State) -> Look:
    gazes = [gaze_of(RIG, SHARP, Album(camera)) for camera in RIG.cameras]
    return look_near([image], RIG, expected, gazes, Mounting(RIG.marker).things)


@pytest.mark.parametrize("camera", [0, 1])
def test_every_ball_is_seen_where_it_is_though_the_track_is_a_little_off(camera: int) -> None:
    off = perturbed(FLYING, np.array([0.003, -0.003, 0.002, 0.02, -0.02, 0.02, *np.zeros(6)]))
    sightings, rejections = look(frame(FLYING, RIG, camera, 0), off)
    assert rejections == []
    assert [(s.camera, s.ball, s.t_ns) for s in sightings] == [(camera, ball, 0) for ball in range(3)]
    for sighting, uv_px in zip(sightings, seen_px(FLYING, RIG, camera, 0), strict=True):
        error_px = sighting.uv_px - uv_px
        assert error_px @ np.linalg.solve(sighting.cov_px, error_px) < 9.0  # what light not known yet may do is in it
        assert np.abs(error_px).max() < 0.2
        assert np.linalg.eigvalsh(sighting.cov_px).min() > 0.0


def test_the_region_is_at_the_frames_time_and_not_the_tracks() -> None:
    """100 ms at 1.5 m/s are 150 mm: the balls have left the regions of the state's own time."""
    fast = replace(FLYING.with_parts(v_BinW=np.array([0.0, -1.5, 0.0])), P=covariance(0.001, 0.01, 0.02, 0.05))
    sightings, _ = look(frame(fast, RIG, 0, 100_000_000), fast)
    assert len(sightings) == 3
    assert {s.t_ns for s in sightings} == {100_000_000}


def test_a_hidden_ball_is_told_and_the_others_seen() -> None:
    sightings, rejections = look(frame(FLYING, RIG, 0, 0, hidden=(1,)), FLYING)
    assert [s.ball for s in sightings] == [0, 2]
    (rejected,) = rejections
    assert (rejected.reason, rejected.camera, rejected.t_ns) == (Reason.NO_BALL, 0, 0)
    assert "green" in rejected.detail


def test_no_ball_is_seen_in_noise_that_holds_every_colour() -> None:
    """As a decoder may leave of a damaged frame: it has spots of each ball's colour, and one is the nearest."""
    rng = np.random.default_rng(1)
    unsure = replace(FLYING, P=covariance(0.01, 0.05, 0.02, 0.05))
    for _ in range(40):
        broken = replace(frame(FLYING, RIG, 0, 0), image=rng.integers(0, 256, (480, 640, 3), np.uint8))
        sightings, rejections = look(broken, unsure)
        assert sightings == []
        assert {rejected.reason for rejected in rejections} == {Reason.NO_BALL}


def test_balls_out_of_view_are_told() -> None:
    camera = RIG.cameras[0]
    aside = state(0, 1.5 * camera.R_CtoW[:, 0])
    sightings, rejections = look(frame(aside, RIG, 0, 0), aside)
    assert sightings == []
    assert [r.reason for r in rejections] == [Reason.AT_BORDER] * 3


@pytest.mark.parametrize("ahead_m", [-1.0, 0.05])
def test_balls_behind_or_at_the_lens_are_told(ahead_m: float) -> None:
    camera = RIG.cameras[0]
    there = state(0, camera.p_CinW + ahead_m * camera.R_CtoW[:, 2])
    sightings, rejections = look(frame(FLYING, RIG, 0, 0), there)
    assert sightings == []
    assert len(rejections) == 3
    assert Reason.BEHIND in {r.reason for r in rejections}


@pytest.mark.parametrize("ahead_m", [-1.0, 0.05])
def test_a_ball_that_is_not_found_shows_nothing_of_itself(ahead_m: float) -> None:
    camera = RIG.cameras[0]
    there = state(0, camera.p_CinW + ahead_m * camera.R_CtoW[:, 2])
    found = whole_look(frame(FLYING, RIG, 0, 0), there)
    assert np.isnan(found.glances[0].fits[:, SHOWN][:, SHARE]).all()


def test_looking_everywhere_finds_each_ball_by_its_colour() -> None:
    found = look_everywhere(frame(FLYING, RIG, 1, 0), RIG.cameras[1], RIG)
    for blobs, uv_px in zip(found, seen_px(FLYING, RIG, 1, 0), strict=True):
        assert np.allclose(blobs[0].uv_px, uv_px, atol=0.8)
