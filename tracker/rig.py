"""What is looked at and from where: the marker's balls and the room's cameras."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.types import Array, frozen_array

COLLINEAR_LIMIT_M = 0.005
LEAST_RADIUS_M = 0.001
LARGEST_ROOM_M = 200.0
MIN_CAMERAS, MAX_CAMERAS = 2, 8


@dataclass(frozen=True, slots=True)
class Colour:
    """What a ball's paint looks like, as a box in HSV.

    hue_deg: centre of the hue [deg, 0 red, 120 green].  hue_tolerance_deg: half width of the accepted hues [deg].
    saturation_min, value_min: least saturation and value, 0..1.
    bgr: the paint's typical colour, 0..255, for drawing and for simulated balls.
    """

    hue_deg: float
    hue_tolerance_deg: float
    saturation_min: float
    value_min: float
    bgr: tuple[int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class Ball:
    """One painted ball: its centre p_inB (3,) [m], its radius [m] and its paint."""

    name: str
    p_inB: Array
    radius_m: float
    colour: Colour


@dataclass(frozen=True, slots=True, eq=False)
class Marker:
    """The rigid set of balls on the vehicle. points_inB: (n, 3) centres in B [m]."""

    balls: tuple[Ball, ...]
    points_inB: Array

    def __len__(self) -> int:
        return len(self.balls)


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """The cameras of a room and the marker they watch."""

    cameras: tuple[Camera, ...]
    marker: Marker


def make_marker(balls: tuple[Ball, ...]) -> Marker:
    """Check the balls and make a marker of them.

    Raises:
        OperatorError: fewer than three balls, a name twice, a radius of no ball, balls in each other, balls in a line.
    """
    names = [ball.name for ball in balls]
    if len(balls) < 3:
        raise OperatorError(f"marker: {len(balls)} balls; at least 3 are needed for an attitude; add [[marker.balls]]")
    if len(set(names)) != len(names):
        raise OperatorError(f"marker: ball names {', '.join(names)} must differ; rename one")
    for ball in balls:
        if not ball.radius_m >= LEAST_RADIUS_M:
            raise OperatorError(
                f"marker: ball {ball.name} has radius {ball.radius_m * 1e3:g} mm, at least {LEAST_RADIUS_M * 1e3:g} mm "
                "can be seen; radius_mm is in millimetres: correct it"
            )
    _refuse_overlaps(balls)
    points = frozen_array([ball.p_inB for ball in balls])
    width = float(np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1])
    if width < COLLINEAR_LIMIT_M:
        raise OperatorError(
            f"marker: the balls lie in a line within {width * 1e3:.2g} mm, limit {COLLINEAR_LIMIT_M * 1e3:g} mm; "
            "roll about that line cannot be seen: move one ball aside"
        )
    return Marker(balls, points)


def _refuse_overlaps(balls: tuple[Ball, ...]) -> None:
    """Refuse balls that stand in each other, as they do when metres are given for millimetres."""
    for one, other in combinations(balls, 2):
        apart_m = float(np.linalg.norm(np.subtract(one.p_inB, other.p_inB)))
        if apart_m < one.radius_m + other.radius_m:
            raise OperatorError(
                f"marker: the centres of {one.name} and {other.name} are {apart_m * 1e3:.3g} mm apart, their radii "
                f"need {(one.radius_m + other.radius_m) * 1e3:.3g} mm; position_mm and radius_mm are in millimetres: "
                "correct them"
            )


def make_rig(cameras: tuple[Camera, ...], marker: Marker) -> Rig:
    """Put cameras and marker together.

    Raises:
        OperatorError: fewer than two or more than eight cameras, or cameras that stand in no one room.
    """
    if not MIN_CAMERAS <= len(cameras) <= MAX_CAMERAS:
        raise OperatorError(
            f"rig: {len(cameras)} cameras; {MIN_CAMERAS} to {MAX_CAMERAS} work; name them in [[rig.cameras]]"
        )
    for one, other in combinations(cameras, 2):
        apart_m = float(np.linalg.norm(one.p_CinW - other.p_CinW))
        if apart_m > LARGEST_ROOM_M:
            raise OperatorError(
                f"rig: {one.name} and {other.name} stand {apart_m:.4g} m apart, limit {LARGEST_ROOM_M:g} m; "
                "T_CtoW and T_BS are in metres: correct them"
            )
    return Rig(cameras, marker)
