"""Which calibration counts: the config's, else the source's, else the nominal cameras of the config."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from bridge.settings.models import BallSettings, CameraSettings, MarkerSettings, Settings
from tracker.camera import Camera, make_camera
from tracker.errors import OperatorError
from tracker.rig import Ball, Colour, Marker, Rig, make_marker, make_rig
from tracker.sources.layout import camera_folders, find_mav0
from tracker.sources.sensor_yaml import read_camera
from tracker.types import frozen_array

METRES_PER_MM = 1e-3
NS_PER_MS = 1e6


class RigOrigin(StrEnum):
    """Where the cameras of a rig come from."""

    CALIBRATION = "calibration"  # the directory the config names
    SOURCE = "source"  # the recording brought it
    NOMINAL = "nominal"  # the drawing: [[rig.cameras]]


@dataclass(frozen=True, slots=True, eq=False)
class ChosenRig:
    """A rig and where its cameras come from."""

    rig: Rig
    origin: RigOrigin

    @property
    def nominal(self) -> bool:
        """Say whether the cameras were drawn, not measured: not fit for flight."""
        return self.origin is RigOrigin.NOMINAL


def rig_of(settings: Settings, source_cameras: tuple[Camera, ...] | None, camera_count: int | None = None) -> ChosenRig:
    """Choose the cameras and put the config's marker before them.

    Args:
        source_cameras: the calibration that came with the source, None if there is none.
        camera_count: how many cameras the source has, None if any number will do.
    Raises:
        OperatorError: no cameras at all, as many as do not fit the source, or a calibration that cannot be used.
    """
    cameras, origin = _cameras(settings, source_cameras)
    if camera_count is not None and camera_count != len(cameras):
        raise OperatorError(
            f"rig: {len(cameras)} cameras ({origin}) but the source has {camera_count}; "
            "name as many in --source as the rig has, or correct the config's [rig]"
        )
    tables = (*settings.rig.cameras, *[None] * len(cameras))
    timed = tuple(_timed(camera, table) for camera, table in zip(cameras, tables, strict=False))
    return ChosenRig(make_rig(timed, marker_of(settings.marker)), origin)


def _timed(camera: Camera, table: CameraSettings | None) -> Camera:
    """Return the camera with what its table in the config, whatever else counts, knows of its clock and shutter."""
    if table is None or not (table.clock_offset_ms or table.readout_ms):
        return camera
    offset_ns, readout_ns = round(table.clock_offset_ms * NS_PER_MS), round(table.readout_ms * NS_PER_MS)
    return replace(camera, clock_offset_ns=offset_ns, readout_ns=readout_ns)


def marker_of(marker: MarkerSettings) -> Marker:
    """Make the tracker's marker of the config's.

    Raises:
        OperatorError: fewer than three balls, or balls in a line.
    """
    return make_marker(tuple(_ball(ball) for ball in marker.balls))


def _cameras(settings: Settings, source: tuple[Camera, ...] | None) -> tuple[tuple[Camera, ...], RigOrigin]:
    if settings.rig.calibration:
        return _calibrated(Path(settings.rig.calibration)), RigOrigin.CALIBRATION
    if source is not None:
        return source, RigOrigin.SOURCE
    return tuple(camera_of(camera) for camera in settings.rig.cameras), RigOrigin.NOMINAL


def _calibrated(directory: Path) -> tuple[Camera, ...]:
    try:
        folders = camera_folders(find_mav0(directory))
        return tuple(read_camera(folder / "sensor.yaml", folder.name) for folder in folders)
    except OperatorError as error:
        raise OperatorError(f"[rig] calibration: {error}") from error


def camera_of(camera: CameraSettings) -> Camera:
    """Make the camera of its table.

    Raises:
        OperatorError: values that are no camera's.
    """
    return make_camera(
        camera.name,
        (camera.width_px, camera.height_px),
        (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px),
        camera.distortion,
        np.asarray(camera.T_CtoW, dtype=np.float64),
    )


def _ball(ball: BallSettings) -> Ball:
    blue, green, red = ball.bgr
    colour = Colour(
        hue_deg=ball.hue_deg,
        hue_tolerance_deg=ball.hue_tolerance_deg,
        saturation_min=ball.saturation_min,
        value_min=ball.value_min,
        bgr=(blue, green, red),
    )
    position_m = frozen_array(np.asarray(ball.position_mm) * METRES_PER_MM)
    return Ball(ball.name, position_m, ball.radius_mm * METRES_PER_MM, colour)
