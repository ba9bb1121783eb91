"""Poses of cameras to one another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tracker.camera import Camera
from tracker.types import Array


def pose_of(camera: Camera) -> Array:
    """Return T_CtoW (4, 4) [m]."""
    T_CtoW = np.eye(4)
    T_CtoW[:3, :3] = camera.R_CtoW
    T_CtoW[:3, 3] = camera.p_CinW
    return T_CtoW


def inverse(T: Array) -> Array:
    """Return the inverse of a pose (4, 4)."""
    back = np.eye(4)
    back[:3, :3] = T[:3, :3].T
    back[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return back


def placed(cameras: Sequence[Camera]) -> bool:
    """Say whether the cameras' poses are known: all in the room's origin is how intrinsics alone are kept."""
    return any(not np.array_equal(pose_of(camera), np.eye(4)) for camera in cameras)
