"""The outline of a ball in an image, beside what OpenCV projects and what rays meet."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from tests.tracker.paper_rig import paper_rig
from tracker.camera import Camera, make_camera
from tracker.filter.measure import camera_table
from tracker.image.centre import Centre, fit_centre
from tracker.image.outline import LONGER_U, LONGER_UV, OUTLINE_SIZE, RADIUS, SHIFT_U, SHIFT_V, outline
from tracker.image.patch import Expected, Response
from tracker.image.template import FLAT
from tracker.rig import make_rig
from tracker.types import Array, Image

WIDE = (-0.31, 0.09, 0.0005, -0.0004)  # what lenses of 55 degrees have
CAMERA, MARKER = paper_rig().cameras[1], paper_rig().marker
RADIUS_M = 0.0075
ASIDE = [(0.0, 0.0), (0.45, 0.0), (-0.3, 0.28), (0.45, -0.3)]  # of the axis, by the depth
SIDE = 9  # rays on each side of a pixel


def camera_with(distortion: tuple[float, ...]) -> Camera:
    """Return a camera whose frame is the room's."""
    return make_camera("wide", (800, 600), (780.0, 784.0, 399.5, 299.5), distortion, np.eye(4))


def told(camera: Camera, ball_inC: Array) -> Array:
    out = np.empty(OUTLINE_SIZE)
    outline(ball_inC, RADIUS_M, camera_table(make_rig((camera, CAMERA), MARKER))[0], np.empty((7, 3)), out)
    return out


def projected(camera: Camera, points_inC: Array) -> Array:
    none = np.zeros(3)
    uv_px, _ = cv2.projectPoints(points_inC.reshape(-1, 1, 3), none, none, camera.K, camera.distortion)
    return np.asarray(uv_px, np.float64).reshape(-1, 2)


def limb(ball_inC: Array) -> Array:
    """Return points (n, 3) of the circle in which the cone from the camera touches a ball."""
    away_m = float(np.linalg.norm(ball_inC))
    first, second = np.linalg.svd(ball_inC[None])[2][1:]
    angles = np.linspace(0.0, 2.0 * math.pi, 400, endpoint=False)[:, None]
    sine = RADIUS_M / away_m
    across = np.cos(angles) * first + np.sin(angles) * second
    return np.asarray((1.0 - sine**2) * ball_inC + RADIUS_M * math.sqrt(1.0 - sine**2) * across)


@pytest.mark.parametrize("distortion", [(0.0, 0.0, 0.0, 0.0), WIDE])
@pytest.mark.parametrize("place", ASIDE)
@pytest.mark.parametrize("depth_m", [0.5, 2.0])
def test_an_outline_is_the_oval_that_is_told(
    depth_m: float, place: tuple[float, float], distortion: tuple[float, ...]
) -> None:
    camera, ball_inC = camera_with(distortion), depth_m * np.array((*place, 1.0))
    oval = told(camera, ball_inC)
    middle_px = projected(camera, ball_inC)[0] + oval[SHIFT_U : SHIFT_V + 1]
    e = np.array(((oval[LONGER_U], oval[LONGER_UV]), (oval[LONGER_UV], -oval[LONGER_U])))
    from_middle = projected(camera, limb(ball_inC)) - middle_px
    off_px = np.linalg.norm(from_middle @ (np.eye(2) - e + 0.5 * e @ e), axis=1) - oval[RADIUS]
    assert np.abs(off_px).max() < 0.005 * oval[RADIUS]
    lean = np.linalg.lstsq(from_middle / np.linalg.norm(from_middle, axis=1)[:, None], off_px, rcond=None)[0]
    assert np.linalg.norm(lean) < 0.005


@pytest.mark.parametrize("place", ASIDE)
def test_a_pinholes_outline_is_shifted_as_the_cone_through_it_says(place: tuple[float, float]) -> None:
    """The middle of the ellipse that a plane cuts out of a cone round a sphere is x / (1 - (r / Z)^2)."""
    camera, ball_inC = camera_with((0.0, 0.0, 0.0, 0.0)), 0.4 * np.array((*place, 1.0))
    focal_px = np.array((camera.K[0, 0], camera.K[1, 1]))
    assert np.allclose(told(camera, ball_inC)[SHIFT_U:], focal_px * place * (RADIUS_M / 0.4) ** 2, rtol=0.01, atol=1e-6)


def test_a_ball_behind_the_camera_has_no_end() -> None:
    oval = told(camera_with(WIDE), np.array((0.0, 0.0, -1.0)))
    assert math.isinf(oval[RADIUS])
    assert not oval[LONGER_U:].any()


def picture(camera: Camera, ball_inC: Array, uv_px: Array) -> Image:
    """Return an image in which every ray that meets the ball is bright."""
    image, half = np.full((600, 800, 3), 60.0), 24
    left, top = (round(float(place)) - half for place in uv_px)
    fine = (np.arange(SIDE * (2 * half + 1)) + 0.5) / SIDE - 0.5
    u, v = np.meshgrid(left + fine, top + fine)
    xy = cv2.undistortPoints(np.stack((u, v), -1).reshape(-1, 1, 2), camera.K, camera.distortion).reshape(-1, 2)
    rays = np.column_stack((xy, np.ones(len(xy))))
    beside_m2 = ball_inC @ ball_inC - (rays @ ball_inC) ** 2 / (rays * rays).sum(axis=1)
    met = (beside_m2 < RADIUS_M**2).reshape(2 * half + 1, SIDE, 2 * half + 1, SIDE).mean(axis=(1, 3))
    part = image[top : top + 2 * half + 1, left : left + 2 * half + 1]
    part += met[:, :, None] * (np.array((40.0, 160.0, 60.0)) - 60.0)
    return np.rint(image + np.random.default_rng(4).normal(0.0, 1.0, image.shape)).astype(np.uint8)


@pytest.mark.parametrize("place", ASIDE[1:])
def test_a_large_ball_is_found_where_it_is_in_a_wide_lenss_corner(place: tuple[float, float]) -> None:
    camera, ball_inC = camera_with(WIDE), 0.5 * np.array((*place, 1.0))
    uv_px, oval = projected(camera, ball_inC)[0], told(camera, ball_inC)
    response, longer = Response(0.0, 0.0, detail=1.0), (float(oval[LONGER_U]), float(oval[LONGER_UV]))
    start = float(uv_px[0]) + 0.3, float(uv_px[1]) - 0.2
    what = Expected(start, float(oval[RADIUS]), (0.0, 0.0), FLAT, response, longer=longer)
    found = fit_centre(picture(camera, ball_inC, uv_px), what)
    assert isinstance(found, Centre)
    assert np.linalg.norm(found.uv_px - oval[SHIFT_U : SHIFT_V + 1] - uv_px) < 0.02
    assert found.misfit < 1.5
