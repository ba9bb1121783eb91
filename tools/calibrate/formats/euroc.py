"""EuRoC/ASL sensor.yaml, one camera a file, written; `tracker.sources.sensor_yaml` reads it."""

from __future__ import annotations

from pathlib import Path

import yaml

from tools.calibrate.formats.fields import write_text
from tools.calibrate.formats.poses import pose_of
from tracker.camera import Camera


def write_euroc(camera: Camera, path: Path) -> None:
    """Write one camera; T_BS is its pose in the room.

    Raises:
        OperatorError: the file cannot be written.
    """
    document = {
        "sensor_type": "camera",
        "comment": f"{camera.name}, calibrated by posebridge",
        "T_BS": {"cols": 4, "rows": 4, "data": pose_of(camera).ravel().tolist()},
        "resolution": [camera.width_px, camera.height_px],
        "camera_model": "pinhole",
        "intrinsics": [float(camera.K[i, j]) for i, j in ((0, 0), (1, 1), (0, 2), (1, 2))],
        "distortion_model": "radial-tangential",
        "distortion_coefficients": camera.distortion.tolist(),
    }
    write_text(path, yaml.safe_dump(document, default_flow_style=None, sort_keys=False, width=200))
