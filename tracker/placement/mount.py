"""Where cameras may stand in a room, and a camera standing there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tracker.camera import Camera, make_camera
from tracker.types import Array, frozen_array


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """A box along the room's axes: low and high corner (3,) in W [m]. Flat or a line where both agree."""

    name: str
    low: Array
    high: Array

    def holds(self, p_inW: Array, slack_m: float = 1e-9) -> bool:
        """Say whether a point (3,) or all points (n, 3) lie inside."""
        return bool(((p_inW >= self.low - slack_m) & (p_inW <= self.high + slack_m)).all())

    def at(self, share: Array) -> Array:
        """Return the point (3,) at a share of the way from low to high along each axis."""
        return np.asarray(self.low + share * (self.high - self.low))

    @property
    def centre(self) -> Array:
        """Return the middle (3,) [m]."""
        return np.asarray((self.low + self.high) / 2.0)

    def points(self, spacing_m: float) -> Array:
        """Return a grid (n, 3) of points no further apart than `spacing_m`, its ends on the box's faces.

        An axis along which the box is flat gets one point.
        """
        axes = [
            np.linspace(low, high, math.ceil((high - low) / spacing_m - 1e-9) + 1) if high > low else np.array([low])
            for low, high in zip(self.low, self.high, strict=True)
        ]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class Lens:
    """A lens on a sensor: horizontal field of view [deg], picture size [px]."""

    view_deg: float
    width_px: int
    height_px: int

    @property
    def focal_px(self) -> float:
        """Return the focal length [px]."""
        return self.width_px / 2.0 / math.tan(math.radians(self.view_deg / 2.0))


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """A camera that stands somewhere and looks somewhere, its picture level.

    mount: the box it stands in, by name.  p_CinW: (3,) [m].
    azimuth: of the optical axis, from the room's x axis to the left as seen from above [rad].
    tilt: of the optical axis above level; looking down is negative [rad].
    """

    mount: str
    p_CinW: Array
    azimuth: float
    tilt: float
    lens: Lens

    def forward(self) -> Array:
        """Return the optical axis (3,) in W."""
        flat = math.cos(self.tilt)
        return np.array([flat * math.cos(self.azimuth), flat * math.sin(self.azimuth), math.sin(self.tilt)])

    def camera(self, name: str) -> Camera:
        """Return it as a camera with an ideal lens."""
        ahead, right = self.forward(), np.array([math.sin(self.azimuth), -math.cos(self.azimuth), 0.0])
        T_CtoW = np.eye(4)
        T_CtoW[:3, :3] = np.column_stack((right, np.cross(ahead, right), ahead))
        T_CtoW[:3, 3] = self.p_CinW
        lens = self.lens
        middle = ((lens.width_px - 1) / 2.0, (lens.height_px - 1) / 2.0)
        size_px = (lens.width_px, lens.height_px)
        return make_camera(name, size_px, (lens.focal_px, lens.focal_px, *middle), (0.0,) * 4, T_CtoW)


def aimed(mount: str, p_CinW: Array, target_inW: Array, lens: Lens) -> Stand:
    """Return a camera at p_CinW that looks at a point; straight above it, with the azimuth of the room's x axis."""
    x, y, z = (target_inW - p_CinW).tolist()
    return Stand(mount, frozen_array(p_CinW), math.atan2(y, x), math.atan2(z, math.hypot(x, y)), lens)
