"""The search for a camera's gamma, and how often first images are gone over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.tracker.drawing import developed, draw_ball, empty_canvas
from tests.tracker.paper_rig import paper_rig
from tracker.image.appearance import Appearance
from tracker.image.behind import ENOUGH, NO_ROOM, TILE_PX, Room
from tracker.image.centre import Centre, fit_centre
from tracker.image.light import Light
from tracker.image.patch import Expected, Response
from tracker.image.rivals import FIRST_BALLS, FIRST_LESSONS, GAMMAS, ROUND_BALLS, Rivals, first_rivals
from tracker.image.template import FLAT

CAMERA, BALL = paper_rig().cameras[0], paper_rig().marker.balls[1]
UV_PX = np.array([300.3, 240.4])
KNOWN_ROOM = Room(
    empty_canvas(CAMERA).astype(np.float32),
    np.full((CAMERA.height_px // TILE_PX, CAMERA.width_px // TILE_PX), ENOUGH, np.uint8),
)


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


def settled_at(gamma: float, balls: int = 200) -> Rivals:
    """Return a search that is over, made before the room was known, and the light learned from so many balls."""
    return Rivals((Appearance(Response(gamma=gamma), Light(count=balls)),), (0.0,), 200, np.zeros(2))


def one_ball_more(rivals: Rivals, room: Room, gamma: float | None = None) -> Rivals:
    """Return the rivals after a ball before a room, looked at as one of such a gamma, or of the best one's."""
    canvas = empty_canvas(CAMERA)
    draw_ball(canvas, UV_PX, 4.0, BALL)
    response = Response(gamma=rivals.best.response.gamma if gamma is None else gamma)
    ball = Expected((UV_PX[0], UV_PX[1]), 4.0, (0.0, 0.0), FLAT, response, room=room)
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


def test_misfits_that_hardly_bend_tell_less_of_the_gamma() -> None:
    sharp, flat = judged(1.0, 0.0, 1.0), judged(0.02, 0.0, 0.3)
    assert sharp.settled
    assert flat.settled
    assert flat.doubt > 2.0 * sharp.doubt


def test_a_gamma_that_may_be_higher_than_all_rivals_is_looked_for_up_there() -> None:
    assert gammas(judged(4.0, 1.5, 0.2)) == pytest.approx([1.9, 2.2, 2.5])


def test_of_misfits_without_a_lowest_point_the_lower_end_is_believed() -> None:
    assert gammas(judged(0.0, 1.5, 2.0)) == [1.0]


@pytest.mark.parametrize(("found", "tried"), [(1.7, [1.1, 1.7, 2.3]), (1.2, [1.0, 1.6, 2.2])])
def test_once_the_room_is_known_the_gamma_is_looked_for_again(found: float, tried: list[float]) -> None:
    again = one_ball_more(settled_at(found), KNOWN_ROOM)
    assert gammas(again) == pytest.approx(tried)
    assert again.by_room


def test_while_the_light_is_hardly_known_no_gamma_is_looked_for_by_the_room() -> None:
    assert one_ball_more(settled_at(1.7, balls=5), KNOWN_ROOM).settled
    searching = replace(one_ball_more(settled_at(1.7), KNOWN_ROOM), misfits=(0.0, 1.0, 2.0))
    anew = searching.in_other_light()
    assert (anew.settled, anew.by_room) == (True, False)
    assert one_ball_more(anew, NO_ROOM).best.light.count == 1


def test_a_gamma_found_by_the_room_is_kept() -> None:
    once = replace(settled_at(1.7), by_room=True)
    assert one_ball_more(once, KNOWN_ROOM).settled
    assert one_ball_more(settled_at(1.7), NO_ROOM).settled


def test_in_the_search_by_the_room_other_balls_do_not_count() -> None:
    again = one_ball_more(settled_at(1.7), KNOWN_ROOM)
    assert one_ball_more(again, NO_ROOM).count == again.count == 1
    assert one_ball_more(again, KNOWN_ROOM).count == 2


def test_a_ball_looked_at_under_another_gamma_teaches_nothing_once_one_is_found() -> None:
    once = replace(settled_at(1.7), by_room=True)
    assert one_ball_more(once, KNOWN_ROOM, gamma=1.0) is once


def test_where_the_lowest_rival_is_the_best_lower_ones_are_tried() -> None:
    again = one_ball_more(settled_at(1.9), KNOWN_ROOM)
    due = replace(again, misfits=(0.0, 1.0, 2.0), count=ROUND_BALLS - 1)
    assert gammas(one_ball_more(due, KNOWN_ROOM)) == pytest.approx([1.0, 1.3, 1.6])


def test_in_other_light_a_camera_stays_known_and_the_light_is_learned_from_nothing() -> None:
    known = Appearance(Response(gamma=1.7, luma_px=0.6), Light(count=200), Light(count=198))
    before = Rivals((known,), (0.0,), 200, np.array([0.1, 0.2]), by_room=True, doubt=0.1)
    anew = before.in_other_light()
    assert anew.settled
    assert anew.best.response == known.response
    assert (anew.best.light.count, anew.best.shown.count) == (0, 0)
    assert anew.lessons_due == FIRST_LESSONS
    assert before.has_seen(200)
    assert not anew.has_seen(1)
    assert anew.doubt_px > before.doubt_px
