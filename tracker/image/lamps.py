"""The light that explains best what balls show: lamps all round, far or near, none of which takes light away.

One camera sees one side of a ball, and a slope of light across it looks much like a centre pulled aside. Three things
tell them apart. Balls seen by all cameras are lit by the same room, from as many sides as there are cameras. Light is
never negative, which one lamp, a row of windows and an even sky obey alike. And a lamp that hangs near lights a
vehicle that flies about from other sides, as its distance demands: nothing else is supposed of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import nnls

from tracker.image.harmonics import LAMBERT, TERMS, terms_at
from tracker.maths.compiled import compiled
from tracker.maths.sphere import spread
from tracker.types import Array

DIRECTIONS = spread(96)
"""Where lamps may be (96, 3), 20 degrees apart: what lies between two is seen as both."""
NEARNESS = (0.0, 0.3, 0.6)
"""One by how far from the room's middle they may hang [1/m]."""
MOVING = 9
"""Terms that differ by place: those of degrees 0, 1 and 2, of the others too little reaches a ball."""
ROOM_TERMS = TERMS + 3 * MOVING
"""The light in the room's middle, and by how much its first terms grow along x, y and z of W [1/m]."""
FARTHEST_M = 0.6  # from the middle: beyond, what was learned in between is not carried on
EVEN = 8.0  # of each term before any ball: two lamps that share half of the light have a sigma of 0.35
NEAR_MISFIT = 0.75  # of what far lamps leave unexplained, at most, for near ones to be believed
ONE = 1e3  # how firmly the even light is held to 1, beside what is learned
BEAM = 0.9  # lamps closer to the brightest than that, by the cosine, are one with it
_STEP_M = 0.4  # over which a near lamp's growth is taken: as far as a vehicle usually goes
_DIMMEST = 0.25  # of the middle's light
_DARKEST = 0.02  # of the even light: harmonics fall below what there is
_AROUND = terms_at(DIRECTIONS)
_BACK, _FIRST_BACK = np.linalg.pinv(_AROUND.T), np.linalg.pinv(_AROUND[:MOVING].T)


def _lamps(nearness: float) -> Array:
    """Return the terms of lamps in DIRECTIONS (ROOM_TERMS, 96), the mean of a lamp's light over a middle ball 1."""
    grown = [np.zeros((MOVING, len(DIRECTIONS)))] * 3
    if nearness:
        axes = _STEP_M * np.eye(3)
        grown = [(_light_at(nearness, axis) - _light_at(nearness, -axis)) / (2.0 * _STEP_M) for axis in axes]
    return np.vstack((terms_at(DIRECTIONS) / LAMBERT[:, None], *grown))


def _light_at(nearness: float, place_m: Array) -> Array:
    """Return the first terms (MOVING, 96) of lamps at a place (3,) from the middle, by the square of the distance."""
    away = DIRECTIONS - nearness * place_m
    distance = np.linalg.norm(away, axis=1)
    terms: Array = terms_at(away / distance[:, None])[:MOVING] / LAMBERT[:MOVING, None]
    return np.asarray(terms / distance**2)


_LAMPS = np.stack([_lamps(nearness) for nearness in NEARNESS])


@dataclass(frozen=True, slots=True, eq=False)
class RoomLight:
    """The light about the room's middle.

    terms: (ROOM_TERMS,), the even light in the middle 1.
    lamp: (3,) unit vector from the middle to the brightest lamp, and its nearness [1/m].
    differs: whether it is another one at another place.
    """

    terms: Array = field(default_factory=lambda: np.eye(ROOM_TERMS)[0])
    lamp: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    nearness: float = 0.0
    differs: bool = False

    def terms_at(self, place_m: Array) -> Array:
        """Return the terms (TERMS,) at a place (3,) from the middle in W [m]."""
        return _terms_at(self.terms, place_m)

    def lamp_at(self, place_m: Array) -> Array:
        """Return the unit vector (3,) from there to the brightest lamp."""
        towards = self.lamp - self.nearness * within(place_m)
        unit: Array = towards / np.linalg.norm(towards)
        return unit

    def recentred(self, shift_m: Array) -> RoomLight:
        """Return the same light about another middle, shift_m (3,) from the one before in W."""
        terms = about(-shift_m) @ self.terms
        return RoomLight(terms / max(terms[0], _DIMMEST), self.lamp_at(shift_m), self.nearness, self.differs)

    def taken_to(self, power: float) -> RoomLight:
        """Return all light taken to a power: what grows, grows by its slope."""
        light, grown = _AROUND.T @ self.terms[:TERMS], self.terms[TERMS:].reshape(3, MOVING) @ _AROUND[:MOVING]
        slope = power * np.maximum(light, _DIMMEST) ** (power - 1.0)
        terms = np.concatenate((_BACK @ _power(light, power), (slope * grown @ _FIRST_BACK.T).ravel()))
        return RoomLight(terms / terms[0], self.lamp, self.nearness, self.differs)


