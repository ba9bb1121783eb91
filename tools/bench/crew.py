"""Work done side by side, one process for each core."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

import cv2

from tools.bench.trial import Flown, Trial, fly

One = TypeVar("One")
Result = TypeVar("Result")


def fly_all(trials: Sequence[Trial]) -> list[Flown]:
    """Fly trials and return what came of each, in their order."""
    return side_by_side(fly, trials)


def side_by_side(work: Callable[[One], Result], items: Sequence[One]) -> list[Result]:
    """Do work on each item and return the results in their order; the number of processes changes only the time."""
    workers = min(os.cpu_count() or 1, len(items))
    if workers <= 1:
        return [work(item) for item in items]
    # Spawned: a forked child would inherit the locks of threads that do not live on in it.
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=spawn, initializer=_alone) as pool:
        return list(pool.map(work, items, chunksize=1))


def _alone() -> None:
    """Keep OpenCV from starting threads of its own beside the other processes."""
    cv2.setNumThreads(1)
