"""How a camera encodes light, told by all that it saw of the balls: gamma, blur and paints.

Sightings whose own unknowns are eliminated leave normal equations of what they share, summed and solved together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tools.calibrate.room.again import Again, taught_anew
from tools.calibrate.room.encoded import SHARED
from tools.calibrate.room.encoding import Encoding, fitted
from tracker.image.appearance import MISFIT_MAX, Appearance
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


def learned(cameras: Sequence[Again], rivals: Sequence[Rivals]) -> list[Encoding | None]:
    """Learn how cameras encode light; None where one keeps colour by the pixel, or too little was seen.

    rivals: what `taught` gave.
    Light learned under a wrong gamma hides most of the error: the same sightings then tell a gamma between the wrong
    and the right one. The right one is told again under its own light, and is found by a secant; all cameras go
    together, since they see one light.
    """
    shown = [one.best for one in rivals]
    under = [one.response.gamma for one in shown]
    told = _each(lambda c: _first(cameras[c], shown[c]), range(len(cameras)))
    first = {c: one for c, one in told.items() if abs(one.gamma - under[c]) >= ALIKE}
    far = {c: _within(under[c] + FURTHER * (one.gamma - under[c])) for c, one in first.items()}
    second = _told_under(cameras, shown, first, far)
    right = {c: _secant(under[c], first[c].gamma, far[c], one.gamma) for c, one in second.items()}
    third = _told_under(cameras, shown, second, right)
    return [third.get(c) if c in first else told.get(c) for c in range(len(cameras))]


def _each(tell: Callable[[int], Encoding | None], cameras: Iterable[int]) -> dict[int, Encoding]:
    """Return what is told of each camera of which something is."""
    return {c: one for c in cameras if (one := tell(c)) is not None}


def _first(camera: Again, shown: Appearance) -> Encoding | None:
    """Return what all sightings tell in the light that was learned as the tracker learns it."""
    if shown.response.block_px == 1 or not shown.shown.trusted:
        return None
    smoothing = SMOOTHED if shown.response.detail > SMOOTH_DETAIL else 0.0
    return _told(camera, Encoding(shown, smoothing, _first_paints(camera, shown.response.gamma)))


def _secant(under: float, told: float, far: float, told_far: float) -> float:
    """Return the gamma that would be told under its own light."""
    less = (told - under) - (told_far - far)
    return _within(under + ((told - under) / less if less * (far - under) > 0.0 else 1.0) * (far - under))


def _within(gamma: float) -> float:
    return min(MOST_GAMMA, max(LEAST_GAMMA, gamma))


def _told_under(
    cameras: Sequence[Again], shown: Sequence[Appearance], known: Mapping[int, Encoding], gammas: Mapping[int, float]
) -> dict[int, Encoding]:
    """Learn light anew, some cameras' under a gamma of theirs, then let all sightings tell gamma, blur and paints."""
    if not gammas:
        return {}
    stand = [known[c].appearance.with_gamma(gammas[c]) if c in gammas else one for c, one in enumerate(shown)]
    light = taught_anew(cameras, stand)

    def under(c: int) -> Encoding | None:
        response = replace(light[c].response, luma_px=known[c].appearance.response.luma_px)
        paints = np.maximum(known[c].paints, LEAST_PAINT) ** (gammas[c] / known[c].gamma)  # of the same grey levels
        return _told(cameras[c], Encoding(replace(light[c], response=response), known[c].smoothing, _unit(paints)))

    return _each(under, gammas)


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


def _first_paints(camera: Again, gamma: float) -> Array:
    """Return about what light each ball sends, by the middles of its images."""
    light = light_of(gamma)
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
