"""Whether an export's memory grows with the log, and how long it takes."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from bridge.log.entry import Entry, make_entry
from bridge.log.stream import open_stream
from bridge.log.writer import Cover, LogWriter
from bridge.settings import load_settings, rig_of
from bridge.wire import Sent
from tools.bench.memory import status_mb
from tools.export.export import ExportTerms, export
from tools.request import CpuClocks
from tracker.maths import so3
from tracker.types import BallSighting, Estimate, Frame, Step, TrackState, frozen_array

FRAME_NS = 66_666_667
START_NS = 1_000_000_000
FLUSH_ENTRIES = 16
QUARTERS = (0.25, 0.5, 0.75)
_NO_IMAGE = np.zeros((0, 0, 3), np.uint8)
_COVARIANCE = frozen_array(np.diag([1e-6] * 3 + [1e-5] * 3 + [1e-3] * 6))
_SPOT = frozen_array([[0.01, 0.0], [0.0, 0.01]])


@dataclass(frozen=True, slots=True)
class ExportFigures:
    """One export. hours: of the log.  grown_mb: resident memory's peak above what it was before [MB].

    grown_by_quarter_mb: the same at a quarter, half and three quarters of the log's second reading [MB].
    """

    format: str
    hours: float
    log_mb: float
    rows: int
    write_cpu_s: float
    export_cpu_s: float
    grown_mb: float
    grown_by_quarter_mb: tuple[float, ...]


def measure_export(hours: float, rate_hz: float, format: str, cpu: CpuClocks) -> ExportFigures:
    """Write a log of a flight of so many hours as fast as it goes, through the real writer, and export it.

    Raises:
        OperatorError: not on Linux, or a disk without room.
    """
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "long.mcap"
        started_ns = cpu.process()
        write_long(log, hours)
        written_ns = cpu.process()
        size, before_mb = log.stat().st_size, status_mb("VmRSS")
        watch = _Watch(size)
        done = export(log, ExportTerms(format, rate_hz), Path(folder) / f"long.{format}", watch)
        spent_s = (cpu.process() - written_ns) / 1e9
        grown = tuple(mb - before_mb for mb in watch.quarters_mb)
        return ExportFigures(
            format, hours, size / 1e6, done.count, (written_ns - started_ns) / 1e9, spent_s,
            watch.peak_mb - before_mb, grown,
        )  # fmt: skip


def write_long(path: Path, hours: float) -> None:
    """Write a log as a flight of so many hours leaves it: two cameras, 15 poses a second, a link."""
    rig = rig_of(load_settings("lab"), None).rig
    cover = Cover({}, {"run": {"pace": "real"}}, rig.cameras, rig.marker, START_NS)
    writer = LogWriter(open_stream(path, overwrite=False), cover)
    for k, entry in enumerate(_entries(round(hours * 3600e9 / FRAME_NS))):
        writer.write(entry)
        if k % FLUSH_ENTRIES == 0:
            writer.flush()
    writer.finish({})


def _entries(pairs: int) -> Iterator[Entry]:
    for k in range(pairs):
        t_ns = START_NS + k * FRAME_NS
        wall_ns = t_ns + 10**18 if k % 15 == 0 else None
        for camera in range(2):
            spots = tuple(BallSighting(camera, ball, t_ns, frozen_array([k % 640, ball]), _SPOT) for ball in range(3))
            estimates = (_estimate(t_ns, k),) if camera else ()
            sent = (_sent(t_ns),) if camera else ()
            step = Step(TrackState.TRACKING, spots, (), estimates)
            frame = Frame(camera, t_ns, _NO_IMAGE, 1)
            yield make_entry(frame, step, sent, t_ns + 8_000_000, None if camera else wall_ns)


def _estimate(t_ns: int, k: int) -> Estimate:
    swing = k * 0.05
    return Estimate(
        t_ns, frozen_array([np.sin(swing), np.cos(swing), 1.0]), frozen_array(so3.exp(frozen_array([0, 0, swing % 3]))),
        frozen_array([0.1, 0.0, 0.0]), frozen_array([0.0, 0.0, 0.1]), _COVARIANCE, TrackState.TRACKING, 0, 12.0, 12, 1,
        MappingProxyType({"find": 400_000, "filter": 90_000}),
    )  # fmt: skip


def _sent(t_ns: int) -> Sent:
    fields = {"usec": t_ns // 1000, "x": 0.5, "y": 0.25, "z": -1.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.5}
    return Sent("udpout:127.0.0.1:14550", "VISION_POSITION_ESTIMATE", t_ns, 9_000_000, 1_000_000, bytes(117), fields)


class _Watch:
    """Look at the process's size as the log is read."""

    def __init__(self, size_bytes: int) -> None:
        self._marks = [share * size_bytes for share in QUARTERS]
        self._walk, self._last, self._count = 1, 0, 0
        self.peak_mb = 0.0
        self.quarters_mb: list[float] = []

    def __call__(self, offset: int) -> None:
        self._walk += offset < self._last
        self._last = offset
        self._count += 1
        due = self._walk == 2 and len(self.quarters_mb) < len(QUARTERS) and offset >= self._marks[len(self.quarters_mb)]
        if due or self._count % 64 == 0:
            now_mb = status_mb("VmRSS")
            self.peak_mb = max(self.peak_mb, now_mb)
            if due:
                self.quarters_mb.append(now_mb)
