"""A camera that was knocked, mended in flight as well as the room behind the vehicle tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from tracker.camera import Camera
from tracker.health.shift import Shift
from tracker.types import frozen_array

SHARE = 0.5  # of the picture's shift, one sigma: what is wrong with a ball still if the camera did not only turn


def turned(camera: Camera, shift: Shift) -> Camera:
    """Return the camera turned so that it sees the room where it was seen before.

    Whether it turned or went aside the room's picture hardly tells; a knock mostly turns, and only a turn moves balls
    and walls alike, wherever they are.
    """
    width, height = camera.width_px - 1, camera.height_px - 1
    corners_px = np.array([[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]])
    moved_px = shift.at(corners_px - np.array([width, height]) / 2.0)
    turn, _ = Rotation.align_vectors(camera.bearings(corners_px), camera.bearings(corners_px + moved_px))
    return replace(camera, R_CtoW=frozen_array(camera.R_CtoW @ turn.as_matrix()))
