"""The light that explains best what balls show: lamps all round, none of which takes light away.

One camera sees one side of a ball, and a slope of light across it looks much like a centre pulled aside. Two things
tell them apart. Balls seen by all cameras are lit by the same room, from as many sides as there are cameras. And light
is never negative, which one lamp, a row of windows and an even sky obey alike: nothing else is supposed of them.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from tracker.image.harmonics import LAMBERT, terms_at
from tracker.maths.sphere import spread
from tracker.types import Array

DIRECTIONS = spread(96)
"""Where lamps may be (96, 3), 20 degrees apart: what lies between two is seen as both."""
EVEN = 8.0  # of each term before any ball: two lamps that share half of the light have a sigma of 0.35
ONE = 1e3  # how firmly the even light is held to 1, beside what is learned
BEAM = 0.9  # lamps closer to the brightest than that, by the cosine, are one with it
_LAMPS = terms_at(DIRECTIONS) / LAMBERT[:, None]  # of each lamp, the mean of its light over the ball 1


def explained(information: Array, target: Array) -> tuple[Array, Array]:
    """Return the light that fits normal equations best among those that no lamp takes anything from.

    Args:
        information (TERMS, TERMS), target (TERMS,): of the terms in W, their even light about 1.
    Returns:
        the terms (TERMS,), their even light 1; and the unit vector (3,) to the brightest lamp.
    """
    held = information + EVEN * np.eye(len(information))
    aim = target.copy()
    aim[0] += EVEN
    root = np.linalg.cholesky(held)
    weight = ONE * root[0, 0]
    rows = np.vstack((root.T @ _LAMPS, np.full(_LAMPS.shape[1], weight)))
    lamps, _ = nnls(rows, np.append(np.linalg.solve(root, aim), weight))
    lamps /= lamps.sum()
    near = lamps * (DIRECTIONS @ DIRECTIONS[np.argmax(lamps)] > BEAM)
    towards = near @ DIRECTIONS
    return _LAMPS @ lamps, towards / np.linalg.norm(towards)
