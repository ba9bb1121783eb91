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
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    squares = np.array([trace, R[0, 0], R[1, 1], R[2, 2]])
    k = int(np.argmax(squares))
    if k == 0:
        q = np.array([1.0 + trace, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        i, j, m = k - 1, k % 3, (k + 1) % 3
        q = np.empty(4)
        q[0] = R[m, j] - R[j, m]
        q[1 + i] = 1.0 + 2.0 * R[i, i] - trace
        q[1 + j] = R[j, i] + R[i, j]
        q[1 + m] = R[m, i] + R[i, m]
    q /= math.sqrt(float(q @ q))
    return np.asarray(-q if q[0] < 0 else q)


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
