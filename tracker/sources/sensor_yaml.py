"""A camera's calibration as EuRoC/ASL recordings carry it: sensor.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import yaml

from tracker.camera import Camera, make_camera
from tracker.errors import OperatorError
from tracker.types import Array

CAMERA_MODELS = ("pinhole",)
DISTORTION_MODELS = ("radial-tangential", "radtan")


def read_camera(path: Path, name: str) -> Camera:
    """Read a sensor.yaml. `T_BS` is the camera's pose in the room (camera to room).

    Args:
        name: the camera's name in messages.
    Raises:
        OperatorError: not readable, no YAML, a field missing or malformed, an unknown model, no camera.
    """
    document = _load(path)
    _check_model(path, document, "camera_model", CAMERA_MODELS)
    _check_model(path, document, "distortion_model", DISTORTION_MODELS)
    width, height = _numbers(path, document, "resolution", (2,))
    fx, fy, cx, cy = _numbers(path, document, "intrinsics", (4,))
    distortion = tuple(_numbers(path, document, "distortion_coefficients", (4, 5, 8)))
    try:
        return make_camera(name, (int(width), int(height)), (fx, fy, cx, cy), distortion, _pose(path, document))
    except OperatorError as error:
        raise OperatorError(f"{path}: {error}") from error


def _load(path: Path) -> Mapping[str, object]:
    try:
        document = yaml.safe_load(path.read_bytes())
    except OSError as error:
        raise OperatorError(f"{path}: cannot be read ({error.strerror}); each camera needs its calibration") from error
    except yaml.YAMLError as error:
        raise OperatorError(f"{path}: is no YAML: {' '.join(str(error).split())}; write it anew") from error
    if not isinstance(document, dict):
        raise OperatorError(f"{path}: must hold fields such as `intrinsics: [fx, fy, cx, cy]`; write it anew")
    return document


def _field(path: Path, document: Mapping[str, object], key: str) -> object:
    if key not in document:
        raise OperatorError(f"{path}: field `{key}` is missing; add it or calibrate again")
    return document[key]


def _check_model(path: Path, document: Mapping[str, object], key: str, known: tuple[str, ...]) -> None:
    model = _field(path, document, key)
    if model not in known:
        raise OperatorError(
            f"{path}: {key} {model!r} is unknown; known: {', '.join(known)}; calibrate with one of them"
        )


def _numbers(path: Path, document: Mapping[str, object], key: str, lengths: tuple[int, ...]) -> list[float]:
    """Return the finite numbers of a list whose length is one of `lengths`."""
    values = _field(path, document, key)
    wanted = " or ".join(str(length) for length in lengths)
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.ndim != 1 or len(numbers) not in lengths or not np.isfinite(numbers).all():
        raise OperatorError(f"{path}: `{key}` must be {wanted} finite numbers, not {values!r}; calibrate again")
    return [float(number) for number in numbers]


def _pose(path: Path, document: Mapping[str, object]) -> Array:
    """Return T_CtoW (4, 4) [m], written either as rows of four or as EuRoC's {rows, cols, data}."""
    field = _field(path, document, "T_BS")
    values = field.get("data") if isinstance(field, dict) else field
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.size != 16:
        raise OperatorError(f"{path}: `T_BS` must be 4 x 4 numbers (`data` of 16), not {values!r}; calibrate again")
    return numbers.reshape(4, 4)
