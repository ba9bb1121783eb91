"""Whether the filter's own figures of its errors are true: a Monte Carlo through rendered cameras.

Each run flies another made-up path in another made-up room: other light, lens, sensor and noise. Errors of neighbouring
instants have much in common, which would make a band for independent ones too narrow; so only a few instants of each
run count, INSTANTS_S, a second apart, after the light has been learned.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from tools.bench.crew import fly_all
from tools.bench.trial import Flown, Trial
from tracker.scene.random_look import random_look
from tracker.sources.sim import SimTiming
from tracker.state import ATTITUDE, POSITION, RATE, VELOCITY
from tracker.types import Array

INSTANTS_S = (1.6, 2.6, 3.6)
DURATION_S = 3.8
PARTS: Mapping[str, slice] = {"position": POSITION, "attitude": ATTITUDE, "velocity": VELOCITY, "rate": RATE}
COVERAGE = 0.95


@dataclass(frozen=True, slots=True)
class Average:
    """A mean of chi-square sums over their degrees of freedom: 1 when honest, less is too cautious, more a lie.

    band: where 95 % of such means lie.  count: independent sums in the mean.
    """

    mean: float
    band: tuple[float, float]
    count: int

    @property
    def honest(self) -> bool:
        """Say whether the mean lies in its band."""
        return self.band[0] <= self.mean <= self.band[1]


@dataclass(frozen=True, slots=True)
class Consistency:
    """A Monte Carlo.

    instants, missing: those that count, and how many of them gave no estimate.
    nees: of position, attitude, velocity and rate.  nis: of the innovations.
    rms: of the length of each part's error: position [mm], attitude [deg], velocity [m/s], rate [deg/s], at every
        estimate after the first of INSTANTS_S.
    wrong: estimates of all runs outside 5 sigma, out of `estimates`.
    """

    seeds: int
    gamma: float
    instants: int
    missing: int
    nees: dict[str, Average]
    nis: Average
    rms: dict[str, float]
    wrong: int
    estimates: int


def measure_consistency(seeds: int, gamma: float) -> Consistency:
    """Fly that many seeds. gamma: of the simulated cameras."""
    timing = SimTiming(15.0, DURATION_S)
    runs = fly_all([Trial(f"random-{seed}", timing, random_look(seed, gamma), seed) for seed in range(seeds)])
    return judged(runs, gamma)


def judged(runs: Sequence[Flown], gamma: float) -> Consistency:
    """Average the runs of a Monte Carlo."""
    chosen = [run.rows(_instants(run)) for run in runs]
    sums = {name: np.concatenate([run.nees(part) for run in chosen]) for name, part in PARTS.items()}
    later = [run.between(INSTANTS_S[0], np.inf) for run in runs]
    units = {"position": 1e3, "attitude": np.degrees(1.0), "velocity": 1.0, "rate": np.degrees(1.0)}
    rms = {
        name: units[name] * _rms(np.concatenate([run.errors[:, part] for run in later])) for name, part in PARTS.items()
    }
    found, wanted = sum(map(len, chosen)), len(INSTANTS_S) * len(runs)
    return Consistency(
        seeds=len(runs),
        gamma=gamma,
        instants=wanted,
        missing=wanted - found,
        nees={name: average(values, np.full(len(values), 3.0)) for name, values in sums.items()},
        nis=average(np.concatenate([run.nis for run in chosen]), np.concatenate([run.nis_dof for run in chosen])),
        rms=rms,
        wrong=sum(len(run.wrong()) for run in runs),
        estimates=sum(map(len, runs)),
    )


def average(sums: Array, freedoms: Array) -> Average:
    """Average independent chi-square sums (n,) with their degrees of freedom (n,).

    Source: the total is chi-square with the total of the freedoms (Bar-Shalom, Li, Kirubarajan, "Estimation with
        Applications to Tracking and Navigation", 5.4.2).
    """
    freedom = float(freedoms.sum())
    low, high = chi2.ppf(((1.0 - COVERAGE) / 2.0, (1.0 + COVERAGE) / 2.0), freedom) / freedom
    return Average(float(sums.sum() / freedom), (float(low), float(high)), len(sums))


def _instants(run: Flown) -> NDArray[np.intp]:
    """Return the estimates at INSTANTS_S, within half a frame."""
    gaps = np.abs(run.seconds[:, None] - np.array(INSTANTS_S))
    nearest = np.argmin(gaps, axis=0)
    return np.asarray(nearest[gaps[nearest, np.arange(len(INSTANTS_S))] <= 0.5 / 15.0])


def _rms(errors: Array) -> float:
    return float(np.sqrt((errors * errors).sum(axis=1).mean()))
