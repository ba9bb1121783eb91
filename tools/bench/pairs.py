"""What each pair of frames cost, where its time went, and why some took long."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bridge.histogram import Histogram
from bridge.summary import Percentiles

SLOW_NS = 2_000_000  # the goal's 99th percentile
WORST = 0.01
LOOP, LOG, GARBAGE, MACHINE = "loop", "log thread", "garbage collector", "other processes"


class Pair(NamedTuple):  # made while the loop is timed: a tuple costs it less
    """One pair's times [ns].

    wall: from its first frame to the end of the loop's work on both.
    process, thread: CPU time meanwhile of the whole process and of the loop's thread.
    garbage: spent in Python's garbage collector.  stages: by name, by the wall clock, one after the other.
    """

    wall: int
    process: int
    thread: int
    garbage: int
    stages: Mapping[str, int]

    @property
    def parts(self) -> dict[str, int]:
        """Return the stages and what is left of the wall time, the loop's own; they add up to it."""
        return {**self.stages, LOOP: self.wall - sum(self.stages.values())}


@dataclass(frozen=True, slots=True)
class Slow:
    """Pairs that took long.

    limit_ms, over_limit: how many pairs took longer than that.
    worst: how many pairs are the slowest hundredth.  causes: by what made most of them slow, how many.
    """

    limit_ms: float
    over_limit: int
    worst: int
    causes: dict[str, int]


def spread(durations_ns: Sequence[int]) -> Percentiles:
    """Return the percentiles of durations [ms]."""
    histogram = Histogram()
    for duration_ns in durations_ns:
        histogram.add(duration_ns)
    return histogram.percentiles()


def stages_of(pairs: Sequence[Pair]) -> dict[str, Percentiles]:
    """Return each part's spread over the pairs in which it occurred, the longest part first."""
    parts = [pair.parts for pair in pairs]
    return {name: spread([each[name] for each in parts if name in each]) for name in shares_of(pairs)}


def shares_of(pairs: Sequence[Pair]) -> dict[str, float]:
    """Return the share of each part in the whole time of all pairs, the largest first; they add up to 1."""
    total: Counter[str] = Counter()
    for pair in pairs:
        total.update(pair.parts)
    whole = sum(pair.wall for pair in pairs)
    return {name: took / whole for name, took in total.most_common()}


def slow_of(pairs: Sequence[Pair]) -> Slow:
    """Count the slow pairs, and what made the slowest hundredth so."""
    usual = Pair(
        wall=_median([pair.wall for pair in pairs]),
        process=_median([pair.process for pair in pairs]),
        thread=_median([pair.thread for pair in pairs]),
        garbage=_median([pair.garbage for pair in pairs]),
        stages=_usual_stages(pairs),
    )
    worst = sorted(pairs, key=lambda pair: pair.wall)[-max(1, round(WORST * len(pairs))) :]
    causes = Counter(_cause(pair, usual) for pair in worst)
    over = sum(pair.wall > SLOW_NS for pair in pairs)
    return Slow(SLOW_NS / 1e6, over, len(worst), dict(causes.most_common()))


def _usual_stages(pairs: Sequence[Pair]) -> dict[str, int]:
    names = dict.fromkeys(name for pair in pairs for name in pair.stages)
    return {name: _median([pair.stages.get(name, 0) for pair in pairs]) for name in names}


def _median(values: Sequence[int]) -> int:
    return round(float(np.median(values)))


def _cause(pair: Pair, usual: Pair) -> str:
    """Return what made at least half of a pair's time above the usual; where nothing did so, its longest-drawn part.

    What comes from outside the loop's own work happens within some stage, and so is looked for first.
    """
    excess = pair.wall - usual.wall
    outside = {
        GARBAGE: pair.garbage,
        LOG: pair.process - pair.thread,
        MACHINE: pair.wall - pair.process,
    }
    name = max(outside, key=lambda each: outside[each])
    if outside[name] >= excess / 2 > 0:
        return name
    before = usual.parts
    return max(pair.parts, key=lambda part: pair.parts[part] - before.get(part, 0))
