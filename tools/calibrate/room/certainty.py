"""What the cameras' places are known to: chance, and errors that do not average out."""

from __future__ import annotations

import numpy as np

from tools.calibrate.room.bundle import Adjusted
from tools.calibrate.room.gauge import LEVER_M
from tools.calibrate.room.jacobian import CAMERA
from tools.calibrate.room.scene import Scene
from tools.calibrate.room.start import placed, triangulated_from
from tracker.camera import Camera
from tracker.types import Array

LEAST_BIAS_PX = 0.03
"""A ball's centre is off by as much everywhere, however still the pixels are: shade, paint, the arms it sits on."""


def camera_covariance(adjusted: Adjusted) -> Array:
    """Return the covariance (7 n, 7 n) of all cameras against their common frame, in the frame of the adjustment.

    Of each camera: position in W (3) [m], turn (3) [rad] in its own frame, clock against camera 0's [s]. What moves all
    cameras as one is not in it: it is the frame's, not theirs.

    Source: to the covariance of the fit, systematic errors are added: each camera sees each ball aside by a constant,
        and all balls by another, and all cameras see each aside on the marker, of as large a sigma as the residuals
        have, since of errors that do not vary they tell nothing. Then the datum is changed from camera 0 to all of
        them: Baarda, "S-transformations and criterion matrices" (1973).
    """
    cameras = adjusted.scene.cameras
    bias_px = max(LEAST_BIAS_PX, adjusted.rms_px)
    poses = CAMERA * (len(cameras) - 1)
    layout = adjusted.layout
    together = adjusted.shifts.reshape(-1, layout.cameras, layout.balls, 2).sum(axis=2).reshape(-1, 2 * layout.cameras)
    by_marker = metres_a_pixel(adjusted.scene) * adjusted.by_marker
    shifts = np.hstack((adjusted.shifts, together, by_marker))[:poses]
    covariance = np.zeros((poses + CAMERA, poses + CAMERA))
    covariance[CAMERA:, CAMERA:] = adjusted.covariance[:poses, :poses] + bias_px**2 * shifts @ shifts.T
    D = _datum(cameras)
    return np.asarray(D @ covariance @ D.T)


def metres_a_pixel(scene: Scene) -> float:
    """Return how large a pixel is where the marker was, on the average [m/px]."""
    return float(np.mean([camera.in_camera(scene.p_BinW)[:, 2].mean() / camera.focal_px for camera in scene.cameras]))


def turned(covariance: Array, R: Array) -> Array:
    """Return a covariance of cameras whose frame was turned by R (3, 3)."""
    n = len(covariance) // CAMERA
    T = np.eye(len(covariance))
    for c in range(n):
        at = slice(CAMERA * c, CAMERA * c + 3)
        T[at, at] = R
    return np.asarray(T @ covariance @ T.T)


def point_sigmas_m(cameras: tuple[Camera, ...], covariance: Array, points_inW: Array) -> Array:
    """Return one sigma (n,) of the places of points (n, 3) that two cameras or more see [m]; NaN where fewer do.

    The mean of the three axes. What the cameras' errors do to a point, not what a single sighting's noise adds.
    """
    uv_px = np.stack([seen_px(camera, points_inW) for camera in cameras])
    nominal = triangulated_from(uv_px, cameras)
    slopes = np.zeros((len(points_inW), 3, len(covariance)))
    for k in (k for k in range(len(covariance)) if k % CAMERA < CAMERA - 1):
        step = max(1e-9, 1e-2 * float(np.sqrt(covariance[k, k])))
        slopes[:, :, k] = (triangulated_from(uv_px, off_by(cameras, k, step)) - nominal) / step
    spread = np.einsum("nik,kl,nil->n", slopes, covariance, slopes)
    return np.asarray(np.sqrt(spread / 3.0))


def seen_px(camera: Camera, points_inW: Array) -> Array:
    """Return where a camera sees points (n, 2) [px]; NaN outside its picture."""
    uv_px = camera.project(points_inW)[0]
    within = np.array([camera.sees(uv) for uv in np.nan_to_num(uv_px, nan=-1.0)], dtype=bool)
    return np.where(within[:, None], uv_px, np.nan)


def off_by(cameras: tuple[Camera, ...], k: int, step: float) -> tuple[Camera, ...]:
    """Return cameras of which one is off by a step of its unknown k."""
    c, axis = divmod(k, CAMERA)
    camera = cameras[c]
    p_CinW, R = camera.p_CinW.copy(), camera.R_CtoW
    if axis < 3:
        p_CinW[axis] += step
    else:
        R = R @ (np.eye(3) + _hat(step * np.eye(3)[axis - 3]))
    return (*cameras[:c], placed(camera, R, p_CinW), *cameras[c + 1 :])


def _datum(cameras: tuple[Camera, ...]) -> Array:
    """Return the matrix (7 n, 7 n) that takes out of errors what moves all cameras as one, as `gauge.aligned` does."""
    size = CAMERA * len(cameras)
    points, motion = np.zeros((12 * len(cameras), size)), np.zeros((size, 6))
    for c, camera in enumerate(cameras):
        at, pose = 12 * c, CAMERA * c
        points[at : at + 12, pose : pose + 3] = np.tile(np.eye(3), (4, 1))
        for k in range(3):
            here = at + 3 + 3 * k
            points[here : here + 3, pose + 3 : pose + 6] = -camera.R_CtoW @ _hat(LEVER_M * np.eye(3)[k])
        motion[pose : pose + 3] = np.hstack((np.eye(3), -_hat(camera.p_CinW)))
        motion[pose + 3 : pose + 6, 3:] = camera.R_CtoW.T
    return np.asarray(np.eye(size) - motion @ np.linalg.pinv(points @ motion) @ points)


def _hat(v: Array) -> Array:
    """Return the matrix (3, 3) of the cross product with v (3,)."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
