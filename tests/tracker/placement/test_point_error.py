"""The paper's section 3.2: attitude errors from point errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.tracker.paper_rig import paper_rig
from tracker.placement.point_error import (
    PAPER_ERROR_M,
    PAPER_RANGE_DEG,
    PAPER_RESULT_DEG,
    PAPER_SIDE_M,
    attitudes,
    drawn_errors,
    triangle,
    worst_errors,
)


def worst_deg(range_deg: float, error_m: float = PAPER_ERROR_M, yaw_step_deg: float = 90.0) -> np.ndarray:
    return np.degrees(worst_errors(attitudes(range_deg, 5.0, yaw_step_deg), PAPER_SIDE_M, error_m))


def test_the_worst_errors_bound_the_papers() -> None:
    roll, pitch, yaw = worst_deg(PAPER_RANGE_DEG)
    assert (roll, pitch, yaw) == pytest.approx((7.21, 5.71, 6.07), abs=0.01)
    assert (np.array([roll, pitch, yaw]) > PAPER_RESULT_DEG).all()


def test_drawn_errors_come_within_half_a_degree_of_the_papers_pitch_and_yaw_but_not_of_its_roll() -> None:
    poses = list(attitudes(PAPER_RANGE_DEG, 5.0, 5.0))
    roll, pitch, yaw = np.degrees(drawn_errors(poses, PAPER_SIDE_M, PAPER_ERROR_M, np.random.default_rng(1)))
    assert len(poses) == 9 * 9 * 72
    assert pitch == pytest.approx(PAPER_RESULT_DEG[1], abs=0.5)
    assert yaw == pytest.approx(PAPER_RESULT_DEG[2], abs=0.5)
    assert roll - PAPER_RESULT_DEG[0] == pytest.approx(1.4, abs=0.5)


def test_level_pitch_and_yaw_err_by_the_angle_of_both_ends_moved_apart() -> None:
    _, pitch, yaw = worst_deg(0.0)
    assert pitch == pytest.approx(math.degrees(math.atan2(2 * PAPER_ERROR_M, PAPER_SIDE_M)), abs=1e-6)
    assert yaw == pytest.approx(pitch, abs=1e-6)


def test_roll_and_yaw_errors_grow_with_the_range_of_roll_and_pitch() -> None:
    errors = np.array([worst_deg(range_deg) for range_deg in (0.0, 10.0, 20.0, 30.0)])
    assert (np.diff(errors[:, [0, 2]], axis=0) > 0.0).all()
    np.testing.assert_allclose(errors[:, 1], errors[0, 1], atol=1e-6)


def test_yaw_itself_changes_no_error() -> None:
    np.testing.assert_allclose(worst_deg(10.0, yaw_step_deg=15.0), worst_deg(10.0, yaw_step_deg=180.0), atol=1e-6)


def test_random_displacements_never_exceed_the_worst() -> None:
    poses = list(attitudes(20.0, 10.0, 45.0))
    worst = worst_errors(poses, PAPER_SIDE_M, PAPER_ERROR_M)
    rng = np.random.default_rng(2)
    drawn = np.max([drawn_errors(poses, PAPER_SIDE_M, PAPER_ERROR_M, rng) for _ in range(10)], axis=0)
    assert (drawn < 1.01 * worst).all()


def test_the_triangle_is_the_papers_marker() -> None:
    np.testing.assert_allclose(triangle(PAPER_SIDE_M), paper_rig().marker.points_inB, atol=1e-6)
