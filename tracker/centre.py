"""Sub-pixel centres of balls, by fitting their images.

A pixel near the edge shows part ball, part room. Which part is unknown where the ball is dark and so is the room, so
the whole patch is fitted at once: coverage times a shaded ball, the rest times a sloping background; brightness and
the two colour differences apart, because cameras blur colour more (Bayer filters, JPEG 4:2:0). The linear coefficients
are solved for inside (variable projection), the centre by Gauss-Newton, and pixels that fit no ball (tubes, writing)
lose their weight (Tukey's biweight). All balls of an image go through at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracker.template import BLUR_STEP_PX, MARGIN_PX, STREAK_MAX_PX, Shades, Streak, Vector, every_term, sample
from tracker.types import Array, Image, Reason, frozen_array

RING_PX = 1.5  # the background's own variation is measured from this far beyond the ball's edge to the patch's corner
LEAST_NOISE = 1.5  # one sigma of quantisation and compression, grey levels
TUKEY = 4.0
LEAST_WEIGHT = 1e-3
ITERATIONS = 5
ROUGH_PX = 0.5
CONVERGED_PX = 0.02  # of the last step; what is left after it is far smaller
MAX_SHIFT_PX = 1.5
PLANE = 3  # terms of the background
# BGR -> luma, blue difference, red difference (ITU-R BT.601)
_TO_YCC = np.array([[0.114, 0.587, 0.299], [0.5, -0.331264, -0.168736], [-0.081312, -0.418688, 0.5]]).T


@dataclass(frozen=True, slots=True)
class Blur:
    """How far a camera smears brightness and colour: one sigma of a round kernel, the pixel's box aside [px]."""

    luma_px: float = 0.4
    chroma_px: float = 0.7


@dataclass(frozen=True, slots=True)
class Expected:
    """What is known of a ball before its image is fitted.

    uv_px: centre within about a pixel.  radius_px: from its size and distance.
    streak_px: how far it moves during the exposure.  shades: see `template.Shades`.
    """

    uv_px: tuple[float, float]
    radius_px: float
    streak_px: Streak
    shades: Shades


