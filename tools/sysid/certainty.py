"""How sure the parameters are: the Cramer-Rao bound, made honest.

Two kinds of error (JCGM 100, "Guide to the expression of uncertainty in measurement"). Type A, by statistics: the bound
from the whitened residuals' derivatives, and where residuals are still coloured or uneven in time the sandwich formula
of Newey and West, which for even ones is Morelli and Klein's correction ("Accuracy of aerodynamic model parameters",
J. Aircraft 34, 1997); Maine and Iliff multiply by a factor for the same reason. The larger of the two counts. Type B,
by knowledge: pulses come in whole microseconds, the autopilot's clock is known to so many milliseconds, and a model
with constant coefficients is a simplification: `MODEL_SHARE` of each value.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tools.sysid import parameters
from tools.sysid.fit import Fit
from tools.sysid.parameters import INDEX, NAMES
from tracker.types import Array

MODEL_SHARE = 0.01
"""One sigma of what constant coefficients cannot tell, as a share of each value. The simulated helicopter's own come
out within 0.5 to 1.5 % through cameras whatever the seed, more than chance allows."""

LEVEL_SIGMA = 1e-3
"""One sigma of the marker's tilt against the rotor disc [rad]: gusts and trim tell it from level flight only as far as
the model is right to second order, as in yaw with a tilt. A trim has the stick's share of it."""

HIGH_CORRELATION = 0.9
COVERAGE = 2.0
"""Standard errors to both sides that hold the truth in about 95 of 100 cases."""

_MEMORY = 15


@dataclass(frozen=True, slots=True, eq=False)
class Certainty:
    """One sigma of each parameter (20,).

    bound: Cramer-Rao.  chance: type A.  total: with type B.  correlation: (20, 20), type A.
    """

    bound: Array
    chance: Array
    total: Array
    correlation: Array

    def entangled(self) -> list[tuple[str, str, float]]:
        """Return the pairs of parameters that the flight hardly tells apart, the worst first."""
        rows, columns = np.triu_indices(parameters.COUNT, 1)
        pairs = [
            (NAMES[i], NAMES[j], float(self.correlation[i, j]))
            for i, j in zip(rows, columns, strict=True)
            if abs(self.correlation[i, j]) > HIGH_CORRELATION
        ]
        return sorted(pairs, key=lambda pair: -abs(pair[2]))


def certainty(fit: Fit, clock_s: float, pulse_step: float) -> Certainty:
    """Return how sure a fit is.

    Args:
        clock_s: one sigma of the servos' times [s].  pulse_step: one microsecond, as a share of full stick.
    """
    information = sum(np.einsum("mcp,mcq->pq", J, J) for J in fit.jacobian)
    inverse = np.linalg.pinv(np.asarray(information), hermitian=True)
    scores = [np.einsum("mcp,mc->mp", J, left) for J, left in zip(fit.jacobian, fit.left, strict=True)]
    sandwich = inverse @ sum(_spread(each) for each in scores) @ inverse
    count = parameters.COUNT
    bound = np.sqrt(np.maximum(np.diag(inverse)[:count], 0.0))
    chance = np.maximum(bound, np.sqrt(np.maximum(np.diag(sandwich)[:count], 0.0)))
    scale = np.sqrt(np.maximum(np.diag(inverse)[:count], 1e-300))
    correlation = inverse[:count, :count] / np.outer(scale, scale)
    known = _known(fit.unknowns.theta, pulse_step)
    known[INDEX["delay"]] = np.hypot(known[INDEX["delay"]], clock_s)
    return Certainty(bound, chance, np.hypot(chance, known), correlation)


def _known(theta: Array, pulse_step: float) -> Array:
    """Return one sigma of the errors that no statistics show (20,), but for the clock's."""
    known = MODEL_SHARE * np.abs(theta)
    for axis in ("roll", "pitch", "yaw", "heave"):
        trim = INDEX[f"{axis}_trim"]
        known[trim] = np.hypot(known[trim], pulse_step / np.sqrt(12.0))
    for axis in ("roll", "pitch"):
        trim, level = INDEX[f"{axis}_trim"], INDEX[f"{axis}_level"]
        per_level = theta[INDEX[f"{axis}_stiffness"]] / theta[INDEX[f"{axis}_gain"]]
        known[level] = np.hypot(known[level], LEVEL_SIGMA)
        known[trim] = np.hypot(known[trim], per_level * LEVEL_SIGMA)
    return np.asarray(known)


def _spread(scores: Array) -> Array:
    """Return the covariance of the sum of scores (m, p) with a memory of 15 samples, Bartlett's weights."""
    total = scores.T @ scores
    for lag in range(1, min(_MEMORY, len(scores) - 1) + 1):
        part = scores[lag:].T @ scores[:-lag]
        total = total + (1.0 - lag / (_MEMORY + 1.0)) * (part + part.T)
    return np.asarray(total)
