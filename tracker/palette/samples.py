"""The pixels of balls whose places are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from tracker.palette.chroma import chroma
from tracker.rig import Rig
from tracker.types import Array, Frame, Image

EDGE_PX = 0.6  # pixels this near to the edge are part room
PATCH_RADII = 2.2
NEAR_RADII = 1.0  # how far a ball's middle may lie from where the pose has it, and a pixel more
ALIKE = 0.8  # of chroma: what differs more from the ball's middle pixels is a tube before it
LEAST_CONTRAST = 0.12


@dataclass(frozen=True, slots=True, eq=False)
class BallPixels:
    """What one frame showed of one ball: its centre (2,) [px], radius [px], pixels bgr (n, 3)."""

    camera: int
    ball: int
    uv_px: Array
    radius_px: float
    bgr: Image


def ball_pixels(frame: Frame, rig: Rig, p_BinW: Array, R_BtoW: Array) -> list[BallPixels]:
    """Return the pixels of every ball of the marker, at a pose, that a frame shows whole."""
    camera = rig.cameras[frame.camera]
    points = rig.marker.points_inB @ R_BtoW.T + p_BinW
    uv_px, _ = camera.project(points)
    depths_m = camera.in_camera(points)[:, 2]
    found = []
    for b, ball in enumerate(rig.marker.balls):
        if depths_m[b] < 0.1 or not np.isfinite(uv_px[b]).all():
            continue
        radius_px = camera.focal_px * ball.radius_m / float(depths_m[b])
        centre = _centre(frame.image, uv_px[b], radius_px)
        if centre is None or np.linalg.norm(centre - uv_px[b]) > NEAR_RADII * radius_px + 1.0:
            continue
        inner = disc_pixels(frame.image, centre, max(radius_px - EDGE_PX, 1.0))
        if len(inner):
            found.append(BallPixels(frame.camera, b, centre, radius_px, inner))
    return found


def vehicle_mask(shape: tuple[int, ...], seen: Sequence[BallPixels]) -> Image:
    """Return 255 where one camera's picture (h, w, ...) shows the vehicle: its balls' hull and a good way round it."""
    mask = np.zeros(shape[:2], dtype=np.uint8)
    if seen:
        hull = cv2.convexHull(np.array([np.rint(one.uv_px) for one in seen], dtype=np.int32))
        cv2.fillConvexPoly(mask, hull, 255)
        reach = int(np.ceil(2.0 * max(one.radius_px for one in seen))) + 3
        mask = np.asarray(
            cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2)), np.uint8
        )
    return mask


def _centre(image: Image, uv_px: Array, radius_px: float) -> Array | None:
    """Return the middle (2,) of what differs from its surroundings at a place; None at a border or if nothing does."""
    half = int(np.ceil(PATCH_RADII * radius_px)) + 2
    u, v = (round(float(x)) for x in uv_px)
    height, width = image.shape[:2]
    if not (half <= u < width - half and half <= v < height - half):
        return None
    part = chroma(image[v - half : v + half + 1, u - half : u + half + 1])
    x, y = (axis.astype(np.float64) for axis in np.meshgrid(*[np.arange(-half, half + 1)] * 2))
    away = np.hypot(x - (uv_px[0] - u), y - (uv_px[1] - v))
    room = np.median(part[away > 1.5 * radius_px + 1.0], axis=0)
    paint = np.median(part[away <= max(0.5 * radius_px, 1.0)], axis=0) - room
    strength = float(paint @ paint)
    if strength < LEAST_CONTRAST**2:
        return None
    weight = np.clip((part - room) @ paint / strength - 0.25, 0.0, 0.75) * (away < 1.5 * radius_px + 1.0)
    total = float(weight.sum())
    if total <= 0.0:
        return None
    return np.array([u + float((weight * x).sum()) / total, v + float((weight * y).sum()) / total])


def disc_pixels(image: Image, uv_px: Array, radius_px: float) -> Image:
    """Return the pixels (n, 3) within a radius of a centre that look like its middle."""
    u, v = (round(float(x)) for x in uv_px)
    half = int(np.ceil(radius_px)) + 1
    top, left = max(v - half, 0), max(u - half, 0)
    part = image[top : v + half + 1, left : u + half + 1]
    rows, columns = np.mgrid[top : top + part.shape[0], left : left + part.shape[1]]
    away = np.hypot(columns - uv_px[0], rows - uv_px[1])
    colour = chroma(part)
    middle = np.median(colour[away <= max(0.5 * radius_px, 1.0)], axis=0)
    alike = np.linalg.norm(colour - middle, axis=2) < ALIKE
    return np.asarray(part[(away <= radius_px) & alike], dtype=np.uint8)
