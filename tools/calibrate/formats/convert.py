"""One calibration file into another."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path

from bridge.settings.section import refuse_twins
from tools.calibrate.formats.euroc import write_euroc
from tools.calibrate.formats.fields import read_text, read_yaml
from tools.calibrate.formats.kalibr import read_kalibr, write_kalibr
from tools.calibrate.formats.opencv import Size, read_opencv, write_opencv
from tools.calibrate.formats.own import read_own, write_own
from tools.calibrate.formats.poses import placed
from tools.calibrate.formats.ros import read_ros, write_ros
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.sources.layout import camera_folders, find_mav0
from tracker.sources.sensor_yaml import read_camera


class FileFormat(StrEnum):
    """What a calibration file can be."""

    TOML = "toml"
    KALIBR = "kalibr"
    ROS = "ros"
    EUROC = "euroc"
    OPENCV = "opencv"


OPENCV_MARKS = ("%YAML:", "!!opencv-matrix", "<opencv_storage>")


def read_cameras(path: Path, size_px: Size | None = None) -> tuple[Camera, ...]:
    """Read a calibration, whatever wrote it: told by its content.

    Args:
        size_px: image size, for OpenCV files that do not tell.
    Raises:
        OperatorError: none that is known, or a model we cannot represent.
    """
    if path.is_dir():
        return _read_folder(path, size_px)
    if path.suffix == ".toml":
        return read_own(path)
    try:
        return _read_file(path, size_px)
    except OperatorError as error:
        # A camera's own values are wrong: say in which file.
        raise error if str(path) in str(error) else OperatorError(f"{path}: {error}") from error


def _read_folder(path: Path, size_px: Size | None) -> tuple[Camera, ...]:
    """Read a folder in EuRoC's layout, or one of one camera a file, as ROS has them."""
    if any((path / name).is_dir() for name in ("mav0", "cam0")):
        folders = camera_folders(find_mav0(path))
        return tuple(read_camera(folder / "sensor.yaml", folder.name) for folder in folders)
    files = sorted(path.rglob("*.yaml"))  # a name such as stereo/left makes a folder of its own
    if not files:
        raise OperatorError(
            f"{path}: holds neither mav0 nor a file NAME.yaml; give a file, or the folder that holds them"
        )
    cameras = tuple(camera for file in files for camera in read_cameras(file, size_px))
    try:
        refuse_twins("camera", [camera.name for camera in cameras])
    except ValueError as error:
        raise OperatorError(f"{path}: {error}") from error
    return cameras


def _read_file(path: Path, size_px: Size | None) -> tuple[Camera, ...]:
    text = read_text(path)
    if any(mark in text for mark in OPENCV_MARKS):
        return read_opencv(path, size_px)
    fields = read_yaml(path)
    if "cam0" in fields:
        return read_kalibr(path)
    if "camera_matrix" in fields:
        return (read_ros(path),)
    if "T_BS" in fields or "camera_model" in fields:
        return (read_camera(path, path.parent.name if path.stem == "sensor" else path.stem),)
    known = "Kalibr camchain, ROS camera_info, EuRoC sensor.yaml, OpenCV FileStorage, our own TOML"
    raise OperatorError(f"{path}: holds no calibration that is known; known: {known}")


def write_cameras(cameras: Sequence[Camera], path: Path, into: FileFormat, remarks: Sequence[str] = ()) -> str:
    """Write a calibration; return what was lost by it, "" if nothing.

    Several cameras in a format of one camera a file make a folder: EuRoC's own layout, or NAME.yaml each.

    Raises:
        OperatorError: the format cannot hold them, or a file cannot be written.
    """
    if into is FileFormat.TOML:
        write_own(cameras, path, remarks)
    elif into is FileFormat.KALIBR:
        write_kalibr(cameras, path)
        return "where the room lies; camera 0 is the origin" if placed(cameras[:1]) else ""
    elif into is FileFormat.OPENCV:
        write_opencv(cameras, path)
        return "where the room lies" if placed(cameras[:1]) else ""
    elif into is FileFormat.ROS:
        for camera in cameras:
            write_ros(camera, path if len(cameras) == 1 else path / f"{camera.name}.yaml")
        return "the cameras' poses: camera_info has none" if placed(cameras) else ""
    else:
        for k, camera in enumerate(cameras):
            write_euroc(camera, path if len(cameras) == 1 else path / "mav0" / f"cam{k}" / "sensor.yaml")
    return ""


def format_of(name: str | None, path: Path) -> FileFormat:
    """Return the format asked for; .toml needs no asking.

    Raises:
        OperatorError: none of that name, or none where it must be named.
    """
    if name is None and path.suffix == ".toml":
        return FileFormat.TOML
    if name is None or name.lower() not in set(FileFormat):
        said = "no format" if name is None else f"unknown format {name!r}"
        raise OperatorError(f"--to: {said} for {path}; give one of {', '.join(FileFormat)}")
    return FileFormat(name.lower())
