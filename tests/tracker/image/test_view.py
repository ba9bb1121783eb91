"""What a camera is expected to see of each ball, and by how much its image may be smeared."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import moved_marker, state
from tracker.filter.bias import LIGHT_PX, STREAK_SHARE, shared_covariance
from tracker.filter.measure import predicted_pixels
from tracker.image.view import DEPTH, RADIUS, RAY_X, S_UU, S_UV, S_VV, SPEED_U, U, V, expected_views, unknown_streak_px
from tracker.maths import so3
from tracker.rig import make_rig
from tracker.state import State
from tracker.types import Array

RIG = make_rig(
    paper_rig().cameras, moved_marker(paper_rig().marker, so3.from_euler(0.2, -0.3, 0.4), np.array([0.02, -0.03, 0.05]))
)
ANGLES = np.linspace(0.0, 2.0 * math.pi, 90, endpoint=False)
VECTOR = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)).map(np.array)


def known(now: State) -> State:
    """Return a state that is as sure of itself as a track is, errors correlated."""
    root = 1e-2 * np.random.default_rng(1).normal(size=(25, 25))
    return replace(now, P=root @ root.T)


@given(VECTOR, VECTOR, VECTOR, st.integers(0, 1), st.sampled_from([0, 16_700_000]))
def test_centres_and_their_covariances_are_the_filters_own(
    p: Array, euler: Array, v: Array, camera: int, tau_ns: int
) -> None:
    now = known(state(10**9, 0.5 * p, 90.0 * euler, 2.5 * v))
    uv_px, H = predicted_pixels(now, RIG, camera, 10**9 + tau_ns)
    views = expected_views(now, RIG, camera, 10**9 + tau_ns)
    S = H @ now.P @ H.transpose(0, 2, 1) + np.eye(2)
    assert np.allclose(views[:, [U, V]], uv_px)
    assert np.allclose(views[:, [S_UU, S_UV, S_UV, S_VV]].reshape(-1, 2, 2), S)


@given(VECTOR, VECTOR, VECTOR, VECTOR, st.integers(0, 1))
def test_a_ball_is_expected_as_large_as_it_is_far_and_as_fast_as_it_moves(
    p: Array, euler: Array, v: Array, w: Array, camera: int
) -> None:
    now = known(state(10**9, 0.5 * p, 90.0 * euler, 2.5 * v, 4.0 * w))
    views, seen_by = expected_views(now, RIG, camera, 10**9), RIG.cameras[camera]
    points_inC = seen_by.in_camera(RIG.marker.points_inB @ now.R_BtoW.T + now.p_BinW)
    later, sooner = (predicted_pixels(now, RIG, camera, 10**9 + step_ns)[0] for step_ns in (1000, -1000))
    assert np.allclose(
        views[:, RAY_X : DEPTH + 1], points_inC / np.column_stack((points_inC[:, 2:], points_inC[:, 2:], np.ones(3)))
    )
    for ball, point_inC, radius_px in zip(RIG.marker.balls, points_inC, views[:, RADIUS], strict=True):
        axes = ball.radius_m * np.linalg.svd(point_inC[None])[2][1:]  # two across the ray
        round_it = point_inC + np.column_stack((np.cos(ANGLES), np.sin(ANGLES))) @ axes
        u, v = seen_by.project(round_it @ seen_by.R_CtoW.T + seen_by.p_CinW)[0].T
        area_px2 = 0.5 * abs(u @ np.roll(v, 1) - v @ np.roll(u, 1))
        assert np.isclose(radius_px, math.sqrt(area_px2 / math.pi), rtol=1e-3)
    assert np.allclose(views[:, SPEED_U : SPEED_U + 2], (later - sooner) / 2e-6, rtol=1e-4, atol=0.01)


def test_a_ball_behind_the_camera_is_expected_nowhere() -> None:
    camera = RIG.cameras[0]
    views = expected_views(known(state(0, camera.p_CinW - camera.R_CtoW[:, 2])), RIG, 0, 0)
    assert np.isnan(views[:, [U, V]]).all()
    assert (views[:, DEPTH] < 0.0).all()


def test_a_streak_not_known_of_is_speeds_sigma_times_exposure_times_focal_length_over_distance() -> None:
    sigma_m_s = 0.3
    P = np.zeros((25, 25))
    P[6:9, 6:9] = sigma_m_s**2 * np.eye(3)
    now, camera = replace(state(), P=P), RIG.cameras[1]
    one_open = unknown_streak_px(now, RIG, (0.0, 0.004))
    assert math.isclose(one_open, sigma_m_s * 0.004 * camera.focal_px / float(np.linalg.norm(camera.p_CinW)))
    assert unknown_streak_px(now, RIG, (0.001, 0.004)) == one_open


def test_what_all_balls_share_shrinks_with_the_information_of_all_cameras() -> None:
    """The covariance is the inverse of the sum of each camera's (f / d s)^2 (I - u u'), s grown by the streak."""
    now, exposure_s, information = state(0, (0.2, -0.1, 0.3), v_BinW=(1.0, -2.0, 0.5)), 0.005, np.zeros((3, 3))
    for camera in RIG.cameras:
        ray = now.p_BinW - camera.p_CinW
        across = np.eye(3) - np.outer(ray, ray) / (ray @ ray)
        scale = camera.focal_px / float(np.linalg.norm(ray))
        streak_px = scale * float(np.linalg.norm(across @ now.v_BinW)) * exposure_s
        information += scale**2 / (LIGHT_PX**2 + (STREAK_SHARE * streak_px) ** 2) * across
    assert np.allclose(shared_covariance(now, RIG, exposure_s, np.zeros(2)) @ information, np.eye(3))
