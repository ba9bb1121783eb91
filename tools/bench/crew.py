"""Trials flown side by side, one process for each core."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor

import cv2

from tools.bench.trial import Flown, Trial, fly


def fly_all(trials: Sequence[Trial]) -> list[Flown]:
    """Fly trials and return what came of each, in their order; the number of processes changes nothing but the time."""
    workers = min(os.cpu_count() or 1, len(trials))
    if workers <= 1:
        return [fly(trial) for trial in trials]
    # Spawned: a forked child would inherit the locks of threads that do not live on in it.
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=spawn, initializer=_alone) as pool:
        return list(pool.map(fly, trials, chunksize=1))


def _alone() -> None:
    """Keep OpenCV from starting threads of its own beside the other processes."""
    cv2.setNumThreads(1)
