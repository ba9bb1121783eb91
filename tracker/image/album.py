"""The templates that serve for the balls one camera sees: the right one, or for some rounds the one next to it.

A vehicle that moves crosses the steps of radius and bearing for ever. Were each template drawn when it is first wanted,
some rounds would draw a dozen. A neighbour does nearly as well: what it is off is put right to the second order
(`tracker/image/reading.py`), and balls a step of bearing apart are shaded alike. So a flight under way draws one at a
time. What is drawn when depends on the rounds alone, never on the time they took: the same input gives the same poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from tracker.camera import Camera
from tracker.image.appearance import BEARING_STEP_RAD, MANY, Appearance
from tracker.image.light import Light
from tracker.image.template import BLUR_STEP_PX, RADIUS_STEP_PX, SMALL_PX, Template, draw, sampling_of, steps_of
from tracker.image.view import RADIUS, RAY_X, RAY_Y

KEPT = 256  # templates, of about 100 kB each: what a flight through a room shows
WELL_BEYOND = 0.8  # of a step of blur: what a template is off is put right while it is read
NEAR = 1  # steps of radius and blur together, and of bearing


class Wanted(NamedTuple):
    """Which template: steps of radius, blur and bearing; side of the box, samples a pixel, and the light."""

    radius_steps: int
    blur_steps: int
    x_steps: int
    y_steps: int
    box_px: int
    per_px: int
    light: Light


Steps = tuple[int, int, int, bool]
"""Of radius and bearing, and whether the ball is small."""
Looks = tuple[int, int, int, Light]
"""What of an appearance tells templates apart: steps of both blurs, side of the blocks, light."""


class Album:
    """Draws and keeps the templates for one camera.

    draws_left: how many may still be drawn of those that a neighbour can stand in for; None for all.
    """

    def __init__(self, camera: Camera) -> None:
        self.draws_left: int | None = None
        self._camera = camera
        self._serving: dict[tuple[int, int], tuple[Wanted, Template]] = {}  # by ball and side of the box
        self._served: dict[int, tuple[Steps, tuple[Template, Template], bool]] = {}  # by ball, and whether as wanted
        self._drawn: dict[Wanted, Template] = {}
        self._looks: Looks = (0, 0, 0, Light())
        self._take_up(Appearance())

    def serve(self, ball: int, view: Sequence[float], appearance: Appearance) -> tuple[Template, Template]:
        """Return the templates of a ball's brightness and of its colour.

        view: a row of `view.expected_views`.
        """
        if appearance is not self._appearance:
            self._take_up(appearance)
        radius_px, ray_x, ray_y = view[RADIUS], view[RAY_X], view[RAY_Y]
        x_steps, y_steps = (round(ray_x / BEARING_STEP_RAD), round(ray_y / BEARING_STEP_RAD)) if self._lit else (0, 0)
        steps = round(radius_px / RADIUS_STEP_PX), x_steps, y_steps, radius_px < SMALL_PX
        before = self._served.get(ball)
        if before is not None and before[0] == steps and (before[2] or self.draws_left == 0):
            return before[1]
        return self._look_up(ball, steps, view, appearance)

    def _look_up(
        self, ball: int, steps: Steps, view: Sequence[float], appearance: Appearance
    ) -> tuple[Template, Template]:
        """Return the templates for these steps, and note them."""
        (radius_steps, x_steps, y_steps, _), (luma_steps, chroma_steps, box_px, shown) = steps, self._looks
        radius_px, bearing = view[RADIUS], (x_steps, y_steps)
        luma = Wanted(radius_steps, luma_steps, *bearing, 1, sampling_of(radius_px, 1), shown)
        chroma = Wanted(radius_steps, chroma_steps, *bearing, box_px, sampling_of(radius_px, box_px), shown)
        slots = (ball, 0), (ball, 1)
        pair = self._template(slots[0], luma, view, appearance), self._template(slots[1], chroma, view, appearance)
        as_wanted = self._serving[slots[0]][0] == luma and self._serving[slots[1]][0] == chroma
        self._served[ball] = steps, pair, as_wanted
        return pair

    def _take_up(self, appearance: Appearance) -> None:
        """Note what of an appearance tells templates apart; it changes with lessons alone."""
        r, (luma_steps, chroma_steps, *_) = appearance.response, self._looks
        if appearance.shown.count <= MANY:
            _, luma_steps = steps_of(0.0, r.luma_px)
            _, chroma_steps = steps_of(0.0, r.chroma_px)
        else:
            luma_steps, chroma_steps = _kept(luma_steps, r.luma_px), _kept(chroma_steps, r.chroma_px)
        looks = luma_steps, chroma_steps, r.block_px, appearance.shown
        if looks != self._looks:
            self._served.clear()
        self._appearance, self._looks, self._lit = appearance, looks, appearance.shown.count > 0

    def _template(
        self, slot: tuple[int, int], wanted: Wanted, view: Sequence[float], appearance: Appearance
    ) -> Template:
        """Return the template wanted; or the one that has served, if that is near and no more may be drawn."""
        serving = self._serving.get(slot)
        if serving is not None and serving[0] == wanted:
            return serving[1]
        template = self._drawn.get(wanted)
        if template is None:
            if self.draws_left is not None and serving is not None and _near(serving[0], wanted):
                if self.draws_left <= 0:
                    return serving[1]
                self.draws_left -= 1
            shades = appearance.shades(self._camera, view[RAY_X], view[RAY_Y])
            template = draw(wanted.radius_steps, wanted.blur_steps, wanted.box_px, wanted.per_px, shades)
            if len(self._drawn) >= KEPT:
                self._drawn.pop(next(iter(self._drawn)))
            self._drawn[wanted] = template
            self._served = {each: served for each, served in self._served.items() if served[2]}  # others may want it
        self._serving[slot] = wanted, template
        return template


def _kept(steps: int, blur_px: float) -> int:
    """Return the steps of a blur, which goes to and fro with each lesson: as they were, unless it is well beyond."""
    if abs(blur_px - steps * BLUR_STEP_PX) <= WELL_BEYOND * BLUR_STEP_PX:
        return steps
    return steps_of(0.0, blur_px)[1]


def _near(serving: Wanted, wanted: Wanted) -> bool:
    """Say whether a template is so like another that it can stand in for it: a step of radius or blur, not of both."""
    apart = abs(serving.radius_steps - wanted.radius_steps) + abs(serving.blur_steps - wanted.blur_steps)
    turned = max(abs(serving.x_steps - wanted.x_steps), abs(serving.y_steps - wanted.y_steps))
    return apart <= NEAR and turned <= NEAR and serving.box_px == wanted.box_px
