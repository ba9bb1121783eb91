"""Sub-pixel centres of balls, by fitting their images.

A pixel near the edge shows part ball, part room. Which part is unknown where the ball is dark and so is the room, so
the whole patch is fitted at once: coverage times a shaded ball, the rest times a sloping background; brightness and
the two colour differences apart, because cameras blur colour more (Bayer filters, JPEG 4:2:0). The linear coefficients
are solved for inside (variable projection), the centre by Gauss-Newton, and pixels that fit no ball (tubes, writing)
lose their weight (Tukey's biweight). All balls of all cameras go through at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.patch import PLANE, Expected, Patches, cut, fits_in, patch_half
from tracker.template import Template, sample, template_for
from tracker.types import Array, Image, Reason, frozen_array

TUKEY = 4.0
LEAST_WEIGHT = 1e-3
ITERATIONS = 4
ROUGH_PX = 0.5
CONVERGED_PX = 0.02  # of the last step; what is left after it is far smaller
MAX_SHIFT_PX = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Centre:
    """A fitted ball.

    uv_px (2,), cov_px (2, 2) [px^2] of the fit alone; misfit: chi2 per degree of freedom.
    """

    uv_px: Array
    cov_px: Array
    misfit: float


def fit_centres(images: Sequence[Image], balls: Sequence[Expected]) -> list[Centre | Reason]:
    """Fit the centres of balls.

    Args:
        images: for each ball the image it is in, (height, width, 3) BGR.
        balls: what is known of each; shades of one kind for all.
    Returns:
        For each ball Centre; AT_BORDER when its patch leaves the image, NO_BALL when the fit runs away.
    Source: Golub, Pereyra, "Separable nonlinear least squares", Inverse Problems 19 (2003), with Kaufman's
        approximation of the Jacobian; weights: Tukey's biweight.
    """
    if not balls:
        return []
    half = patch_half(balls)
    whole = [fits_in(image, ball, half) for image, ball in zip(images, balls, strict=True)]
    fitted = [k for k, inside in enumerate(whole) if inside]
    results: list[Centre | Reason] = [Reason.AT_BORDER for _ in balls]
    if fitted:
        expected = [balls[k] for k in fitted]
        for k, found in zip(fitted, _fit(cut([images[k] for k in fitted], expected, half), expected), strict=True):
            results[k] = found
    return results


def _fit(patches: Patches, balls: Sequence[Expected]) -> list[Centre | Reason]:
    """Run Gauss-Newton for all balls."""
    templates = [
        tuple(
            template_for(ball.radius_px, blur_px, ball.shades, patches.half, ball.streak_px)
            for blur_px in (ball.blur.luma_px, ball.blur.chroma_px)
        )
        for ball in balls
    ]
    start = np.array([ball.uv_px for ball in balls]) - patches.middle
    centre, weight = start, patches.inside
    for iteration in range(ITERATIONS):
        grid, information, gradient, squares = _linearise(patches, balls, templates, centre, weight)
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
    patches: Patches,
    balls: Sequence[Expected],
    templates: Sequence[tuple[Template, ...]],
    centre: Array,
    weight: Array,
) -> tuple[Array, Array, Array, Array]:
    """Linearise about the templates' grid points nearest the centres (k, 2).

    Args:
        templates: for each ball, of brightness and of colour.
        weight: (k, n) of each pixel.
    Returns:
        grid (k, 2), information (k, 2, 2), gradient (k, 2) of the centre, misfit of each pixel (k, n).
    The background's plane stands where the ball is not: its columns are (1 - coverage) (1, x, y).
    """
    k, n = weight.shape
    p = len(balls[0].shades.weights)
    shapes = np.empty((k, 2, 3, p, n))
    grid = np.empty((k, 2))
    for i, (ball, pair, at) in enumerate(zip(balls, templates, centre.tolist(), strict=True)):
        for group, template in enumerate(pair):
            grid[i], drawn = sample(template, ball.radius_px, (at[0], at[1]), patches.half, ball.streak_px)
            shapes[i, group] = drawn.reshape(3, p, n)
    w = weight[:, None, None, :]
    model = np.concatenate((shapes[:, :, 0], (1.0 - shapes[:, :, 0, :1]) * patches.plane), axis=2)
    weighted = model * w
    normal = weighted @ weighted.swapaxes(2, 3)
    diagonal = np.arange(p + PLANE)
    normal[:, :, diagonal, diagonal] *= 1.0 + 1e-9
    inverse = np.linalg.inv(normal)
    w = weight[:, None, :, None]
    coefficients = inverse @ (weighted @ (patches.z * w))
    rest = patches.z - model.swapaxes(2, 3) @ coefficients
    squares = (rest * rest).sum(axis=(1, 3)) / 3.0
    uncovered = patches.plane.T @ coefficients[:, :, p:]
    slopes = shapes[:, :, 1:].swapaxes(3, 4) @ coefficients[:, :, None, :p]
    slopes -= shapes[:, :, 1:, 0, :, None] * uncovered[:, :, None]
    slopes *= w[:, :, None]
    slopes -= weighted.swapaxes(2, 3)[:, :, None] @ (inverse[:, :, None] @ (weighted[:, :, None] @ slopes))
    flat = slopes.reshape(k, 2, 2, 2 * n)
    information = (flat @ flat.swapaxes(2, 3)).sum(axis=1)
    gradient = (flat @ (rest * w).reshape(k, 2, 2 * n, 1)).sum(axis=1)[:, :, 0]
    return grid, information, gradient, squares
