"""The times between samples, of any number of them in bounded memory, with a median good enough to be a period."""

from __future__ import annotations

import math

BINS_PER_DECADE = 200


class Intervals:
    """Count intervals in logarithmic bins, 1.2 % wide, each with its sum: regular ones come back exactly."""

    def __init__(self) -> None:
        self._bins: dict[int, list[int]] = {}
        self.count = 0
        self.longest_ns = 0

    def add(self, interval_ns: int) -> None:
        """Count one, longer than 0 ns."""
        place = self._bins.setdefault(round(BINS_PER_DECADE * math.log10(interval_ns)), [0, 0])
        place[0] += 1
        place[1] += interval_ns
        self.count += 1
        self.longest_ns = max(self.longest_ns, interval_ns)

    def quantile_ns(self, share: float) -> float | None:
        """Return the interval that `share` of them do not exceed: the mean of its bin [ns]; None without any."""
        needed, below = math.ceil(share * self.count), 0
        for place in sorted(self._bins):
            count, total_ns = self._bins[place]
            below += count
            if below >= needed:
                return total_ns / count
        return None
