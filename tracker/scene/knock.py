"""A camera that was knocked: where it stands afterwards, and how it then sees the room."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from tracker.camera import Camera
from tracker.maths import so3
from tracker.scene.sensor import Plane
from tracker.scene.trouble import Knock
from tracker.types import frozen_array

WALL_M = 5.0  # from the camera to the wall that the backdrop is painted on


def knocked(camera: Camera, knock: Knock) -> Camera:
    """Return the camera as it stands after a knock."""
    R_CtoW = camera.R_CtoW @ so3.exp(np.radians(knock.turn_deg))
    p_CinW = camera.p_CinW + camera.R_CtoW @ (np.array(knock.shift_mm) * 1e-3)
    return replace(camera, R_CtoW=frozen_array(R_CtoW), p_CinW=frozen_array(p_CinW))


def seen_from(room: Plane, before: Camera, after: Camera) -> Plane:
    """Return a camera's picture (h, w, 3) of the room as the same camera takes it from elsewhere.

    The room is a wall, WALL_M before the camera and square to its axis; past the picture's border it goes on as there.
    """
    height, width = room.shape[:2]
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2).astype(np.float64)
    origin_m = before.in_camera(after.p_CinW[None])[0]
    rays = after.bearings(pixels) @ (before.R_CtoW.T @ after.R_CtoW).T
    on_wall_m = origin_m + rays * ((WALL_M - origin_m[2]) / rays[:, 2:])
    places, _ = cv2.projectPoints(on_wall_m, np.zeros(3), np.zeros(3), before.K, before.distortion)
    u, v = np.moveaxis(np.asarray(places, dtype=np.float32).reshape(height, width, 2), 2, 0)
    moved = cv2.remap(room, u, v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(np.maximum(moved, 0.0), dtype=np.float32)
