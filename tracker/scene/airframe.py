"""The helicopter around the balls: carbon tubes from a hub to each ball, fuselage, boom, skids and the rotor's disc."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tracker.camera import Camera
from tracker.rig import Marker
from tracker.scene.ball import Stamp
from tracker.scene.sensor import Plane, to_light
from tracker.types import Array, Image

_CARBON = (38, 36, 35)
_CANOPY = (96, 92, 88)
_BLADE = (58, 56, 56)
_ROTOR_RADIUS_M, _ROTOR_HEIGHT_M, _ROTOR_COVER = 0.15, 0.055, 0.07
_TUBE_RADIUS_M = 0.001
_SHIFT_BITS = 4


@dataclass(frozen=True, slots=True, eq=False)
class Rod:
    """A straight round piece from a to b (3,) in B [m]. ball: index of the ball that b touches, if any."""

    a_inB: Array
    b_inB: Array
    radius_m: float
    bgr: tuple[int, int, int]
    ball: int | None = None


def airframe(marker: Marker) -> tuple[Rod, ...]:
    """Return the pieces of a small helicopter that carries this marker, its hub at the balls' mean."""
    hub = marker.points_inB.mean(axis=0)
    tubes = []
    for index, ball in enumerate(marker.balls):
        direction = (hub - ball.p_inB) / np.linalg.norm(hub - ball.p_inB)
        end = ball.p_inB + 0.9 * ball.radius_m * direction
        tubes.append(Rod(hub, end, _TUBE_RADIUS_M, _CARBON, index))
    body = [
        ((0.045, 0.0, -0.030), (-0.030, 0.0, -0.026), 0.013, _CANOPY),
        ((-0.030, 0.0, -0.024), (-0.150, 0.0, -0.016), 0.0025, _CARBON),
        ((0.0, 0.0, -0.024), (0.0, 0.0, _ROTOR_HEIGHT_M), 0.0015, _CARBON),
        ((0.050, 0.030, -0.058), (-0.050, 0.030, -0.058), 0.0013, _CARBON),
        ((0.050, -0.030, -0.058), (-0.050, -0.030, -0.058), 0.0013, _CARBON),
    ]
    return (*tubes, *(Rod(hub + np.array(a), hub + np.array(b), r, bgr) for a, b, r, bgr in body))


class RodPainter:
    """Paint one rod as one camera sees it: a straight band, since over its few pixels a lens bends nothing."""

    def __init__(self, camera: Camera, rod: Rod, light: float, gamma: float) -> None:
        self._camera = camera
        self._rod = rod
        self._light = (to_light(np.array(rod.bgr, dtype=np.uint8), gamma) * light).astype(np.float32)

    def paint(self, ends_px: Array, depth_m: float) -> list[Stamp] | None:
        """Paint the rod between pixels ends_px (k, 2, 2) at k instants at a depth [m]; None where out of sight."""
        half_px = self._rod.radius_m * self._camera.focal_px / depth_m
        low = np.floor(ends_px.min(axis=(0, 1)) - half_px - 1).astype(int).tolist()
        high = np.ceil(ends_px.max(axis=(0, 1)) + half_px + 2).astype(int).tolist()
        u0, v0 = max(low[0], 0), max(low[1], 0)
        u1, v1 = min(high[0], self._camera.width_px), min(high[1], self._camera.height_px)
        if u0 >= u1 or v0 >= v1:
            return None
        cover = _band(ends_px - (u0, v0), half_px, u1 - u0, v1 - v0)
        layers = cover[..., None] * np.append(self._light, np.float32(1.0))
        return [Stamp(u0, v0, layer) for layer in layers]


def _band(ends_px: Array, half_px: float, width: int, height: int) -> Plane:
    """Return the share of each pixel covered (k, h, w) by bands (k, 2, 2): exact for one that crosses it straight."""
    u = np.arange(width, dtype=np.float32)
    v = np.arange(height, dtype=np.float32)[:, None]
    ua, va, ub, vb = ends_px.reshape(-1, 4, 1, 1).astype(np.float32).transpose(1, 0, 2, 3)
    du, dv = ub - ua, vb - va
    u_off, v_off = u - ua, v - va
    along = np.clip((u_off * du + v_off * dv) / np.maximum(du * du + dv * dv, 1e-6), 0.0, 1.0)
    u_off, v_off = u_off - along * du, v_off - along * dv
    away = np.sqrt(u_off * u_off + v_off * v_off)
    overlap = np.minimum(away + 0.5, half_px) - np.maximum(away - 0.5, -half_px)
    return np.asarray(np.clip(overlap, 0.0, 1.0), dtype=np.float32)


class RotorPainter:
    """Paint the turning rotor's see-through disc."""

    def __init__(self, camera: Camera, marker: Marker, gamma: float) -> None:
        self._camera = camera
        angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
        rim = _ROTOR_RADIUS_M * np.column_stack((np.cos(angle), np.sin(angle), np.zeros_like(angle)))
        self.rim_inB: Array = rim + marker.points_inB.mean(axis=0) + (0.0, 0.0, _ROTOR_HEIGHT_M)
        self._light = to_light(np.array(_BLADE, dtype=np.uint8), gamma)

    def paint(self, rim_px: Array) -> Stamp | None:
        """Paint the disc within its rim (40, 2) [px]; None where out of sight."""
        u0, v0 = np.maximum(np.floor(rim_px.min(axis=0)).astype(int) - 1, 0).tolist()
        u1 = min(int(rim_px[:, 0].max()) + 2, self._camera.width_px)
        v1 = min(int(rim_px[:, 1].max()) + 2, self._camera.height_px)
        if u0 >= u1 or v0 >= v1:
            return None
        mask: Image = np.zeros((v1 - v0, u1 - u0), dtype=np.uint8)
        corners = np.rint((rim_px - (u0, v0)) * (1 << _SHIFT_BITS)).astype(np.int32)
        cv2.fillConvexPoly(mask, corners, (255,), cv2.LINE_AA, _SHIFT_BITS)
        cover = mask.astype(np.float32) * (_ROTOR_COVER / 255.0)
        return Stamp(u0, v0, cover[..., None] * np.append(self._light, np.float32(1.0)))
