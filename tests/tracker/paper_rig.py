"""The paper's rig, with lenses that distort a little: sections 2.3 and 4.1."""

from __future__ import annotations

import math

import numpy as np

from tracker.camera import Camera, make_camera
from tracker.rig import Ball, Colour, Rig, make_marker, make_rig
from tracker.types import frozen_array

BASELINE_M = 4.5
FOCAL_PX = 320.0 / math.tan(math.radians(15.0))
SPACING_M = 0.16


def paper_camera(name: str, azimuth_deg: float, distortion: tuple[float, ...], polar_deg: float = 45.0) -> Camera:
    """Return a camera on the half circle of right-angled convergence that looks at the room's origin, image level."""
    azimuth, polar = math.radians(azimuth_deg), math.radians(polar_deg)
    outwards = np.array([math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)])
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    T_CtoW = np.eye(4)
    T_CtoW[:3, :3] = np.column_stack((right, np.cross(-outwards, right), -outwards))
    T_CtoW[:3, 3] = BASELINE_M / math.sqrt(2.0) * outwards
    return make_camera(name, (640, 480), (FOCAL_PX, FOCAL_PX, 319.5, 239.5), distortion, T_CtoW)


def paper_rig() -> Rig:
    """Return the two cameras and the three balls, the marker's mean the body's origin."""
    low, high = -SPACING_M / (2.0 * math.sqrt(3.0)), SPACING_M / math.sqrt(3.0)
    balls = (
        _ball("yellow", (-0.08, low, 0.0), Colour(56.0, 16.0, 0.35, 0.15, (24, 186, 198))),
        _ball("green", (0.08, low, 0.0), Colour(128.0, 36.0, 0.35, 0.15, (50, 157, 33))),
        _ball("orange", (0.0, high, 0.0), Colour(23.0, 16.0, 0.35, 0.15, (17, 91, 205))),
    )
    cameras = (
        paper_camera("cam0", 45.0, (-0.095, 0.023, 0.00017, -0.00038)),
        paper_camera("cam1", -135.0, (-0.102, 0.019, 0.00017, 0.00045)),
    )
    return make_rig(cameras, make_marker(balls))


def _ball(name: str, p_inB: tuple[float, float, float], colour: Colour) -> Ball:
    return Ball(name, frozen_array(p_inB), 0.0075, colour)
