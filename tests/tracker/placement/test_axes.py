"""The paper's section 2.3: eq. 1 with table 1, eq. 2-3 with fig. 4."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.placement.axes import (
    PAPER_OPTIMUM,
    Case,
    axis,
    best_orientation,
    image_motion,
    orientations,
    orthogonality,
    solve,
    total_motion,
)

QUARTER = math.pi / 2.0
INSIDE = st.floats(0.05, QUARTER - 0.05)
AZIMUTH = st.floats(-math.pi, math.pi)


@given(INSIDE, AZIMUTH)
def test_table_1_row_1_a_camera_straight_above_wants_the_other_level(phi: float, psi_A: float) -> None:
    assert solve(0.0, 0.0, psi_A).case is Case.NONE
    assert solve(0.0, phi, psi_A).case is Case.NONE
    assert solve(0.0, QUARTER, psi_A).case is Case.FREE


@given(INSIDE, INSIDE, AZIMUTH)
def test_table_1_row_2_a_slanting_camera(phi_A: float, phi_B: float, psi_A: float) -> None:
    assert solve(phi_A, 0.0, psi_A).case is Case.NONE
    assert solve(phi_A, QUARTER, psi_A).case is Case.QUARTER
    if abs(phi_A + phi_B - QUARTER) > 1e-6:
        wanted = Case.ARC if phi_A + phi_B > QUARTER else Case.NONE
        assert solve(phi_A, phi_B, psi_A).case is wanted


@given(INSIDE, AZIMUTH)
def test_table_1_row_3_a_level_camera(phi: float, psi_A: float) -> None:
    assert solve(QUARTER, 0.0, psi_A).case is Case.FREE
    for phi_B in (phi, QUARTER):
        found = solve(QUARTER, phi_B, psi_A)
        assert found.case is Case.QUARTER
        np.testing.assert_allclose(np.abs(np.array(found.psi_B) - psi_A), QUARTER, atol=1e-12)


@given(INSIDE, INSIDE, AZIMUTH)
def test_every_solution_sets_the_axes_at_a_right_angle_with_either_sign(
    phi_A: float, phi_B: float, psi_A: float
) -> None:
    for psi_B in solve(phi_A, phi_B, psi_A).psi_B:
        assert float(axis(phi_A, psi_A) @ axis(phi_B, psi_B)) == pytest.approx(0.0, abs=1e-9)
        assert orthogonality(phi_A, phi_B, psi_A, psi_B) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(0.0, QUARTER), AZIMUTH)
def test_image_motion_is_what_of_a_step_lies_across_the_axis(phi: float, psi: float) -> None:
    u = axis(phi, psi)
    across = np.linalg.norm(np.eye(3) - np.outer(u, u), axis=0)
    np.testing.assert_allclose(image_motion(u), across, atol=1e-7)


def test_the_papers_orientation_moves_the_images_by_4_8783() -> None:
    assert orthogonality(*PAPER_OPTIMUM) == pytest.approx(0.0, abs=1e-12)
    assert total_motion(*PAPER_OPTIMUM) == pytest.approx(4.8783, abs=5e-5)


def test_no_orientation_of_the_sweep_beats_the_papers() -> None:
    best, motion = best_orientation(math.radians(5.0))
    assert motion == pytest.approx(total_motion(*PAPER_OPTIMUM), abs=1e-9)
    np.testing.assert_allclose(best, PAPER_OPTIMUM, atol=1e-9)


def test_with_eq_3_as_printed_the_papers_orientation_would_not_be_the_best() -> None:
    _, motion = best_orientation(math.radians(5.0), as_printed=True)
    assert motion == pytest.approx(5.4142, abs=5e-5)
    assert total_motion(*PAPER_OPTIMUM, as_printed=True) == pytest.approx(4.8783, abs=5e-5)


def test_the_sweep_holds_right_angles_only() -> None:
    swept = list(orientations(math.radians(15.0)))
    assert max(abs(orthogonality(*each)) for each in swept) < 1e-12
    assert len(swept) > 100
