"""What one well-fitted ball teaches of the camera's response and the room's light."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from tracker.centre import Group, misfit_at, slopes_at
from tracker.compiled import compiled
from tracker.patch import LUMA, TRUST, Expected, Patch, Response, X, Y
from tracker.solve import eliminate
from tracker.template import BLUR_STEP_PX, GLOSS, TERMS, Vector, every_term, places_along, read, template_for
from tracker.types import Array

BLUR_MAX_PX = 1.5
EXPOSURE_TRIAL_S, EXPOSURE_MAX_S = 0.001, 0.02
EXPOSURE_S_PX = 0.008  # step of exposure for one of blur [s/px]
LEAST_STREAK_PX = 0.2  # a trial that moves the ball's ends by less shows nothing
SMEARED_PX = 2.0  # a streak so long hides the blur
PLANE, OTHERS = 3, 6  # of the background; with the centre's two, and the gloss, whose share differs by paint


def sharper(patch: Patch, ball: Expected, centre: tuple[float, float], step_px: float) -> Response:
    """Return the camera's response, its blurs and its exposure moved one step to where the ball fits better.

    Args:
        patch: the ball's.
        centre: as fitted, from the patch's middle pixel [px].
    """
    now, trial_px = ball.response, max(step_px, BLUR_STEP_PX)

    def tried(group: Group, **change: float) -> float:
        changed = replace(ball, response=replace(now, **change))
        return misfit_at(patch, changed, centre, group)

    def less(group: Group, name: str, value: float, trial: float) -> bool:
        return tried(group, **{name: max(0.0, value - trial)}) < tried(group, **{name: value + trial})

    changed, streak_px = now, math.hypot(*ball.streak_px)
    if math.hypot(*ball.speed_px_s) * EXPOSURE_TRIAL_S > LEAST_STREAK_PX:
        less_s = less(Group.BRIGHTNESS, "exposure_s", now.exposure_s, EXPOSURE_TRIAL_S)
        exposure_s = _stepped(now.exposure_s, less_s, step_px * EXPOSURE_S_PX, EXPOSURE_MAX_S)
        changed = replace(changed, exposure_s=exposure_s)
    if streak_px < SMEARED_PX:
        less_luma = less(Group.BRIGHTNESS, "luma_px", now.luma_px, trial_px)
        less_chroma = less(Group.COLOUR, "chroma_px", now.chroma_px, trial_px)
        changed = replace(
            changed,
            luma_px=_stepped(now.luma_px, less_luma, step_px, BLUR_MAX_PX),
            chroma_px=_stepped(now.chroma_px, less_chroma, step_px, BLUR_MAX_PX),
        )
    return changed


def _stepped(now: float, less: bool, step: float, most: float) -> float:
    return min(most, max(0.0, now + (-step if less else step)))


@compiled("void(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])")
def _without_others(pixels: Array, terms: Array, slopes: Array, products: Array) -> None:
    """Fill in the products of terms and brightness (m, m), m = OTHERS + TERMS + 1, without what is each ball's own.

    That is the background, the gloss, and where exactly its centre is: light learned at a centre that the light
    itself has pulled aside would never be put right.
    terms: (TERMS + 1, n), the gloss last.  slopes: (2, n) by the centre.
    The terms' products stand after the OTHERS first rows, the brightness's last, lower triangle.
    """
    row = np.empty(len(products))
    products[:] = 0.0
    for i in range(pixels.shape[1]):
        bare = 1.0 - terms[0, i]
        row[0], row[1], row[2] = bare, bare * pixels[X, i], bare * pixels[Y, i]
        row[PLANE], row[PLANE + 1], row[PLANE + 2] = slopes[0, i], slopes[1, i], terms[GLOSS, i]
        row[OTHERS:-1] = terms[:GLOSS, i]
        row[-1] = pixels[LUMA, i]
        for j in range(len(row)):
            weighted = pixels[TRUST, i] ** 2 * row[j]
            for k in range(j + 1):
                products[j, k] += weighted * row[k]
    eliminate(products, OTHERS)


def light_on(patch: Patch, ball: Expected, centre: tuple[float, float], lamp: Vector) -> tuple[Array, Array] | None:
    """Return the normal equations of the light's terms on a ball, at mean brightness 1.

    Args:
        patch: its pixels.
        ball: what is known of it.
        centre: as fitted, from the patch's middle pixel [px].
        lamp: the lamp as seen along the ball's ray.
    Returns:
        information (TERMS, TERMS), target (TERMS,) for `Light.learned`; None for a ball without brightness of its own.
    """
    template = template_for(ball.radius_px, ball.response.luma_px, every_term(lamp))
    n, pixels = template.per_px, patch.bright
    value, by_u, by_v = (np.empty((TERMS + 1, pixels.shape[1])) for _ in range(3))
    u, v = (round(c * n) for c in centre)
    places = places_along(ball.streak_px, n)
    read(template.fine, n, template.radius_px, ball.radius_px, u, v, places, pixels, value, by_u, by_v)
    terms = value + (centre[0] - u / n) * by_u + (centre[1] - v / n) * by_v
    products = np.empty((OTHERS + TERMS + 1, OTHERS + TERMS + 1))
    _without_others(pixels, terms, slopes_at(patch, ball, centre), products)
    lower = products[OTHERS:-1, OTHERS:-1]
    information, target = np.tril(lower) + np.tril(lower, -1).T, products[-1, OTHERS:-1]
    even = np.linalg.solve(information[:4, :4] + 1e-9 * np.eye(4), target[:4])
    mean = float(even[0] + 2.0 / 3.0 * even[3])  # z is 2/3 on the mean over a disc
    return (information * mean**2, target * mean) if mean > 0.0 else None
