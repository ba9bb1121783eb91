"""Cameras in a room, what they are good for, and what a step aside would change."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tools.place.limits import Limits
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.placement.forecast import Forecast, forecast
from tracker.placement.mount import Lens, aimed
from tracker.placement.views import Poses, attitudes_within, look, poses_of
from tracker.types import Array, frozen_array

FINE, COARSE = (8, 8), (4, 4)
"""Steps along the volume's longest side, and headings."""


@dataclass(frozen=True, slots=True)
class Figures:
    """A layout in six numbers.

    covered: share of the poses of which two cameras have every ball in the picture.
    clear: share of all poses at which two cameras see every ball, none behind another.
    position_mm, attitude_deg: expected rms error over the covered poses, from one instant's pictures.
    worst_position_mm, worst_attitude_deg: the same at the volume's worst point.
    """

    covered: float
    clear: float
    position_mm: float
    worst_position_mm: float
    attitude_deg: float
    worst_attitude_deg: float


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """A layout's figures, and behind them each pose's forecast."""

    poses: Poses
    expected: Forecast

    def per_point(self, values: Array) -> Array:
        """Return the rms (points,) of values (s,) over the covered poses of each point; NaN where none is."""
        covered = self.poses.by_point(self.expected.covered.astype(np.float64))
        squares = np.where(covered > 0.0, self.poses.by_point(values) ** 2, 0.0)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.sqrt(squares.sum(axis=1) / covered.sum(axis=1)))

    @property
    def points(self) -> Array:
        """Return the points (n, 3) [m]."""
        return self.poses.p_BinW[:: len(self.poses) // self.poses.points]

    @property
    def coverage(self) -> Array:
        """Return the share of covered attitudes at each point (n,)."""
        return np.asarray(self.poses.by_point(self.expected.covered.astype(np.float64)).mean(axis=1))

    @property
    def figures(self) -> Figures:
        """Return the six numbers; NaN for errors where nothing is covered."""
        covered, expected = self.expected.covered, self.expected
        if not covered.any():
            return Figures(0.0, 0.0, *(math.nan,) * 4)
        position_mm, attitude_deg = 1e3 * expected.position_m, np.degrees(expected.attitude_rad)
        return Figures(
            float(covered.mean()),
            float(expected.clear.mean()),
            _rms(position_mm[covered]),
            float(np.nanmax(self.per_point(position_mm))),
            _rms(attitude_deg[covered]),
            float(np.nanmax(self.per_point(attitude_deg))),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Move:
    """A camera, by its index, moved by a step (3,) in W [m], and the figures before and after."""

    camera: int
    step_m: Array
    before: Figures
    after: Figures
    leaves_room: bool


def survey(cameras: Sequence[Camera], limits: Limits, detail: tuple[int, int] = FINE) -> Survey:
    """Forecast the pose's errors all over the volume."""
    steps, yaws = detail
    extent = limits.volume.high - limits.volume.low
    poses = poses_of(limits.volume.points(float(extent.max()) / steps), attitudes_within(limits.tilt_rad, yaws))
    views = [look(camera, limits.marker, poses, limits.sharpness) for camera in cameras]
    return Survey(poses, forecast(views, limits.marker, poses))


def moved(camera: Camera, step_m: Array, limits: Limits) -> Camera:
    """Return a camera a step aside (3,) [m], level, turned to look at the same point.

    That point is the one on its optical axis nearest the volume's middle.
    """
    target = aim_point(camera, limits)
    place = camera.p_CinW + step_m
    lens = Lens(view_deg(camera), camera.width_px, camera.height_px)
    turned = aimed("", place, target, lens).camera(camera.name)
    return replace(camera, p_CinW=frozen_array(place), R_CtoW=turned.R_CtoW)


def aim_point(camera: Camera, limits: Limits) -> Array:
    """Return the point (3,) of the optical axis nearest the volume's middle, at least 0.1 m ahead [m]."""
    ahead = camera.R_CtoW[:, 2]
    return np.asarray(camera.p_CinW + max(0.1, float((limits.volume.centre - camera.p_CinW) @ ahead)) * ahead)


def what_if(cameras: Sequence[Camera], limits: Limits, moves: Sequence[tuple[int, Array]]) -> list[Move]:
    """Survey the layout with one camera moved at a time, on a coarse grid."""
    before = survey(cameras, limits, COARSE).figures
    answers = []
    for index, step_m in moves:
        changed = [moved(c, step_m, limits) if k == index else c for k, c in enumerate(cameras)]
        after = survey(changed, limits, COARSE).figures
        answers.append(Move(index, step_m, before, after, not limits.room.holds(changed[index].p_CinW)))
    return answers


def every_move(count: int, step_m: float) -> list[tuple[int, Array]]:
    """Return a step forth and back along each axis for each of so many cameras."""
    steps = [sign * step_m * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    return [(camera, step) for camera in range(count) for step in steps]


def asked_move(text: str, cameras: Sequence[Camera], limits: Limits) -> tuple[int, Array]:
    """Read `cam1:0.5,0,0`.

    Raises:
        OperatorError: no such camera, not three numbers, or a place outside the room.
    """
    names = [camera.name for camera in cameras]
    name, _, numbers = text.partition(":")
    if name not in names:
        raise OperatorError(f"--move: no camera {name!r}; known are {', '.join(names)}")
    try:
        step_m = np.array([float(part) for part in numbers.split(",")])
    except ValueError:
        step_m = np.empty(0)
    if step_m.shape != (3,) or not np.isfinite(step_m).all():
        raise OperatorError(f"--move: {text!r} must be a camera and three metres, such as {name}:0.5,0,0; correct it")
    index = names.index(name)
    place = cameras[index].p_CinW + step_m
    if not limits.room.holds(place):
        where = ", ".join(f"{x:g}" for x in place)
        raise OperatorError(f"--move: {name} would stand at {where} m, outside the room; give a shorter step")
    return index, step_m


def view_deg(camera: Camera) -> float:
    """Return the horizontal field of view [deg]."""
    return math.degrees(2.0 * math.atan(camera.width_px / 2.0 / float(camera.K[0, 0])))


def _rms(values: Array) -> float:
    return float(np.sqrt((values**2).mean()))
