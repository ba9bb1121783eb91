"""Sub-pixel centres of balls, by fitting their images.

A pixel near the edge shows part ball, part room. Which part is unknown where the ball is dark and so is the room, so
the whole patch is fitted at once: coverage times a shaded ball, the rest times a sloping background and, where it is
known, the room behind (`tracker/image/behind.py`); brightness and the two colour differences apart, because cameras
blur colour more (Bayer filters, JPEG 4:2:0). The linear coefficients are solved for inside (variable projection), the
centre by Gauss-Newton, and pixels that fit no ball (tubes, writing) lose their weight (Tukey's biweight):
`tracker/image/newton.py`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tracker.image.at_centre import squares_at
from tracker.image.evidence import LEAST_EVIDENCE
from tracker.image.hiding import AT_ONCE, WHOLE, hidden_variance
from tracker.image.holder import without_holders
from tracker.image.newton import EVIDENCE, FIT_SIZE, SHARES, gauss_newton
from tracker.image.patch import Expected, Patch, cut, extent_of, fits_in
from tracker.image.reading import LUMA_VAR
from tracker.image.template import Template, template_for, variance_of
from tracker.types import Array, Image, Reason, frozen_array

MAX_SHIFT_PX = 1.5  # of a centre from its spot's middle; or
SHIFT_SHARE = 0.3  # of its radius, where that is more: the dark side of a large ball may be too dark for a spot


@dataclass(frozen=True, slots=True, eq=False)
class Centre:
    """A fitted ball.

    uv_px (2,), cov_px (2, 2) [px^2] of the fit alone; misfit: chi2 per degree of freedom.
    """

    uv_px: Array
    cov_px: Array
    misfit: float


def numbers_of(ball: Expected) -> Array:
    """Return what is known of a ball as compiled code takes it, see `reading.BALL_SIZE`."""
    r = ball.response
    variances = variance_of(r.luma_px, 1), variance_of(r.chroma_px, r.block_px)
    return np.array((ball.radius_px, *variances, *ball.streak_px, *ball.longer))


def templates_of(ball: Expected) -> tuple[Template, Template]:
    """Return the templates of a ball's brightness and of its colour."""
    if ball.drawn is not None:
        return ball.drawn
    r = ball.response
    luma = template_for(ball.radius_px, r.luma_px, ball.shades)
    return luma, template_for(ball.radius_px, r.chroma_px, ball.shades, r.block_px)


def fit_centre(image: Image, ball: Expected) -> Centre | Reason:
    """Fit the centre of a ball.

    Args:
        image: (height, width, 3) BGR.
        ball: what is known of it.
    Returns:
        Centre; AT_BORDER when its patch leaves the image, NO_BALL when nothing is there or the fit runs away.
    Source: Golub, Pereyra, "Separable nonlinear least squares", Inverse Problems 19 (2003), with Kaufman's
        approximation of the Jacobian; weights: Tukey's biweight.
    """
    extent = extent_of(ball)
    if not fits_in(image, extent):
        return Reason.AT_BORDER
    patch, fit = without_holders(cut(image, extent, ball), extent, ball), np.empty(FIT_SIZE)
    luma, chroma = templates_of(ball)
    numbers = numbers_of(ball)
    gauss_newton(patch.bright, patch.colour, *luma, *chroma, numbers, extent.du, extent.dv, fit)
    du, dv, cov_uu, cov_uv, cov_vv, misfit, evidence = fit[: EVIDENCE + 1].tolist()
    if not (
        math.hypot(du - extent.du, dv - extent.dv) <= max(MAX_SHIFT_PX, SHIFT_SHARE * ball.radius_px)
        and evidence >= LEAST_EVIDENCE
    ):
        return Reason.NO_BALL
    uv_px = frozen_array((extent.u + du, extent.v + dv))
    hidden = hidden_variance(fit[SHARES:], AT_ONCE, WHOLE, numbers)
    return Centre(uv_px, frozen_array(((cov_uu + hidden, cov_uv), (cov_uv, cov_vv + hidden))), misfit)


def misfit_at(patch: Patch, ball: Expected, centre: tuple[float, float]) -> float:
    """Return the sum of squares that a ball's fit leaves in its brightness at a given centre.

    centre: from the patch's middle pixel [px].
    """
    luma, _ = templates_of(ball)
    return squares_at(patch.bright, luma.fine, luma.made, numbers_of(ball), LUMA_VAR, *centre)
