"""Rotations: exponential, logarithm and the quaternion the messages want."""

from __future__ import annotations

import math

import numpy as np

from tracker.types import Array

_SMALL_ANGLE = 1e-8
_EYE = np.eye(3)


def hat(v: Array) -> Array:
    """Return the (3, 3) matrix with hat(v) w = v x w."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exp(theta: Array) -> Array:
    """Return the rotation (3, 3) by the rotation vector theta (3,) [rad]. Source: Rodrigues' formula."""
    angle = math.sqrt(float(theta @ theta))
    H = hat(theta)
    if angle < _SMALL_ANGLE:
        return np.asarray(_EYE + H)
    return np.asarray(_EYE + (math.sin(angle) / angle) * H + ((1.0 - math.cos(angle)) / angle**2) * (H @ H))


def log(R: Array) -> Array:
    """Return the rotation vector (3,) [rad] of R (3, 3), of length at most pi; exp(log(R)) = R."""
    w, x, y, z = quaternion(R).tolist()
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if sine < _SMALL_ANGLE else 2.0 * math.atan2(sine, w) / sine
    return scale * np.array([x, y, z])


def quaternion(R: Array) -> Array:
    """Return the Hamilton quaternion (w, x, y, z) of R (3, 3), unit length, w >= 0.

    Source: Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1 (1978): divide by the largest.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R.tolist()  # nine plain numbers are quicker than NumPy's calls
    trace = xx + yy + zz
    largest = max(trace, xx, yy, zz)
    if largest == trace:
        w, x, y, z = 1.0 + trace, zy - yz, xz - zx, yx - xy
    elif largest == xx:
        w, x, y, z = zy - yz, 1.0 + 2.0 * xx - trace, yx + xy, zx + xz
    elif largest == yy:
        w, x, y, z = xz - zx, yx + xy, 1.0 + 2.0 * yy - trace, zy + yz
    else:
        w, x, y, z = yx - xy, zx + xz, zy + yz, 1.0 + 2.0 * zz - trace
    scale = math.copysign(1.0 / math.sqrt(w * w + x * x + y * y + z * z), w)
    return np.array([scale * w, scale * x, scale * y, scale * z])


def right_jacobian(theta: Array) -> Array:
    """Return J_r (3, 3) with exp(theta + d) = exp(theta) exp(J_r d) to first order.

    Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018), eq. 143.
    """
    angle = math.sqrt(float(theta @ theta))
    H = hat(theta)
    if angle < 1e-5:
        return np.asarray(_EYE - 0.5 * H)
    return np.asarray(
        _EYE - ((1.0 - math.cos(angle)) / angle**2) * H + ((angle - math.sin(angle)) / angle**3) * (H @ H)
    )


def from_euler(roll: float, pitch: float, yaw: float) -> Array:
    """Return Rz(yaw) Ry(pitch) Rx(roll) (3, 3), the paper's and MAVLink's Z-Y-X order [rad]."""
    sr, cr, sp, cp, sy, cy = (
        math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch), math.sin(yaw), math.cos(yaw),
    )  # fmt: skip
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def to_euler(R: Array) -> tuple[float, float, float]:
    """Return (roll, pitch, yaw) [rad] of R = Rz(yaw) Ry(pitch) Rx(roll); at pitch +/-90 deg the roll is set to 0."""
    pitch = math.asin(max(-1.0, min(1.0, -float(R[2, 0]))))
    if abs(R[2, 0]) > 1.0 - 1e-12:
        return 0.0, pitch, math.atan2(-float(R[0, 1]), float(R[1, 1]))
    return math.atan2(float(R[2, 1]), float(R[2, 2])), pitch, math.atan2(float(R[1, 0]), float(R[0, 0]))
