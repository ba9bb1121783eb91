"""Light learned from balls, and the lamps that explain it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.image.harmonics import LAMBERT, TERMS, terms_at
from tracker.image.lamps import FARTHEST_M, MOVING, ROOM_TERMS, explained
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
SOFT = np.concatenate(((1.0, 0.1, -0.2, 0.3), np.zeros(TERMS - 4)))
GROWN = np.concatenate((np.zeros(2 * MOVING), 0.4 * np.eye(MOVING)[3]))  # more from above, the higher
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
    size = (ROOM_TERMS, ROOM_TERMS)
    root, target = drawn.normal(size=size), drawn.normal(size=ROOM_TERMS) * 10.0 ** drawn.uniform(-2.0, 4.0)
    room = explained(root @ root.T * 10.0 ** drawn.uniform(-2.0, 6.0), target)
    terms = room.terms[:TERMS]
    assert (terms @ terms_at(NORMALS)).min() > SHADOW
    assert terms[0] == pytest.approx(1.0)
    assert np.linalg.norm(room.lamp) == pytest.approx(1.0)
    for place_m in FARTHEST_M * np.vstack((np.eye(3), -np.eye(3))):
        assert room.terms_at(place_m)[0] == pytest.approx(1.0)
        assert np.isfinite(room.terms_at(place_m)).all()


NEAR_M = np.array([0.9, -0.7, 1.4])  # where a lamp hangs
PLACES = np.array([[x, y, z] for x in (-0.4, 0.0, 0.4) for y in (-0.4, 0.4) for z in (-0.3, 0.3)])
ELSEWHERE = np.array([0.3, -0.3, 0.1])


def lamps_from(place_m: Array, *, near: bool) -> Lamps:
    """Return how a ball at a place from the middle is lit: half by even light in the middle, half by a lamp."""
    away = NEAR_M - place_m if near else NEAR_M
    distance, at_the_middle = np.linalg.norm(away), np.linalg.norm(NEAR_M)
    strength = float((at_the_middle / distance) ** 2)
    return ((away / distance, strength / (1.0 + strength)),)


def learned_about(*, near: bool) -> Light:
    """Return the light that two cameras learn of balls that go about."""
    lights = []
    for side in SIDES:
        light = Light()
        for seed, place_m in enumerate(PLACES):
            seen = equations(lamps_from(place_m, near=near), side, 1.0 + seed / 10.0, seed)
            light = light.learned(*seen, NO_TURN, place_m).solved([])
        lights.append(light)
    return lights[0].solved(lights[1:])


def test_a_lamp_that_hangs_near_lights_each_place_from_its_own_side() -> None:
    light = learned_about(near=True)
    there, true = light.at(ELSEWHERE), lamps_from(ELSEWHERE, near=True)
    assert misjudged(there, true) < 0.12  # of up to 3
    assert misjudged(light.at(np.zeros(3)), true) > 2.0 * misjudged(there, true)
    assert float(there.lamp @ true[0][0]) > np.cos(np.radians(20.0))


def test_a_lamp_that_is_far_away_lights_all_places_alike() -> None:
    light = learned_about(near=False)
    assert light.at(ELSEWHERE).apart_from(light.at(np.zeros(3))) < 0.01
    assert misjudged(light.at(ELSEWHERE), lamps_from(ELSEWHERE, near=False)) < 0.06


def test_light_is_the_same_about_another_middle() -> None:
    light, shift_m = learned_about(near=True), np.array([0.2, -0.1, 0.1])
    other = light.recentred(shift_m)
    assert np.allclose(other.at(ELSEWHERE - shift_m).terms, light.at(ELSEWHERE).terms)
    # Balls that teach there say the same of it.
    seen = equations(lamps_from(ELSEWHERE, near=True), SIDES[0], 1.0, 99)
    anew = other.learned(*seen, NO_TURN, ELSEWHERE - shift_m).solved([]).at(np.zeros(3))
    as_before = light.learned(*seen, NO_TURN, ELSEWHERE).solved([]).at(shift_m)
    assert anew.apart_from(as_before) < 0.05


@pytest.mark.parametrize("power", [0.7, 1.4])
def test_light_that_another_gamma_shows_is_the_power_of_what_it_was(power: float) -> None:
    """Its mean is 1 again; and what differs by place does so by the slope of that power."""
    before = Light(terms=SOFT, room=replace(Light().room, terms=np.append(SOFT, GROWN)))
    after = before.taken_to(power)
    wanted = (terms_at(NORMALS).T @ before.terms) ** power
    assert np.abs(terms_at(NORMALS).T @ after.terms - wanted / wanted.mean()).max() < 0.05
    there = np.array([0.0, 0.0, 0.1])
    grown = (terms_at(NORMALS).T @ before.at(there).terms) ** power
    assert np.abs(terms_at(NORMALS).T @ after.at(there).terms - grown / grown.mean()).max() < 0.05


def test_what_was_learned_is_carried_over_to_another_gamma_and_counts_less() -> None:
    before = learned(ONE_LAMP, SIDES[0], (1.0,) * 30)
    after = before.taken_to(1.3)
    terms = terms_at(NORMALS[NORMALS @ SIDES[0] > 0.1])
    old, carried, anew = (light.terms @ terms for light in (before, after, after.solved(())))
    old, carried, anew = old / old.mean(), carried / carried.mean(), anew / anew.mean()
    assert np.std(anew - carried) < 0.3 * np.std(old - carried)
    assert (np.diag(after.information) <= np.diag(before.information)).all()
