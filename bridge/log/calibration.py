"""Cameras and marker as a log's attachment: what the tracker really used, whatever files it came from."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from tracker.camera import Camera, make_camera
from tracker.errors import OperatorError
from tracker.rig import Marker
from tracker.types import frozen_array

CALIBRATION_ATTACHMENT = "calibration.json"


def calibration_json(cameras: tuple[Camera, ...], marker: Marker) -> bytes:
    """Return cameras and marker as JSON text; every number reads back as it was."""
    content = {
        "cameras": [
            {
                "name": camera.name,
                "resolution_px": [camera.width_px, camera.height_px],
                "K_px": camera.K.tolist(),
                "distortion": camera.distortion.tolist(),
                "R_CtoW": camera.R_CtoW.tolist(),
                "p_CinW_m": camera.p_CinW.tolist(),
            }
            for camera in cameras
        ],
        "marker": [
            {"name": ball.name, "p_inB_m": ball.p_inB.tolist(), "radius_m": ball.radius_m} for ball in marker.balls
        ],
    }
    return json.dumps(content, indent=1).encode()


def cameras_of(data: bytes, where: str) -> tuple[Camera, ...]:
    """Read the cameras back, bit for bit.

    where: names the log in a complaint.
    Raises:
        OperatorError: not what `calibration_json` writes, or a calibration that cannot be.
    """
    try:
        return tuple(_camera(value) for value in json.loads(data)["cameras"])
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise OperatorError(f"{where}: its calibration cannot be read ({error}); the log is damaged") from error


def _camera(value: dict[str, object]) -> Camera:
    K, R_CtoW, p_CinW = (np.array(value[key], dtype=np.float64) for key in ("K_px", "R_CtoW", "p_CinW_m"))
    T_CtoW = np.eye(4)
    T_CtoW[:3, :3], T_CtoW[:3, 3] = R_CtoW, p_CinW
    width_px, height_px = np.array(value["resolution_px"]).tolist()
    intrinsics = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
    distortion = tuple(np.array(value["distortion"], dtype=np.float64).tolist())
    camera = make_camera(str(value["name"]), (width_px, height_px), intrinsics, distortion, T_CtoW)
    # It was made orthonormal before it was written; doing so again would change its last bits.
    return replace(camera, R_CtoW=frozen_array(R_CtoW))
