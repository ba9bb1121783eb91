"""Kalibr's camchain.yaml.

Source: Kalibr's wiki, "YAML formats": `T_cn_cnm1` turns points of the camera before into this one's coordinates;
`distortion_coeffs` of radtan are k1 k2 p1 p2; `intrinsics` of pinhole are fu fv pu pv. Pixel centres are at integers.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tools.calibrate.formats.fields import Fields, read_yaml, write_text
from tools.calibrate.formats.poses import inverse, placed, pose_of
from tracker.camera import Camera, make_camera
from tracker.errors import OperatorError
from tracker.types import Array

COEFFICIENTS = 4


def read_kalibr(path: Path) -> tuple[Camera, ...]:
    """Read a camera chain; camera 0 is the room's origin.

    Raises:
        OperatorError: not as Kalibr writes it, or a model we cannot represent.
    """
    document = read_yaml(path)
    T_CtoW: Array = np.eye(4)
    cameras = []
    for k in range(sum(key.startswith("cam") for key in document.table)):
        fields = document.sub(f"cam{k}")
        if k and "T_cn_cnm1" in fields:
            T_CtoW = T_CtoW @ inverse(fields.numbers("T_cn_cnm1", 16).reshape(4, 4))
        cameras.append(_camera(fields, f"cam{k}", T_CtoW))
    if not cameras:
        raise OperatorError(f"{path}: holds no cam0; give Kalibr's camchain.yaml")
    return tuple(cameras)


def write_kalibr(cameras: Sequence[Camera], path: Path) -> None:
    """Write a camera chain; where the room lies is lost.

    Raises:
        OperatorError: distortion beyond Kalibr's radtan, or a file that cannot be written.
    """
    chain: dict[str, dict[str, Any]] = {}
    for k, camera in enumerate(cameras):
        entry: dict[str, Any] = {
            "camera_model": "pinhole",
            "intrinsics": [float(camera.K[i, j]) for i, j in ((0, 0), (1, 1), (0, 2), (1, 2))],
            "distortion_model": "radtan",
            "distortion_coeffs": _four(camera),
            "resolution": [camera.width_px, camera.height_px],
            "rostopic": f"/{camera.name}/image_raw",
        }
        if k and placed(cameras):
            entry["T_cn_cnm1"] = (inverse(pose_of(camera)) @ pose_of(cameras[k - 1])).tolist()
        chain[f"cam{k}"] = entry
    write_text(path, yaml.safe_dump(chain, default_flow_style=None, sort_keys=True, width=200))


def _camera(fields: Fields, name: str, T_CtoW: Array) -> Camera:
    fields.model("camera_model", ("pinhole",))
    fields.model("distortion_model", ("radtan", "none"))
    fx, fy, cx, cy = fields.numbers("intrinsics", 4)
    width, height = fields.numbers("resolution", 2)
    distortion = np.zeros(COEFFICIENTS)
    if fields.get("distortion_model") == "radtan":
        distortion = fields.numbers("distortion_coeffs", COEFFICIENTS)
    return make_camera(name, (int(width), int(height)), (fx, fy, cx, cy), tuple(distortion), T_CtoW)


def _four(camera: Camera) -> list[float]:
    beyond = camera.distortion[COEFFICIENTS:]
    if np.any(beyond != 0.0):
        raise OperatorError(
            f"{camera.name}: {len(camera.distortion)} distortion coefficients, Kalibr's radtan has {COEFFICIENTS}; "
            "calibrate with --coefficients 4, or write another format"
        )
    return [float(x) for x in camera.distortion[:COEFFICIENTS]]