def raised(terms: Array, power: float) -> Array:
    """Return the terms (TERMS,) of light taken to a power, the even light 1."""
    after = _BACK @ _power(_AROUND.T @ terms, power)
    return np.asarray(after / after[0])


def _power(light: Array, power: float) -> Array:
    return np.asarray(np.maximum(light, _DARKEST) ** power)


@compiled("f8[::1](Array(f8, 1, 'C', True), Array(f8, 1, 'C', True))")
def _terms_at(room: Array, place_m: Array) -> Array:
    """Return the terms (TERMS,) of a room's light (ROOM_TERMS,) at a place (3,) from its middle in W [m]."""
    away_m = math.sqrt(place_m[0] ** 2 + place_m[1] ** 2 + place_m[2] ** 2)
    share, grown, terms = 1.0 if away_m <= FARTHEST_M else FARTHEST_M / away_m, np.zeros(MOVING), room[:TERMS].copy()
    for k in range(3):
        for i in range(MOVING):
            grown[i] += share * place_m[k] * room[TERMS + MOVING * k + i]
    if terms[0] + grown[0] < _DIMMEST:  # a straight line leads to no light, which there is none without
        grown *= (terms[0] - _DIMMEST) / -grown[0]
    for i in range(MOVING):
        terms[i] += grown[i]
    even = terms[0]
    for i in range(TERMS):
        terms[i] /= even
    return terms


def about(shift_m: Array) -> Array:
    """Return M (ROOM_TERMS, ROOM_TERMS): M times the terms about a middle shifted by shift_m (3,) are those about it.

    Source: a ball at d from the new middle is at d + shift from the old one, so a' = a + sum_k shift_k b_k.
    """
    by = np.eye(ROOM_TERMS)
    for k, along_m in enumerate(shift_m.tolist()):
        some = slice(TERMS + MOVING * k, TERMS + MOVING * (k + 1))
        by[:MOVING, some] = -along_m * np.eye(MOVING)
    return by


def within(place_m: Array) -> Array:
    """Return a place (3,) from the middle, or the farthest one on the way there that light is told for [m]."""
    away_m = float(np.linalg.norm(place_m))
    return place_m if away_m <= FARTHEST_M else place_m * (FARTHEST_M / away_m)


def explained(information: Array, target: Array) -> RoomLight:
    """Return the light that fits normal equations best among those that no lamp takes anything from.

    Lamps are first taken to be far away; then those that shine may be near, if that explains clearly more: what is
    free to hang anywhere follows chance.

    Args:
        information (ROOM_TERMS, ROOM_TERMS), target (ROOM_TERMS,): of the terms, the even light about 1.
    Raises:
        RuntimeError: the search for lamps did not end.
    """
    held = information + EVEN * np.eye(len(information))
    aim = target.copy()
    aim[0] += EVEN
    root = np.asarray(np.linalg.cholesky(held), np.float64)
    goal = np.asarray(np.linalg.solve(root, aim), np.float64)
    some = slice(0, TERMS)  # far lamps are alike everywhere: the root, a triangle, leaves nothing of them further down
    shares, far_misfit = _shares(root[some, some], goal[some], _LAMPS[0, some])
    far_misfit += float(goal[TERMS:] @ goal[TERMS:])
    lamps, towards, nearness = _LAMPS[0], DIRECTIONS, np.zeros(len(DIRECTIONS))
    shining = np.flatnonzero(shares)
    near = np.concatenate(_LAMPS[:, :, shining], axis=1)
    near_shares, misfit = _shares(root, goal, near)
    differs = misfit < NEAR_MISFIT * far_misfit
    if differs:
        lamps, shares, nearness = near, near_shares, np.repeat(NEARNESS, len(shining))
        towards = np.tile(DIRECTIONS[shining], (len(NEARNESS), 1))
    beam = shares * (towards @ towards[np.argmax(shares)] > BEAM)
    lamp = beam @ towards
    return RoomLight(lamps @ shares, lamp / np.linalg.norm(lamp), float(beam @ nearness / beam.sum()), differs)


def _shares(root: Array, goal: Array, lamps: Array) -> tuple[Array, float]:
    """Return how much light each of some lamps (ROOM_TERMS, n) throws, and the sum of squares that they leave.

    Returns:
        (n,) none negative, 1 together, and what they leave unexplained.
    """
    weight = ONE * root[0, 0]
    rows = np.vstack((root.T @ lamps, np.full(lamps.shape[1], weight)))
    shares, left = nnls(rows, np.append(goal, weight))
    return np.asarray(shares / shares.sum()), float(left) ** 2
