"""Balls that no longer look as they were learned to look are told from a single spoiled ball or picture."""

from __future__ import annotations

import numpy as np
import pytest

from tracker.image.surprise import KNOWN, NEWEST, Surprise

COMMON = 0.3, 0.8  # what two cameras' balls commonly leave: each camera has its own
ROUNDS = 2 * NEWEST
SCATTER = 0.25  # of a ball's logarithm, one sigma


def look(surprise: Surprise, times: float, balls: int = 3, seed: int = 1, rounds: int = 4 * ROUNDS) -> list[bool]:
    """Look for some rounds at balls that leave so many times what is common; say after each whether that is much."""
    random, great = np.random.default_rng(seed), []
    for _ in range(rounds):
        for camera, common in enumerate(COMMON):
            surprise.take(camera, (times * common * np.exp(SCATTER * random.standard_normal(balls))).tolist())
        great.append(surprise.is_great)
    return great


def accustomed() -> Surprise:
    """Return one that has long looked at what is common."""
    surprise = Surprise(len(COMMON))
    assert not any(look(surprise, 1.0, rounds=300))
    return surprise


@pytest.mark.parametrize("times", [1.5, 2.0, 4.0])
def test_balls_that_all_fit_worse_are_noticed_the_sooner_the_worse_they_fit(times: float) -> None:
    great = look(accustomed(), times, seed=2)
    assert True in great
    assert great.index(True) < 0.5 * ROUNDS / np.log(times)


@pytest.mark.parametrize("times", [0.2, 0.7, 1.1])
def test_balls_that_fit_better_or_hardly_worse_are_nothing_new(times: float) -> None:
    assert not any(look(accustomed(), times, seed=2))


def test_one_ball_of_three_that_fits_badly_is_none_of_the_lights_doing() -> None:
    surprise = accustomed()
    for _ in range(10 * ROUNDS):
        surprise.take(0, [0.3, 30.0, 0.3])
        surprise.take(1, [0.8, 0.8, 80.0])
        assert not surprise.is_great


@pytest.mark.parametrize("cameras", [2, 8])
def test_pictures_of_one_instant_surprise_little_however_spoiled_they_are(cameras: int) -> None:
    surprise = Surprise(cameras)
    for _ in range(2 * KNOWN):
        for camera in range(cameras):
            surprise.take(camera, [0.5] * 3)
    for camera in range(cameras):
        surprise.take(camera, [1e6] * 3)
    assert not surprise.is_great


def test_a_fit_that_leaves_nothing_or_no_number_tells_nothing() -> None:
    surprise = accustomed()
    for misfit in (0.0, float("nan")):
        surprise.take(0, [misfit] * 3)
    assert True in look(surprise, 4.0, seed=2)


def test_a_ball_alone_tells_nothing() -> None:
    assert not any(look(accustomed(), 10.0, balls=1))


def test_before_it_is_known_what_is_common_nothing_surprises() -> None:
    surprise = Surprise(len(COMMON))
    assert not any(look(surprise, 1.0, rounds=KNOWN // 2))
    assert not any(look(surprise, 10.0, rounds=KNOWN // 2))


def test_what_grows_slowly_becomes_common() -> None:
    surprise = accustomed()
    assert not any(great for k in range(100) for great in look(surprise, 1.01**k, rounds=6, seed=k))
