"""How a camera encodes light, told by all that it saw of the balls: gamma, blur and paints.

Sightings whose own unknowns are eliminated leave normal equations of what they share, summed and solved together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tools.calibrate.room.again import Again
from tools.calibrate.room.encoded import SHARED
from tools.calibrate.room.encoding import Encoding, fitted
from tracker.image.appearance import MISFIT_MAX
from tracker.image.centre import Centre, fit_centre
from tracker.image.lesson import BLUR_MAX_PX
from tracker.image.patch import light_of
from tracker.image.rivals import Rivals, settled_on
from tracker.types import Array

SMOOTHED = 1.0 / 8.0
"""Of a block's colour, what it has of either neighbour where a decoder draws colour between the blocks by 3 to 1."""
SMOOTH_DETAIL = 0.1  # of `Response.detail`: without smoothing all of a block has one colour
STEPS, SIGHTINGS = 3, 120  # of Gauss-Newton, each by about so many
LEAST_GAMMA, MOST_GAMMA = 0.5, 3.0  # below 1 no camera is; told there, gamma makes up for what the model lacks
MOST_STEP, MOST_STEP_PX2 = 0.5, 0.1
ALIKE, FURTHER = 0.02, 3.0  # a gamma told again; how much further than told the second is tried
ENOUGH = 30  # sightings
LEAST_PAINT, RIDGE = 1e-3, 1e-6


def learned(camera: Again, rivals: Rivals) -> Encoding | None:
    """Learn how a camera encodes light, None where it keeps colour by the pixel, or too little was seen.

    rivals: what `camera.taught` gave.
    Light learned under a wrong gamma hides most of the error: the same sightings then tell a gamma between the wrong
    and the right one. The right one is told again under its own light, and is found by a secant.
    """
    response, under = rivals.best.response, rivals.best.response.gamma
    if response.block_px == 1 or not rivals.best.shown.trusted:
        return None
    smoothing = SMOOTHED if response.detail > SMOOTH_DETAIL else 0.0
    first = _told(camera, Encoding(rivals.best, smoothing, _first_paints(camera, rivals)))
    if first is None or abs(first.gamma - under) < ALIKE:
        return first
    far = _within(under + FURTHER * (first.gamma - under))
    second = _told_under(camera, first, far)
    if second is None:
        return None
    less = (first.gamma - under) - (second.gamma - far)
    share = (first.gamma - under) / less if less * (far - under) > 0.0 else 1.0
    return _told_under(camera, second, _within(under + share * (far - under)))


def _within(gamma: float) -> float:
    return min(MOST_GAMMA, max(LEAST_GAMMA, gamma))


def _told_under(camera: Again, known: Encoding, gamma: float) -> Encoding | None:
    """Learn light anew under a gamma, then let all sightings tell gamma, blur and paints."""
    then = known.appearance.with_gamma(gamma)
    light = camera.taught_anew(then)
    response = replace(light.response, luma_px=known.appearance.response.luma_px)
    paints = np.maximum(known.paints, LEAST_PAINT) ** (gamma / known.gamma)  # of the same grey levels
    return _told(camera, Encoding(replace(light, response=response), known.smoothing, _unit(paints)))


def _told(camera: Again, known: Encoding) -> Encoding | None:
    """Return what all sightings tell, None for too few."""
    for _ in range(STEPS):
        step = _step(camera, known)
        if step is None:
            return None
        known = _stepped(known, step)
    return known


def _unit(paints: Array) -> Array:
    return np.asarray(paints / np.linalg.norm(paints, axis=1, keepdims=True))


def _sightings(camera: Again) -> list[int]:
    """Return some images, spread over the footage."""
    known = camera.known()
    return known[:: max(1, len(known) * len(camera.rig.marker) // SIGHTINGS)]


def _first_paints(camera: Again, rivals: Rivals) -> Array:
    """Return about what light each ball sends, by the middles of its images."""
    light = light_of(rivals.best.response.gamma)
    paints = np.zeros((len(camera.rig.marker), 3))
    for k in _sightings(camera):
        image = camera.image(k)
        for ball, (u, v, _) in enumerate(camera.clips[k].centres_px.tolist()):
            paints[ball] += light[image[round(v), round(u)]]
    return _unit(paints)


def _step(camera: Again, known: Encoding) -> Array | None:
    """Return the step (2 + 3 balls,) of gamma, blur and paints to where all sightings fit better; None for too few."""
    size, count = 2 + known.paints.size, 0
    N, g = np.zeros((size, size)), np.zeros(size)
    for ball, products in _told_by_each(camera, known):
        at = [0, 1, *range(2 + 3 * ball, 5 + 3 * ball)]
        N[np.ix_(at, at)] += products[:-1, :-1]
        g[at] += products[-1, :-1]
        count += 1
    if count < ENOUGH:
        return None
    N[np.diag_indices(size)] *= 1.0 + RIDGE  # brightness and paint go together
    return np.asarray(np.linalg.lstsq(N, g)[0])


def _told_by_each(camera: Again, known: Encoding) -> Iterator[tuple[int, Array]]:
    """Yield of each sighting which ball it is of, and its products of what is shared, see `fit_encoded`."""
    rivals = settled_on(known.appearance)
    for k in _sightings(camera):
        image = camera.image(k)
        for ball in range(len(known.paints)):
            expected, shared = camera.expected(rivals, k, ball), np.zeros((SHARED + 1, SHARED + 1))
            found = fit_centre(image, expected)
            if not isinstance(found, Centre) or found.misfit > MISFIT_MAX:
                continue
            there = replace(expected, uv_px=(float(found.uv_px[0]), float(found.uv_px[1])))
            if fitted(image, there, known, ball, shared) is not None:
                yield ball, np.tril(shared) + np.tril(shared, -1).T


def _stepped(known: Encoding, step: Array) -> Encoding:
    response = known.appearance.response
    gamma = response.gamma + min(MOST_STEP, max(-MOST_STEP, float(step[0])))
    variance_px2 = response.luma_px**2 + min(MOST_STEP_PX2, max(-MOST_STEP_PX2, float(step[1])))
    paints = known.paints + step[2:].reshape(known.paints.shape)
    response = replace(
        response,
        gamma=_within(gamma),
        luma_px=min(BLUR_MAX_PX, math.sqrt(max(0.0, variance_px2))),
    )
    return replace(
        known,
        appearance=replace(known.appearance, response=response),
        paints=_unit(paints),
    )
