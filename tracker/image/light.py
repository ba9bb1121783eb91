"""The room's light, learned from the balls it falls on.

All balls are matt, of one paint each, and far smaller than the room: the brightness of a ball at a point with normal
n is its paint times one function of n in the room, E(n) = e + a.n + max(0, n.L): even light, light that comes from
one side, and a lamp. It is learned from the balls' own images; afterwards a ball's image is known up to two factors,
and the shaded limb no longer pulls its centre towards the lamp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from tracker.image.template import GLOSS, TERMS, Shades, Vector
from tracker.maths.compiled import compiled
from tracker.maths.solve import cholesky, dot, solve
from tracker.types import Array

FORGETTING = 0.99  # a ball: the light of about the last hundred counts
FADED = 0.2  # what is left of what was learned under another gamma
ENOUGH = 3  # balls until the light is trusted
RIDGE = np.array([0.0, 0.05, 0.05, 0.05, 0.002, 0.002, 0.002])  # a lamp explains what it can, one-sided light the rest
LAMP_STEPS = 32  # directions and weights are rounded to 1 / LAMP_STEPS, so that templates can be kept
COVERAGE = (1.0,) + (0.0,) * TERMS
MIRROR = (0.0,) * GLOSS + (1.0,)
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """What is known of the light.

    lamp: (3,) unit vector to the lamp in W.  terms: (TERMS,) of E in W, relative to its mean over a disc.
    information (TERMS, TERMS), target (TERMS,): normal equations of what was learned.  count: balls learned.
    """

    lamp: Array = field(default_factory=lambda: _UP)
    terms: Array = field(default_factory=lambda: np.eye(TERMS)[0])
    information: Array = field(default_factory=lambda: np.zeros((TERMS, TERMS)))
    target: Array = field(default_factory=lambda: np.zeros(TERMS))
    count: int = 0

    @property
    def trusted(self) -> bool:
        """Say whether enough balls were learned."""
        return self.count >= ENOUGH

    def learned(self, information: Array, target: Array, R_RtoW: Array) -> Light:
        """Return the light with one more ball in it.

        Args:
            information (TERMS, TERMS), target (TERMS,): normal equations of the terms in the ball's ray frame, with
                the lamp of `lamp_seen`, scaled to mean brightness 1.
            R_RtoW: (3, 3) turns the ray's frame into the room.
        """
        after, aim, lamp = self.information.copy(), self.target.copy(), self.lamp.copy()
        terms = _with_one_more(after, aim, information, target, R_RtoW, lamp)
        return Light(lamp, terms, after, aim, self.count + 1)

    def faded(self) -> Light:
        """Return the same light, less sure of it."""
        return replace(self, information=FADED * self.information, target=FADED * self.target)

    def lamp_seen(self, R_RtoW: Array) -> Vector:
        """Return the lamp's direction in a ray's frame, rounded."""
        return _rounded(R_RtoW, self.lamp)

    def shades(self, R_RtoW: Array) -> Shades:
        """Return the shapes of a ball seen along a ray: coverage, that times the light, the lamp's mirror image."""
        weights = np.concatenate((self.terms[:1], R_RtoW.T @ self.terms[1:4], R_RtoW.T @ self.terms[4:7]))
        rounded = np.round(weights / weights[0] * LAMP_STEPS) / LAMP_STEPS
        matt = (*(float(w) for w in rounded), 0.0)
        return Shades(self.lamp_seen(R_RtoW), (COVERAGE, matt, MIRROR))


@compiled("UniTuple(f8, 3)(f8[:, ::1], f8[::1])")
def _rounded(R_RtoW: Array, lamp: Array) -> Vector:
    """Return what `Light.lamp_seen` does."""
    x = y = z = 0.0
    for i in range(3):
        x, y, z = x + R_RtoW[i, 0] * lamp[i], y + R_RtoW[i, 1] * lamp[i], z + R_RtoW[i, 2] * lamp[i]
    return round(x * LAMP_STEPS) / LAMP_STEPS, round(y * LAMP_STEPS) / LAMP_STEPS, round(z * LAMP_STEPS) / LAMP_STEPS


@compiled("f8[::1](f8[:, ::1], f8[::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[::1])")
def _with_one_more(information: Array, target: Array, more: Array, aim: Array, R_RtoW: Array, lamp: Array) -> Array:
    """Add one ball's normal equations, turned into the room, and turn the lamp, in place; return the terms."""
    turn = np.eye(TERMS)
    turn[1:4, 1:4] = R_RtoW
    turn[4:7, 4:7] = R_RtoW
    information[:] = FORGETTING * information + turn @ more @ turn.T
    target[:] = FORGETTING * target + turn @ aim
    factor, terms = information.copy(), target.copy()
    for i in range(TERMS):
        factor[i, i] += RIDGE[i] * information[0, 0] + 1e-9
    cholesky(factor)
    solve(factor, terms)
    length, pull = math.sqrt(dot(terms[4:7], terms[4:7])), dot(terms[1:4] + terms[4:7], terms[4:7])
    if length > 0.0 and pull > 0.0:
        lamp[:] = terms[4:7] / length
    return terms


@compiled("f8[:, ::1](f8, f8, Array(f8, 2, 'A', readonly=True))")
def ray_frame(x: float, y: float, R_CtoW: Array) -> Array:
    """Return R_RtoW (3, 3) of the frame in which a ball's image is drawn, seen along the ray (x, y, 1).

    R: x right, y down in the image, z from the ball towards the camera, which makes it left-handed as images are.
    """
    flat, whole = math.sqrt(1.0 + x * x), math.sqrt(1.0 + x * x + y * y)
    both = flat * whole
    right, down = (1.0 / flat, 0.0, -x / flat), (-x * y / both, flat * flat / both, -y / both)
    back, R_RtoW = (-x / whole, -y / whole, -1.0 / whole), np.zeros((3, 3))
    for i in range(3):
        for k in range(3):
            R_RtoW[i, 0] += R_CtoW[i, k] * right[k]
            R_RtoW[i, 1] += R_CtoW[i, k] * down[k]
            R_RtoW[i, 2] += R_CtoW[i, k] * back[k]
    return R_RtoW
