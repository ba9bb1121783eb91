"""What mended cameras are known to: chance, what does not average out, and the cameras that hold the room.

Neighbouring instants err alike: a ball's shade changes as slowly as the vehicle turns. So chance counts for as many
instants as there are independent ones, by how long the residuals stay alike; what stays alike for ever is the bias.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from tools.calibrate.refine.equations import Equation, Unknowns, normal
from tracker.filter.measure import Indices
from tracker.health.sample import MOTION
from tracker.rig import Rig
from tracker.types import Array

BIAS_PX = 0.03  # by which a camera sees a ball aside always, however still the pixels are: shade, paint, the arms
ALIKE_S = 2.0  # residuals may stay alike for so long; what does so longer is bias

Held = Mapping[int, Array]
"""One sigma (6,) of cameras that did not move: place in W [m], turn in W [rad]. Those left out are taken as exact."""


def covariance_of(of: Sequence[Equation], rig: Rig, unknowns: Unknowns, done: Array, held: Held) -> Array:
    """Return the covariance (size, size) of the unknowns.

    Source: with N the information and A the slopes' products with what else errs (balls' biases, the stand of the held
        cameras), of covariance B: s N^-1 + N^-1 A B A' N^-1, the "consider" covariance of Bierman, "Factorization
        Methods for Discrete Sequential Estimation" (1977), section VIII; s is the residuals' variance over what was
        claimed, times how many instants tell what one independent one does.
    """
    N, _ = normal(of, unknowns, done)
    inverse = np.linalg.inv(N)
    balls = len(rig.marker)
    by_bias, by_stand = (np.zeros((unknowns.size, k * len(rig.cameras))) for k in (2 * balls, MOTION))
    for each in of:
        np.add.at(by_bias.T, _channels(each, balls), each.told * each.one.weight[:, None])
        by_stand += each.told.T @ each.one.D
    stand = np.concatenate([held.get(c, np.zeros(MOTION)) for c in range(len(rig.cameras))])
    shifts = inverse @ np.hstack((BIAS_PX * by_bias, by_stand * stand))
    return np.asarray(_excess(of) * alike(of, balls) * inverse + shifts @ shifts.T)


def _channels(each: Equation, balls: int) -> Indices:
    """Return of each residual (2n,) which ball it is of in which camera, and along which axis, as a number."""
    first = 2 * np.array([balls * sighting.camera + sighting.ball for sighting in each.instant.sightings])
    return np.stack((first, first + 1), axis=1).reshape(-1).astype(np.int64)


def _excess(of: Sequence[Equation]) -> float:
    """Return the residuals' variance over what the images claim; 1 at least."""
    rests = [each.rest() for each in of]
    count = sum(len(rest) - MOTION for rest in rests)
    return max(1.0, sum(float(rest @ rest) for rest in rests) / max(1, count))


def alike(of: Sequence[Equation], balls: int) -> float:
    """Return how many instants tell as much as one independent one; 1 at least.

    Source: the integrated autocorrelation 1 + 2 sum rho_k of the residuals, each ball's in each camera without its
        mean, summed while it is positive: Geyer, "Practical Markov chain Monte Carlo", Statistical Science 7 (1992).
    """
    series: dict[int, dict[int, float]] = defaultdict(dict)
    for k, each in enumerate(of):
        for channel, value in zip(_channels(each, balls).tolist(), each.rest().tolist(), strict=True):
            series[channel][k] = value
    rests = np.full((len(series), len(of)), np.nan)
    for row, values in zip(rests, series.values(), strict=True):
        row[list(values)] = list(values.values())
    rests -= np.nanmean(rests, axis=1, keepdims=True)
    t_s = np.array([each.instant.state.t_ns for each in of]) * 1e-9
    most = int(ALIKE_S / max(float(np.median(np.diff(t_s))), 1e-3)) if len(t_s) > 1 else 0
    spread, total = float(np.nanmean(rests**2)), 1.0
    for lag in range(1, min(most, len(of) - 1) + 1):
        rho = float(np.nanmean(rests[:, lag:] * rests[:, :-lag])) / max(spread, 1e-30)
        if not rho > 0.0:
            break
        total += 2.0 * rho
    return total
