"""The search for a camera's gamma, and how often first images are gone over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, empty_canvas
from tests.tracker.paper_rig import paper_rig
from tracker.image.appearance import Appearance
from tracker.image.centre import Centre, fit_centre
from tracker.image.light import Light
from tracker.image.patch import Expected, Response
from tracker.image.rivals import FIRST_BALLS, FIRST_LESSONS, GAMMAS, ROUND_BALLS, Rivals, first_rivals
from tracker.image.template import FLAT

CAMERA, BALL = paper_rig().cameras[0], paper_rig().marker.balls[1]
UV_PX = np.array([300.3, 240.4])


def after(balls: int, since: int) -> Rivals:
    """Return rivals that know the light of so many balls, set up anew since when so many were learned."""
    known = replace(Appearance(), light=Light(count=balls))
    return Rivals((known,) * 3, (0.0,) * 3, since, np.zeros(2))


def judged(*misfits: float) -> Rivals:
    """Return what becomes of rivals that have differed so, with the ball that completes their round."""
    rivals = Rivals(
        tuple(Appearance(Response(gamma=gamma)) for gamma in GAMMAS), misfits, ROUND_BALLS - 1, np.array([0.3, 0.4])
    )
    canvas = empty_canvas(CAMERA)
    draw_ball(canvas, UV_PX, 4.0, BALL)
    ball = Expected((UV_PX[0], UV_PX[1]), 4.0, (0.0, 0.0), FLAT, Response())
    found = fit_centre(developed(canvas), ball)
    assert isinstance(found, Centre)
    return rivals.learned(developed(canvas), CAMERA, ball, found)


def gammas(rivals: Rivals) -> list[float]:
    return [appearance.response.gamma for appearance in rivals.appearances]


def test_the_first_images_are_gone_over_again() -> None:
    assert first_rivals().lessons_due == FIRST_LESSONS


def test_an_image_is_not_gone_over_again_only_because_the_gamma_is_looked_for_more_closely() -> None:
    """Light and centres learned from one image over and over bear each other out, right or wrong."""
    assert after(FIRST_BALLS + 24, since=0).lessons_due == 0


@pytest.mark.parametrize("gamma", [1.0, 1.3, 1.6, 1.8])
def test_the_gamma_is_where_the_misfits_parabola_is_lowest(gamma: float) -> None:
    found = judged(*(3.0 * (each - gamma) ** 2 for each in GAMMAS))
    assert found.settled
    assert gammas(found) == [pytest.approx(gamma, abs=0.06)]


def test_rivals_that_hardly_differ_are_not_judged_yet() -> None:
    assert gammas(judged(0.1, 0.0, 0.1)) == list(GAMMAS)


def test_the_better_the_gamma_is_known_the_less_it_may_move_the_centres() -> None:
    searching, told, linear = judged(0.1, 0.0, 0.1), judged(1.0, 0.0, 1.0), judged(0.0, 1.5, 2.0)
    assert searching.doubt_px > told.doubt_px > linear.doubt_px > 0.0


def test_a_gamma_that_may_be_higher_than_all_rivals_is_looked_for_up_there() -> None:
    assert gammas(judged(4.0, 1.5, 0.2)) == pytest.approx([1.9, 2.2, 2.5])


def test_of_misfits_without_a_lowest_point_the_lower_end_is_believed() -> None:
    assert gammas(judged(0.0, 1.5, 2.0)) == [1.0]
