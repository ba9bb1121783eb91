"""Attitude and position from three points: the paper's section 3.1."""

from __future__ import annotations

import math

import numpy as np

from tracker.maths import so3
from tracker.rig import Marker
from tracker.types import Array, Reason, Rejected

SINGULAR_LIMIT_RAD = math.radians(89.0)


def attitude(p1: Array, p2: Array, p3: Array) -> tuple[float, float, float] | Rejected:
    """Return (roll, pitch, yaw) [rad] of the frame whose x runs from point 1 to 2 and y towards 3.

    Args:
        p1, p2, p3: (3,) points in W, z up [m].
    Returns:
        Z-Y-X angles, roll and pitch within +/-pi/2; Rejected SINGULAR within 1 deg of pitch +/-90 deg, where roll
        and yaw turn about one axis, and GEOMETRY for points in a line.
    Source: the paper, eq. 4-6. 2' is the foot of the perpendicular from 3 on the line 12. In eq. 4 the height of 3
        over 2' is sin(roll) cos(pitch) |2'3|, so the sine is divided by cos(pitch) = horizontal length 12 / |12|.
    """
    along = p2 - p1
    length = float(np.linalg.norm(along))
    horizontal = math.hypot(float(along[0]), float(along[1]))
    if length == 0.0:
        return Rejected(Reason.GEOMETRY, "points 1 and 2 are one")
    pitch = math.atan2(-float(along[2]), horizontal)  # (5)
    if abs(pitch) > SINGULAR_LIMIT_RAD:
        return Rejected(
            Reason.SINGULAR,
            f"pitch {math.degrees(pitch):.1f} deg, limit +/-{math.degrees(SINGULAR_LIMIT_RAD):.0f} deg: "
            "roll and yaw turn about one axis there",
        )
    foot = p1 + along * (float((p3 - p1) @ along) / length**2)
    across = p3 - foot
    width = float(np.linalg.norm(across))
    if width < 1e-9 * length:
        return Rejected(Reason.GEOMETRY, "the three points lie in a line")
    sine = float(across[2]) / width * length / horizontal
    roll = math.asin(max(-1.0, min(1.0, sine)))  # (4)
    yaw = math.atan2(float(along[1]), float(along[0]))  # (6)
    return roll, pitch, yaw


def pose(points_inW: Array, marker: Marker) -> tuple[Array, Array] | Rejected:
    """Return (p_BinW, R_BtoW) of the marker whose balls stand at points_inW (n, 3).

    The first three balls give the attitude, all of them the position. The marker's own axes may differ from the
    three points' axes: both are expressed by the same three points, taken in the order in which they turn to the left
    about the body's z, so that a level vehicle has a level triangle and not one upside down.
    """
    p1, p2, p3 = marker.points_inB[:3]
    order = [0, 1, 2] if np.cross(p2 - p1, p3 - p1)[2] >= 0.0 else [1, 0, 2]
    in_room = attitude(*points_inW[order])
    if isinstance(in_room, Rejected):
        return in_room
    in_body = attitude(*marker.points_inB[order])
    if isinstance(in_body, Rejected):
        return in_body
    R_BtoW = so3.from_euler(*in_room) @ so3.from_euler(*in_body).T
    return points_inW.mean(axis=0) - R_BtoW @ marker.points_inB.mean(axis=0), R_BtoW
