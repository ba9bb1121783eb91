"""The one turn from the room and the paper's body axes into MAVLink's: NED and a forward-right-down body.

Frames here: N is north-east-down with its origin in the room's, F the body's forward-right-down axes.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

import numpy as np

from tracker import so3
from tracker.compiled import compiled
from tracker.errors import OperatorError
from tracker.types import Array, Estimate, frozen_array

# F is B turned by half a turn about x; as a diagonal it is its own inverse and flips columns by broadcasting.
_FLIP = frozen_array([1.0, -1.0, -1.0])
# Euler angles end at pitch +/-90 deg. Beyond 89.4 deg their covariance stays at its value there: already "unknown"
# to any filter, and still positive definite in 32-bit floats, which resolve 1 - rho^2 = cos(pitch)^2 no further.
_MIN_COS_PITCH = 0.01
_POSE_FLOAT32 = struct.Struct("<31f")
_VELOCITY_FLOAT32 = struct.Struct("<12f")
_TWIST_FLOAT32 = struct.Struct("<27f")
_UPPER = np.triu_indices(6)


@dataclass(frozen=True, slots=True, eq=False)
class NedPose:
    """An estimate's pose as autopilots read it; every float is exact in 32 bits.

    p_BinN: x y z [m].  euler: roll pitch yaw of F in N, Z-Y-X [rad].  q_FtoN: Hamilton w x y z, unit length.
    covariance: row-major upper triangle, 21 long, of the (6, 6) covariance of x y z roll pitch yaw [m, rad].
    """

    p_BinN: list[float]
    euler: list[float]
    q_FtoN: list[float]
    covariance: list[float]


@dataclass(frozen=True, slots=True, eq=False)
class NedVelocity:
    """An estimate's velocity. v_BinN: [m/s]. covariance: row-major (3, 3), 9 long [m^2/s^2]; exact in 32 bits."""

    v_BinN: list[float]
    covariance: list[float]


@dataclass(frozen=True, slots=True, eq=False)
class NedTwist:
    """An estimate's motion in the body's own axes; every float is exact in 32 bits.

    v_BinF: [m/s].  w_BinF: [rad/s].
    covariance: row-major upper triangle, 21 long, of the (6, 6) covariance of both.
    """

    v_BinF: list[float]
    w_BinF: list[float]
    covariance: list[float]


class NedFrame:
    """Where north is in the room.

    room_yaw_deg: heading of the room's x axis, clockwise from north [deg].
    """

    def __init__(self, room_yaw_deg: float) -> None:
        if not math.isfinite(room_yaw_deg):
            raise OperatorError(f"room_yaw_deg: {room_yaw_deg} deg must be a finite number; measure the room's x axis")
        self.R_WtoN = rotation_from_room(math.radians(room_yaw_deg))

    def pose(self, estimate: Estimate) -> NedPose:
        """Turn an estimate's pose and the pose part of its covariance.

        Source: R_FtoN = R_WtoN R_BtoW diag(1, -1, -1); covariance by `pose_jacobian`.
        """
        R_FtoN = self.R_WtoN @ estimate.R_BtoW * _FLIP
        roll, pitch, yaw = so3.to_euler(R_FtoN)
        J = pose_jacobian(self.R_WtoN, roll, pitch)
        triangle = turned_triangle(J, estimate.covariance)
        rounded = _POSE_FLOAT32.unpack(
            _POSE_FLOAT32.pack(
                *(self.R_WtoN @ estimate.p_BinW).tolist(),
                roll,
                pitch,
                yaw,
                *so3.quaternion(R_FtoN).tolist(),
                *triangle.tolist(),
            )
        )
        return NedPose(list(rounded[:3]), list(rounded[3:6]), list(rounded[6:10]), list(rounded[10:]))

    def velocity(self, estimate: Estimate) -> NedVelocity:
        """Turn an estimate's velocity and its covariance."""
        covariance = self.R_WtoN @ estimate.covariance[6:9, 6:9] @ self.R_WtoN.T
        values = (self.R_WtoN @ estimate.v_BinW).tolist() + covariance.ravel().tolist()
        rounded = _VELOCITY_FLOAT32.unpack(_VELOCITY_FLOAT32.pack(*values))
        return NedVelocity(list(rounded[:3]), list(rounded[3:]))

    def twist(self, estimate: Estimate) -> NedTwist:
        """Turn an estimate's velocity and rate into F, with their covariance.

        Derivation: v_B = R_BtoW' v. With R_BtoW = R_hat exp(theta) it changes by [v_B]x theta for an attitude error and
        by R_hat' dv for a velocity error; the rate is the body's already. F is B with y and z turned about.
        """
        R_WtoB = estimate.R_BtoW.T
        v_B = R_WtoB @ estimate.v_BinW
        J = np.zeros((6, 12))
        J[:3, 3:6] = so3.hat(v_B)
        J[:3, 6:9] = R_WtoB
        J[3:, 9:] = np.eye(3)
        J *= np.tile(_FLIP, 2)[:, None]
        covariance = J @ estimate.covariance @ J.T
        values = (_FLIP * v_B).tolist() + (_FLIP * estimate.w_BinB).tolist() + covariance[_UPPER].tolist()
        rounded = _TWIST_FLOAT32.unpack(_TWIST_FLOAT32.pack(*values))
        return NedTwist(list(rounded[:3]), list(rounded[3:6]), list(rounded[6:]))


def rotation_from_room(room_yaw: float) -> Array:
    """Return R_WtoN (3, 3) for a room whose x axis has the heading `room_yaw`, clockwise from north [rad].

    x_W points to (cos, sin, 0) in N, y_W, a quarter turn counter-clockwise of it, to (sin, -cos, 0), z_W up.
    """
    c, s = math.cos(room_yaw), math.sin(room_yaw)
    return frozen_array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])


@compiled("f8[::1](Array(f8, 2, 'A', readonly=True), Array(f8, 2, 'A', readonly=True))")
def turned_triangle(J: Array, covariance: Array) -> Array:
    """Return the upper triangle (21,), row by row, of J C J' for J (6, 6) and the first six of C's rows and columns."""
    half = np.zeros((6, 6))
    for i in range(6):
        for k in range(6):
            for j in range(6):
                half[i, j] += J[i, k] * covariance[k, j]
    triangle = np.zeros(21)
    place = 0
    for i in range(6):
        for j in range(i, 6):
            for k in range(6):
                triangle[place] += half[i, k] * J[j, k]
            place += 1
    return triangle


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
    J[3:, 3:] = ((1.0, -sr * sp / cp, -cr * sp / cp), (0.0, -cr, sr), (0.0, -sr / cp, -cr / cp))
    return J
