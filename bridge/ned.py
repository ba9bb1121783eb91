"""The one turn from the room and the paper's body axes into MAVLink's: NED and a forward-right-down body.

Frames here: N is north-east-down with its origin in the room's, F the body's forward-right-down axes.
"""

from __future__ import annotations

import math
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.errors import OperatorError
from tracker.maths.compiled import compiled
from tracker.types import Array, Estimate, frozen_array

Floats = NDArray[np.float32]

# F is B turned by half a turn about x: a diagonal, and its own inverse.
_FLIP = (1.0, -1.0, -1.0)
# Euler angles end at pitch +/-90 deg. Beyond 89.4 deg their covariance stays at its value there: already "unknown"
# to any filter, and still positive definite in 32-bit floats, which resolve 1 - rho^2 = cos(pitch)^2 no further.
_MIN_COS_PITCH = 0.01
_POLE = 1.0 - 1e-12  # as `so3.to_euler`
_LENGTHS = (3, 3, 4, 21, 3, 9, 3, 3, 21)  # of a `NedState`'s lists
_PARTS = tuple(slice(a, b) for a, b in pairwise(accumulate(_LENGTHS, initial=0)))
_READ_ONLY = "Array(f8, 2, 'A', readonly=True)"
_READ_ONLY_1D = "Array(f8, 1, 'A', readonly=True)"


class NedState(NamedTuple):  # made for each estimate: a tuple costs a quarter of a dataclass
    """An estimate as autopilots read it; every float is exact in 32 bits.

    p_BinN: x y z [m].  euler: roll pitch yaw of F in N, Z-Y-X [rad].  q_FtoN: Hamilton w x y z, unit length.
    pose_covariance: row-major upper triangle, 21 long, of the (6, 6) covariance of x y z roll pitch yaw [m, rad].
    v_BinN: [m/s].  v_covariance: its covariance in N, row-major (3, 3), 9 long [m^2/s^2].
    v_BinF: [m/s].  w_BinF: [rad/s].
    twist_covariance: row-major upper triangle, 21 long, of the (6, 6) covariance of the last two.
    """

    p_BinN: list[float]
    euler: list[float]
    q_FtoN: list[float]
    pose_covariance: list[float]
    v_BinN: list[float]
    v_covariance: list[float]
    v_BinF: list[float]
    w_BinF: list[float]
    twist_covariance: list[float]


class NedFrame:
    """Where north is in the room.

    room_yaw_deg: heading of the room's x axis, clockwise from north [deg].
    """

    def __init__(self, room_yaw_deg: float) -> None:
        if not math.isfinite(room_yaw_deg):
            raise OperatorError(f"room_yaw_deg: {room_yaw_deg} deg must be a finite number; measure the room's x axis")
        self.R_WtoN = rotation_from_room(math.radians(room_yaw_deg))

    def turn(self, estimate: Estimate) -> NedState:
        """Turn an estimate and its covariance."""
        values = _turned(
            self.R_WtoN, estimate.p_BinW, estimate.R_BtoW, estimate.v_BinW, estimate.w_BinB, estimate.covariance
        ).tolist()
        return NedState(*[values[part] for part in _PARTS])


def rotation_from_room(room_yaw: float) -> Array:
    """Return R_WtoN (3, 3) for a room whose x axis has the heading `room_yaw`, clockwise from north [rad].

    x_W points to (cos, sin, 0) in N, y_W, a quarter turn counter-clockwise of it, to (sin, -cos, 0), z_W up.
    """
    c, s = math.cos(room_yaw), math.sin(room_yaw)
    return frozen_array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])


@compiled(f"f8[:, ::1]({_READ_ONLY}, f8, f8)")
def pose_jacobian(R_WtoN: Array, roll: float, pitch: float) -> Array:
    """Return J (6, 6): (dx dy dz droll dpitch dyaw) in N by the estimate's (position error in W, theta in B).

    Derivation: positions turn by R_WtoN. With R_BtoW = R_hat exp(theta) and D = diag(1, -1, -1),
        R_FtoN = R_WtoN R_hat exp(theta) D = (R_WtoN R_hat D) exp(D theta),
    so the body error in F is D theta. For R = Rz(yaw) Ry(pitch) Rx(roll) a small body rotation phi changes the
    angles by the Z-Y-X rate matrix (Diebel, "Representing attitude", 2006, eq. 76-78)
        d(roll, pitch, yaw) = [[1, sr tp, cr tp], [0, cr, -sr], [0, sr / cp, cr / cp]] phi,
    and times D its second and third columns change sign.
    """
    sr, cr, sp = math.sin(roll), math.cos(roll), math.sin(pitch)
    cp = max(math.cos(pitch), _MIN_COS_PITCH)
    J = np.zeros((6, 6))
    J[:3, :3] = R_WtoN
    J[3, 3], J[3, 4], J[3, 5] = 1.0, -sr * sp / cp, -cr * sp / cp
    J[4, 4], J[4, 5] = -cr, sr
    J[5, 4], J[5, 5] = -sr / cp, -cr / cp
    return J


