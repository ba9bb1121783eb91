"""What the spots' frame is known to: cameras that are off move all spots much alike, and tilt them little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tools.calibrate.room.certainty import off_by
from tools.calibrate.room.jacobian import CAMERA
from tools.calibrate.room.spots import Floor
from tools.calibrate.room.start import triangulated_from
from tracker.camera import Camera
from tracker.maths import so3
from tracker.types import Array


@dataclass(frozen=True, slots=True)
class FloorSigmas:
    """One sigma of the floor's tilt, of the x axis' heading and of the distance of the first two spots."""

    tilt_deg: float
    heading_deg: float
    along_mm: float


def floor_sigmas(floor: Floor, cameras: tuple[Camera, ...], covariance: Array, stands_m: float) -> FloorSigmas:
    """Say how well the spots are known.

    Args:
        cameras, covariance (7 cameras, 7 cameras): in the frame that the stands are in, see
            `certainty.camera_covariance`.
        stands_m: one sigma of what one stand's place errs by itself, apart from the cameras [m].
    Source: first-order propagation: the spots are triangulated anew with each unknown of each camera off by a step.
    """
    uv_px = np.stack([stand.uv_px for stand in floor.stands])
    now_R, now_m = _frame(uv_px, cameras, floor)
    slopes = np.zeros((4, len(covariance)))
    for k in (k for k in range(len(covariance)) if k % CAMERA < CAMERA - 1):
        step = max(1e-9, 1e-2 * float(np.sqrt(covariance[k, k])))
        R, along_m = _frame(uv_px, off_by(cameras, k, step), floor)
        slopes[:, k] = np.append(so3.log(R @ now_R.T), along_m - now_m) / step
    by_cameras = np.sqrt(np.einsum("ik,kl,il->i", slopes, covariance, slopes))
    own = np.sqrt(2.0) * stands_m
    tilt_rad = np.hypot(by_cameras[:2].max(), own / min(floor.along_m, floor.across_m))
    heading_rad = np.hypot(by_cameras[2], own / floor.along_m)
    tilt_deg, heading_deg = np.degrees((tilt_rad, heading_rad)).tolist()
    return FloorSigmas(tilt_deg, heading_deg, 1e3 * float(np.hypot(by_cameras[3], own)))


def _frame(uv_px: Array, cameras: tuple[Camera, ...], floor: Floor) -> tuple[Array, float]:
    """Return the frame's R_WtoF (3, 3), and how far its first two spots are apart [m], as cameras see the stands.

    uv_px (3, cameras, balls, 2): of the stands.
    """
    a, b, c = (triangulated_from(seen, cameras).mean(axis=0) for seen in uv_px)
    along_m = float(np.linalg.norm(b - a))
    x_inW, normal = (b - a) / along_m, np.cross(b - a, c - a)
    z_inW = np.copysign(1.0, normal @ floor.R_WtoF[2]) * normal / np.linalg.norm(normal)
    return np.vstack((x_inW, np.cross(z_inW, x_inW), z_inW)), along_m
