"""What one well-fitted ball teaches of the camera's blur and the room's light."""

from __future__ import annotations

import numpy as np

from tracker.patch import PLANE, Blur, Expected, Patches
from tracker.template import BLUR_STEP_PX, Vector, every_term, sample, template_for
from tracker.types import Array

BLUR_MAX_PX = 1.5


def sharper(patches: Patches, ball: Expected, centre: Array, step_px: float) -> Blur:
    """Return the camera's blur, moved one step to where the one ball of `patches` fits better.

    Args:
        centre: (2,) fitted centre from the patch's middle pixel [px].
    """
    moved = []
    for z, now_px in zip(patches.z[0], (ball.blur.luma_px, ball.blur.chroma_px), strict=True):
        less, more = (
            _misfit(patches, ball, centre, z, blur_px)
            for blur_px in (max(0.0, now_px - BLUR_STEP_PX), now_px + BLUR_STEP_PX)
        )
        moved.append(min(BLUR_MAX_PX, max(0.0, now_px + (-step_px if less < more else step_px))))
    return Blur(*moved)


def _misfit(patches: Patches, ball: Expected, centre: Array, z: Array, blur_px: float) -> float:
    """Return the sum of squares that a blur leaves of z (n, 2)."""
    template = template_for(ball.radius_px, blur_px, ball.shades, patches.half, ball.streak_px)
    place = (float(centre[0]), float(centre[1]))
    shapes = sample(template, ball.radius_px, place, patches.half, ball.streak_px)[1][0].reshape(-1, len(patches.x))
    w = patches.inside[0]
    model = np.concatenate((shapes, (1.0 - shapes[:1]) * patches.plane)) * w
    normal = model @ model.T + 1e-9 * np.eye(len(model))
    rest = z * w[:, None] - model.T @ np.linalg.solve(normal, model @ z)
    return float((rest * rest).sum())


def light_on(patches: Patches, ball: Expected, centre: Array, lamp: Vector) -> tuple[Array, Array] | None:
    """Return the normal equations of the light's terms on the one ball of `patches`, at mean brightness 1.

    Args:
        ball: what is known of it.
        centre: (2,) fitted centre from the patch's middle pixel [px].
        lamp: the lamp as seen along the ball's ray.
    Returns:
        information (TERMS, TERMS), target (TERMS,) for `Light.learned`; None for a ball without brightness of its own.
    """
    template = template_for(ball.radius_px, ball.blur.luma_px, every_term(lamp), patches.half, ball.streak_px)
    place = (float(centre[0]), float(centre[1]))
    grid, drawn = sample(template, ball.radius_px, place, patches.half, ball.streak_px)
    value, by_u, by_v = drawn.reshape(3, -1, len(patches.x))
    terms = value + (centre[0] - grid[0]) * by_u + (centre[1] - grid[1]) * by_v
    w = patches.inside[0]
    room = (1.0 - terms[0]) * patches.plane
    z = patches.z[0, 0, :, 0]
    # Take the background out of terms and pixels, as the fit does.
    out = np.linalg.solve(room * w @ room.T + 1e-9 * np.eye(PLANE), room * w)
    rest, rest_z = terms - (terms @ out.T) @ room, z - (z @ out.T) @ room
    information, target = rest * w @ rest.T, rest * w @ rest_z
    even = np.linalg.solve(information[:4, :4] + 1e-9 * np.eye(4), target[:4])
    mean = float(even[0] + 2.0 / 3.0 * even[3])  # z is 2/3 on the mean over a disc
    return (information * mean**2, target * mean) if mean > 0.0 else None
