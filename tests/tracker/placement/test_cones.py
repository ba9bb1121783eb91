"""The paper's section 2.2: fig. 3 and what it claims."""

from __future__ import annotations

import numpy as np
import pytest

from tracker.placement.cones import (
    PAPER_BASELINE_M,
    PAPER_HALF_ANGLE_RAD,
    convergence_angle,
    first_order_error,
    grid,
    half_circle,
    quadrilateral,
    triangulation_error,
)

CONES = (PAPER_HALF_ANGLE_RAD, PAPER_HALF_ANGLE_RAD)


def test_the_least_error_is_7_08_mm_all_along_the_half_circle() -> None:
    error_mm = 1e3 * triangulation_error(half_circle(181, PAPER_BASELINE_M, 0.01), PAPER_BASELINE_M, CONES)
    assert error_mm.max() == pytest.approx(7.08, abs=0.005)
    assert error_mm.min() == pytest.approx(7.07, abs=0.005)


def test_on_the_papers_grid_the_least_error_lies_where_the_rays_meet_at_a_right_angle() -> None:
    points = grid(np.arange(-3.0, 3.0, 0.02), np.arange(0.02, 3.5, 0.02))
    error = triangulation_error(points, PAPER_BASELINE_M, CONES)
    best = np.argsort(error)[:50]
    assert 1e3 * error.min() == pytest.approx(7.07, abs=0.01)
    np.testing.assert_allclose(np.degrees(convergence_angle(points[best], PAPER_BASELINE_M)), 90.0, atol=2.0)


def test_the_error_grows_to_both_sides_of_the_half_circle() -> None:
    for direction in np.radians([20.0, 60.0, 90.0, 130.0]):
        radii = np.linspace(0.5, 1.5, 11) * PAPER_BASELINE_M / 2.0
        points = radii[:, None] * np.array([np.cos(direction), np.sin(direction)])
        best = int(np.argmin(triangulation_error(points, PAPER_BASELINE_M, CONES)))
        assert radii[best] == pytest.approx(PAPER_BASELINE_M / 2.0)


@pytest.mark.parametrize(("baseline_m", "half_angle"), [(1.0, 1e-4), (4.5, 1e-3), (10.0, 3e-4)])
def test_equal_cones_keep_the_arc_whatever_baseline_and_angle(baseline_m: float, half_angle: float) -> None:
    arc = triangulation_error(half_circle(91, baseline_m, 0.05), baseline_m, (half_angle, half_angle))
    np.testing.assert_allclose(arc, baseline_m * half_angle, rtol=2e-3)


def test_unequal_cones_leave_the_arc_no_level_line() -> None:
    """The paper says the minimum holds whatever theta_A and theta_B; near the camera of the wider cone it is less."""
    wide, narrow = 2.0 * PAPER_HALF_ANGLE_RAD, PAPER_HALF_ANGLE_RAD
    near_b, near_a = triangulation_error(half_circle(2, PAPER_BASELINE_M, 0.05), PAPER_BASELINE_M, (wide, narrow))
    assert near_b / near_a == pytest.approx(2.0, rel=0.01)


def test_the_closed_form_agrees_with_the_cut_cones() -> None:
    points = np.random.default_rng(1).uniform([-3.0, 0.3], [3.0, 3.5], (500, 2))
    for cones in (CONES, (2e-4, 5e-4)):
        exact = triangulation_error(points, PAPER_BASELINE_M, cones)
        np.testing.assert_allclose(first_order_error(points, PAPER_BASELINE_M, cones), exact, rtol=0.02)


def test_the_corners_are_seen_from_the_cameras_at_the_cones_edges() -> None:
    points = np.array([[0.3, 2.0], [-1.0, 0.8]])
    corners = quadrilateral(points, PAPER_BASELINE_M, CONES)
    for camera_x, signs in ((-2.25, (-1, -1, 1, 1)), (2.25, (-1, 1, 1, -1))):
        camera = np.array([camera_x, 0.0])
        axis = np.arctan2(*(points - camera).T[::-1])
        seen = np.arctan2(corners[..., 1], corners[..., 0] - camera_x)
        np.testing.assert_allclose(seen - axis[:, None], np.tile(signs, (2, 1)) * PAPER_HALF_ANGLE_RAD, atol=1e-12)


def test_a_region_that_never_closes_has_no_finite_error() -> None:
    assert triangulation_error(np.array([[0.0, 5000.0]]), PAPER_BASELINE_M, CONES) == [np.inf]
