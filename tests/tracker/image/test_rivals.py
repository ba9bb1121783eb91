"""The search for a camera's gamma, and how often first images are gone over."""

from __future__ import annotations

from dataclasses import replace

from tracker.image.appearance import Appearance
from tracker.image.light import Light
from tracker.image.rivals import FIRST_BALLS, FIRST_LESSONS, Rivals, first_rivals


def after(balls: int, since: int) -> Rivals:
    """Return rivals that know the light of so many balls, set up anew since when so many were learned."""
    known = replace(Appearance(), light=Light(count=balls))
    return Rivals((known,) * 3, (0.0,) * 3, since, 0.3)


def test_the_first_images_are_gone_over_again() -> None:
    assert first_rivals().lessons_due == FIRST_LESSONS


def test_an_image_is_not_gone_over_again_only_because_the_gamma_is_looked_for_more_closely() -> None:
    """Light and centres learned from one image over and over bear each other out, right or wrong."""
    assert after(FIRST_BALLS + 24, since=0).lessons_due == 0
