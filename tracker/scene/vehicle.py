"""The whole vehicle over an exposure, as one layer to lay over a backdrop."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tracker.camera import Camera
from tracker.rig import Marker
from tracker.scene.airframe import RodPainter, RotorPainter, airframe
from tracker.scene.ball import BallPainter, Bgr, RayMap, Stamp
from tracker.scene.look import Look
from tracker.scene.sensor import Plane
from tracker.scene.thing import ThingPainter
from tracker.scene.trouble import NO_TROUBLE, Trouble
from tracker.types import Array

Pose = tuple[Array, Array]
"""Where the vehicle is: p_BinW (3,) [m] and R_BtoW (3, 3)."""

_BLUR_MARGIN_PX = 3


class VehiclePainter:
    """Paint balls, tubes and airframe in the order of their distance.

    Balls and the tubes that touch them move over the exposure; the rest of the airframe is drawn once, at its middle,
    behind them or before them, which leaves the balls' pictures as they are.
    """

    def __init__(self, camera: Camera, marker: Marker, look: Look) -> None:
        rods = airframe(marker)
        light = look.on_average
        self._camera = camera
        rays = RayMap(camera)
        radii_m, colours = [ball.radius_m for ball in marker.balls], [ball.colour.bgr for ball in marker.balls]
        self._balls = BallPainter(camera, rays, radii_m, colours, look)
        self._things = ThingPainter(camera, rays, look)
        self._tubes = [RodPainter(camera, rod, light, look.gamma) for rod in rods if rod.ball is not None]
        self._body = [RodPainter(camera, rod, light, look.gamma) for rod in rods if rod.ball is None]
        self._rotor = RotorPainter(camera, marker, look.gamma)
        ends = [end for rod in rods for end in (rod.a_inB, rod.b_inB)]
        self._points_inB = np.concatenate((marker.points_inB, np.array(ends), self._rotor.rim_inB))
        first, second = len(marker), len(marker) + 2 * len(self._tubes)
        self._parts = (first, second, second + 2 * len(self._body))

    def paint(self, poses: Sequence[Pose], trouble: Trouble = NO_TROUBLE) -> Stamp | None:
        """Paint the vehicle's mean over the poses and the things about it; None where none of it is in sight.

        What is farther than the marker goes behind the vehicle, what is nearer before it.
        """
        places = np.concatenate([self._points_inB @ R_BtoW.T + p_BinW for p_BinW, R_BtoW in poses])
        p_inC = self._camera.in_camera(places).reshape(len(poses), -1, 3)
        uv_px = self._camera.project(places)[0].reshape(len(poses), -1, 2)
        if not np.isfinite(uv_px).all():
            return None
        moving = self._moving(p_inC, uv_px, trouble.repainted)
        middle = len(poses) // 2
        body = [*self._still(p_inC[middle], uv_px[middle]), *self._things.paint(trouble.things)]
        hub_m = float(np.linalg.norm(p_inC[middle, : self._parts[0]], axis=1).mean())
        frame = self._frame([stamp for instant in moving for stamp in instant] + [stamp for _, stamp in body])
        if frame is None:
            return None
        for range_m, stamp in body:
            if range_m > hub_m:
                _lay_over(frame, stamp)
        _lay_over(frame, _mean(moving, frame))
        for range_m, stamp in body:
            if range_m <= hub_m:
                _lay_over(frame, stamp)
        return frame

    def _moving(self, p_inC: Array, uv_px: Array, repainted: Sequence[tuple[int, Bgr]]) -> list[list[Stamp]]:
        """Return for each instant the balls and tubes in sight, farthest first."""
        first, second, _ = self._parts
        balls = self._balls.paint(p_inC[:, :first], uv_px[:, :first], repainted)
        tubes = [
            painter.paint(uv_px[:, k : k + 2], float(p_inC[0, k, 2]))
            for k, painter in zip(range(first, second, 2), self._tubes, strict=True)
        ]
        range_m = np.linalg.norm(p_inC[:, :second], axis=2)
        # A tube goes before or behind its ball as a whole, by the end that touches it.
        touching_m = range_m[:, first + 1 :: 2]
        order = np.argsort(-np.concatenate((range_m[:, :first], touching_m), axis=1), axis=1).tolist()
        layers = []
        for k, instant in enumerate(order):
            pieces = balls[k] + [None if tube is None else tube[k] for tube in tubes]
            layers.append([piece for piece in (pieces[index] for index in instant) if piece is not None])
        return layers

    def _still(self, p_inC: Array, uv_px: Array) -> Iterator[tuple[float, Stamp]]:
        """Yield distance [m] and stamp of the airframe's other pieces in sight, the rotor last."""
        _, second, third = self._parts
        for k, painter in zip(range(second, third, 2), self._body, strict=True):
            stamps = painter.paint(uv_px[None, k : k + 2], float(p_inC[k, 2]))
            if stamps is not None:
                yield float(np.linalg.norm(p_inC[k : k + 2].mean(axis=0))), stamps[0]
        rotor = self._rotor.paint(uv_px[third:])
        if rotor is not None:
            yield float(np.linalg.norm(p_inC[third:].mean(axis=0))), rotor

    def _frame(self, stamps: Sequence[Stamp]) -> Stamp | None:
        """Return an empty layer within the image that holds all stamps and their blur; None if that is nothing."""
        if not stamps:
            return None
        u0 = max(min(stamp.u_px for stamp in stamps) - _BLUR_MARGIN_PX, 0)
        v0 = max(min(stamp.v_px for stamp in stamps) - _BLUR_MARGIN_PX, 0)
        u1 = min(max(stamp.u_px + stamp.layer.shape[1] for stamp in stamps) + _BLUR_MARGIN_PX, self._camera.width_px)
        v1 = min(max(stamp.v_px + stamp.layer.shape[0] for stamp in stamps) + _BLUR_MARGIN_PX, self._camera.height_px)
        if u0 >= u1 or v0 >= v1:
            return None
        return Stamp(u0, v0, np.zeros((v1 - v0, u1 - u0, 4), dtype=np.float32))


def _mean(instants: Sequence[Sequence[Stamp]], frame: Stamp) -> Stamp:
    """Lay each instant's stamps over one another and return the layers' mean, in the frame's place."""
    total: Plane = np.zeros_like(frame.layer)
    for stamps in instants:
        layer = Stamp(frame.u_px, frame.v_px, np.zeros_like(frame.layer))
        for stamp in stamps:
            _lay_over(layer, stamp)
        total += layer.layer
    return Stamp(frame.u_px, frame.v_px, total * np.float32(1.0 / len(instants)))


def _lay_over(under: Stamp, stamp: Stamp) -> None:
    """Lay a stamp over another, in place; what is outside falls away."""
    u, v = stamp.u_px - under.u_px, stamp.v_px - under.v_px
    height, width = stamp.layer.shape[:2]
    top, left = max(-v, 0), max(-u, 0)
    bottom, right = min(height, under.layer.shape[0] - v), min(width, under.layer.shape[1] - u)
    if top >= bottom or left >= right:
        return
    source = stamp.layer[top:bottom, left:right]
    target = under.layer[v + top : v + bottom, u + left : u + right]
    target *= 1.0 - source[..., 3:]
    target += source
