"""What the model leaves over, as a noise model: autoregressive in time, correlated between channels.

Gusts push the vehicle, and what they did to its speed stays for a second: residuals of output error are coloured.
Taking them for white, each sample would count as news: the fit would trust slow drift too much, and the parameters'
stated errors would be too small. Residuals are therefore whitened before they are squared. With inputs that are
measured, and fed back from the outputs, that is the prediction error method, consistent in closed loop where plain
output error is not (Ljung, "System identification", 2nd ed. 1999, 13.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tracker.types import Array

ORDER = 6


@dataclass(frozen=True, slots=True, eq=False)
class Predictor:
    """r_k = sum a_j r_{k-j} + e_k for each channel, with e of one covariance.

    weights: (channels, order) the a.  whiten: (channels, channels), turns e into unit noise.
    """

    weights: Array
    whiten: Array

    def errors(self, rows: Array) -> Array:
        """Return e (m - order, channels, ...) behind residuals (m, channels, ...) or their derivatives."""
        order = self.weights.shape[1]
        left = rows[order:].copy()
        shape = (-1,) + (1,) * (rows.ndim - 2)
        for j in range(order):
            left -= self.weights[:, j].reshape(shape) * rows[order - 1 - j : len(rows) - 1 - j]
        return left

    def unit(self, rows: Array) -> Array:
        """Return the errors as unit noise."""
        return np.asarray(np.einsum("ij,mj...->mi...", self.whiten, self.errors(rows)))


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """The residuals of a track, each foretold by those before it.

    predictors: the k-th, of order k, for a track's k-th residual, the last for it and all that follow. Were the first
    residuals left out, nothing would hold the first rates, which are forgotten within them.
    """

    predictors: tuple[Predictor, ...]

    def whitened(self, rows: Array) -> Array:
        """Return the unit noise (m, channels, ...) behind residuals (m, channels, ...) or their derivatives."""
        *first, rest = self.predictors
        return np.concatenate([each.unit(rows[: k + 1]) for k, each in enumerate(first)] + [rest.unit(rows)])


def white(sigma: Array) -> Noise:
    """Return the noise of channels that are white and apart, one sigma each (channels,)."""
    return Noise((Predictor(np.zeros((len(sigma), 0)), np.diag(1.0 / sigma)),))


def fitted(rows: list[Array]) -> Noise:
    """Fit the noise to the residuals of each track (m, channels) by least squares."""
    return Noise(tuple(_predictor(rows, order) for order in range(ORDER + 1)))


def _predictor(rows: list[Array], order: int) -> Predictor:
    channels = rows[0].shape[1]
    weights = np.zeros((channels, order))
    for c in range(channels):
        past = np.vstack([_past(each[:, c], order) for each in rows])
        now = np.concatenate([each[order:, c] for each in rows])
        weights[c] = np.linalg.lstsq(past, now, rcond=None)[0]
    plain = Predictor(weights, np.eye(channels))
    left = np.vstack([plain.errors(each) for each in rows])
    return Predictor(weights, np.linalg.inv(np.linalg.cholesky(left.T @ left / len(left))))


def _past(values: Array, order: int) -> Array:
    """Return the values before each from the order-th on (m - order, order), newest first."""
    return sliding_window_view(values, order + 1)[:, :order][:, ::-1]
