"""Takes the times of each pair while the loop works on it."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

from bridge.clock import Nanoseconds
from tools.bench.pairs import Pair
from tools.bench.stages import Stages
from tools.request import CpuClocks
from tracker.types import Event, Frame


class Meter:
    """Keep the times of every pair. pairs: those so far."""

    def __init__(self, stopwatch: Nanoseconds, cpu: CpuClocks) -> None:
        self.pairs: list[Pair] = []
        self._stopwatch = stopwatch
        self._cpu = cpu
        self._garbage_ns = 0
        self._collecting_ns = 0

    def events(self, played: Iterator[tuple[Frame, ...]], stages: Stages) -> Iterator[Event]:
        """Yield every frame, and time each pair until the loop asks for the next one."""
        for pair in played:
            process_ns, thread_ns, garbage_ns = self._cpu.process(), self._cpu.thread(), self._garbage_ns
            started_ns = self._stopwatch()
            yield from pair
            wall_ns = self._stopwatch() - started_ns
            process_ns, thread_ns = self._cpu.process() - process_ns, self._cpu.thread() - thread_ns
            self.pairs.append(Pair(wall_ns, process_ns, thread_ns, self._garbage_ns - garbage_ns, stages.end_pair()))

    @contextmanager
    def watch_garbage(self) -> Iterator[None]:
        """Time the garbage collector."""
        gc.callbacks.append(self._note)
        try:
            yield
        finally:
            gc.callbacks.remove(self._note)

    def _note(self, phase: str, _details: dict[str, int]) -> None:
        if phase == "start":
            self._collecting_ns = self._stopwatch()
        else:
            self._garbage_ns += self._stopwatch() - self._collecting_ns
