"""Which way is which: how the axes that three pushes showed lie to the axes they ought to have shown."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tracker.types import Array

PUSHES = ("forward", "right", "lift")
# Rows: where each push must lead, north-east-down, the nose pointing north.
EXPECTED = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
_NAMES = (("north", "south"), ("east", "west"), ("down", "up"))


@dataclass(frozen=True, slots=True, eq=False)
class Axes:
    """What three pushes say about a frame.

    P: the signed permutation (3, 3) nearest to them: what should be e_i came out as P e_i.
    heading_deg: mean turn of the level pushes, clockwise from where they should lead [deg].
    skew_deg: the worst push's angle to its place, after that turn; to its signed axis when the frame is not level.
    """

    P: Array
    heading_deg: float
    skew_deg: float

    @property
    def mirrored(self) -> bool:
        """The axes are left-handed."""
        return bool(np.linalg.det(self.P) < 0.0)

    @property
    def upright(self) -> bool:
        """Lifting shows as up."""
        return bool(self.P[2, 2] > 0.5)

    def outcomes(self) -> str:
        """Say where each push came out."""
        return ", ".join(
            f"{push} came out as {_direction(self.P @ expected)}"
            for push, expected in zip(PUSHES, EXPECTED, strict=True)
            if not np.allclose(self.P @ expected, expected)
        )


def axes_of(displacements: Array) -> Axes:
    """Find the axes of three pushes: forward with the nose to north, right, up.

    Args:
        displacements: (3, 3), a row a push, north-east-down as measured [m], none of them nothing.
    Source: of the 48 signed permutations, the one with the greatest sum of cosines.
    """
    unit = displacements / np.linalg.norm(displacements, axis=1, keepdims=True)
    P = max(_signed_permutations(), key=lambda each: float(np.sum(unit * (EXPECTED @ each.T))))
    level = P[2, 2] > 0.5 and np.linalg.det(P) > 0.0
    heading_deg = _heading_deg(unit) if level else 0.0
    goal = EXPECTED @ (_turn(heading_deg).T if level else P.T)
    skew_deg = float(np.degrees(np.arccos(np.clip(np.min(np.sum(unit * goal, axis=1)), -1.0, 1.0))))
    return Axes(P, heading_deg, skew_deg)


def wrapped_deg(angle_deg: float) -> float:
    """Return an angle in -180 to 180 [deg]."""
    return (angle_deg + 180.0) % 360.0 - 180.0


def _heading_deg(unit: Array) -> float:
    """Return the mean turn of forward from north and of right from east, clockwise [deg]."""
    forward, right = complex(unit[0, 0], unit[0, 1]), complex(unit[1, 0], unit[1, 1])
    mean = forward + right / 1j
    return math.degrees(math.atan2(mean.imag, mean.real))


def _turn(heading_deg: float) -> Array:
    c, s = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _signed_permutations() -> Iterator[Array]:
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            yield np.eye(3)[list(order)] * np.array(signs)[:, None]


def _direction(vector: Array) -> str:
    axis = int(np.argmax(np.abs(vector)))
    return _NAMES[axis][0 if vector[axis] > 0 else 1]
