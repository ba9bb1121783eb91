"""What one camera tells of the vehicle's pose, over a whole set of poses at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.camera import Camera
from tracker.maths import so3
from tracker.rig import Marker
from tracker.types import Array

Flags = NDArray[np.bool_]
BORDER_PX = 2.0  # between a ball's edge and the picture's, as the blur needs it


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Poses of the vehicle: p_BinW (s, 3) [m], R_BtoW (s, 3, 3); every point with every attitude, point by point.

    points: how many different points; s is a multiple of it.
    """

    p_BinW: Array
    R_BtoW: Array
    points: int

    def __len__(self) -> int:
        return len(self.p_BinW)

    def by_point(self, values: Array) -> Array:
        """Return values (s,) as (points, attitudes)."""
        return values.reshape(self.points, -1)


@dataclass(frozen=True, slots=True)
class Sharpness:
    """What a ball's centre can be told to.

    lens_px: what lens and calibration add, one sigma in each direction [px].
    grey_noise: noise of a pixel as a share of the step in grey between ball and background.
    blur_px: one sigma of the picture's blur [px].
    least_radius_px: smaller balls are not found [px].
    """

    lens_px: float
    grey_noise: float
    blur_px: float
    least_radius_px: float

    def sigma_px(self, radius_px: Array) -> Array:
        """Return the noise of a centre in each direction, one sigma [px].

        Source: an edge of height C blurred by b has a slope whose square adds up to C^2 / (2 sqrt(pi) b) across it.
            A shift moves the edge by its cosine, which squared adds up to pi r round the disc; by Fisher's information
            the variance of the centre is 2 sqrt(pi) b n^2 / (pi r C^2) = 2 b (n / C)^2 / (sqrt(pi) r) (1).
        """
        fit = 2.0 * self.blur_px * self.grey_noise**2 / (math.sqrt(math.pi) * radius_px)  # (1)
        return np.asarray(np.sqrt(self.lens_px**2 + fit))


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What one camera sees of s poses of a marker with n balls.

    pictured: (s, n) the ball is whole in the picture and large enough.
    seen: (s, n) and no other ball stands before it.
    information: (s, 6, 6) of the pose, from the balls seen: errors are position in W [m] and rotation in B [rad].
    """

    pictured: Flags
    seen: Flags
    information: Array


def poses_of(points: Array, attitudes: Sequence[Array]) -> Poses:
    """Return every attitude (3, 3) at every point (n, 3)."""
    return Poses(
        np.repeat(points, len(attitudes), axis=0), np.tile(np.stack(attitudes), (len(points), 1, 1)), len(points)
    )


def attitudes_within(tilt_rad: float, yaws: int) -> list[Array]:
    """Return level and leaning attitudes at so many headings: level, then by `tilt_rad` to each of the four sides."""
    leans = [(0.0, 0.0)] + [(a * tilt_rad, b * tilt_rad) for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)) if tilt_rad]
    headings = np.linspace(-math.pi, math.pi, yaws, endpoint=False).tolist()
    return [so3.from_euler(roll, pitch, yaw) for yaw in headings for roll, pitch in leans]


def look(camera: Camera, marker: Marker, poses: Poses, sharpness: Sharpness) -> View:
    """Look at all poses through one camera.

    Source: ball m stands at p + R m; an error (dp, theta) moves it by dp - R [m]x theta (1), its pixel by J times that,
        and a pixel of noise sigma tells H'H / sigma^2 of the pose (2).
    """
    count = len(marker)
    balls_inW = balls_in_room(marker, poses)
    uv_px, J = camera.project(balls_inW.reshape(-1, 3))
    uv_px, J = uv_px.reshape(-1, count, 2), J.reshape(-1, count, 2, 3)
    depth = camera.in_camera(balls_inW.reshape(-1, 3))[:, 2].reshape(-1, count)
    radius_m = np.array([ball.radius_m for ball in marker.balls])
    radius_px = camera.focal_px * radius_m / np.where(depth > 0.0, depth, np.inf)
    pictured = _pictured(camera, balls_inW, uv_px, radius_px) & (radius_px >= sharpness.least_radius_px)
    seen = pictured & ~_hidden(uv_px, depth, radius_px)
    H = np.concatenate((J, J @ arms(marker, poses)), axis=3)  # (1)
    weight = np.where(seen, 1.0 / sharpness.sigma_px(np.maximum(radius_px, 1e-6)), 0.0)
    rows = (np.where(seen[:, :, None, None], H, 0.0) * weight[:, :, None, None]).reshape(len(poses), -1, 6)
    return View(pictured, seen, np.asarray(rows.transpose(0, 2, 1) @ rows))  # (2)


def balls_in_room(marker: Marker, poses: Poses) -> Array:
    """Return the balls' centres (s, n, 3) in W [m]."""
    return np.asarray(poses.p_BinW[:, None, :] + np.einsum("sij,nj->sni", poses.R_BtoW, marker.points_inB))


def arms(marker: Marker, poses: Poses) -> Array:
    """Return d ball / d rotation, -R [m]x (s, n, 3, 3) [m/rad]."""
    return np.asarray(np.einsum("sij,njk->snik", poses.R_BtoW, -np.stack([so3.hat(m) for m in marker.points_inB])))


def _pictured(camera: Camera, balls_inW: Array, uv_px: Array, radius_px: Array) -> Flags:
    """Say which balls lie whole in the picture (s, n).

    Far outside the field of view a distorted lens's polynomial turns back and would fold points into the picture, so
    the ray without distortion must be near it too.
    """
    p_inC = camera.in_camera(balls_inW.reshape(-1, 3)).reshape(balls_inW.shape)
    ahead = np.where(p_inC[..., 2] > 0.0, p_inC[..., 2], np.inf)
    across = np.abs(p_inC[..., :2] / ahead[..., None])
    reach = np.array([camera.width_px / camera.K[0, 0], camera.height_px / camera.K[1, 1]])
    margin = radius_px + BORDER_PX
    u, v = uv_px[..., 0], uv_px[..., 1]
    inside = (u >= margin) & (u <= camera.width_px - 1 - margin) & (v >= margin) & (v <= camera.height_px - 1 - margin)
    return np.asarray(inside & (p_inC[..., 2] > 0.0) & (across < reach).all(axis=-1))


def _hidden(uv_px: Array, depth: Array, radius_px: Array) -> Flags:
    """Say which balls (s, n) a nearer ball touches in the picture: half hidden, a centre is not to be trusted."""
    apart = np.linalg.norm(uv_px[:, :, None] - uv_px[:, None], axis=3)
    touches = apart < radius_px[:, :, None] + radius_px[:, None]
    nearer = depth[:, None, :] < depth[:, :, None]
    return np.asarray((touches & nearer).any(axis=2))
