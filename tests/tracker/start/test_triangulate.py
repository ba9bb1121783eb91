"""Rays to points: exact without noise, honest with it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tracker.rigs import ring_rig
from tracker.start.triangulate import MISS_SIGMA, Rays, meetings, triangulate
from tracker.types import Array, Point, Reason, Rejected

SIGMA_RAD = 5e-4
TRIALS = 300
OFF_CENTRE = np.array([0.9, 0.6, 0.7])  # nearer to one camera than to the others


def directions(p_inW: Array, p_CinW: Array) -> Array:
    """Return the unit bearings (n, 3) from the cameras to a point."""
    towards = p_inW - p_CinW
    return np.asarray(towards / np.linalg.norm(towards, axis=1, keepdims=True))


def shaken(u: Array, sigma_rad: float, rng: np.random.Generator) -> Array:
    """Turn each bearing by an isotropic small angle."""
    turned = u + np.cross(u, sigma_rad * rng.normal(size=u.shape))
    return np.asarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))


def centres(count: int) -> Array:
    return np.stack([camera.p_CinW for camera in ring_rig(count).cameras])


@given(
    st.integers(2, 4), st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)).map(np.array)
)  # fmt: skip
def test_rays_without_noise_meet_in_the_point(count: int, p_inW: Array) -> None:
    point = triangulate(directions(p_inW, centres(count)), centres(count), SIGMA_RAD)
    assert isinstance(point, Point)
    assert np.allclose(point.p_inW, p_inW, atol=1e-9)
    assert point.miss_m < 1e-9


@pytest.mark.parametrize("count", [2, 3, 4])
def test_the_reported_covariance_is_consistent(count: int) -> None:
    """Mean NEES of a 3-D error is 3; the band is four sigma for n trials, sd sqrt(6 / n)."""
    rng = np.random.default_rng(7)
    u = directions(OFF_CENTRE, centres(count))
    nees = []
    for _ in range(TRIALS):
        point = triangulate(shaken(u, SIGMA_RAD, rng), centres(count), SIGMA_RAD)
        assert isinstance(point, Point)
        error = point.p_inW - OFF_CENTRE
        nees.append(error @ np.linalg.solve(point.covariance, error))
    assert abs(np.mean(nees) - 3.0) < 4.0 * np.sqrt(6.0 / TRIALS)


def test_a_camera_far_away_counts_as_less_sure() -> None:
    """The covariance grows with the square of the distance: twice as far, four times the variance."""
    p_CinW = centres(2)
    near, far = (triangulate(directions(np.zeros(3), k * p_CinW), k * p_CinW, SIGMA_RAD) for k in (1.0, 2.0))
    assert isinstance(near, Point)
    assert isinstance(far, Point)
    assert np.allclose(far.covariance, 4.0 * near.covariance)


def test_rays_that_pass_each_other_are_met_in_the_middle_and_the_miss_is_told() -> None:
    p_CinW = np.array([[-1.0, 0.0, 0.01], [0.0, -1.0, -0.01]])
    point = triangulate(np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), p_CinW, SIGMA_RAD)
    assert isinstance(point, Point)
    assert np.allclose(point.p_inW, 0.0, atol=1e-12)
    assert point.miss_m == pytest.approx(0.01)


@pytest.mark.parametrize(("angle_deg", "enough"), [(0.0, False), (1.9, False), (2.1, True), (178.1, False)])
def test_rays_too_parallel_are_rejected(angle_deg: float, enough: bool) -> None:
    """Cameras that look at each other have no parallax either."""
    angle = np.radians(angle_deg)
    p_CinW = np.array([[0.0, 0.0, -1.0], [-np.sin(angle), 0.0, -np.cos(angle)]])
    point = triangulate(directions(np.zeros(3), p_CinW), p_CinW, SIGMA_RAD)
    if enough:
        assert isinstance(point, Point)
    else:
        assert isinstance(point, Rejected)
        assert point.reason is Reason.PARALLAX
        assert "least 2 deg" in point.detail


def test_two_parallel_rays_do_no_harm_when_a_third_crosses_them() -> None:
    p_CinW = np.array([[0.0, 0.0, -2.0], [0.001, 0.0, -2.0], [2.0, 0.0, 0.0]])
    point = triangulate(directions(np.array([0.1, 0.2, 0.3]), p_CinW), p_CinW, SIGMA_RAD)
    assert isinstance(point, Point)
    assert np.allclose(point.p_inW, [0.1, 0.2, 0.3], atol=1e-9)


def test_rays_that_meet_behind_a_camera_are_rejected() -> None:
    p_CinW = centres(2)
    for side in (np.array([[-1.0], [-1.0]]), np.array([[1.0], [-1.0]])):
        point = triangulate(side * directions(np.zeros(3), p_CinW), p_CinW, SIGMA_RAD)
        assert isinstance(point, Rejected)
        assert point.reason is Reason.BEHIND


def test_two_cameras_in_one_place_are_rejected() -> None:
    p_CinW = np.zeros((2, 3))
    point = triangulate(directions(np.array([0.0, 0.0, 1.0]), p_CinW), p_CinW, SIGMA_RAD)
    assert isinstance(point, Rejected)
    assert point.reason is Reason.PARALLAX


def anywhere(u_inW: Array) -> Rays:
    return Rays(u_inW, np.tile((0.0, np.inf), (len(u_inW), 1)))


@pytest.mark.parametrize(("camera", "share", "found"), [(0, 0.9, False), (1, 0.9, False), (0, 1.1, True)])
def test_rays_meet_only_where_both_may_be(camera: int, share: float, found: bool) -> None:
    """One camera's thing is said to be no further off than a share of its distance."""
    p, p_CinW = np.array([0.1, -0.2, 0.3]), centres(2)
    a, b = (anywhere(u[None]) for u in directions(p, p_CinW))
    (a, b)[camera].within_m[0, 1] = share * np.linalg.norm(p - p_CinW[camera])
    assert len(meetings(a, b, p_CinW, SIGMA_RAD, 0.0, 100)) == found


def test_rays_of_two_cameras_meet_where_each_pair_of_them_is_triangulated() -> None:
    """Each ray leads to a point of its own; the ray to the last one points the other way."""
    rng, p_CinW = np.random.default_rng(3), centres(2)
    a, b = (np.stack([directions(p, p_CinW)[k] for p in rng.uniform(-0.5, 0.5, (6, 3))]) for k in (0, 1))
    b[-1] *= -1.0
    pairs = [triangulate(np.stack((u, v)), p_CinW, SIGMA_RAD) for u in a for v in b]
    points = [point for point in pairs if isinstance(point, Point)]
    near = [p for p in points if p.miss_m <= 0.1 + MISS_SIGMA * np.sqrt(np.trace(p.covariance) / 3.0)]
    met = meetings(anywhere(a), anywhere(b), p_CinW, SIGMA_RAD, 0.1, 100)
    assert 0 < len(met) == len(near) < len(points) < len(pairs)
    assert len(meetings(anywhere(a), anywhere(b), p_CinW, SIGMA_RAD, 0.1, 2)) == 2
    for one, other in zip(met, sorted(near, key=lambda point: point.miss_m), strict=True):
        assert np.array_equal(one.p_inW, other.p_inW)
        assert np.array_equal(one.covariance, other.covariance)
        assert one.miss_m == other.miss_m
