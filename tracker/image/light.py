"""The room's light, learned from the balls it falls on.

All balls are matt, of one paint each, and far smaller than the room: the brightness of a ball at a point with normal
n is its paint times one function of n, E(n), whatever lamps, windows and walls there are: a sum of a few harmonics
(`tracker/image/harmonics.py`), with lamps behind them (`tracker/image/lamps.py`), and with those that hang near another
one at another place. It is learned from the balls' own images; afterwards a ball's image is known up to two factors,
and the shaded limb no longer pulls its centre towards the lamp.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from tracker.image.harmonics import LAMBERT, TERMS, turned
from tracker.image.lamps import MOVING, ROOM_TERMS, RoomLight, about, explained, raised, within
from tracker.image.template import GLOSS, Shades, Vector
from tracker.maths.compiled import compiled
from tracker.maths.covariance import propagated
from tracker.maths.solve import dot
from tracker.types import Array

FORGETTING = 0.99  # a ball: the light of about the last hundred counts
FADED = 0.2  # what is left of what was learned under another gamma
ENOUGH = 3  # balls until the light is trusted
STEPS, LAMP_STEPS = 512, 32  # how finely 1 is divided where weights, and the lamp's direction, are rounded
COVERAGE = (1.0,) + (0.0,) * TERMS
MIRROR = (0.0,) * GLOSS + (1.0,)
MIDDLE = np.zeros(3)


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """What is known of the light.

    lamp: (3,) unit vector to the brightest lamp in W.  terms: (TERMS,) of E in W, the even light 1. Both are of one
        place in the room.
    room: the light at any place.
    information (ROOM_TERMS, ROOM_TERMS), target (ROOM_TERMS,): normal equations of what one camera's balls taught.
    count: balls.
    """

    lamp: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    terms: Array = field(default_factory=lambda: np.eye(TERMS)[0])
    room: RoomLight = field(default_factory=RoomLight)
    information: Array = field(default_factory=lambda: np.zeros((ROOM_TERMS, ROOM_TERMS)))
    target: Array = field(default_factory=lambda: np.zeros(ROOM_TERMS))
    count: int = 0

    @property
    def trusted(self) -> bool:
        """Say whether enough balls were learned."""
        return self.count >= ENOUGH

    def at(self, place_m: Array) -> Light:
        """Return it at a place (3,) from the room's middle in W [m]."""
        return replace(self, lamp=self.room.lamp_at(place_m), terms=self.room.terms_at(place_m))

    def apart_at(self, place_m: Array, other: Light) -> float:
        """Return by how much it is apart from another at a place (3,) from the room's middle in W [m]."""
        return _apart(self.room.terms_at(place_m), other.terms)

    def recentred(self, shift_m: Array) -> Light:
        """Return the same light about another middle of the room, shift_m (3,) from the one before in W."""
        by = about(shift_m)
        after = by.T @ self.information @ by
        return replace(self, room=self.room.recentred(shift_m), information=after, target=by.T @ self.target)

    def learned(self, information: Array, target: Array, R_RtoW: Array, place_m: Array = MIDDLE) -> Light:
        """Return it with what one more ball teaches; the same when the ball has no brightness of its own.

        Args:
            information (TERMS, TERMS), target (TERMS,): normal equations of the terms in the ball's ray frame, times
                the brightness of its paint.
            R_RtoW: (3, 3) turns the ray's frame into the room.
            place_m: (3,) where the ball was, from the room's middle in W.
        """
        after, aim = self.information.copy(), self.target.copy()
        kept = min(FORGETTING, 1.0 - 1.0 / (self.count + 2.0))  # the first are learned before blur and light are known
        if not _add(after, aim, information, target, R_RtoW, self.room.terms, within(place_m), kept):
            return self
        return Light(self.lamp, self.terms, self.room, after, aim, self.count + 1)

    def solved(self, others: Iterable[Light], place_m: Array = MIDDLE) -> Light:
        """Return it with the lamps that explain best what this camera's balls and those of others show, at a place."""
        information, target = self.information.copy(), self.target.copy()
        for other in others:
            information += other.information
            target += other.target
        try:
            room = explained(information, target)
        except RuntimeError:  # the search for lamps did not end: the light known before serves on
            return self
        return replace(self, room=room).at(place_m)

    def apart_from(self, other: Light) -> float:
        """Return by how much two lights differ, rms over all directions a ball's surface may face, their mean being 1.

        Source: the harmonics are orthogonal, and the mean square of each is that of Lambert's factor.
        """
        return _apart(self.terms, other.terms)

    def taken_to(self, power: float) -> Light:
        """Return it as another gamma shows it, which takes all light to a power, and less sure of it."""
        room, terms = self.room.taken_to(power), raised(self.terms, power)
        target = self.target + self.information @ (room.terms - self.room.terms)
        return replace(self, room=room, terms=terms, information=FADED * self.information, target=FADED * target)

    def lamp_seen(self, R_RtoW: Array) -> Vector:
        """Return the brightest lamp's direction in a ray's frame, rounded."""
        x, y, z = _rounded(R_RtoW.T @ self.lamp, LAMP_STEPS)
        return x, y, z

    def shades(self, R_RtoW: Array) -> Shades:
        """Return the shapes of a ball seen along a ray: coverage, that times the light, the lamp's mirror image."""
        matt = (*_rounded(turned(R_RtoW).T @ self.terms, STEPS), 0.0)
        return Shades(self.lamp_seen(R_RtoW), (COVERAGE, matt, MIRROR))


