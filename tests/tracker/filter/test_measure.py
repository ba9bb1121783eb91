"""Where balls are expected: at each camera's own time, with the slope that the filter needs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import moved_marker, perturbed, seen_px, state
from tracker.filter.measure import predicted_pixels
from tracker.maths import so3
from tracker.rig import make_rig
from tracker.types import Array

OFF_CENTRE = moved_marker(paper_rig().marker, so3.from_euler(0.2, -0.3, 0.4), np.array([0.02, -0.03, 0.05]))
RIG = make_rig(paper_rig().cameras, OFF_CENTRE)
VECTOR = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)).map(np.array)
TAU_NS = st.sampled_from([0, 16_700_000, -33_300_000, 200_000_000])


@given(VECTOR, VECTOR, VECTOR, VECTOR, TAU_NS, st.integers(0, 1))
def test_balls_are_expected_where_the_vehicle_will_be_at_the_cameras_time(
    p: Array, euler: Array, v: Array, w: Array, tau_ns: int, camera: int
) -> None:
    now = state(10**9, 0.5 * p, 90.0 * euler, 2.5 * v, 4.0 * w)
    uv_px, _ = predicted_pixels(now, RIG, camera, 10**9 + tau_ns)
    assert np.allclose(uv_px, seen_px(now, RIG, camera, 10**9 + tau_ns), atol=1e-7)


@given(VECTOR, VECTOR, VECTOR, VECTOR, TAU_NS, st.integers(0, 1))
def test_the_slope_is_that_of_finite_differences(
    p: Array, euler: Array, v: Array, w: Array, tau_ns: int, camera: int
) -> None:
    step, now = 1e-6, state(10**9, 0.5 * p, 90.0 * euler, 2.5 * v, 4.0 * w)
    _, H = predicted_pixels(now, RIG, camera, 10**9 + tau_ns)
    for k, e in enumerate(np.eye(12)):
        ahead, behind = (seen_px(perturbed(now, s * step * e), RIG, camera, 10**9 + tau_ns) for s in (1, -1))
        assert np.allclose(H[:, :, k], (ahead - behind) / (2.0 * step), rtol=1e-5, atol=2e-4)


def test_at_the_states_own_time_velocity_and_rate_do_not_show() -> None:
    now = state(5, v_BinW=(1.0, 2.0, 3.0), w_BinB=(3.0, 2.0, 1.0))
    _, H = predicted_pixels(now, RIG, 0, 5)
    assert not H[:, :, 6:24].any()
    assert H[:, :, :6].any(axis=(0, 1)).all()


def test_a_ball_behind_the_camera_is_expected_nowhere() -> None:
    camera = RIG.cameras[0]
    uv_px, H = predicted_pixels(state(0, camera.p_CinW - camera.R_CtoW[:, 2]), RIG, 0, 0)
    assert uv_px.shape == (3, 2)
    assert H.shape == (3, 2, 25)
    assert np.isnan(uv_px).all()


def test_a_ball_moves_by_speed_times_focal_length_over_distance_times_the_time() -> None:
    """1.5 m/s along the image for 16.7 ms, 3.18 m away with 1194 px: 9.4 px, what pairing frames would cost."""
    camera = paper_rig().cameras[0]
    now = state(0, v_BinW=1.5 * camera.R_CtoW[:, 0])
    there, _ = predicted_pixels(now, paper_rig(), 0, 16_700_000)
    here, _ = predicted_pixels(now, paper_rig(), 0, 0)
    assert (there - here)[:, 0].mean() == pytest.approx(9.4, abs=0.1)
