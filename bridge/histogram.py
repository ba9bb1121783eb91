"""Durations in bounded memory: percentiles of any number of samples from one fixed table."""

from __future__ import annotations

import math

from bridge.summary import NO_SAMPLES, Percentiles

LEAST_NS = 1_000
BINS_PER_DECADE = 200  # neighbouring bins are 1.16 % apart
DECADES = 8  # 1 us to 100 s


class Histogram:
    """Count durations in logarithmic bins; the largest is kept exactly."""

    def __init__(self) -> None:
        self._bins = [0] * (BINS_PER_DECADE * DECADES + 1)
        self._count = 0
        self._max_ns = 0

    def add(self, duration_ns: int) -> None:
        """Count one duration [ns]; those outside 1 us to 100 s count in the first or last bin."""
        place = round(BINS_PER_DECADE * math.log10(max(duration_ns, LEAST_NS) / LEAST_NS))
        self._bins[min(place, len(self._bins) - 1)] += 1
        self._count += 1
        self._max_ns = max(self._max_ns, duration_ns)

    def percentiles(self) -> Percentiles:
        """Return the spread [ms], each percentile the middle of its bin and none beyond the largest sample."""
        if self._count == 0:
            return NO_SAMPLES
        p50, p95, p99 = (self._quantile_ms(share) for share in (0.50, 0.95, 0.99))
        return Percentiles(self._count, p50, p95, p99, self._max_ns / 1e6)

    def _quantile_ms(self, share: float) -> float:
        """Return the duration that `share` of the samples do not exceed [ms]."""
        needed = math.ceil(share * self._count)
        seen = 0
        for place, count in enumerate(self._bins):
            seen += count
            if seen >= needed:
                return min(LEAST_NS * 10 ** (place / BINS_PER_DECADE), self._max_ns) / 1e6
        return self._max_ns / 1e6
