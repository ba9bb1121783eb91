"""The sub-pixel centre of one ball, by fitting its image.

A pixel near the edge shows part ball, part room. Which part is unknown where the ball is dark and so is the room, so
the whole patch is fitted at once: coverage times a shaded ball, the rest times a sloping background, brightness and
the two colour differences apart because cameras blur colour more (Bayer filters, JPEG 4:2:0). The linear coefficients
are solved for inside (variable projection); centre and blurs are found by Gauss-Newton, pixels that fit no ball
(tubes, writing) lose their weight (Tukey's biweight).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracker.ball_model import ball_image
from tracker.types import Array, Image, Reason, Rejected, frozen_array

MARGIN_PX = 3.5  # patch beyond the ball's edge
RING_PX = (2.5, 5.0)  # where the background's own variation is measured, beyond the ball's edge
LEAST_NOISE = 1.5  # one sigma of quantisation and compression, grey levels
PRIOR_BLUR_SIGMA_PX = 0.2
BLUR_RANGE_PX = (0.15, 1.5)
TUKEY = 4.0
MAX_ITERATIONS = 12
CONVERGED_PX = 2e-3
MAX_SHIFT_PX = 2.5
# BGR -> luma, blue difference, red difference (ITU-R BT.601)
_TO_YCC = np.array([[0.114, 0.587, 0.299], [0.5, -0.331264, -0.168736], [-0.081312, -0.418688, 0.5]]).T
_GROUPS = (slice(0, 1), slice(1, 3))


@dataclass(frozen=True, slots=True)
class Blur:
    """How far a camera smears brightness and colour: one sigma of a round kernel, the pixel's box aside [px]."""

    luma_px: float = 0.5
    chroma_px: float = 0.7


@dataclass(frozen=True, slots=True, eq=False)
class Centre:
    """A fitted ball: uv_px (2,), cov_px (2, 2) [px^2], the blur that fits best, chi2 per degree of freedom."""

    uv_px: Array
    cov_px: Array
    blur: Blur
    misfit: float


@dataclass(frozen=True, slots=True, eq=False)
class _Patch:
    """Pixels around a ball: x, y (n,) from the patch's middle pixel, whitened colour groups (n, 1) and (n, 2)."""

    x: Array
    y: Array
    groups: tuple[Array, Array]
    radius_px: float


def fit_centre(image: Image, guess_px: Array, radius_px: float, blur: Blur, floor_px: float) -> Centre | Rejected:
    """Fit a ball's centre.

    Args:
        image: (height, width, 3) BGR.
        guess_px: (2,) centre within about a pixel.
        radius_px: the ball's radius in this image, known from its size and distance [px].
        blur: the camera's blur so far; the fit may depart from it.
        floor_px: one sigma of what the model cannot explain, added to the covariance [px].
    Returns:
        Centre; Rejected AT_BORDER when the patch leaves the image, NO_BALL when the fit runs away.
    Source: Golub, Pereyra, "Separable nonlinear least squares", Inverse Problems 19 (2003); weights: Tukey.
    """
    middle = np.rint(guess_px).astype(int)
    patch = _cut(image, middle, guess_px, radius_px)
    if patch is None:
        return Rejected(Reason.AT_BORDER, f"ball at ({guess_px[0]:.0f}, {guess_px[1]:.0f}) px")
    found = _gauss_newton(patch, guess_px - middle, blur)
    if found is None:
        return Rejected(Reason.NO_BALL, f"no ball fits at ({guess_px[0]:.0f}, {guess_px[1]:.0f}) px")
    parameters, covariance, misfit = found
    return Centre(
        uv_px=frozen_array(parameters[:2] + middle),
        cov_px=frozen_array(covariance + floor_px**2 * np.eye(2)),
        blur=Blur(float(parameters[2]), float(parameters[3])),
        misfit=misfit,
    )


