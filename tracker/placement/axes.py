"""How the two cameras' optical axes should lie in the room: the paper's section 2.3, eq. 1-3, table 1, fig. 4."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tracker.types import Array

PAPER_OPTIMUM = (math.pi / 4.0, math.pi / 4.0, math.pi / 4.0, -3.0 * math.pi / 4.0)
"""phi_A, phi_B, psi_A, psi_B."""
TOLERANCE = 1e-12


class Case(StrEnum):
    """What eq. 1 leaves of psi_B when phi_A, phi_B and psi_A are chosen: the cells of table 1."""

    NONE = "no solution"
    FREE = "psi_A, psi_B free"
    QUARTER = "psi_B = psi_A +- pi/2"
    ARC = "psi_B = psi_A +- acos(-1 / (tan phi_A tan phi_B))"


@dataclass(frozen=True, slots=True)
class Solutions:
    """Case of table 1 and the azimuths psi_B that meet eq. 1 [rad]; none in case NONE, any would do in case FREE."""

    case: Case
    psi_B: tuple[float, ...]


def axis(phi: float, psi: float) -> Array:
    """Return the unit vector (3,) of polar angle phi (from z) and azimuth psi [rad]."""
    return np.array([math.sin(phi) * math.cos(psi), math.sin(phi) * math.sin(psi), math.cos(phi)])


def orthogonality(phi_A: float, phi_B: float, psi_A: float, psi_B: float) -> float:
    """Return the left side of eq. 1, u_A . u_B: 0 where the axes meet at a right angle."""
    return math.sin(phi_A) * math.sin(phi_B) * math.cos(psi_A - psi_B) + math.cos(phi_A) * math.cos(phi_B)


def solve(phi_A: float, phi_B: float, psi_A: float) -> Solutions:
    """Solve eq. 1 for psi_B.

    Args:
        phi_A, phi_B: polar angles, 0 to pi/2.  psi_A: azimuth [rad].
    Returns:
        The case of table 1. The paper writes only the minus sign of case ARC; both signs meet eq. 1.
    """
    sines, cosines = math.sin(phi_A) * math.sin(phi_B), math.cos(phi_A) * math.cos(phi_B)
    if abs(sines) < TOLERANCE:
        return Solutions(Case.FREE, (psi_A,)) if abs(cosines) < TOLERANCE else Solutions(Case.NONE, ())
    cosine = -cosines / sines
    if cosine < -1.0 - TOLERANCE:
        return Solutions(Case.NONE, ())
    turn = math.acos(max(cosine, -1.0))
    case = Case.QUARTER if abs(cosines) < TOLERANCE else Case.ARC
    return Solutions(case, (psi_A - turn, psi_A + turn))


def image_motion(u: Array) -> Array:
    """Return how far the image moves for a unit step along x, y and z of the room, (..., 3), u (..., 3) the axis.

    Source: eq. 3, sqrt(1 - u_axis^2): what of the step lies across the optical axis. The paper's third row has
        cos psi where u_z = cos phi belongs; `image_motion_as_printed` keeps the slip for comparison.
    """
    return np.asarray(np.sqrt(np.maximum(1.0 - u**2, 0.0)))


def image_motion_as_printed(phi: float, psi: float) -> Array:
    """Return eq. 3 (3,) with the third row as it is printed."""
    u = axis(phi, psi)
    return image_motion(np.array([u[0], u[1], math.cos(psi)]))


def total_motion(phi_A: float, phi_B: float, psi_A: float, psi_B: float, *, as_printed: bool = False) -> float:
    """Return the sum over both cameras and three axes that eq. 2-3 maximise, in units of the step delta."""
    if as_printed:
        return float(sum(image_motion_as_printed(*each).sum() for each in ((phi_A, psi_A), (phi_B, psi_B))))
    return float(image_motion(axis(phi_A, psi_A)).sum() + image_motion(axis(phi_B, psi_B)).sum())


def orientations(step_rad: float) -> Iterator[tuple[float, float, float, float]]:
    """Yield the (phi_A, phi_B, psi_A, psi_B) of a sweep that meet eq. 1, as for fig. 4.

    phi_A, phi_B and psi_A go from 0 to pi/2 in steps; psi_B follows. Where it is free, it goes round in steps.
    """
    quarter = [k * step_rad for k in range(round(math.pi / 2.0 / step_rad) + 1)]
    circle = [k * step_rad - math.pi for k in range(round(2.0 * math.pi / step_rad))]
    for phi_A in quarter:
        for phi_B in quarter:
            for psi_A in quarter:
                found = solve(phi_A, phi_B, psi_A)
                for psi_B in circle if found.case is Case.FREE else found.psi_B:
                    yield phi_A, phi_B, psi_A, math.remainder(psi_B, 2.0 * math.pi)


def best_orientation(step_rad: float, *, as_printed: bool = False) -> tuple[tuple[float, float, float, float], float]:
    """Return the best orientation of a sweep and its total motion; of equals the first."""
    swept = ((each, total_motion(*each, as_printed=as_printed)) for each in orientations(step_rad))
    return max(swept, key=lambda pair: pair[1])