@compiled(f"f8[::1]({_READ_ONLY}, {_READ_ONLY})")
def turned_triangle(J: Array, covariance: Array) -> Array:
    """Return the upper triangle (21,), row by row, of J C J' for J (6, n) and the first n of C's rows and columns."""
    count = J.shape[1]
    half = np.zeros((6, count))
    for i in range(6):
        for k in range(count):
            for j in range(count):
                half[i, j] += J[i, k] * covariance[k, j]
    triangle = np.zeros(21)
    place = 0
    for i in range(6):
        for j in range(i, 6):
            for k in range(count):
                triangle[place] += half[i, k] * J[j, k]
            place += 1
    return triangle


@compiled(f"f4[::1]({_READ_ONLY}, {_READ_ONLY_1D}, {_READ_ONLY}, {_READ_ONLY})")
def _turned_pose(R_WtoN: Array, p_BinW: Array, R_BtoW: Array, covariance: Array) -> Floats:
    """Return p_BinN, roll pitch yaw of F in N, q_FtoN and the covariance's upper triangle, (31,).

    Source: R_FtoN = R_WtoN R_BtoW diag(1, -1, -1); angles as `so3.to_euler`; the quaternion is the product of those of
    the three turns, taken with w >= 0; covariance by `pose_jacobian`.
    """
    R = np.zeros((3, 3))
    out = np.zeros(31, np.float32)
    for i in range(3):
        place = 0.0
        for k in range(3):
            place += R_WtoN[i, k] * p_BinW[k]
            for j in range(3):
                R[i, j] += R_WtoN[i, k] * R_BtoW[k, j] * _FLIP[j]
        out[i] = place
    pitch = math.asin(max(-1.0, min(1.0, -R[2, 0])))
    at_pole = abs(R[2, 0]) > _POLE
    roll = 0.0 if at_pole else math.atan2(R[2, 1], R[2, 2])
    yaw = math.atan2(-R[0, 1], R[1, 1]) if at_pole else math.atan2(R[1, 0], R[0, 0])
    out[3], out[4], out[5] = roll, pitch, yaw
    sr, cr, sp, cp = math.sin(roll / 2), math.cos(roll / 2), math.sin(pitch / 2), math.cos(pitch / 2)
    sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
    sign = 1.0 if cr * cp * cy + sr * sp * sy >= 0.0 else -1.0
    out[6] = sign * (cr * cp * cy + sr * sp * sy)
    out[7] = sign * (sr * cp * cy - cr * sp * sy)
    out[8] = sign * (cr * sp * cy + sr * cp * sy)
    out[9] = sign * (cr * cp * sy - sr * sp * cy)
    out[10:] = turned_triangle(pose_jacobian(R_WtoN, roll, pitch), covariance)
    return out


@compiled(f"f4[::1]({_READ_ONLY}, {_READ_ONLY_1D}, {_READ_ONLY})")
def _turned_velocity(R_WtoN: Array, v_BinW: Array, covariance: Array) -> Floats:
    """Return v_BinN and its covariance row by row, (12,)."""
    out = np.zeros(12, np.float32)
    for i in range(3):
        speed = 0.0
        for k in range(3):
            speed += R_WtoN[i, k] * v_BinW[k]
        out[i] = speed
        for j in range(3):
            total = 0.0
            for k in range(3):
                for m in range(3):
                    total += R_WtoN[i, k] * covariance[6 + k, 6 + m] * R_WtoN[j, m]
            out[3 + 3 * i + j] = total
    return out


@compiled(f"f4[::1]({_READ_ONLY}, {_READ_ONLY_1D}, {_READ_ONLY_1D}, {_READ_ONLY})")
def _turned_twist(R_BtoW: Array, v_BinW: Array, w_BinB: Array, covariance: Array) -> Floats:
    """Return velocity and rate in F and their covariance's upper triangle, (27,).

    Derivation: v_B = R_BtoW' v. With R_BtoW = R_hat exp(theta) it changes by [v_B]x theta for an attitude error and
    by R_hat' dv for a velocity error; the rate is the body's already. F is B with y and z turned about.
    """
    out = np.zeros(27, np.float32)
    v = np.zeros(3)
    J = np.zeros((6, 9))  # by the errors of attitude, velocity and rate
    for i in range(3):
        for k in range(3):
            v[i] += R_BtoW[k, i] * v_BinW[k]
            J[i, 3 + k] = _FLIP[i] * R_BtoW[k, i]
        J[3 + i, 6 + i] = _FLIP[i]
        out[i], out[3 + i] = _FLIP[i] * v[i], _FLIP[i] * w_BinB[i]
    J[0, 1], J[0, 2] = -v[2], v[1]
    J[1, 0], J[1, 2] = -v[2], v[0]
    J[2, 0], J[2, 1] = v[1], -v[0]
    out[6:] = turned_triangle(J, covariance[3:, 3:])
    return out


@compiled(f"f4[::1]({_READ_ONLY}, {_READ_ONLY_1D}, {_READ_ONLY}, {_READ_ONLY_1D}, {_READ_ONLY_1D}, {_READ_ONLY})")
def _turned(R_WtoN: Array, p_BinW: Array, R_BtoW: Array, v_BinW: Array, w_BinB: Array, covariance: Array) -> Floats:
    """Return everything of a `NedState` in its order, (70,)."""
    out = np.empty(70, np.float32)
    out[:31] = _turned_pose(R_WtoN, p_BinW, R_BtoW, covariance)
    out[31:43] = _turned_velocity(R_WtoN, v_BinW, covariance)
    out[43:] = _turned_twist(R_BtoW, v_BinW, w_BinB, covariance)
    return out
