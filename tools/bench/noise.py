"""A camera's noise, from the difference of images of one still scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.types import Array, Image

LAGS = 2  # pixels over which neighbours may share noise
LEAST_VARIANCE = 1.0 / 12.0  # of the quantisation
# BGR -> luma, blue difference, red difference (ITU-R BT.601)
TO_YCC = np.array([[0.114, 0.587, 0.299], [0.5, -0.331264, -0.168736], [-0.081312, -0.418688, 0.5]]).T


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """How a camera's noise is made up, in luma and colour differences.

    axes: (3, 3), columns are combinations of the channels whose noises are independent.  variances: (3,) of them.
    correlations: (3, 2 LAGS + 1, 2 LAGS + 1) of each with its neighbours.
    rise: the luma's variance at level L is variance_mean * (rise[0] + rise[1] L).
    """

    axes: Array
    variances: Array
    correlations: Array
    rise: tuple[float, float]

    def whitened(self, values: Array, luma: Array, whiteners: Array) -> Array:
        """Return values (n, 3, q) on a patch, in luma and colour differences, in units of the noise, flat (3 n, q).

        luma: (n,) expected, which sets how strong the noise is.  whiteners: of the patch.
        """
        strength = np.sqrt(np.maximum(self.rise[0] + self.rise[1] * luma, 0.05))
        parts = np.einsum("ncq,ck->nkq", values, self.axes) / strength[:, None, None]
        parts /= np.sqrt(self.variances)[None, :, None]
        return np.concatenate([whitener @ parts[:, k] for k, whitener in enumerate(whiteners)])

    def whiteners(self, half: int) -> Array:
        """Return for each component the matrix (3, n, n) that makes its noise white over a patch."""
        return np.stack([_whitener(self.correlations[k], half) for k in range(3)])


def _whitener(correlation: Array, half: int) -> Array:
    """Return the inverse root (n, n) of a correlation (2 LAGS + 1, 2 LAGS + 1) over a patch."""
    span = np.arange(2 * half + 1)
    u, v = (a.ravel() for a in np.meshgrid(span, span))
    du, dv = np.abs(u[:, None] - u), np.abs(v[:, None] - v)
    near = (du <= LAGS) & (dv <= LAGS)
    matrix = np.where(near, correlation[np.minimum(dv, LAGS) + LAGS, np.minimum(du, LAGS) + LAGS], 0.0)
    # Cut off at LAGS the function need not be one of a noise; what is negative then is too small to be measured.
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors / np.sqrt(np.maximum(values, 0.05))).T)


def measure_noise(pairs: Sequence[tuple[Image, Image, Array]]) -> Noise:
    """Measure the noise of a camera that does not move.

    Args:
        pairs: two images each, and where both show the same (h, w) bool.
    """
    covariance, correlations, levels, squares = np.zeros((3, 3)), [], [], []
    for before, after, same in pairs:
        ycc = [image.astype(np.float64) @ TO_YCC for image in (before, after)]
        difference = (ycc[1] - ycc[0]) / np.sqrt(2.0)
        covariance += np.cov(difference[same].T) / len(pairs)
        levels.append((ycc[0][..., 0] + ycc[1][..., 0])[same] / 2.0)
        squares.append(difference[..., 0][same] ** 2)
        correlations.append((difference, same))
    variances, axes = np.linalg.eigh(covariance)
    lagged = np.mean([_correlations(each @ axes, same) for each, same in correlations], axis=0)
    rise = _rise(np.concatenate(levels), np.concatenate(squares))
    return Noise(axes, np.maximum(variances, LEAST_VARIANCE), lagged, rise)


def _correlations(parts: Array, same: Array) -> Array:
    """Return the correlation of each part (h, w, 3) with itself shifted (3, 2 LAGS + 1, 2 LAGS + 1)."""
    parts = parts * same[..., None]
    height, width = same.shape
    result = np.empty((3, 2 * LAGS + 1, 2 * LAGS + 1))
    inner = parts[LAGS : height - LAGS, LAGS : width - LAGS]
    for dv in range(2 * LAGS + 1):
        for du in range(2 * LAGS + 1):
            shifted = parts[dv : height - 2 * LAGS + dv, du : width - 2 * LAGS + du]
            result[:, dv, du] = np.einsum("vuc,vuc->c", inner, shifted)
    return np.asarray(result / result[:, LAGS, LAGS][:, None, None])


def _rise(levels: Array, squares: Array) -> tuple[float, float]:
    """Fit the variance's rise with the grey level, relative to its mean: photons arrive one by one."""
    slope, start = np.polyfit(levels, squares, 1)
    mean = float(squares.mean())
    return float(start / mean), float(slope / mean)