@dataclass(frozen=True, slots=True, eq=False)
class Centre:
    """A fitted ball.

    uv_px (2,), cov_px (2, 2) [px^2] of the fit alone; misfit: chi2 per degree of freedom.
    """

    uv_px: Array
    cov_px: Array
    misfit: float


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Square patches of k balls, n pixels each.

    middle (k, 2): the middle pixels.  x, y (n,): pixels from there.  plane (PLANE, n).  inside (k, n): 1 near the ball.
    luma (k, n, 1), chroma (k, n, 2): whitened by the background's own variation.
    luma_noise (k,): one sigma of luma, grey levels.
    """

    half: int
    middle: Array
    x: Array
    y: Array
    plane: Array
    inside: Array
    groups: tuple[Array, Array]
    luma_noise: Array


def fit_centres(image: Image, balls: list[Expected], blur: Blur) -> list[Centre | Reason]:
    """Fit the centres of balls in one image.

    Args:
        image: (height, width, 3) BGR.
        balls: what is known of each.
        blur: the camera's.
    Returns:
        For each ball Centre; AT_BORDER when its patch leaves the image, NO_BALL when the fit runs away.
    Source: Golub, Pereyra, "Separable nonlinear least squares", Inverse Problems 19 (2003), with Kaufman's
        approximation of the Jacobian; weights: Tukey's biweight.
    """
    half = patch_half(balls)
    middles = [(round(ball.uv_px[0]), round(ball.uv_px[1])) for ball in balls]
    height, width = image.shape[:2]
    whole = [half <= u < width - half and half <= v < height - half for u, v in middles]
    fitted = [ball for ball, inside in zip(balls, whole, strict=True) if inside]
    if not fitted:
        return [Reason.AT_BORDER for _ in balls]
    results = iter(_fit(cut(image, fitted, half), fitted, blur))
    return [next(results) if inside else Reason.AT_BORDER for inside in whole]


def patch_half(balls: list[Expected]) -> int:
    """Return how far patches reach from their middle pixel [px]."""
    reach = max(ball.radius_px + min(float(np.hypot(*ball.streak_px)), STREAK_MAX_PX) / 2.0 for ball in balls)
    return int(np.ceil(reach + MARGIN_PX))


def cut(image: Image, balls: list[Expected], half: int) -> Patches:
    """Cut out and whiten the pixels round balls whose patches lie within the image."""
    span = np.arange(-half, half + 1)
    uv = np.array([ball.uv_px for ball in balls])
    middle = np.rint(uv).astype(int)
    pixels = image[middle[:, 1, None, None] + span[:, None], middle[:, 0, None, None] + span]
    ycc = pixels.reshape(len(balls), -1, 3) @ _TO_YCC
    y, x = np.repeat(span, 2 * half + 1).astype(np.float64), np.tile(span, 2 * half + 1).astype(np.float64)
    offset = uv - middle
    distance = np.hypot(x - offset[:, :1], y - offset[:, 1:])
    edge = np.array([ball.radius_px + float(np.hypot(*ball.streak_px)) / 2.0 for ball in balls])[:, None]
    plane = np.stack((np.ones_like(x), x / half, y / half))
    variance = _variation(ycc, plane, distance > edge + RING_PX)
    variance[:, [0, 1, 2], [0, 1, 2]] += LEAST_NOISE**2
    luma_noise = np.sqrt(variance[:, 0, 0])
    luma = ycc[:, :, :1] / luma_noise[:, None, None]
    # Cholesky of the chroma's 2 x 2 covariance, by hand.
    a = np.sqrt(variance[:, 1, 1])
    b = variance[:, 1, 2] / a
    c = np.sqrt(variance[:, 2, 2] - b * b)
    first = ycc[:, :, 1] / a[:, None]
    chroma = np.stack((first, (ycc[:, :, 2] - b[:, None] * first) / c[:, None]), axis=2)
    inside = (distance < edge + MARGIN_PX).astype(np.float64)
    return Patches(half, middle.astype(np.float64), x, y, plane, inside, (luma, chroma), luma_noise)


def _variation(ycc: Array, plane: Array, ring: Array) -> Array:
    """Return the covariance (k, 3, 3) of the background pixels about their own plane."""
    on = ring.astype(np.float64)[:, :, None] * plane.T
    normal = on.transpose(0, 2, 1) @ plane.T + 1e-9 * np.eye(PLANE)
    rest = (ycc - plane.T @ np.linalg.solve(normal, on.transpose(0, 2, 1) @ ycc)) * ring[:, :, None]
    freedom = np.maximum(ring.sum(axis=1) - PLANE, 1.0)
    return np.asarray(rest.transpose(0, 2, 1) @ rest / freedom[:, None, None])


def _fit(patches: Patches, balls: list[Expected], blur: Blur) -> list[Centre | Reason]:
    """Run Gauss-Newton for all balls."""
    start = np.array([ball.uv_px for ball in balls]) - patches.middle
    centre, weight = start, patches.inside
    for iteration in range(ITERATIONS):
        grid, information, gradient, squares = _linearise(patches, balls, centre, blur, weight)
        used = weight
        step = np.clip(np.linalg.solve(information, gradient[:, :, None])[:, :, 0], -1.0, 1.0)
        moved = float(np.abs(grid + step - centre).max())
        centre = grid + step
        if moved < CONVERGED_PX and iteration > 0:
            break
        if moved > ROUGH_PX:
            continue  # weights now would hold the wrong place fast
        scale = np.maximum(1.0, np.median(squares, axis=1, keepdims=True))
        weight = patches.inside * np.clip(1.0 - squares / (TUKEY**2 * scale), LEAST_WEIGHT, None)
    freedom = np.maximum(1.0, 3.0 * (used**2).sum(axis=1) - 3.0 * (PLANE + len(balls[0].shades.weights)) - 2.0)
    misfit = 3.0 * (squares * used**2).sum(axis=1) / freedom
    covariance = np.linalg.inv(information) * np.maximum(1.0, misfit)[:, None, None]
    ran = np.hypot(*(centre - start).T) > MAX_SHIFT_PX
    return [
        Reason.NO_BALL
        if ran[k]
        else Centre(frozen_array(centre[k] + patches.middle[k]), frozen_array(covariance[k]), float(misfit[k]))
        for k in range(len(balls))
    ]


def _linearise(
    patches: Patches, balls: list[Expected], centre: Array, blur: Blur, weight: Array
) -> tuple[Array, Array, Array, Array]:
    """Linearise about the templates' grid points nearest the centres (k, 2).

    Returns:
        grid (k, 2), information (k, 2, 2), gradient (k, 2) of the centre, misfit of each pixel (k, n).
    The background's plane stands where the ball is not: its columns are (1 - coverage) (1, x, y).
    """
    k, n = weight.shape
    information, gradient, squares = np.zeros((k, 2, 2)), np.zeros((k, 2)), np.zeros((k, n))
    w = weight[:, None, :]
    for z, blur_px in zip(patches.groups, (blur.luma_px, blur.chroma_px), strict=True):
        read = [
            sample(ball.radius_px, blur_px, ball.shades, (float(c[0]), float(c[1])), patches.half, ball.streak_px)
            for ball, c in zip(balls, centre, strict=True)
        ]
        grid = np.stack([place for place, _ in read])
        shapes = np.stack([shape for _, shape in read]).reshape(k, 3, -1, n)
        model = np.concatenate((shapes[:, 0], (1.0 - shapes[:, 0, :1]) * patches.plane), axis=1)
        weighted = model * w
        normal = weighted @ weighted.transpose(0, 2, 1)
        diagonal = np.arange(normal.shape[1])
        normal[:, diagonal, diagonal] *= 1.0 + 1e-9
        target = z * weight[:, :, None]
        coefficients = np.linalg.solve(normal, weighted @ target)
        rest = z - model.transpose(0, 2, 1) @ coefficients
        squares += (rest * rest).sum(axis=2)
        p = shapes.shape[2]
        uncovered = patches.plane.T @ coefficients[:, p:]
        slopes = shapes[:, 1:].transpose(0, 1, 3, 2) @ coefficients[:, None, :p]
        slopes -= shapes[:, 1:, 0, :, None] * uncovered[:, None]
        slopes *= weight[:, None, :, None]
        within = np.linalg.solve(normal[:, None], weighted[:, None] @ slopes)
        slopes -= weighted.transpose(0, 2, 1)[:, None] @ within
        flat = slopes.reshape(k, 2, -1)
        information += flat @ flat.transpose(0, 2, 1)
        gradient += (flat @ (rest * weight[:, :, None]).reshape(k, -1, 1))[:, :, 0]
    return grid, information, gradient, squares / 3.0


def sharper(patches: Patches, ball: Expected, centre: Array, blur: Blur, step_px: float, most_px: float) -> Blur:
    """Return the blur, moved one step to where the one ball of `patches` fits better."""
    moved = []
    place = (float(centre[0]), float(centre[1]))
    w = patches.inside[0]
    for z, now_px in zip(patches.groups, (blur.luma_px, blur.chroma_px), strict=True):
        misfits = []
        for blur_px in (max(0.0, now_px - BLUR_STEP_PX), now_px + BLUR_STEP_PX):
            shapes = sample(ball.radius_px, blur_px, ball.shades, place, patches.half, ball.streak_px)[1][0]
            shapes = shapes.reshape(len(ball.shades.weights), -1)
            model = np.concatenate((shapes, (1.0 - shapes[:1]) * patches.plane)) * w
            normal = model @ model.T
            rest = z[0] * w[:, None] - model.T @ np.linalg.solve(normal + 1e-9 * np.eye(len(normal)), model @ z[0])
            misfits.append(float((rest * rest).sum()))
        direction = -1.0 if misfits[0] < misfits[1] else 1.0
        moved.append(min(most_px, max(0.0, now_px + direction * step_px)))
    return Blur(*moved)


def light_on(patches: Patches, ball: Expected, centre: Array, blur: Blur, lamp: Vector) -> tuple[Array, Array] | None:
    """Return the normal equations of the light's terms on the one ball of `patches`, at mean brightness 1.

    Args:
        ball: what is known of it.
        centre: (2,) fitted centre from the patch's middle pixel [px].
        lamp: the lamp as seen along the ball's ray.
    Returns:
        information (TERMS, TERMS), target (TERMS,) for `Light.learned`; None for a ball without brightness of its own.
    """
    place = (float(centre[0]), float(centre[1]))
    grid, drawn = sample(ball.radius_px, blur.luma_px, every_term(lamp), place, patches.half, ball.streak_px)
    value, by_u, by_v = drawn.reshape(3, -1, len(patches.x))
    terms = value + (centre[0] - grid[0]) * by_u + (centre[1] - grid[1]) * by_v
    w = patches.inside[0]
    room = (1.0 - terms[0]) * patches.plane
    z = patches.groups[0][0, :, 0]
    # Take the background out of terms and pixels, as the fit does.
    out = np.linalg.solve(room * w @ room.T + 1e-9 * np.eye(PLANE), room * w)
    rest, rest_z = terms - (terms @ out.T) @ room, z - (z @ out.T) @ room
    information, target = rest * w @ rest.T, rest * w @ rest_z
    even = np.linalg.solve(information[:4, :4] + 1e-9 * np.eye(4), target[:4])
    mean = float(even[0] + 2.0 / 3.0 * even[3])  # z is 2/3 on the mean over a disc
    return (information * mean**2, target * mean) if mean > 0.0 else None
