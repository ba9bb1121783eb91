"""The frame of a room: what cameras see of each other's balls tells it only up to a rigid motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tools.calibrate.room.rigid import rigid
from tools.calibrate.room.scene import Scene
from tools.calibrate.room.start import placed
from tracker.camera import Camera
from tracker.types import Array

LEVER_M = 1.5  # an error of 2 deg in a camera's attitude weighs as much as one of 52 mm in its place


def aligned(scene: Scene, cameras: Sequence[Camera]) -> Scene:
    """Return a scene, moved as a whole so that its cameras come nearest to given ones.

    Source: Kabsch's rigid motion between the cameras' places and points LEVER_M from them along their axes; two
        places alone would leave the turn about the line between them open.
    """
    return moved(scene, *rigid(_points(scene.cameras), _points(cameras)))


def moved(scene: Scene, R: Array, p: Array) -> Scene:
    """Return a scene in another frame: turned by R (3, 3), then moved by p (3,) [m]."""
    cameras = tuple(placed(camera, R @ camera.R_CtoW, R @ camera.p_CinW + p) for camera in scene.cameras)
    return replace(scene, cameras=cameras, p_BinW=scene.p_BinW @ R.T + p, R_BtoW=R @ scene.R_BtoW)


def _points(cameras: Sequence[Camera]) -> Array:
    return np.concatenate([np.vstack((camera.p_CinW, camera.p_CinW + LEVER_M * camera.R_CtoW.T)) for camera in cameras])
