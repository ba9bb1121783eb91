"""The middle of where a vehicle flies follows one that goes elsewhere, and not one that flies about it."""

from __future__ import annotations

import numpy as np

from tracker.image.middle import FARTHEST_MEAN_M, ROUNDS, Middle

START = np.array([3.0, 1.0, 0.0])


def test_the_first_place_is_the_middle() -> None:
    assert not Middle().is_known
    middle = Middle()
    assert np.array_equal(middle.place(START), np.zeros(3))
    assert middle.is_known
    assert np.allclose(middle.place(START + 0.1), np.full(3, 0.1))


def test_a_vehicle_that_flies_about_leaves_it_where_it_is() -> None:
    middle = Middle()
    middle.place(START)
    for k in range(10 * ROUNDS):
        assert middle.moved(START + 0.5 * np.array([np.sin(k / 3.0), np.cos(k / 3.0), 0.0])) is None


def test_a_vehicle_that_takes_off_takes_it_along() -> None:
    middle, hover = Middle(), START + np.array([0.0, 0.0, 1.2])
    middle.place(START)
    shifts = [shift for _ in range(10 * ROUNDS) if (shift := middle.moved(hover)) is not None]
    assert shifts
    assert np.allclose(middle.place(hover), hover - START - np.sum(shifts, axis=0))
    assert np.linalg.norm(middle.place(hover)) <= FARTHEST_MEAN_M
