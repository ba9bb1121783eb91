"""Images of painted balls, drawn pixel by pixel and apart from the product's own renderer."""

from __future__ import annotations

from collections.abc import Collection

import cv2
import numpy as np

from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import at
from tracker.camera import Camera
from tracker.rig import Ball, Rig
from tracker.state import State
from tracker.types import Array, Frame, Image

FINE = 8  # samples a pixel along each axis
ROOM_BGR = (96.0, 90.0, 84.0)
LIGHT_inW = np.array([0.33, -0.24, 0.91])
VIEW = paper_rig().cameras[0]
AMBIENT = 0.45


def frame(
    truth: State,
    rig: Rig,
    camera: int,
    t_ns: int,
    hidden: Collection[int] = (),
    noise: tuple[float, np.random.Generator] | None = None,
) -> Frame:
    """Take a picture of a vehicle that keeps its velocity and rate.

    hidden: balls that are not there.  noise: one sigma in grey levels, and its source.
    """
    then = at(truth, t_ns)
    view = rig.cameras[camera]
    canvas = empty_canvas(view)
    points_inW = rig.marker.points_inB @ then.R_BtoW.T + then.p_BinW
    depths_m = (points_inW - view.p_CinW) @ view.R_CtoW[:, 2]
    for b, ball in enumerate(rig.marker.balls):
        if b not in hidden and depths_m[b] > 0:
            uv_px = view.project(points_inW[b : b + 1])[0][0]
            draw_ball(canvas, uv_px, view.focal_px * ball.radius_m / depths_m[b], ball, view)
    return Frame(camera, t_ns, developed(canvas, noise), available_ns=t_ns)


def empty_canvas(view: Camera) -> Array:
    """Return a grey wall, brighter to the right, (height, width, 3)."""
    slope = np.linspace(-12.0, 12.0, view.width_px)[None, :, None]
    return np.asarray(np.broadcast_to(np.array(ROOM_BGR) + slope, (view.height_px, view.width_px, 3)).copy())


def light_along(ray_inC: Array, light_inC: Array) -> Array:
    """Return the light's direction (3,) seen along a ray: right, down, and from the ball back to the camera."""
    back = -ray_inC / np.linalg.norm(ray_inC)
    right = np.cross((0.0, -1.0, 0.0), back)
    right /= np.linalg.norm(right)
    return np.array((right, -np.cross(back, right), back)) @ light_inC


def draw_ball(canvas: Array, uv_px: Array, radius_px: float, ball: Ball, view: Camera = VIEW) -> None:
    """Put a matt ball on a camera's canvas, each pixel the mean of FINE x FINE samples."""
    right, down, back = light_along(view.bearings(uv_px[None])[0], view.R_CtoW.T @ LIGHT_inW)
    half = int(np.ceil(radius_px)) + 2
    left, top = np.floor(uv_px).astype(int) - half
    size = 2 * half + 2
    fine = (np.arange(size * FINE) + 0.5) / FINE - 0.5  # sample positions from the first pixel's centre
    x = (fine[None, :] + left - uv_px[0]) / radius_px
    y = (fine[:, None] + top - uv_px[1]) / radius_px
    inside = x * x + y * y < 1.0
    towards = np.sqrt(np.maximum(0.0, 1.0 - x * x - y * y))
    lit = np.maximum(0.0, x * right + y * down + towards * back)
    shade = (AMBIENT + (1.0 - AMBIENT) * lit) * inside
    coverage, light = (a.reshape(size, FINE, size, FINE).mean(axis=(1, 3)) for a in (inside.astype(float), shade))
    height, width = canvas.shape[:2]
    rows, columns = slice(max(0, top), min(height, top + size)), slice(max(0, left), min(width, left + size))
    cut = slice(rows.start - top, rows.stop - top), slice(columns.start - left, columns.stop - left)
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return
    part = canvas[rows, columns]
    part *= 1.0 - coverage[cut][..., None]
    part += light[cut][..., None] * np.array(ball.colour.bgr)


def draw_band(canvas: Array, uv_px: Array, turn_rad: float, aside_px: float, half_px: float, bgr: Array) -> None:
    """Put a straight band on the canvas, its middle line so far aside of uv_px (2,)."""
    v, u = np.mgrid[: canvas.shape[0], : canvas.shape[1]]
    across = (u - uv_px[0]) * np.sin(turn_rad) - (v - uv_px[1]) * np.cos(turn_rad)
    cover = np.clip(half_px + 0.5 - np.abs(across - aside_px), 0.0, 1.0)[..., None]
    canvas += cover * (bgr - canvas)


def developed(canvas: Array, noise: tuple[float, np.random.Generator] | None = None) -> Image:
    """Return the canvas as an 8-bit image, with sensor noise if wanted."""
    if noise is not None:
        sigma, rng = noise
        canvas = canvas + sigma * rng.standard_normal(canvas.shape, dtype=np.float32)
    return np.clip(np.rint(canvas), 0, 255).astype(np.uint8)


def through_jpeg(image: Image, quality: int = 90) -> Image:
    """Return what JPEG leaves of an image, colour kept by blocks of 2 x 2 pixels."""
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    options += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420]
    return np.asarray(cv2.imdecode(cv2.imencode(".jpg", image, options)[1], cv2.IMREAD_COLOR), dtype=np.uint8)
