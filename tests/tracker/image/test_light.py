"""Light learned from balls, and the lamps that explain it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.image.harmonics import LAMBERT, TERMS, terms_at
from tracker.image.lamps import explained
from tracker.image.light import Light
from tracker.maths.sphere import spread
from tracker.types import Array

NORMALS = spread(2000)
LAMP = np.array([0.48, -0.36, 0.8])
ONE_LAMP = ((LAMP, 0.6),)
SEVERAL = ((LAMP, 0.25), (np.array([-0.8, 0.0, 0.6]), 0.25), (np.array([0.0, 0.6, 0.8]), 0.15))
SIDES = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # where two cameras stand
NO_TURN = np.eye(3)
SHADOW = ((terms_at(LAMP[None]) / LAMBERT[:, None]).T @ terms_at(NORMALS)).min() - 0.01  # of one lamp, by the harmonics
Lamps = tuple[tuple[Array, float], ...]


def lit(lamps: Lamps) -> Array:
    """Return how bright a matt ball is at NORMALS, its mean 1; what is left of the lamps is even light."""
    even = 1.0 - sum(share for _, share in lamps)
    return sum(
        (4.0 * share * np.maximum(0.0, NORMALS @ towards) for towards, share in lamps), np.full(len(NORMALS), even)
    )


def equations(lamps: Lamps, side: Array, paint: float, seed: int) -> tuple[Array, Array]:
    """Return what a noisy ball shows to a camera on one side."""
    seen = NORMALS @ side > 0.1
    terms = terms_at(NORMALS[seen])
    pixels = paint * lit(lamps)[seen] + np.random.default_rng(seed).normal(0.0, 0.1, seen.sum())
    return terms @ terms.T, terms @ pixels


def learned(lamps: Lamps, side: Array, paints: tuple[float, ...] = (0.3, 1.0, 2.5)) -> Light:
    """Return the light that one camera's balls teach."""
    light = Light()
    for seed, paint in enumerate(paints):
        light = light.learned(*equations(lamps, side, paint, seed), NO_TURN).solved(())
    return light


def misjudged(light: Light, lamps: Lamps) -> float:
    """Return the rms error of a light where one of the cameras sees it, its mean 1."""
    seen = (NORMALS @ SIDES.T > 0.0).any(axis=1)
    return float(np.sqrt(np.mean((light.terms @ terms_at(NORMALS) - lit(lamps))[seen] ** 2)))


@pytest.mark.parametrize("lamps", [(), ONE_LAMP, SEVERAL])
def test_two_cameras_tell_the_light_whatever_lamps_there_are(lamps: Lamps) -> None:
    first, second = (learned(lamps, side) for side in SIDES)
    assert misjudged(first.solved([second]), lamps) < 0.06  # of up to 2.8; the harmonics leave half of it


def test_two_cameras_tell_more_than_one() -> None:
    first, second = (learned(SEVERAL, side) for side in SIDES)
    assert misjudged(first.solved([second]), SEVERAL) < 0.5 * misjudged(first.solved(()), SEVERAL)


def test_the_brightest_lamp_is_told() -> None:
    first, second = (learned(ONE_LAMP, side) for side in SIDES)
    assert float(first.solved([second]).lamp @ LAMP) > np.cos(np.radians(10.0))


def test_a_ball_without_brightness_of_its_own_teaches_nothing() -> None:
    light = learned(ONE_LAMP, SIDES[0])
    assert light.learned(np.zeros((TERMS, TERMS)), np.zeros(TERMS), NO_TURN) is light


@given(st.integers(0, 2**32 - 1))
def test_no_light_is_negative(seed: int) -> None:
    drawn = np.random.default_rng(seed)
    root, target = drawn.normal(size=(TERMS, TERMS)), drawn.normal(size=TERMS) * 10.0 ** drawn.uniform(-2.0, 4.0)
    terms, lamp = explained(root @ root.T * 10.0 ** drawn.uniform(-2.0, 6.0), target)
    assert (terms @ terms_at(NORMALS)).min() > SHADOW
    assert terms[0] == pytest.approx(1.0)
    assert np.linalg.norm(lamp) == pytest.approx(1.0)
