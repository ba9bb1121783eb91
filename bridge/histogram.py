"""Durations in bounded memory: percentiles of any number of samples from one fixed table."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

import numpy as np

from bridge.summary import NO_SAMPLES, Percentiles

LEAST_NS = 1_000
BINS_PER_DECADE = 200  # neighbouring bins are 1.16 % apart
DECADES = 8  # 1 us to 100 s
BINS = BINS_PER_DECADE * DECADES + 1
FOLD_AT = 512  # samples that wait to be counted together, so that one costs the loop next to nothing


class Histogram:
    """Count durations in logarithmic bins; the largest is kept exactly."""

    def __init__(self) -> None:
        self._bins = np.zeros(BINS, np.int64)
        self._waiting: list[int] = []
        self._count = 0
        self._max_ns = 0

    def add(self, duration_ns: int) -> None:
        """Count one duration [ns]; those outside 1 us to 100 s count in the first or last bin."""
        self._waiting.append(duration_ns)
        if len(self._waiting) >= FOLD_AT:
            self._fold()

    def percentiles(self) -> Percentiles:
        """Return the spread [ms], each percentile the middle of its bin and none beyond the largest sample."""
        self._fold()
        if self._count == 0:
            return NO_SAMPLES
        needed = [math.ceil(share * self._count) for share in (0.50, 0.95, 0.99)]
        places = self._bins.cumsum().searchsorted(needed).tolist()
        p50, p95, p99 = (min(LEAST_NS * 10 ** (place / BINS_PER_DECADE), self._max_ns) / 1e6 for place in places)
        return Percentiles(self._count, p50, p95, p99, self._max_ns / 1e6)

    def coarse(self, edges_ns: tuple[int, ...]) -> tuple[int, ...]:
        """Return how many samples lie below the first edge, between each two, and above the last; edges rising [ns]."""
        self._fold()
        below = [0, *np.append(0, self._bins.cumsum())[_places(edges_ns)].tolist(), self._count]
        return tuple(b - a for a, b in pairwise(below))

    def _fold(self) -> None:
        """Count what waits."""
        if not self._waiting:
            return
        self._count += len(self._waiting)
        self._max_ns = max(self._max_ns, *self._waiting)
        ratios = np.maximum(self._waiting, LEAST_NS) / LEAST_NS
        places = np.rint(BINS_PER_DECADE * np.log10(ratios)).astype(np.int64)
        self._bins += np.bincount(np.minimum(places, BINS - 1), minlength=BINS)
        self._waiting.clear()


@cache
def _places(edges_ns: tuple[int, ...]) -> list[int]:
    """Return how many bins lie below each edge [ns]."""
    places = (math.ceil(BINS_PER_DECADE * math.log10(edge / LEAST_NS) - 0.5) for edge in edges_ns)
    return [min(max(place, 0), BINS) for place in places]
