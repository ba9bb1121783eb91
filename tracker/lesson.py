"""What one well-fitted ball teaches of the camera's blur and the room's light."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from tracker.patch import PLANE, Blur, Expected, Patches
from tracker.template import BLUR_STEP_PX, Vector, every_term, sample, template_for
from tracker.types import Array

BLUR_MAX_PX = 1.5
EXPOSURE_TRIAL_S, EXPOSURE_STEP_S, EXPOSURE_MAX_S = 0.001, 0.00025, 0.02
LEAST_STREAK_PX = 0.2  # a trial that moves the ball's ends by less shows nothing


def sharper(patches: Patches, ball: Expected, centre: Array, step_px: float) -> Blur:
    """Return the camera's blur, moved one step to where the one ball of `patches` fits better.

    Args:
        centre: (2,) fitted centre from the patch's middle pixel [px].
    """
    now = ball.blur
    luma, chroma = patches.z[0]

    def tried(group: int, **change: float) -> float:
        z = luma if group == 0 else chroma
        changed = replace(ball, blur=replace(now, **change))
        blur_px = changed.blur.luma_px if group == 0 else changed.blur.chroma_px
        return _misfit(patches, changed, centre, z, blur_px)

    less_luma = tried(0, luma_px=max(0.0, now.luma_px - BLUR_STEP_PX)) < tried(0, luma_px=now.luma_px + BLUR_STEP_PX)
    less_chroma = tried(1, chroma_px=max(0.0, now.chroma_px - BLUR_STEP_PX)) < tried(
        1, chroma_px=now.chroma_px + BLUR_STEP_PX
    )
    exposure_s = now.exposure_s
    if math.hypot(*ball.speed_px_s) * EXPOSURE_TRIAL_S > LEAST_STREAK_PX:
        shorter, longer = max(0.0, exposure_s - EXPOSURE_TRIAL_S), exposure_s + EXPOSURE_TRIAL_S
        less = tried(0, exposure_s=shorter) < tried(0, exposure_s=longer)
        exposure_s = min(EXPOSURE_MAX_S, max(0.0, exposure_s + (-EXPOSURE_STEP_S if less else EXPOSURE_STEP_S)))
    return Blur(_stepped(now.luma_px, less_luma, step_px), _stepped(now.chroma_px, less_chroma, step_px), exposure_s)


def _stepped(now_px: float, less: bool, step_px: float) -> float:
    return min(BLUR_MAX_PX, max(0.0, now_px + (-step_px if less else step_px)))


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
