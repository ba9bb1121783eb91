"""How long the tracker takes, with the frames in memory."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.clock import StreamClock
from bridge.histogram import Histogram
from bridge.monitor import Monitor
from bridge.outlet import open_outlet
from bridge.run import Outlets, run
from bridge.settings import Settings
from bridge.summary import Percentiles, Summary
from tools.bench.footage import Footage
from tools.request import Clocks
from tools.session import tracker_of
from tracker.types import Event, Silence, TrackState

WARM_UP = 300  # instants: templates drawn, light learned
LONG_AGO_NS = 3_600_000_000_000


@dataclass(frozen=True, slots=True)
class Speed:
    """Tracking and acquisition on this machine.

    pairs: measured.  pairs_per_s: through tracker, packing and a link in memory, one core.
    track_ms: one stereo pair, tracked.  acquire_ms: one stereo pair, whole frames searched.
    run: the loop's own figures, stage by stage.
    """

    pairs: int
    pairs_per_s: float
    track_ms: Percentiles
    acquire_ms: Percentiles
    run: Summary


def measure_speed(settings: Settings, clocks: Clocks, pairs: int) -> Speed:
    """Track a simulated flight from memory, then search it from nothing again and again."""
    footage = Footage(settings, clocks, "figure8", 90)
    tracker = tracker_of(settings, footage.rig, clocks)
    outlet = open_outlet(
        [("memory:", ("VISION_POSITION_ESTIMATE", "ATT_POS_MOCAP"))],
        system_id=settings.mavlink.system_id,
        component_id=settings.mavlink.component_id,
        room_yaw_deg=settings.room.room_yaw_deg,
        stopwatch=clocks.stopwatch,
    )
    outlets = Outlets(outlet, Monitor(tuple(camera.name for camera in footage.rig.cameras)))
    tracking, clock = Histogram(), StreamClock()
    spent_ns = 0
    for k, pair in enumerate(footage.play(WARM_UP + pairs)):
        if k == WARM_UP:
            outlets = Outlets(outlet, Monitor(tuple(camera.name for camera in footage.rig.cameras)))
        started_ns = clocks.stopwatch()
        events: list[Event] = list(pair)
        run(events, tracker, clock, outlets)
        took_ns = clocks.stopwatch() - started_ns
        if k >= WARM_UP:
            tracking.add(took_ns)
            spent_ns += took_ns
    summary = outlets.summary(None)
    outlet.close()
    acquiring = _acquisition(settings, clocks, footage)
    return Speed(pairs, pairs * 1e9 / spent_ns, tracking.percentiles(), acquiring, summary)


def _acquisition(settings: Settings, clocks: Clocks, footage: Footage) -> Percentiles:
    """Lose the track before every pair and time its finding."""
    tracker = tracker_of(settings, footage.rig, clocks)
    histogram = Histogram()
    for k, pair in enumerate(footage.play(2 * len(footage.pairs))):
        lost = tracker.step(Silence(pair[0].t_ns + 2 * k * LONG_AGO_NS))
        later = [type(frame)(frame.camera, frame.t_ns + (2 * k + 1) * LONG_AGO_NS, frame.image) for frame in pair]
        started_ns = clocks.stopwatch()
        steps = [tracker.step(frame) for frame in later]
        if lost.state is not TrackState.TRACKING and k >= len(footage.pairs) and any(s.estimates for s in steps):
            histogram.add(clocks.stopwatch() - started_ns)
    return histogram.percentiles()
