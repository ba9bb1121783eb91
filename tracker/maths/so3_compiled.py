"""Rotations for compiled loops, written into arrays that the caller brings."""

from __future__ import annotations

import math

from tracker.maths.compiled import compiled
from tracker.types import Array

_SMALL_ANGLE = 1e-4


@compiled("void(f8, f8, f8, f8[:, ::1], f8[:, ::1])")
def turn_into(x: float, y: float, z: float, R: Array, J: Array) -> None:
    """Write exp(theta) (3, 3) into R and the right Jacobian (3, 3) into J; see `so3` for both formulas."""
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < _SMALL_ANGLE:
        a, b, c = 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
        c = (1.0 - a) / square
    # R = I + a H + b H^2 and J = I - b H + c H^2, with H^2 = t t' - |t|^2 I.
    t = (x, y, z)
    for i in range(3):
        for j in range(3):
            R[i, j] = b * t[i] * t[j]
            J[i, j] = c * t[i] * t[j]
        R[i, i] += 1.0 - b * square
        J[i, i] += 1.0 - c * square
    for i, j, h in ((0, 1, -z), (0, 2, y), (1, 0, z), (1, 2, -x), (2, 0, -y), (2, 1, x)):
        R[i, j] += a * h
        J[i, j] -= b * h
