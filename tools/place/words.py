"""A camera's place in words for a person with a tape, and as a table of the config."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import tomlkit

from bridge.settings import config_path
from tools.place.layout import view_deg
from tools.place.limits import Limits
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.placement.mount import Box
from tracker.types import Array

ON_MOUNT_M = 0.01
DRAWN = "Drawn by posebridge place, not measured: calibrate before flight."


def instructions(camera: Camera, limits: Limits) -> list[str]:
    """Say where a camera hangs and where it looks, a line each."""
    place, room = camera.p_CinW, limits.room
    ahead = camera.R_CtoW[:, 2]
    azimuth, tilt = math.degrees(math.atan2(ahead[1], ahead[0])), math.degrees(math.asin(max(-1.0, min(1.0, ahead[2]))))
    mount = next((box.name for box in limits.mounts if box.holds(place, ON_MOUNT_M)), "free")
    lean = f"{abs(tilt):.1f} deg {'down' if tilt < 0 else 'up'}"
    mark, face = sight(place, ahead, room)
    return [
        f"{camera.name}: {mount}, lens {view_deg(camera):.0f} deg, at x, y, z = {_metres(place)} m: "
        f"{place[2] - room.low[2]:.2f} m above the floor, {place[0] - room.low[0]:.2f} m from wall x-, "
        f"{place[1] - room.low[1]:.2f} m from wall y-",
        f"looks {azimuth:.1f} deg to the left of the x axis and {lean}, picture level; its middle shows {face} at "
        f"x, y, z = {_metres(mark)} m",
    ]


def sight(place: Array, ahead: Array, room: Box) -> tuple[Array, str]:
    """Return the point (3,) at which the optical axis meets the room's shell, and the name of that face."""
    faces = np.where(ahead > 0.0, room.high, room.low)
    reach = np.full(3, np.inf)
    slanting = np.abs(ahead) > 1e-9
    reach[slanting] = (faces - place)[slanting] / ahead[slanting]
    k = int(np.argmin(reach))
    name = (
        ("the ceiling" if ahead[2] > 0.0 else "the floor")
        if k == 2
        else f"wall {'xy'[k]}{'+' if ahead[k] > 0.0 else '-'}"
    )
    return place + reach[k] * ahead, name


def snippet(cameras: Sequence[Camera], limits: Limits) -> str:
    """Return the [[rig.cameras]] tables of a config."""
    return "\n".join([f"# {DRAWN}", *(_table(camera, limits) for camera in cameras)])


def config_with(config: str, cameras: Sequence[Camera], limits: Limits) -> str:
    """Return the text of a config with its cameras replaced by these; its comments stay.

    Raises:
        OperatorError: the config has gone meanwhile.
    """
    path = config_path(config)
    try:
        document = tomlkit.parse(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise OperatorError(f"config {path}: cannot be read ({error.strerror}); name one that is there") from error
    drawn = tomlkit.parse(snippet(cameras, limits))
    rig = tomlkit.table()
    rig.add(tomlkit.comment(DRAWN))
    rig["calibration"] = ""
    rig["cameras"] = drawn["rig"]["cameras"]
    document["rig"] = rig
    return tomlkit.dumps(document)


def _table(camera: Camera, limits: Limits) -> str:
    K, T = camera.K, np.eye(4)
    T[:3, :3], T[:3, 3] = camera.R_CtoW, camera.p_CinW
    rows = ",\n".join("    [" + ", ".join(f"{_zero(x):.12f}" for x in row) + "]" for row in T)
    distortion = ", ".join(repr(float(x)) for x in camera.distortion)
    comments = "\n".join(f"# {line}" for line in instructions(camera, limits))
    return (
        f'[[rig.cameras]]\n{comments}\nname = "{camera.name}"\nwidth_px = {camera.width_px}\n'
        f"height_px = {camera.height_px}\nfx_px = {K[0, 0]:.7f}\nfy_px = {K[1, 1]:.7f}\ncx_px = {K[0, 2]:.4f}\n"
        f"cy_px = {K[1, 2]:.4f}\ndistortion = [{distortion}]\nT_CtoW = [\n{rows},\n]\n"
    )


def _zero(x: float) -> float:
    """Write no minus before a zero."""
    return 0.0 if abs(x) < 5e-13 else x


def _metres(point: Array) -> str:
    return ", ".join(f"{_zero(round(float(x), 2)):.2f}" for x in point)