@compiled("f8(Array(f8, 1, 'C', True), Array(f8, 1, 'C', True))")
def _apart(one: Array, other: Array) -> float:
    total = 0.0
    for i in range(TERMS):
        total += (LAMBERT[i] * (one[i] - other[i])) ** 2
    return math.sqrt(total)


def _rounded(values: Array, steps: int) -> list[float]:
    return [round(value * steps) / steps for value in values.tolist()]


@compiled("b1(f8[:, ::1], f8[::1], f8[:, ::1], f8[::1], Array(f8, 2, 'C', True), f8[::1], f8[::1], f8)")
def _add(
    information: Array, target: Array, seen: Array, seen_target: Array, R_RtoW: Array, room: Array, place_m: Array,
    kept: float,
) -> bool:  # fmt: skip
    """Keep so much and add one ball's normal equations, turned into the room, in place; False if it has no brightness.

    How bright its paint is in this light is the ball's own, and is taken out: to give every ball the same mean would
    say that no side of the room is brighter, and what is left for the light to follow looks like a centre pulled aside.
    Source: pixels are s T e with paint s and terms e, linearised about today's e and the s that fits it best; e goes
        with the place, e = a + sum_k place_k b_k of the room's terms (a, b).
    """
    turn, terms = turned(R_RtoW), room[:TERMS].copy()
    for k in range(3):
        for i in range(MOVING):
            terms[i] += place_m[k] * room[TERMS + MOVING * k + i]
    more, aim, shown = propagated(turn, seen, np.zeros((TERMS, TERMS))), np.zeros(TERMS), np.zeros(TERMS)
    for i in range(TERMS):
        aim[i], shown[i] = dot(turn[i], seen_target), dot(more[i], terms)
    squares, common = dot(terms, shown), dot(terms, aim)
    if not (squares > 0.0 and common > 0.0):
        return False
    paint, n = common / squares, TERMS + 3 * MOVING
    term, by = np.empty(n, np.int64), np.empty(n)
    for i in range(n):
        k, of = (i - TERMS) // MOVING, (i - TERMS) % MOVING
        term[i], by[i] = (i, 1.0) if i < TERMS else (of, place_m[k])
    for i in range(n):
        target[i] = kept * target[i] + by[i] * paint * (aim[term[i]] - paint * shown[term[i]])
        for j in range(n):
            apart = more[term[i], term[j]] - shown[term[i]] * shown[term[j]] / squares
            information[i, j] = kept * information[i, j] + by[i] * by[j] * paint * paint * apart
    return True


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
