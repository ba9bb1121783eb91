"""Our own TOML: [[rig.cameras]], as a config takes them."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path

import tomlkit
from pydantic import ValidationError
from tomlkit.items import Array as TomlArray

from bridge.settings.choose_rig import camera_of
from bridge.settings.complaint import complaint
from bridge.settings.models import RigSettings
from tools.calibrate.formats.fields import read_text, write_text
from tools.calibrate.formats.poses import placed, pose_of
from tracker.camera import Camera
from tracker.errors import OperatorError

NOT_PLACED = (
    "Poses are not known yet: T_CtoW puts the camera in the room's origin. posebridge calibrate room finds them."
)


def read_own(path: Path) -> tuple[Camera, ...]:
    """Read the cameras of a config or of a part of one.

    Raises:
        OperatorError: no TOML, or no [[rig.cameras]] that a config would take.
    """
    try:
        table = tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise OperatorError(f"{path}: not TOML: {error}; correct that line") from error
    rig = table.get("rig", {})
    try:
        cameras = RigSettings.model_validate(rig).cameras
    except ValidationError as error:
        raise OperatorError(f"{path}: [rig] {complaint(error, rig)}") from error
    if not cameras:
        raise OperatorError(f"{path}: holds no [[rig.cameras]]; give a config or a calibration of ours")
    return tuple(camera_of(camera) for camera in cameras)


def write_own(cameras: Sequence[Camera], path: Path, remarks: Sequence[str] = ()) -> None:
    """Write [[rig.cameras]] to put into a config.

    Args:
        remarks: comment lines at the top.
    Raises:
        OperatorError: the file cannot be written.
    """
    document = tomlkit.document()
    known = placed(cameras)
    for remark in (
        *remarks,
        "Put these values into a config's [[rig.cameras]]; its keys for live cameras are not repeated here.",
        *([] if known else [NOT_PLACED]),
    ):
        document.add(tomlkit.comment(remark))
    document.add(tomlkit.nl())
    tables = tomlkit.aot()
    for camera in cameras:
        tables.append(_table(camera))
    rig = tomlkit.table(is_super_table=True)
    rig.add("cameras", tables)
    document.add("rig", rig)
    write_text(path, tomlkit.dumps(document))


def _table(camera: Camera) -> tomlkit.items.Table:
    table = tomlkit.table()
    table.add("name", camera.name)
    table.add("width_px", camera.width_px)
    table.add("height_px", camera.height_px)
    for key, (i, j) in (("fx_px", (0, 0)), ("fy_px", (1, 1)), ("cx_px", (0, 2)), ("cy_px", (1, 2))):
        table.add(key, float(camera.K[i, j]))
    table.add("distortion", _floats(camera.distortion.tolist()))
    rows = tomlkit.array()
    for row in pose_of(camera).tolist():
        rows.append(_floats(row))
    table.add("T_CtoW", rows.multiline(True))
    if camera.clock_offset_ns:
        table.add("clock_offset_ms", camera.clock_offset_ns / 1e6)
    if camera.readout_ns:
        table.add("readout_ms", camera.readout_ns / 1e6)
    return table


def _floats(values: list[float]) -> TomlArray:
    array = tomlkit.array()
    array.extend([value + 0.0 for value in values])  # no negative zeros
    return array
