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

from tracker.types import Array

ORDER = 6


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """r_k = sum a_j r_{k-j} + e_k for each channel, with e of one covariance.

    weights: (channels, ORDER) the a.  whiten: (channels, channels), turns e into unit noise.
    """

    weights: Array
    whiten: Array

    def whitened(self, rows: Array) -> Array:
        """Return the unit noise (m - order, channels, ...) behind residuals (m, channels, ...) or their derivatives."""
        order = self.weights.shape[1]
        left = rows[order:].copy()
        shape = (-1,) + (1,) * (rows.ndim - 2)
        for j in range(order):
            left -= self.weights[:, j].reshape(shape) * rows[order - 1 - j : len(rows) - 1 - j]
        return np.asarray(np.einsum("ij,mj...->mi...", self.whiten, left))


def white(sigma: Array) -> Noise:
    """Return the noise of channels that are white and apart, one sigma each (channels,)."""
    return Noise(np.zeros((len(sigma), 0)), np.diag(1.0 / sigma))


def fitted(rows: list[Array]) -> Noise:
    """Fit the noise to the residuals of each track (m, channels) by least squares."""
    channels = rows[0].shape[1]
    weights = np.zeros((channels, ORDER))
    for c in range(channels):
        past = np.vstack([_past(each[:, c]) for each in rows])
        now = np.concatenate([each[ORDER:, c] for each in rows])
        weights[c] = np.linalg.lstsq(past, now, rcond=None)[0]
    plain = Noise(weights, np.eye(channels))
    left = np.vstack([plain.whitened(each) for each in rows])
    covariance = left.T @ left / len(left)
    return Noise(weights, np.linalg.inv(np.linalg.cholesky(covariance)))


def _past(values: Array) -> Array:
    """Return the ORDER values before each from the ORDER-th on, newest first."""
    return np.column_stack([values[ORDER - 1 - j : len(values) - 1 - j] for j in range(ORDER)])
