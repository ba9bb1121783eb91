"""How long a stereo pair takes through the whole loop on one core, log included, with the frames in memory."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

from bridge.clock import StreamClock
from bridge.dialect import Encoder, Identity
from bridge.dialogue import Terms
from bridge.histogram import Histogram
from bridge.links import open_link
from bridge.monitor import Monitor
from bridge.outlet import DEFAULT_SYSTEM_ID, Outlet, Spout
from bridge.pack import MESSAGES, Packer
from bridge.run import Outlets, close, run
from bridge.settings import Settings
from bridge.summary import Percentiles, Summary
from bridge.telemetry.snapshot import to_bytes
from bridge.telemetry.telemetry import Telemetry
from tools.bench.footage import Footage
from tools.bench.meter import Meter
from tools.bench.one_core import one_core
from tools.bench.pairs import Slow, shares_of, slow_of, spread, stages_of
from tools.bench.stages import Stages, TimedLink, TimedMonitor, TimedPacker, TimedRecorder, TimedTelemetry, TimedTracker
from tools.request import Clocks, CpuClocks
from tools.session import recorder_of, telemetry_of, tracker_of
from tools.steady import steady
from tracker.types import Frame, Silence, TrackState

WARM_UP = 300  # instants: templates drawn, light learned
LONG_AGO_NS, JUST_BEFORE_NS = 3_600_000_000_000, 500_000_000
LAP = 120  # instants: the eight takes 8 s at 15 Hz
SNAPSHOTS = 100


@dataclass(frozen=True, slots=True)
class Speed:
    """Tracking and acquisition on this machine.

    pairs: measured.  pinned: whether the system held the process to one core.
    pairs_per_s: by the wall clock; pairs_per_cpu_s: by the CPU time of the whole process, the log's thread included.
    pair_ms: from a pair's first frame to the end of the loop's work on both.
    acquire_ms: one stereo pair, whole frames searched.
    stages_ms: the parts of a pair, the longest first: the tracker's own stages, `intake` (all else in the tracker),
        pack, link, monitor, record (handing over to the log's thread), telemetry (alarms, the look for who listens),
        loop (what is left).
    shares: of each in the time of all pairs; they add up to 1.
    snapshot_ms: one snapshot for `posebridge monitor`, which the loop makes five times a second while it is watched.
    slow: the pairs that took long, and why.
    log_thread_ms: mean CPU time of the threads other than the loop's, which is the log's, a pair.
    log_bytes: a pair, on the disk.
    run: the loop's own figures.
    """

    pairs: int
    pinned: bool
    pairs_per_s: float
    pairs_per_cpu_s: float
    pair_ms: Percentiles
    acquire_ms: Percentiles
    stages_ms: dict[str, Percentiles]
    shares: dict[str, float]
    snapshot_ms: Percentiles
    slow: Slow
    log_thread_ms: float
    log_bytes: float
    run: Summary


def measure_speed(settings: Settings, clocks: Clocks, cpu: CpuClocks, pairs: int, warm_up: int = WARM_UP) -> Speed:
    """Track a simulated flight from memory, log and all, then search it from nothing again and again."""
    footage = Footage(settings, clocks, "figure8", LAP, closed=True)
    with one_core() as pinned, tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "bench.mcap"
        stages, meter = Stages(clocks.stopwatch), Meter(clocks.stopwatch, cpu)
        tracker, played = tracker_of(settings, footage.rig, clocks), footage.play(warm_up + pairs)
        names = tuple(camera.name for camera in footage.rig.cameras)
        run(chain(*islice(played, warm_up)), tracker, StreamClock(), Outlets(Outlet([], Packer(0.0)), Monitor(names)))
        packer = TimedPacker(settings.room.room_yaw_deg, stages)
        identity = Identity(DEFAULT_SYSTEM_ID, settings.mavlink.component_id)
        link = TimedLink(open_link("memory:", Encoder(identity), clocks.stopwatch), stages)
        recorder = recorder_of(log, settings, footage.rig, {"source": "bench"}, clocks, block_when_full=True)
        monitor = TimedMonitor(names, stages)
        telemetry = telemetry_of("bench", settings, footage.rig, monitor, clocks)
        outlets = Outlets(
            Outlet([Spout(link, Terms(messages=MESSAGES))], packer),
            monitor,
            TimedRecorder(recorder, stages),
            telemetry=TimedTelemetry(telemetry, stages),
        )
        clock, timed = StreamClock(), TimedTracker(tracker, stages, clocks.stopwatch)
        with steady(), meter.watch_garbage():
            started = clocks.stopwatch(), cpu.process(), cpu.thread()
            try:
                run(meter.events(played, stages), timed, clock, outlets)
            finally:
                close(clock, outlets)
            wall_ns, process_ns, thread_ns = (
                now - then for now, then in zip((clocks.stopwatch(), cpu.process(), cpu.thread()), started, strict=True)
            )
        return Speed(
            pairs,
            pinned,
            pairs * 1e9 / wall_ns,
            pairs * 1e9 / process_ns,
            spread([pair.wall for pair in meter.pairs]),
            _acquisition(settings, clocks, footage),
            stages_of(meter.pairs),
            shares_of(meter.pairs),
            _snapshots(telemetry, outlets, clocks),
            slow_of(meter.pairs),
            (process_ns - thread_ns) / pairs / 1e6,
            log.stat().st_size / pairs,
            outlets.summary(str(log)),
        )


def _snapshots(telemetry: Telemetry, outlets: Outlets, clocks: Clocks) -> Percentiles:
    """Time what a watched run's loop does besides: the state of the run, put together and written down."""
    histogram = Histogram()
    for _ in range(SNAPSHOTS):
        started_ns = clocks.stopwatch()
        to_bytes(telemetry.snapshot(outlets.surroundings))
        histogram.add(clocks.stopwatch() - started_ns)
    return histogram.percentiles()


def _acquisition(settings: Settings, clocks: Clocks, footage: Footage) -> Percentiles:
    """Lose the track before every pair and time its finding."""
    tracker = tracker_of(settings, footage.rig, clocks)
    histogram = Histogram()
    for k, pair in enumerate(footage.play(2 * len(footage.pairs))):
        lost = tracker.step(Silence(pair[0].t_ns + k * LONG_AGO_NS - JUST_BEFORE_NS))
        later = [Frame(frame.camera, frame.t_ns + k * LONG_AGO_NS, frame.image) for frame in pair]
        started_ns = clocks.stopwatch()
        steps = [tracker.step(frame) for frame in later]
        if lost.state is not TrackState.TRACKING and k >= len(footage.pairs) and any(s.estimates for s in steps):
            histogram.add(clocks.stopwatch() - started_ns)
    return histogram.percentiles()
