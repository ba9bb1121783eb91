"""Whether a long run grows."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from bridge.clock import StreamClock
from bridge.monitor import Monitor
from bridge.run import Outlets, close, run
from bridge.settings import Settings
from tools.bench.footage import Footage
from tools.request import Clocks
from tools.session import links_of, recorder_of, tracker_of
from tracker.errors import OperatorError
from tracker.types import Event

INSTANTS = 30  # frames kept: two cameras' 2 s are 55 MB
STATUS = Path("/proc/self/status")


@dataclass(frozen=True, slots=True)
class Memory:
    """Resident memory of one run with link and log, by stereo pairs done, and the most there ever was [MB]."""

    resident_mb: dict[int, float]
    peak_mb: float
    log_mb: float


def measure_memory(settings: Settings, clocks: Clocks, pairs: int) -> Memory:
    """Run that many pairs through the whole loop, log included, and look at the process's size on the way.

    Raises:
        OperatorError: not on Linux.
    """
    if not STATUS.exists():
        raise OperatorError("bench memory: reads /proc/self/status, which only Linux has; run it there")
    footage = Footage(settings, clocks, "figure8", INSTANTS)
    resident: dict[int, float] = {}
    every = max(1, pairs // 10)

    def events() -> Iterator[Event]:
        for k, pair in enumerate(footage.play(pairs)):
            yield from pair
            if (k + 1) % every == 0:
                resident[k + 1] = status_mb("VmRSS")

    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "bench.mcap"
        recorder = recorder_of(log, settings, footage.rig, {"source": "bench"}, clocks, block_when_full=True)
        monitor = Monitor(tuple(camera.name for camera in footage.rig.cameras))
        outlets, clock = Outlets(links_of(settings, clocks), monitor, recorder), StreamClock()
        try:
            run(events(), tracker_of(settings, footage.rig, clocks), clock, outlets)
        finally:
            close(clock, outlets)
        return Memory(resident, status_mb("VmHWM"), log.stat().st_size / 1e6)


def status_mb(name: str) -> float:
    """Return a line of the kernel's account of this process [MB]."""
    for line in STATUS.read_text(encoding="ascii").splitlines():
        if line.startswith(f"{name}:"):
            return int(line.split()[1]) * 1024 / 1e6
    raise OperatorError(f"bench memory: {STATUS} has no {name}; this kernel does not account for memory")
