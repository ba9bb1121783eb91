"""One calibrated camera: room point <-> pixel, with the Jacobian."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tracker.errors import OperatorError
from tracker.types import Array, frozen_array

ROTATION_TOLERANCE = 1e-4
_ZERO = np.zeros(3)
_UNDISTORT_CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-12)


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A pinhole camera with radial-tangential distortion, and where it stands in the room.

    width_px, height_px: image size [px].
    K: (3, 3) intrinsic matrix [px].
    distortion: (4,), (5,) or (8,) OpenCV order k1 k2 p1 p2 [k3 [k4 k5 k6]].
    R_CtoW: (3, 3), p_CinW: (3,) the camera's pose in the room [m].
    clock_offset_ns: known time by which it sees later than its stamps say [ns].
    readout_ns: how much later its last row is exposed than its first [ns]: a rolling shutter's; 0 for a global one,
        negative where the picture is read from below. A frame's stamp is that of the row in the middle.
    Build it with `make_camera`, which checks the values.
    """

    name: str
    width_px: int
    height_px: int
    K: Array
    distortion: Array
    R_CtoW: Array
    p_CinW: Array
    clock_offset_ns: int = 0
    readout_ns: int = 0

    def in_camera(self, p_inW: Array) -> Array:
        """Turn room points (n, 3) into camera coordinates (n, 3) [m]."""
        return (p_inW - self.p_CinW) @ self.R_CtoW

    def project(self, p_inW: Array) -> tuple[Array, Array]:
        """Project room points into the image.

        Args:
            p_inW: (n, 3) room points [m]; those behind the camera give NaN.
        Returns:
            uv_px: (n, 2) distorted pixels.
            J: (n, 2, 3) d uv / d p_inW [px/m].
        Source: OpenCV's pinhole model; with rvec = tvec = 0 its derivative by tvec is that by the camera-frame
            point, and d p_inC / d p_inW = R_CtoW'.
        """
        p_inC = self.in_camera(p_inW)
        uv, jacobian = cv2.projectPoints(p_inC, _ZERO, _ZERO, self.K, self.distortion)
        uv_px: Array = np.asarray(uv, dtype=np.float64).reshape(-1, 2)
        J = jacobian[:, 3:6].reshape(-1, 2, 3) @ self.R_CtoW.T
        behind = p_inC[:, 2] <= 0.0
        if behind.any():
            uv_px[behind] = np.nan
            J[behind] = np.nan
        return uv_px, J

    def bearings(self, uv_px: Array) -> Array:
        """Return the unit directions (n, 3) in C of the rays through distorted pixels (n, 2)."""
        normalised = cv2.undistortPoints(
            uv_px.reshape(-1, 1, 2).astype(np.float64), self.K, self.distortion, criteria=_UNDISTORT_CRITERIA
        ).reshape(-1, 2)
        rays = np.column_stack((normalised, np.ones(len(normalised))))
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))

    def sees(self, uv_px: Array, margin_px: float = 0.0) -> bool:
        """Say whether a pixel (2,) lies inside the image by at least `margin_px`."""
        u, v = float(uv_px[0]), float(uv_px[1])
        return margin_px <= u <= self.width_px - 1 - margin_px and margin_px <= v <= self.height_px - 1 - margin_px

    @property
    def row_ns(self) -> float:
        """How much later each row is exposed than the one above it [ns]."""
        return self.readout_ns / max(self.height_px - 1, 1)

    def delay_ns(self, v_px: float) -> float:
        """Return how much later than the middle row, and so than the frame's stamp, a row is exposed [ns]."""
        return (v_px - (self.height_px - 1) / 2.0) * self.row_ns

    @property
    def focal_px(self) -> float:
        """Mean focal length [px]."""
        return float(self.K[0, 0] + self.K[1, 1]) / 2.0


def make_camera(
    name: str,
    size_px: tuple[int, int],
    intrinsics: tuple[float, float, float, float],
    distortion: tuple[float, ...],
    T_CtoW: Array,
) -> Camera:
    """Check a calibration and make the camera of it.

    Args:
        size_px: (width, height) [px].
        intrinsics: fx, fy, cx, cy [px].
        distortion: k1 k2 p1 p2 [k3 [k4 k5 k6]].
        T_CtoW: (4, 4) homogeneous pose of the camera in the room [m].
    Raises:
        OperatorError: a focal length that is not positive, a centre outside the image, a matrix that is no pose.
    """
    fx, fy, cx, cy = intrinsics
    width, height = size_px
    where = f"calibration of {name}"
    if width <= 0 or height <= 0:
        raise OperatorError(f"{where}: resolution {width} x {height} px must be positive; correct `resolution`")
    if not (np.isfinite(intrinsics).all() and fx > 0 and fy > 0):
        raise OperatorError(f"{where}: focal lengths {fx:g}, {fy:g} px must be positive; calibrate again")
    if not (0 <= cx < width and 0 <= cy < height):
        raise OperatorError(
            f"{where}: principal point {cx:g}, {cy:g} px lies outside the {width} x {height} px image; "
            "the calibration belongs to another resolution"
        )
    if len(distortion) not in (4, 5, 8) or not np.isfinite(distortion).all():
        raise OperatorError(
            f"{where}: {len(distortion)} distortion coefficients; give 4, 5 or 8 finite ones (k1 k2 p1 p2 ...)"
        )
    return Camera(
        name=name,
        width_px=width,
        height_px=height,
        K=frozen_array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]),
        distortion=frozen_array(distortion),
        R_CtoW=frozen_array(_checked_rotation(where, np.asarray(T_CtoW, dtype=np.float64))),
        p_CinW=frozen_array(np.asarray(T_CtoW, dtype=np.float64)[:3, 3]),
    )


def _checked_rotation(where: str, T_CtoW: Array) -> Array:
    """Return the rotation of a homogeneous pose, made exactly orthonormal, or refuse it."""
    if T_CtoW.shape != (4, 4) or not np.isfinite(T_CtoW).all():
        raise OperatorError(f"{where}: the pose must be 4 x 4 finite numbers, not {T_CtoW.shape}; calibrate again")
    R = T_CtoW[:3, :3]
    departure = float(np.abs(R @ R.T - np.eye(3)).max())
    if departure > ROTATION_TOLERANCE or not np.allclose(T_CtoW[3], (0.0, 0.0, 0.0, 1.0)):
        raise OperatorError(
            f"{where}: the pose holds no rotation: R R' departs from the identity by {departure:.2g}, "
            f"limit {ROTATION_TOLERANCE:g}; calibrate again"
        )
    if np.linalg.det(R) < 0:
        raise OperatorError(f"{where}: the rotation mirrors (determinant -1, must be +1); calibrate again")
    u, _, vt = np.linalg.svd(R)
    return np.asarray(u @ vt)
