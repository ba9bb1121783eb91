"""Things in the room besides the vehicle: look-alikes of balls, a hand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tracker.camera import Camera
from tracker.scene.airframe import Rod, RodPainter
from tracker.scene.ball import BallPainter, Bgr, RayMap, Stamp
from tracker.scene.look import Look
from tracker.types import Array

Place = tuple[float, float, float]

SKIN: Bgr = (118, 142, 198)
_PALM_RADIUS_M, _FINGER_RADIUS_M, _FINGER_M, _ARM_RADIUS_M, _ARM_M = 0.040, 0.008, 0.085, 0.035, 0.30


@dataclass(frozen=True, slots=True)
class Sphere:
    """A painted ball that stands at p_inW [m]."""

    p_inW: Place
    radius_m: float
    bgr: Bgr


@dataclass(frozen=True, slots=True)
class Bar:
    """A straight round bar from a to b, in W [m]."""

    a_inW: Place
    b_inW: Place
    radius_m: float
    bgr: Bgr


def hand(p_inW: Array, towards_inW: Array) -> tuple[Sphere | Bar, ...]:
    """Return a bare hand with its palm at p_inW (3,) [m], fingers spread about a direction (3,), the arm behind it."""
    along = towards_inW / np.linalg.norm(towards_inW)
    aside = np.cross(along, [0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [1.0, 0.0, 0.0])
    aside /= np.linalg.norm(aside)
    fingers = [along * np.cos(turn) + aside * np.sin(turn) for turn in (-0.5, -0.17, 0.17, 0.5, 1.1)]
    reach = _PALM_RADIUS_M + _FINGER_M
    bars = [Bar(_place(p_inW), _place(p_inW + reach * f), _FINGER_RADIUS_M, SKIN) for f in fingers]
    arm = Bar(_place(p_inW), _place(p_inW - (_PALM_RADIUS_M + _ARM_M) * along), _ARM_RADIUS_M, SKIN)
    return (Sphere(_place(p_inW), _PALM_RADIUS_M, SKIN), arm, *bars)


def _place(p_inW: Array) -> Place:
    x, y, z = p_inW.tolist()
    return x, y, z


class ThingPainter:
    """Paint things as one camera sees them."""

    def __init__(self, camera: Camera, rays: RayMap, look: Look) -> None:
        self._camera = camera
        self._rays = rays
        self._look = look

    def paint(self, things: Sequence[Sphere | Bar]) -> Iterator[tuple[float, Stamp]]:
        """Yield distance [m] and stamp of those in sight."""
        spheres = [thing for thing in things if isinstance(thing, Sphere)]
        if spheres:
            yield from self._spheres(spheres)
        for thing in things:
            if isinstance(thing, Bar):
                yield from self._bar(thing)

    def _spheres(self, spheres: Sequence[Sphere]) -> Iterator[tuple[float, Stamp]]:
        places = np.array([sphere.p_inW for sphere in spheres])
        p_inC, uv_px = self._camera.in_camera(places), self._camera.project(places)[0]
        seen = np.flatnonzero(np.isfinite(uv_px).all(axis=1)).tolist()
        radii_m, colours = [spheres[k].radius_m for k in seen], [spheres[k].bgr for k in seen]
        if seen:
            painter = BallPainter(self._camera, self._rays, radii_m, colours, self._look)
            for k, stamp in zip(seen, painter.paint(p_inC[None, seen], uv_px[None, seen])[0], strict=True):
                if stamp is not None:
                    yield float(np.linalg.norm(p_inC[k])), stamp

    def _bar(self, bar: Bar) -> Iterator[tuple[float, Stamp]]:
        ends = np.array([bar.a_inW, bar.b_inW])
        p_inC, uv_px = self._camera.in_camera(ends), self._camera.project(ends)[0]
        if not np.isfinite(uv_px).all():
            return
        light = self._look.on_average
        painter = RodPainter(self._camera, Rod(ends[0], ends[1], bar.radius_m, bar.bgr), light, self._look.gamma)
        stamps = painter.paint(uv_px[None], float(p_inC[:, 2].mean()))
        if stamps is not None:
            yield float(np.linalg.norm(p_inC.mean(axis=0))), stamps[0]