def _cut(image: Image, middle: Array, guess_px: Array, radius_px: float) -> _Patch | None:
    """Cut out and whiten the pixels around a guess, or None at the border."""
    half = int(np.ceil(radius_px + RING_PX[1])) + 1
    u, v = int(middle[0]), int(middle[1])
    if u < half or v < half or u + half >= image.shape[1] or v + half >= image.shape[0]:
        return None
    pixels = image[v - half : v + half + 1, u - half : u + half + 1].reshape(-1, 3) @ _TO_YCC
    y, x = np.mgrid[-half : half + 1, -half : half + 1].reshape(2, -1).astype(np.float64)
    distance = np.hypot(x - (guess_px[0] - u), y - (guess_px[1] - v))
    ring = (distance > radius_px + RING_PX[0]) & (distance < radius_px + RING_PX[1])
    near = distance < radius_px + MARGIN_PX
    plane = np.column_stack((np.ones(int(ring.sum())), x[ring], y[ring]))
    rest = pixels[ring] - plane @ np.linalg.lstsq(plane, pixels[ring], rcond=None)[0]
    groups = tuple(_whiten(pixels[near][:, g], rest[:, g]) for g in _GROUPS)
    return _Patch(x[near], y[near], (groups[0], groups[1]), radius_px)


def _whiten(pixels: Array, background: Array) -> Array:
    """Scale channels (n, k) so that the background's variation about its plane is one unit."""
    k = pixels.shape[1]
    covariance = background.T @ background / max(1, len(background) - 3) + LEAST_NOISE**2 * np.eye(k)
    return np.asarray(np.linalg.solve(np.linalg.cholesky(covariance), pixels.T).T)


def _linearise(patch: _Patch, p: Array, weight: Array) -> tuple[Array, Array, Array]:
    """Return the normal equations of (u, v, luma blur, chroma blur): information (4, 4), gradient (4,), misfit (n,).

    Kaufman's approximation: the Jacobian is that of the model at fixed coefficients, less its part within the model.
    The background's plane stands where the ball is not, so its columns are (1 - coverage) (1, x, y).
    """
    information, gradient, squares = np.zeros((4, 4)), np.zeros(4), np.zeros(len(patch.x))
    plane = np.stack((np.ones_like(patch.x), patch.x, patch.y))
    for k, z in enumerate(patch.groups):
        shapes = ball_image(patch.x - p[0], patch.y - p[1], patch.radius_px, float(p[2 + k]))
        model = np.concatenate((shapes[0], (1.0 - shapes[0, 0]) * plane)) * weight
        normal = model @ model.T
        normal[np.diag_indices(7)] += 1e-9 * normal.trace()
        target = z * weight[:, None]
        coefficients = np.linalg.solve(normal, model @ target)
        rest = target - model.T @ coefficients
        squares += (rest * rest).sum(axis=1) / (weight * weight)
        # Moving the centre by +u moves dx by -u; the uncovered room gives way as the coverage comes.
        slopes = np.concatenate((shapes[1:], -shapes[1:, :1] * plane), axis=1) * weight
        slopes[:2] *= -1.0
        moved = slopes.transpose(0, 2, 1) @ coefficients
        within = np.linalg.solve(normal, model @ moved)
        moved = (moved - model.T @ within).reshape(3, -1)
        index = [0, 1, 2 + k]
        information[np.ix_(index, index)] += moved @ moved.T
        gradient[index] += moved @ rest.ravel()
    return information, gradient, squares / 3.0


def _gauss_newton(patch: _Patch, start: Array, blur: Blur) -> tuple[Array, Array, float] | None:
    """Return parameters (4,), centre covariance (2, 2) and misfit, or None when the centre runs away."""
    prior = np.array([blur.luma_px, blur.chroma_px])
    p = np.concatenate((start, prior))
    weight = np.ones(len(patch.x))
    for iteration in range(MAX_ITERATIONS):
        used = weight
        information, gradient, squares = _linearise(patch, p, weight)
        information[2:, 2:] += np.eye(2) / PRIOR_BLUR_SIGMA_PX**2
        gradient[2:] += (prior - p[2:]) / PRIOR_BLUR_SIGMA_PX**2
        information[np.diag_indices(4)] += 1e-9
        step = np.clip(np.linalg.solve(information, gradient), -0.7, 0.7)
        p = p + step
        p[2:] = np.clip(p[2:], *BLUR_RANGE_PX)
        if float(np.hypot(*(p[:2] - start))) > MAX_SHIFT_PX:
            return None
        if np.abs(step[:2]).max() < CONVERGED_PX and iteration > 1:
            break
        scale = max(1.0, float(np.median(squares)))
        weight = np.clip(1.0 - squares / (TUKEY**2 * scale), 1e-3, None)
    freedom = max(1.0, 3.0 * float((used**2).sum()) - 23.0)
    misfit = 3.0 * float(squares @ used**2) / freedom
    covariance = np.asarray(np.linalg.inv(information)[:2, :2] * max(1.0, misfit), dtype=np.float64)
    return p, covariance, misfit
