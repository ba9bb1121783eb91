"""When templates follow the light that is learned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.tracker.drawing import AMBIENT, LIGHT_inW, developed, draw_ball, empty_canvas
from tests.tracker.paper_rig import paper_rig
from tracker.image.appearance import LEAST_CHANGE, MANY, Appearance, to_show
from tracker.image.centre import Centre, fit_centre
from tracker.image.harmonics import LAMBERT, TERMS, terms_at
from tracker.image.lamps import ROOM_TERMS, RoomLight
from tracker.image.light import Light
from tracker.image.patch import Expected, Response
from tracker.image.template import FLAT
from tracker.maths.sphere import spread
from tracker.types import Array

CAMERA, BALL, RADIUS_PX = paper_rig().cameras[0], paper_rig().marker.balls[1], 2.8
HARDLY_PX = 0.01  # a third of the noise of balls that show clearly
NORMALS = spread(2000)
EVEN = np.eye(TERMS)[0]
LAMPS = terms_at(spread(30)).T / LAMBERT  # terms of the light of one lamp alone, by lamp


def known(terms: Array, balls: int = MANY + 1) -> Light:
    return Light(terms=terms, count=balls)


def with_more(share: float, lamp: int, balls: int = MANY + 1, before: Array = EVEN) -> Light:
    """Return light into which a lamp has brought so much change."""
    change = LAMPS[lamp] - before
    return known(before + share * change / np.linalg.norm(LAMBERT * change), balls)


@given(st.integers(0, 2**32 - 1))
def test_two_lights_differ_by_what_they_do_to_a_surface_rms_over_where_it_may_face(seed: int) -> None:
    one, other = np.random.default_rng(seed).normal(size=(2, TERMS))
    apart = (one - other) @ terms_at(NORMALS)
    assert abs(known(one).apart_from(known(other)) / np.sqrt(np.mean(apart**2)) - 1.0) < 0.001


def test_a_light_that_was_shown_before_is_shown_again_where_it_is_hardly_another() -> None:
    """A vehicle that goes round comes back to the same light: its templates are drawn already."""
    round_trip = [*range(6), *reversed(range(6))]
    appearance, shown = Appearance(light=known(EVEN), shown=known(EVEN)), []
    for step in round_trip:
        lit = with_more(1.5 * LEAST_CHANGE * step, 3)
        room = RoomLight(np.append(lit.terms, np.zeros(ROOM_TERMS - TERMS)))
        appearance = replace(appearance, light=replace(lit, room=room)).at(np.zeros(3))
        assert appearance.shown.apart_from(lit) <= LEAST_CHANGE
        shown.append(appearance.shown)
    there, back = shown[:6], shown[6:]
    assert len(set(there)) == 6
    assert set(back) == set(there)


@given(st.integers(0, len(LAMPS) - 1))
def test_templates_follow_a_lamp_switched_on_and_not_what_hardly_changes(lamp: int) -> None:
    shown = known(EVEN)
    assert to_show(with_more(0.9 * LEAST_CHANGE, lamp), [shown]) is shown
    switched = with_more(1.1 * LEAST_CHANGE, lamp)
    assert to_show(switched, [shown]) is switched


def test_small_changes_add_up_until_they_are_shown() -> None:
    shown, drawn = known(EVEN), 0
    for step in range(1, 41):
        before, shown = shown, to_show(with_more(0.1 * LEAST_CHANGE * step, 3), [shown])
        drawn += shown is not before
    assert 3 <= drawn <= 4
    assert shown.apart_from(with_more(4.0 * LEAST_CHANGE, 3)) <= LEAST_CHANGE


def test_the_light_of_few_balls_is_always_followed() -> None:
    newest = with_more(0.1 * LEAST_CHANGE, 3, balls=MANY)
    assert to_show(newest, [known(EVEN)]) is newest


def drawn_light() -> Array:
    """Return the terms of the light that `draw_ball` shades by: even light, and a lamp of a quarter on average."""
    lamp = terms_at(LIGHT_inW[None] / np.linalg.norm(LIGHT_inW))[:, 0] / LAMBERT
    both = AMBIENT * EVEN + (1.0 - AMBIENT) / 4.0 * lamp
    return np.asarray(both / both[0])


def test_what_is_not_shown_moves_a_centre_by_a_third_of_what_is_doubted_of_light() -> None:
    """Root mean square on each axis, of lamps from everywhere."""
    rng, light, response = np.random.default_rng(5), drawn_light(), Response(0.2, 0.2, detail=1.0)
    moved_px = []
    for lamp in range(len(LAMPS)):
        uv_px, canvas = rng.uniform((200, 200), (400, 300)), empty_canvas(CAMERA)
        draw_ball(canvas, uv_px, RADIUS_PX, BALL)
        image, ball = developed(canvas), Expected((uv_px[0], uv_px[1]), RADIUS_PX, (0.0, 0.0), FLAT, response)
        seen = []
        for shown in (known(light), with_more(LEAST_CHANGE, lamp, before=light)):
            found = fit_centre(image, Appearance(response, shown, shown).expected_like(ball, CAMERA, uv_px))
            assert isinstance(found, Centre)
            seen.append(found.uv_px)
        moved_px.append(seen[1] - seen[0])
    assert np.sqrt(np.mean(np.square(moved_px), axis=0)).max() < HARDLY_PX
