"""What a placement may choose from: the config's [place], with the command line's word on top."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bridge.settings import PlaceSettings, Settings, marker_of
from tracker.errors import OperatorError
from tracker.placement.mount import Box, Lens
from tracker.placement.views import Sharpness
from tracker.rig import MAX_CAMERAS, MIN_CAMERAS, Marker
from tracker.types import frozen_array

WALLS = ("x-", "x+", "y-", "y+", "ceiling")


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """Room, volume and mounts, lenses on offer, marker, how far it leans [rad], what a ball's centre is known to.

    apart_m: least distance of two cameras [m].  coverage_min: share of poses to be covered.
    """

    room: Box
    volume: Box
    mounts: tuple[Box, ...]
    lenses: tuple[Lens, ...]
    marker: Marker
    tilt_rad: float
    sharpness: Sharpness
    apart_m: float
    coverage_min: float


@dataclass(frozen=True, slots=True)
class Wishes:
    """What the command line says, as text; None leaves the config's.

    room, volume: six numbers x0,x1,y0,y1,z0,z1 [m].  walls: names.  lenses: fields of view [deg].
    """

    room: str | None = None
    volume: str | None = None
    walls: str | None = None
    lenses: str | None = None


def limits_of(settings: Settings, wishes: Wishes) -> Limits:
    """Put config and command line together.

    Raises:
        OperatorError: a range that is none, a volume or mount outside the room, no mount, no lens.
    """
    place = settings.place
    room = _box("room", wishes.room, (place.room_x_m, place.room_y_m, place.room_z_m))
    volume = _box("volume", wishes.volume, (place.volume_x_m, place.volume_y_m, place.volume_z_m))
    _check_inside(volume, room)
    lenses_deg = place.lenses_deg if wishes.lenses is None else _numbers("--lenses", wishes.lenses, "45 or 30,45,60")
    if not all(1.0 < view < 150.0 for view in lenses_deg):
        raise OperatorError(f"--lenses: {wishes.lenses} deg: each must be 1 to 150 deg; correct it")
    return Limits(
        room=room,
        volume=volume,
        mounts=_mounts(place, room, wishes.walls),
        lenses=tuple(Lens(view, place.width_px, place.height_px) for view in lenses_deg),
        marker=marker_of(settings.marker),
        tilt_rad=math.radians(place.tilt_deg),
        sharpness=Sharpness(settings.tracker.pixel_noise_px, place.grey_noise, place.blur_px, place.least_radius_px),
        apart_m=place.apart_m,
        coverage_min=place.coverage_min,
    )


def check_count(cameras: int) -> None:
    """Refuse a number of cameras that no rig may have.

    Raises:
        OperatorError: fewer than 2 or more than 8.
    """
    if not MIN_CAMERAS <= cameras <= MAX_CAMERAS:
        raise OperatorError(
            f"--cameras: {cameras} cameras must be {MIN_CAMERAS} to {MAX_CAMERAS}; give a number within"
        )


def _mounts(place: PlaceSettings, room: Box, walls: str | None) -> tuple[Box, ...]:
    names = place.walls if walls is None else tuple(name.strip() for name in walls.split(",") if name.strip())
    unknown = [name for name in names if name not in WALLS]
    if unknown:
        raise OperatorError(f"--walls: no wall {unknown[0]!r}; known are {', '.join(WALLS)}")
    inner = Box("room", room.low + place.clearance_m, room.high - place.clearance_m)
    if not (inner.low < inner.high).all():
        raise OperatorError(f"[place] clearance_m = {place.clearance_m:g} m leaves nothing of the room; give less")
    boxes = [_wall(name, inner, place) for name in names]
    for mount in place.mounts:
        box = _box(f"[[place.mounts]] {mount.name}:", None, (mount.x_m, mount.y_m, mount.z_m), flat=True)
        own = replace(box, name=mount.name)
        _check_inside(own, room)
        boxes.append(own)
    if not boxes:
        raise OperatorError("place: no wall and no mount to hang a camera on; give --walls or [[place.mounts]]")
    return tuple(boxes)


def _wall(name: str, inner: Box, place: PlaceSettings) -> Box:
    low, high = inner.low.copy(), inner.high.copy()
    if name == "ceiling":
        low[2] = high[2]
        return Box("ceiling", frozen_array(low), frozen_array(high))
    axis = "xy".index(name[0])
    low[axis] = high[axis] = (low if name[1] == "-" else high)[axis]
    low[2], high[2] = max(low[2], place.wall_z_m[0]), min(high[2], place.wall_z_m[1])
    if low[2] > high[2]:
        raise OperatorError(
            f"[place] wall_z_m = {place.wall_z_m[0]:g} to {place.wall_z_m[1]:g} m lies outside the room's height, "
            f"{inner.low[2]:g} to {inner.high[2]:g} m with clearance; correct it"
        )
    return Box(f"wall {name}", frozen_array(low), frozen_array(high))


def _box(what: str, text: str | None, ranges: Sequence[Sequence[float]], *, flat: bool = False) -> Box:
    """Return the box of three ranges, or of six numbers in a text."""
    source = what if flat else f"[place] {what}"
    if text is not None:
        source = f"--{what}"
        six = _numbers(source, text, "x0,x1,y0,y1,z0,z1 in metres")
        if len(six) != 6:
            raise OperatorError(f"{source}: {text!r} holds {len(six)} numbers, wanted 6: x0,x1,y0,y1,z0,z1 in metres")
        ranges = list(pairwise(six))[::2]
    for axis, (low, high) in zip("xyz", ranges, strict=True):
        if not (low <= high if flat else low < high):
            raise OperatorError(f"{source} {axis}: from {low:g} to {high:g} m is no range; give the lower end first")
    return Box(what, frozen_array([r[0] for r in ranges]), frozen_array([r[1] for r in ranges]))


def _numbers(source: str, text: str, wanted: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = (math.nan,)
    if not np.isfinite(numbers).all():
        raise OperatorError(f"{source}: {text!r} must be numbers such as {wanted}; correct it")
    return numbers


def _check_inside(box: Box, room: Box) -> None:
    for k, axis in enumerate("xyz"):
        if box.low[k] < room.low[k] or box.high[k] > room.high[k]:
            raise OperatorError(
                f"place: {box.name} reaches from {axis} = {box.low[k]:g} to {box.high[k]:g} m, outside the room's "
                f"{room.low[k]:g} to {room.high[k]:g} m; correct one of them"
            )
