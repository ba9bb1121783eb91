"""What the room file of mended cameras says of them, and what it keeps of the file before."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import tomlkit

from bridge.settings import Settings
from bridge.settings.models import MeasuredCameraSettings, RigSettings
from tools.calibrate.room.file import Record
from tools.calibrate.room.worth import CameraWorth, Worth, three
from tools.request import Clocks
from tracker.camera import Camera
from tracker.rig import Rig
from tracker.types import Array


def config_text(settings: Settings) -> str:
    """Return settings as the TOML of a config; what need not be said is left out."""
    return tomlkit.dumps(settings.model_dump(mode="json", exclude_none=True, exclude_defaults=True))


def record_of(log: Path, by: str, before: RigSettings, clocks: Clocks) -> Record:
    """Return who mended the cameras, and when; the frame is that of the file before."""
    day = str(datetime.fromtimestamp(clocks.wall() / 1e9, UTC).date())
    frame = "config" if before.measured is None else before.measured.frame
    return Record(day, by, f"log:{log.name}", frame, "calibrate refine", "docs/health.md")


def with_the_others(worth: Worth, before: RigSettings) -> Worth:
    """Return a worth with the cameras that did not move as the file before had them."""
    kept = {name: _worth(one) for name, one in _measured(before).items()}
    return replace(worth, cameras=tuple((kept | {one.name: one for one in worth.cameras}).values()))


def held_to(before: RigSettings, rig: Rig, bumped: tuple[int, ...]) -> dict[int, Array]:
    """Return what the cameras that did not move are known to, where the file before says so, see `certainty.Held`."""
    measured = _measured(before)
    return {
        c: _sigmas(measured[camera.name], camera)
        for c, camera in enumerate(rig.cameras)
        if c not in bumped and camera.name in measured
    }


def _measured(rig: RigSettings) -> Mapping[str, MeasuredCameraSettings]:
    return {} if rig.measured is None else {one.name: one for one in rig.measured.cameras}


def _worth(one: MeasuredCameraSettings) -> CameraWorth:
    position_mm, attitude_deg = three(np.array(one.position_sigma_mm)), three(np.array(one.attitude_sigma_deg))
    return CameraWorth(one.name, position_mm, attitude_deg, one.clock_sigma_ms)


def _sigmas(one: MeasuredCameraSettings, camera: Camera) -> Array:
    """Return one sigma (6,) of a camera's place [m] and turn [rad], both along the room's axes."""
    turn_rad = np.sqrt(camera.R_CtoW**2 @ np.radians(one.attitude_sigma_deg) ** 2)
    return np.concatenate((1e-3 * np.array(one.position_sigma_mm), turn_rad))
