"""A painted ball under a lamp, ray-traced on the few pixels it covers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.camera import Camera
from tracker.scene.look import Lamp, Look
from tracker.scene.sensor import Plane, to_light
from tracker.types import Array

MARGIN_PX = 48
_SUPERSAMPLING = 3

Bgr = tuple[int, int, int]


class RayMap:
    """The direction of the ray through every pixel of a camera, and MARGIN_PX beyond its border.

    The map holds for each pixel its ray (x, y, 1) in C and how x and y differ from those of the next column and
    row, for rays between the pixels: (h + 2 margin, w + 2 margin, 6).
    """

    def __init__(self, camera: Camera) -> None:
        columns = np.arange(-MARGIN_PX, camera.width_px + MARGIN_PX + 1, dtype=np.float64)
        rows = np.arange(-MARGIN_PX, camera.height_px + MARGIN_PX + 1, dtype=np.float64)
        uv_px = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 1, 2)
        xy = cv2.undistortPoints(uv_px, camera.K, camera.distortion).reshape(len(rows), len(columns), 2)
        across, down = xy[:-1, 1:] - xy[:-1, :-1], xy[1:, :-1] - xy[:-1, :-1]
        self._map: Array = np.concatenate((xy[:-1, :-1], across, down), axis=2)
        part = (np.arange(_SUPERSAMPLING) + 0.5) / _SUPERSAMPLING - 0.5
        self._across, self._down = (offset.ravel() for offset in np.meshgrid(part, part))

    def window(self, corners_px: NDArray[np.int64], size_px: int) -> tuple[Array, Array]:
        """Return x and y (k, size * size, s * s) of sub-pixel rays in k square windows with corners (u, v) (k, 2)."""
        near = np.empty((len(corners_px), size_px, size_px, 6))
        for k, (u, v) in enumerate((corners_px + MARGIN_PX).tolist()):
            near[k] = self._map[v : v + size_px, u : u + size_px]
        flat = near.reshape(len(corners_px), size_px * size_px, 6, 1)
        x = flat[:, :, 0] + flat[:, :, 2] * self._across + flat[:, :, 4] * self._down
        y = flat[:, :, 1] + flat[:, :, 3] * self._across + flat[:, :, 5] * self._down
        return x, y


@dataclass(frozen=True, slots=True, eq=False)
class Stamp:
    """A little picture to lay over an image: its corner (u, v) [px] and premultiplied BGR light and cover (h, w, 4)."""

    u_px: int
    v_px: int
    layer: Plane


class BallPainter:
    """Paint balls as one camera sees them."""

    def __init__(
        self, camera: Camera, rays: RayMap, radii_m: Sequence[float], colours: Sequence[Bgr], look: Look
    ) -> None:
        """Take each ball's radius [m] and typical colour, 0..255."""
        self._camera = camera
        self._rays = rays
        self._radius_m = np.array(radii_m)
        # The paint's colour is how the ball looks on average over its disc, about where the light adds up to one.
        self._albedo = to_light(np.array(colours, dtype=np.uint8), look.gamma)
        self._look = look
        lamp_inW = np.array(look.lamp_inW) / np.linalg.norm(look.lamp_inW)
        self._lamp_inC = camera.R_CtoW.T @ lamp_inW
        self._lamps = [(camera.in_camera(np.array([lamp.p_inW]))[0], _strength(lamp)) for lamp in look.lamps]
        self._up_inC = camera.R_CtoW[2]

    def paint(self, p_inC: Array, uv_px: Array, repainted: Sequence[tuple[int, Bgr]] = ()) -> list[list[Stamp | None]]:
        """Paint the balls at k instants.

        Args:
            p_inC: (k, balls, 3) centres [m].  uv_px: (k, balls, 2) their pixels.
            repainted: balls, by index, of another colour than their own.
        Returns:
            For each instant a stamp for each ball, None where it is out of sight.
        """
        instants, balls = p_inC.shape[:2]
        albedo = self._albedo.copy()
        for ball, bgr in repainted:
            albedo[ball] = to_light(np.array(bgr, dtype=np.uint8), self._look.gamma)
        stamps: list[Stamp | None] = [None] * (instants * balls)
        centres, radius_m = p_inC.reshape(-1, 3), np.tile(self._radius_m, instants)
        if (centres[:, 2] > 2.0 * radius_m).all():
            radius_px = radius_m * self._camera.focal_px / centres[:, 2]
            size = 2 * int(np.ceil(radius_px.max() + 1.0)) + 1
            corners = np.rint(uv_px.reshape(-1, 2)).astype(np.int64) - size // 2
            limit = np.array([self._camera.width_px, self._camera.height_px]) + MARGIN_PX - size
            inside = np.flatnonzero(((corners >= -MARGIN_PX) & (corners <= limit)).all(axis=1))
            if not len(inside):
                return [stamps[k * balls : (k + 1) * balls] for k in range(instants)]
            rays = self._rays.window(corners[inside], size)
            layers = self._trace(rays, centres[inside], inside % balls, albedo).reshape(-1, size, size, 4)
            for k, layer in zip(inside.tolist(), layers, strict=True):
                stamps[k] = Stamp(int(corners[k, 0]), int(corners[k, 1]), layer)
        return [stamps[k * balls : (k + 1) * balls] for k in range(instants)]

    def _trace(self, rays: tuple[Array, Array], p_inC: Array, which: NDArray[np.int64], albedo: Plane) -> Plane:
        """Meet rays x, y (k, n, s) with balls `which` (k,) at p_inC (k, 3); return colour and cover (k, n, 4).

        With ray d, centre c, b = d.c: the ray passes the centre at distance sqrt(c.c - b^2/d.d) and meets the sphere
        at t = (b - sqrt(b^2 - d.d (c.c - r^2))) / d.d. Cover falls over one sub-sample's width at the edge.
        """
        x, y = rays
        cx, cy, cz = (p_inC[:, i, None, None] for i in range(3))
        r = self._radius_m[which, None, None]
        dd = x * x + y * y + 1.0
        b = x * cx + y * cy + cz
        cc = cx * cx + cy * cy + cz * cz
        inside_m = r - np.sqrt(np.maximum(cc - b * b / dd, 0.0))
        cover = np.clip(inside_m * (_SUPERSAMPLING * self._camera.focal_px / cz) + 0.5, 0.0, 1.0)
        t = (b - np.sqrt(np.maximum(b * b - dd * (cc - r * r), 0.0))) / dd
        matt, mirror = self._shade(((t * x - cx) / r, (t * y - cy) / r, (t - cz) / r), p_inC)
        layer = np.empty((*x.shape[:2], 4), dtype=np.float32)
        layer[..., :3] = (cover * matt).mean(axis=2)[..., None] * albedo[which, None]
        layer[..., :3] += (cover * mirror).mean(axis=2)[..., None]
        layer[..., 3] = cover.mean(axis=2)
        return layer

    def _shade(self, normal: tuple[Array, Array, Array], p_inC: Array) -> tuple[Array, Array]:
        """Return matt and mirrored light (k, n, s). Source: Blinn, "Models of light reflection", SIGGRAPH 1977."""
        look, up = self._look, _dot(normal, self._up_inC)
        matt = look.ambient * (0.75 + 0.25 * up) + look.diffuse * np.maximum(_dot(normal, self._lamp_inC), 0.0)
        mirror = look.specular * _gloss(normal, self._lamp_inC, p_inC[0])
        for lamp_inC, strength_m2 in self._lamps:
            away = lamp_inC - p_inC
            distance_m = np.linalg.norm(away, axis=1)[:, None]
            facing = _dot(normal, (away / distance_m).T[:, :, None, None])
            share = strength_m2 / distance_m[:, :, None] ** 2
            matt += share * np.maximum(facing, 0.0)
            mirror += look.glossiness * share * _gloss(normal, away[0] / distance_m[0], p_inC[0])
        return matt, mirror


def _gloss(normal: tuple[Array, Array, Array], lamp_inC: Array, p_inC: Array) -> Array:
    """Return a lamp's mirror image (k, n, s) in a ball at p_inC (3,), 1 where it is brightest. lamp_inC: (3,) unit."""
    half = lamp_inC - p_inC / np.linalg.norm(p_inC)
    half /= np.linalg.norm(half)
    gloss = np.maximum(_dot(normal, half), 0.0) ** 2
    for _ in range(5):
        gloss = gloss * gloss
    return gloss


def _strength(lamp: Lamp) -> float:
    """Return a lamp's share of light at 1 m [m^2]."""
    return lamp.share * float(np.dot(lamp.p_inW, lamp.p_inW))


def _dot(v: tuple[Array, Array, Array], axis: Array) -> Array:
    """Return the scalar product of a field of vectors with one direction (3,), or one for each ball (3, k, 1, 1)."""
    return np.asarray(v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2])
