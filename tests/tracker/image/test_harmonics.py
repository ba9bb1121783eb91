"""The terms of light on a matt ball."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tracker.image.harmonics import TERMS, terms_at, turned
from tracker.types import Array

LAMBERT = np.repeat((1.0, 2.0 / 3.0, 1.0 / 4.0, -1.0 / 24.0), (1, 3, 5, 9))
MIRROR = np.diag((1.0, 1.0, -1.0))


def normals(count: int) -> Array:
    """Return unit vectors (count, 3) of any direction."""
    drawn = np.random.default_rng(1).standard_normal((count, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1)[:, None])


def test_terms_are_each_as_strong_as_lambert_lets_them_be_and_tell_of_nothing_twice() -> None:
    terms = terms_at(normals(40_000)).T / LAMBERT
    assert terms.T @ terms / len(terms) == pytest.approx(np.eye(TERMS), abs=0.05)


def test_a_lamp_lights_a_matt_ball_by_the_cosine() -> None:
    lamp, places = np.array([0.6, 0.0, 0.8]), normals(2_000)
    lit = terms_at(places).T @ (terms_at(lamp[None])[:, 0] / LAMBERT) / 4.0
    assert np.sqrt(np.mean((lit - np.maximum(0.0, places @ lamp)) ** 2)) < 0.02


@pytest.mark.parametrize("mirror", [np.eye(3), MIRROR])
def test_turned_terms_are_those_of_turned_normals(mirror: Array) -> None:
    R, places = Rotation.from_rotvec((0.3, -1.1, 2.0)).as_matrix() @ mirror, normals(50)
    assert terms_at(places @ R.T) == pytest.approx(turned(R) @ terms_at(places), abs=1e-5)
