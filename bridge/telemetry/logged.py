"""The telemetry of a run that is over, from its log: the same gauges, alarms and figures, fed with the logged turns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import orjson

from bridge.alarms import Limits
from bridge.log.calibration import CALIBRATION_ATTACHMENT
from bridge.log.reader import LogReader
from bridge.log.turns import turns
from bridge.monitor import Monitor
from bridge.telemetry.far_side import FarSide
from bridge.telemetry.gauges import Names
from bridge.telemetry.snapshot import About, Snapshot
from bridge.telemetry.states import LogState, Surroundings
from bridge.telemetry.telemetry import WATCH_NS, Telemetry
from tracker.errors import OperatorError

CONFIG_ATTACHMENT = "config.json"
LONGEST_SILENCE_NS = 60_000_000_000  # a longer one in a log is not gone through step by step


class LoggedRun:
    """One log.

    Raises:
        OperatorError: no log, or one without the calibration that `run` attaches.
    """

    def __init__(self, path: Path) -> None:
        self._reader = LogReader(path)
        attachments, metadata = self._reader.attachments(), self._reader.metadata()
        try:
            calibration = orjson.loads(attachments[CALIBRATION_ATTACHMENT])
            config = orjson.loads(attachments.get(CONFIG_ATTACHMENT, b"{}"))
            self._names = _names(calibration, config)
            self._limits = _limits(config)
        except (KeyError, TypeError, orjson.JSONDecodeError) as error:
            raise OperatorError(
                f"log {path}: holds no {CALIBRATION_ATTACHMENT} of posebridge; name a log that `run --log` wrote"
            ) from error
        run, versions = metadata.get("run", {}), metadata.get("versions", {})
        self._about = About(run.get("source", "?"), versions.get("posebridge", ""))
        recorder = metadata.get("recorder", {})
        written, dropped = (int(recorder.get(key, "0")) for key in ("steps_written", "steps_dropped"))
        self._log = LogState(str(path), path.stat().st_size, written, dropped)

    def snapshots(self, every_ns: int | None = None) -> Iterator[Snapshot]:
        """Yield the run's state each `every_ns` of stream time [ns], and at the log's end; only there if None.

        A log without a single frame gives one snapshot, of nothing.
        """
        monitor = Monitor(self._names.cameras)
        telemetry = Telemetry(self._about, self._names, self._limits, monitor, None, lambda: 0)
        far = FarSide()
        due_ns: int | None = None
        before_ns: int | None = None

        def around() -> Surroundings:
            return Surroundings(far.links(), self._log, far.far_ends())

        for turn in turns(self._reader):
            before_ns = turn.now_ns if before_ns is None else before_ns
            for now_ns in _steps(before_ns, turn.now_ns):
                telemetry.move_on(now_ns, around)
            before_ns = max(turn.now_ns, before_ns)
            if every_ns is not None and due_ns is not None and turn.now_ns >= due_ns:
                yield telemetry.snapshot(around)
                due_ns = None
            if every_ns is not None and due_ns is None:
                due_ns = turn.now_ns + every_ns
            far.take(turn)
            monitor.take(turn.event, turn.step, turn.sent)
            telemetry.take(turn.event, turn.step, turn.sent, turn.now_ns, around)
        yield telemetry.snapshot(around)


def _steps(before_ns: int, now_ns: int) -> range:
    """Return the times between two records at which a running bridge would have looked at its alarms."""
    start_ns = max(before_ns, now_ns - LONGEST_SILENCE_NS)
    return range(start_ns + WATCH_NS, now_ns, WATCH_NS)


def _names(calibration: Mapping[str, Any], config: Mapping[str, Any]) -> Names:
    cameras = tuple(str(camera["name"]) for camera in calibration["cameras"])
    balls = tuple(str(ball["name"]) for ball in calibration["marker"])
    configured = [camera.get("clock_offset_ms", 0.0) for camera in config.get("rig", {}).get("cameras", ())]
    offsets_ms = (*map(float, configured), *(0.0 for _ in cameras))[: len(cameras)]
    return Names(cameras, balls, offsets_ms)


def _limits(config: Mapping[str, Any]) -> Limits:
    chosen = config.get("monitor", {})
    usual = Limits()
    return Limits(
        float(chosen.get("rate_min_hz", usual.rate_min_hz)),
        float(chosen.get("latency_limit_ms", usual.latency_limit_ms)),
        float(config.get("mavlink", {}).get("max_age_ms", usual.max_age_ms)),
    )
