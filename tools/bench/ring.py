"""Nominal cameras in a ring round the room, all looking at its origin."""

from __future__ import annotations

import math

import numpy as np

from tracker.camera import Camera, make_camera
from tracker.rig import Marker, Rig, make_rig

SIZE_PX = (640, 480)


def ring_rig(
    marker: Marker,
    count: int = 2,
    *,
    spread_deg: float = 360.0,
    polar_deg: float = 45.0,
    distance_m: float = 3.182,
    view_deg: float = 30.0,
) -> Rig:
    """Return 2 to 8 cameras round a marker.

    Args:
        spread_deg: the cameras stand this far round, the first at an azimuth of 45 deg; 360 closes the ring.
        polar_deg: from straight above.  distance_m: from the origin.  view_deg: horizontal field of view.
    With the defaults and two cameras it is the paper's rig (sections 2.3 and 4.1), with a little distortion.
    """
    step_deg = spread_deg / count if spread_deg >= 360.0 else spread_deg / (count - 1)
    cameras = (_camera(f"cam{k}", 45.0 + k * step_deg, polar_deg, distance_m, view_deg) for k in range(count))
    return make_rig(tuple(cameras), marker)


def _camera(name: str, azimuth_deg: float, polar_deg: float, distance_m: float, view_deg: float) -> Camera:
    azimuth, polar = math.radians(azimuth_deg), math.radians(polar_deg)
    outwards = np.array([math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)])
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    T_CtoW = np.eye(4)
    T_CtoW[:3, :3] = np.column_stack((right, np.cross(-outwards, right), -outwards))
    T_CtoW[:3, 3] = distance_m * outwards
    width, height = SIZE_PX
    focal_px = width / 2.0 / math.tan(math.radians(view_deg / 2.0))
    centre_px = ((width - 1) / 2.0, (height - 1) / 2.0)
    return make_camera(name, SIZE_PX, (focal_px, focal_px, *centre_px), (-0.1, 0.02, 0.0002, -0.0004), T_CtoW)
