"""Work done side by side, one process for each core."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
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
        with _unheard():
            results = [pool.submit(work, item) for item in items]
        try:
            return [result.result() for result in results]
        except BaseException:
            for process in multiprocessing.active_children():
                process.kill()
            raise


@contextmanager
def _unheard() -> Iterator[None]:
    """Keep Ctrl-C, which a terminal sends to all processes, from those begun meanwhile; here it is only put off."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _alone() -> None:
    """Keep OpenCV from starting threads of its own beside the other processes."""
    cv2.setNumThreads(1)
