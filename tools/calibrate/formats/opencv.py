"""OpenCV FileStorage, YAML or XML, with the names that OpenCV's own samples use.

One camera, as `calibration` writes it: image_width, image_height, camera_matrix, distortion_coefficients. Two, as
`stereo_calib` writes them: M1 D1 M2 D2, and R T with X_2 = R X_1 + T. That sample writes no image size, so it is
asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from tools.calibrate.formats.fields import RADIAL_TANGENTIAL
from tools.calibrate.formats.poses import inverse, placed, pose_of
from tracker.camera import Camera, make_camera
from tracker.errors import OperatorError
from tracker.types import Array

Size = tuple[int, int]


def read_opencv(path: Path, size_px: Size | None = None) -> tuple[Camera, ...]:
    """Read one camera or two; camera 0 is the room's origin.

    Args:
        size_px: (width, height), for files that do not tell.
    Raises:
        OperatorError: no such file, no FileStorage, no camera in it, or one we cannot represent.
    """
    storage = _opened(path, cv2.FILE_STORAGE_READ)
    try:
        return _cameras(storage, path, size_px)
    finally:
        storage.release()


def write_opencv(cameras: Sequence[Camera], path: Path) -> None:
    """Write one camera or two.

    Raises:
        OperatorError: more than two, or a file that cannot be written.
    """
    if len(cameras) > 2:
        raise OperatorError(
            f"{path}: OpenCV's samples know one camera or two, not {len(cameras)}; write kalibr or toml"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    storage = _opened(path, cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", cameras[0].width_px)
    storage.write("image_height", cameras[0].height_px)
    names = ("camera_matrix", "distortion_coefficients") if len(cameras) == 1 else ("M{}", "D{}")
    for number, camera in enumerate(cameras, 1):
        storage.write(names[0].format(number), camera.K)
        storage.write(names[1].format(number), camera.distortion.reshape(1, -1))
    if len(cameras) == 2 and placed(cameras):
        T_C0toC1 = inverse(pose_of(cameras[1])) @ pose_of(cameras[0])
        storage.write("R", T_C0toC1[:3, :3].copy())
        storage.write("T", T_C0toC1[:3, 3:].copy())
    storage.release()


def _opened(path: Path, mode: int) -> cv2.FileStorage:
    if mode == cv2.FILE_STORAGE_READ and not path.is_file():
        raise OperatorError(f"{path}: no such file; check the path")
    try:
        storage = cv2.FileStorage(str(path), mode)
    except (cv2.error, SystemError) as error:
        raise OperatorError(f"{path}: is no OpenCV FileStorage; give one that ends in .yml, .yaml or .xml") from error
    if not storage.isOpened():
        raise OperatorError(f"{path}: OpenCV cannot open it; name a .yml, .yaml or .xml in a folder that exists")
    return storage


def _cameras(storage: cv2.FileStorage, path: Path, size_px: Size | None) -> tuple[Camera, ...]:
    if not storage.getNode("fisheye_model").empty() and storage.getNode("fisheye_model").real():
        raise OperatorError(f"{path}: fisheye_model cannot be represented here; {RADIAL_TANGENTIAL}")
    width, height = (storage.getNode(key) for key in ("image_width", "image_height"))
    if not (width.empty() or height.empty()):
        size_px = int(width.real()), int(height.real())
    if size_px is None:
        raise OperatorError(f"{path}: tells no image size; give it, such as --size 640x480")
    if not storage.getNode("camera_matrix").empty():
        return (_camera(storage, path, "cam0", ("camera_matrix", "distortion_coefficients"), size_px, np.eye(4)),)
    T_C1toC0 = np.eye(4)
    if not (storage.getNode("R").empty() or storage.getNode("T").empty()):
        T_C0toC1 = np.eye(4)
        T_C0toC1[:3] = np.column_stack(
            (_matrix(storage, path, "R", (9,)).reshape(3, 3), _matrix(storage, path, "T", (3,)))
        )
        T_C1toC0 = inverse(T_C0toC1)
    return (
        _camera(storage, path, "cam0", ("M1", "D1"), size_px, np.eye(4)),
        _camera(storage, path, "cam1", ("M2", "D2"), size_px, T_C1toC0),
    )


def _camera(
    storage: cv2.FileStorage, path: Path, name: str, keys: tuple[str, str], size_px: Size, T_CtoW: Array
) -> Camera:
    K = _matrix(storage, path, keys[0], (9,)).reshape(3, 3)
    distortion = _matrix(storage, path, keys[1], (4, 5, 8, 12, 14))
    if np.any(distortion[8:]):
        raise OperatorError(f"{path}: `{keys[1]}` has thin prism or tilt terms, which cannot be represented here")
    return make_camera(name, size_px, (K[0, 0], K[1, 1], K[0, 2], K[1, 2]), tuple(distortion[:8]), T_CtoW)


def _matrix(storage: cv2.FileStorage, path: Path, key: str, counts: tuple[int, ...]) -> Array:
    node = storage.getNode(key)
    values = None if node.empty() else node.mat()
    if values is None or values.size not in counts or not np.isfinite(values).all():
        wanted = " or ".join(str(count) for count in counts)
        raise OperatorError(f"{path}: matrix `{key}` of {wanted} finite numbers is missing; calibrate again")
    return np.asarray(values, dtype=np.float64).ravel()
