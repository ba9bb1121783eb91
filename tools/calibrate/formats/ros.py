"""ROS camera_info YAML, one camera a file.

Source: sensor_msgs/CameraInfo and camera_calibration_parsers: plumb_bob has k1 k2 t1 t2 k3, rational_polynomial
eight in OpenCV's order. Pixel centres are at integers. Poses it has none, so that they are lost.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tools.calibrate.formats.fields import read_yaml, write_text
from tracker.camera import Camera, make_camera
from tracker.types import Array

COUNTS = {"plumb_bob": (4, 5), "rational_polynomial": (8,)}


def read_ros(path: Path) -> Camera:
    """Read one camera.

    Raises:
        OperatorError: not as ROS writes it, or a model we cannot represent.
    """
    fields = read_yaml(path)
    model = fields.model("distortion_model", tuple(COUNTS))
    size = int(fields.numbers("image_width", 1)[0]), int(fields.numbers("image_height", 1)[0])
    K = fields.numbers("camera_matrix", 9).reshape(3, 3)
    distortion = fields.numbers("distortion_coefficients", *COUNTS[model])
    name = str(fields.table.get("camera_name") or path.stem)
    return make_camera(name, size, (K[0, 0], K[1, 1], K[0, 2], K[1, 2]), tuple(distortion), np.eye(4))


def write_ros(camera: Camera, path: Path) -> None:
    """Write one camera, unrectified.

    Raises:
        OperatorError: the file cannot be written.
    """
    many = len(camera.distortion) == 8
    coefficients = camera.distortion if many else np.resize(np.append(camera.distortion, 0.0), 5)
    document = {
        "image_width": camera.width_px,
        "image_height": camera.height_px,
        "camera_name": camera.name,
        "camera_matrix": _matrix(camera.K),
        "distortion_model": "rational_polynomial" if many else "plumb_bob",
        "distortion_coefficients": _matrix(coefficients[None]),
        "rectification_matrix": _matrix(np.eye(3)),
        "projection_matrix": _matrix(np.column_stack((camera.K, np.zeros(3)))),
    }
    write_text(path, yaml.safe_dump(document, default_flow_style=None, sort_keys=False, width=200))


def _matrix(values: Array) -> dict[str, Any]:
    return {"rows": values.shape[0], "cols": values.shape[1], "data": values.ravel().tolist()}
