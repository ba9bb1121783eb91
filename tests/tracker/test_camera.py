"""The camera's laws: projection, its inverse, its slope, and calibrations it will not take."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tracker.paper_rig import FOCAL_PX, paper_camera
from tracker.camera import Camera, make_camera
from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.types import Array

DISTORTIONS = [
    (0.0, 0.0, 0.0, 0.0),
    (-0.11, 0.09, -0.0004, 0.0006),
    (-0.28, 0.07, 0.0003, -0.0002, 0.01),
    (-0.2, 0.05, 0.0003, -0.0002, 0.01, 0.02, -0.01, 0.004),
]
CAMERAS = [paper_camera(f"cam{i}", 45.0 + 100.0 * i, d) for i, d in enumerate(DISTORTIONS)]
IN_THE_VOLUME = st.tuples(st.floats(-0.6, 0.6), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)).map(np.array)


def by_hand(camera: Camera, p_inW: Array) -> Array:
    """Project one point by the textbook's formula."""
    x_m, y_m, z_m = camera.R_CtoW.T @ (p_inW - camera.p_CinW)
    x, y = x_m / z_m, y_m / z_m
    k1, k2, p1, p2, k3, k4, k5, k6 = (*camera.distortion, 0.0, 0.0, 0.0, 0.0)[:8]
    r2 = x * x + y * y
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.array([camera.K[0, 0] * xd + camera.K[0, 2], camera.K[1, 1] * yd + camera.K[1, 2]])


@given(st.sampled_from(CAMERAS), IN_THE_VOLUME)
def test_a_point_is_seen_where_the_textbook_says(camera: Camera, p_inW: Array) -> None:
    assert np.allclose(camera.project(p_inW[None])[0][0], by_hand(camera, p_inW), atol=1e-9)


@given(st.sampled_from(CAMERAS), IN_THE_VOLUME)
def test_the_slope_of_the_projection_is_that_of_finite_differences(camera: Camera, p_inW: Array) -> None:
    step = 1e-6
    ahead, behind = (camera.project(p_inW + side * step * np.eye(3))[0] for side in (1.0, -1.0))
    J = camera.project(p_inW[None])[1][0]
    assert np.allclose(J, ((ahead - behind) / (2.0 * step)).T, rtol=1e-6, atol=1e-3)


@given(st.sampled_from(CAMERAS), IN_THE_VOLUME)
def test_the_ray_through_a_points_pixel_goes_to_the_point(camera: Camera, p_inW: Array) -> None:
    u_inC = camera.bearings(camera.project(p_inW[None])[0])[0]
    towards = camera.in_camera(p_inW[None])[0]
    assert np.linalg.norm(u_inC) == pytest.approx(1.0, abs=1e-12)
    assert np.allclose(u_inC, towards / np.linalg.norm(towards), atol=1e-9)


def test_many_points_are_projected_as_each_alone() -> None:
    points = np.array([[0.1, 0.2, -0.1], [-0.4, 0.0, 0.3], [0.0, 0.0, 0.0]])
    uv_px, J = CAMERAS[1].project(points)
    for i, point in enumerate(points):
        alone_px, alone_J = CAMERAS[1].project(point[None])
        assert np.allclose(uv_px[i], alone_px[0], rtol=0.0, atol=1e-9)
        assert np.allclose(J[i], alone_J[0], rtol=1e-12)


def test_a_point_behind_the_camera_is_seen_nowhere_and_spoils_no_other() -> None:
    camera = CAMERAS[1]
    behind = camera.p_CinW - camera.R_CtoW[:, 2]
    uv_px, J = camera.project(np.stack((behind, np.zeros(3))))
    assert np.isnan(uv_px[0]).all()
    assert np.isnan(J[0]).all()
    assert np.isfinite(uv_px[1]).all()
    assert np.isfinite(J[1]).all()


@pytest.mark.parametrize(
    ("uv_px", "margin_px", "seen"),
    [
        ((0.0, 0.0), 0.0, True),
        ((639.0, 479.0), 0.0, True),
        ((639.5, 100.0), 0.0, False),
        ((100.0, -0.1), 0.0, False),
        ((4.9, 100.0), 5.0, False),
        ((634.0, 474.0), 5.0, True),
        ((100.0, 474.1), 5.0, False),
        ((math.nan, 5.0), 0.0, False),
    ],
)
def test_a_camera_sees_what_lies_in_its_image_by_a_margin(
    uv_px: tuple[float, float], margin_px: float, seen: bool
) -> None:
    assert CAMERAS[0].sees(np.array(uv_px), margin_px) is seen


def test_a_rotation_rounded_in_a_file_is_made_exact() -> None:
    T_CtoW = np.eye(4)
    T_CtoW[:3, :3] = np.round(so3.from_euler(0.3, -0.7, 2.0), 5)
    camera = make_camera("cam0", (640, 480), (FOCAL_PX, FOCAL_PX, 319.5, 239.5), (0.0,) * 4, T_CtoW)
    assert np.allclose(camera.R_CtoW @ camera.R_CtoW.T, np.eye(3), atol=1e-14)
    assert np.allclose(camera.R_CtoW, T_CtoW[:3, :3], atol=1e-4)


def test_a_calibration_cannot_be_changed() -> None:
    for values in (CAMERAS[0].K, CAMERAS[0].R_CtoW, CAMERAS[0].p_CinW, CAMERAS[0].distortion):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1.0


def pose(R: Array) -> Array:
    T = np.eye(4)
    T[:3, :3] = R
    return T


GOOD = ((640, 480), (600.0, 600.0, 320.0, 240.0), (0.0,) * 4, np.eye(4))


@pytest.mark.parametrize(
    ("place", "value", "complaint"),
    [
        (0, (0, 480), "resolution 0 x 480 px must be positive"),
        (1, (-600.0, 600.0, 320.0, 240.0), "focal lengths -600, 600 px must be positive"),
        (1, (math.nan, 600.0, 320.0, 240.0), "focal lengths nan, 600 px must be positive"),
        (1, (600.0, 600.0, 640.0, 240.0), "principal point 640, 240 px lies outside the 640 x 480 px image"),
        (1, (600.0, 600.0, 320.0, -1.0), "principal point 320, -1 px lies outside"),
        (2, (0.0,) * 6, "6 distortion coefficients; give 4, 5 or 8"),
        (2, (0.0, 0.0, 0.0, math.inf), "finite"),
        (3, np.eye(3), "must be 4 x 4 finite numbers"),
        (3, np.full((4, 4), math.nan), "must be 4 x 4 finite numbers"),
        (3, pose(1.001 * np.eye(3)), "holds no rotation: R R' departs from the identity by 0.002, limit 0.0001"),
        (3, pose(np.diag([1.0, 1.0, -1.0])), "mirrors"),
        (3, np.diag([1.0, 1.0, 1.0, 2.0]), "holds no rotation"),
    ],
)  # fmt: skip
def test_a_calibration_that_cannot_be_is_refused_in_one_line(place: int, value: object, complaint: str) -> None:
    values: list[Any] = list(GOOD)
    values[place] = value
    with pytest.raises(OperatorError) as caught:
        make_camera("cam7", *values)
    assert str(caught.value).startswith("calibration of cam7: ")
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)
