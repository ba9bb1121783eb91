"""The equations of what is to be found: the bumped cameras' motions, and the clocks; the vehicle's poses taken out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tools.calibrate.refine.evidence import Instant
from tracker.health.sample import MOTION, Linear, linearised
from tracker.rig import Rig
from tracker.types import Array

SIGMA_PX = 0.05  # what a camera adds to its fits
CAUCHY = 2.4  # sigmas; Holland, Welsch, "Robust regression using iteratively reweighted least squares" (1977)
BUMP_M, BUMP_RAD = 0.03, np.radians(2.0)  # one sigma, so that what nothing tells stays where it was


@dataclass(frozen=True, slots=True)
class Unknowns:
    """What is to be found, and where it stands: of each bumped camera its motion, then the clocks of all but camera 0.

    cameras: how many there are.  bumped: which were bumped.
    clock_s: one sigma of a clock's offset beforehand; 0 where the clocks are known, and none is to be found [s].
    """

    cameras: int
    bumped: tuple[int, ...]
    clock_s: float

    @property
    def motions(self) -> int:
        """Return how many unknowns are motions: the first."""
        return MOTION * len(self.bumped)

    @property
    def size(self) -> int:
        """Return how many unknowns there are."""
        return self.motions + (self.cameras - 1) * (self.clock_s > 0.0)

    def prior(self) -> Array:
        """Return the inverse variance of each beforehand (size,)."""
        motion = np.repeat([BUMP_M**-2, BUMP_RAD**-2], 3)
        clocks = np.full(self.size - self.motions, self.clock_s**-2 if self.clock_s > 0.0 else 0.0)
        return np.concatenate((np.tile(motion, len(self.bumped)), clocks))

    def slopes(self, one: Linear) -> Array:
        """Return how the whitened pixels go with each unknown (2n, size)."""
        columns = [one.D[:, MOTION * c : MOTION * (c + 1)] for c in self.bumped]
        return np.hstack((*columns, one.C[:, : self.size - self.motions]))


@dataclass(frozen=True, slots=True, eq=False)
class Equation:
    """One instant. one: its sightings, weighed robustly.  slopes (2n, size): see `Unknowns.slopes`.

    told (2n, size): what of them another pose of the vehicle does not explain.
    """

    instant: Instant
    one: Linear
    slopes: Array
    told: Array

    def rest(self) -> Array:
        """Return the residuals (2n,) that another pose does not explain."""
        return np.asarray(self.one.r - self.one.J @ np.linalg.lstsq(self.one.J, self.one.r)[0])

    def pose(self, step: Array) -> Array:
        """Return how the vehicle's pose (6,) goes with a step of the unknowns."""
        return np.asarray(np.linalg.lstsq(self.one.J, self.one.r - self.slopes @ step)[0])

    def at_vehicle(self) -> Array:
        """Return by how much the vehicle's place goes with the unknowns (3, size)."""
        return np.asarray(np.linalg.lstsq(self.one.J, self.slopes)[0][:3])


def equations(instants: Sequence[Instant], rig: Rig, unknowns: Unknowns) -> list[Equation]:
    """Linearise those instants at which two cameras see enough of the marker."""
    found = []
    for instant in instants:
        one = linearised(instant.sightings, instant.state, rig, SIGMA_PX)
        if one is not None:
            one = _weighed(one)
            slopes, basis = unknowns.slopes(one), np.linalg.qr(one.J)[0]
            found.append(Equation(instant, one, slopes, slopes - basis @ (basis.T @ slopes)))
    return found


def normal(of: Sequence[Equation], unknowns: Unknowns, done: Array) -> tuple[Array, Array]:
    """Return the normal equations' matrix and right side of a step on top of what was done already (size,)."""
    prior = unknowns.prior()
    N, g = np.diag(prior), -prior * done
    for each in of:
        N, g = N + each.told.T @ each.told, g + each.told.T @ each.one.r
    return N, g


def _weighed(one: Linear) -> Linear:
    """Return an instant whose sightings count by how well they fit."""
    rest = one.r - one.J @ np.linalg.lstsq(one.J, one.r)[0]
    squared = (rest.reshape(-1, 2) ** 2).sum(axis=1) / 2.0
    root = np.repeat(1.0 / np.sqrt(1.0 + squared / CAUCHY**2), 2)
    column = root[:, None]
    return replace(one, r=root * one.r, J=column * one.J, D=column * one.D, C=column * one.C, weight=root * one.weight)
