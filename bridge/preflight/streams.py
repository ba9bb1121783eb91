"""Lines on what the bridge sends: rate, worst gap, age; and on the link and its time."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from bridge.dialogue.profile import Profile
from bridge.dialogue.timesync import SyncState
from bridge.preflight.poses import PoseWatch, Timing
from bridge.preflight.verdict import Line, Mark
from bridge.wire import LinkState
from tracker.types import TrackState

GOOD_RATE_HZ = 15.0
MOST_GAP_MS = {"ardupilot": 300.0, "px4": 200.0}  # unhealthy, and fusion not started, beyond these
MOST_GAP_ELSE_MS = 200.0
MOST_RTT_MS = 10.0
SOME_SAMPLES = 20


def pose_lines(
    watch: PoseWatch, profile: Profile, holding: str, window_ns: tuple[int, int], max_age_ms: float
) -> Iterator[Line]:
    """Yield the lines on the poses sent within a window of time [ns]."""
    timings, now_ns = watch.timings_in(window_ns), window_ns[1]
    if len(timings) < 2:
        yield _none_sent(watch, holding)
        return
    yield _rate_line(timings, profile)
    yield _gap_line(timings, profile, now_ns)
    yield _age_line(timings, max_age_ms)


def _none_sent(watch: PoseWatch, holding: str) -> Line:
    what, needed = "poses sent", f"{GOOD_RATE_HZ:g} Hz and more"
    if holding:
        return Line(Mark.FAIL, what, f"held back, {holding}", needed, "see the line on the origin")
    if not watch.estimates:
        fix = "the tracker finds no marker: run posebridge colours, and see that all balls are in both pictures"
        return Line(Mark.FAIL, what, f"none, the track is {watch.state.value}", needed, fix)
    fix = "too old when they could leave: see max_age_ms, lag_rounds, the cameras' latency_ms, and this computer's load"
    return Line(Mark.FAIL, what, f"none of {watch.estimates} estimates left", needed, fix)


def _rate_line(timings: Sequence[Timing], profile: Profile) -> Line:
    rate_hz = (len(timings) - 1) * 1e9 / max(timings[-1].t_ns - timings[0].t_ns, 1)
    needed = f"{GOOD_RATE_HZ:g} Hz and more"
    found = f"{rate_hz:.1f} Hz"
    if rate_hz >= GOOD_RATE_HZ * 0.97:
        return Line(Mark.PASS, "rate", found, needed)
    fix = "raise frame_rate_hz or the light, quicken the link's baud, free this computer"
    mark = Mark.WARN if rate_hz >= profile.least_rate_hz else Mark.FAIL
    return Line(mark, "rate", found, needed, fix)


def _gap_line(timings: Sequence[Timing], profile: Profile, now_ns: int) -> Line:
    limit_ms = MOST_GAP_MS.get(profile.name, MOST_GAP_ELSE_MS)
    steps_ns = [after.t_ns - before.t_ns for before, after in itertools.pairwise(timings)]
    newest = timings[-1]
    waited_ns = now_ns - newest.t_ns - newest.age_ns
    worst_ms = max(*steps_ns, waited_ns) / 1e6
    needed = f"below {limit_ms / 2.0:.0f} ms; at {limit_ms:.0f} ms it gives vision up"
    if worst_ms < limit_ms / 2.0:
        return Line(Mark.PASS, "worst gap", f"{worst_ms:.0f} ms", needed)
    fix = "find what hides balls or stops frames for so long: the run's log and its status line tell"
    return Line(Mark.WARN if worst_ms < limit_ms else Mark.FAIL, "worst gap", f"{worst_ms:.0f} ms", needed, fix)


def _age_line(timings: Sequence[Timing], max_age_ms: float) -> Line:
    ages_ms = np.array([timing.age_ns for timing in timings]) / 1e6
    p50, p99 = np.percentile(ages_ms, [50, 99])
    needed = f"99 % below {max_age_ms:g} ms; none older is sent"
    found = f"half below {p50:.0f}, 99 % below {p99:.0f} ms"
    if p99 <= max_age_ms:
        return Line(Mark.PASS, "age when sent", found, needed)
    fix = "see the stages below: quicken the slowest, or free this computer"
    return Line(Mark.WARN, "age when sent", found, needed, fix)


def track_line(watch: PoseWatch) -> Line:
    """Return the line on the tracker."""
    if watch.state is TrackState.TRACKING:
        return Line(Mark.PASS, "track", watch.state.value, "tracking")
    fix = "carry the vehicle to where both cameras see all balls; run posebridge colours if they still are not found"
    return Line(Mark.FAIL, "track", watch.state.value, "tracking", fix)


def camera_lines(watch: PoseWatch) -> Iterator[Line]:
    """Yield the line on the cameras' stand, once rays to the balls have been held against each other."""
    health = watch.health
    if health is None or health.epipolar_px is None:
        return
    found, needed = f"rays to the balls miss by {health.epipolar_px:.2f} px", "cameras stand as they were calibrated"
    if not health.brief:
        yield Line(Mark.PASS, "cameras", found, needed)
        return
    who = " and ".join(camera.name for camera in health.cameras if camera.moved) or "one of them, nothing tells which,"
    fix = f"{who} was moved: fix it, then calibrate the room anew, or posebridge calibrate refine with a flight's log"
    yield Line(Mark.FAIL, "cameras", found, needed, fix)


def link_line(link: LinkState) -> Line:
    """Return the line on the link's own losses."""
    share = (link.dropped + link.superseded) / max(link.sent + link.dropped + link.superseded, 1)
    found = f"{link.sent} sent, {link.dropped} dropped, {link.superseded} superseded"
    if not link.up:
        return Line(Mark.FAIL, "link", f"down, {link.reason}", "up", "see cable, address and power")
    if share < 0.01:
        return Line(Mark.PASS, "link", found, "less than 1 % lost")
    fix = "it is too slow for what is sent: raise the baud at both ends"
    return Line(Mark.WARN, "link", found, "less than 1 % lost", fix)


def time_line(sync: SyncState | None) -> Line:
    """Return the line on the autopilot's clock."""
    what, needed = "time", f"round trip below {MOST_RTT_MS:g} ms"
    if sync is None:
        fix = "it answers no TIMESYNC, or more slowly than that: a telemetry radio will; delay is then only estimated"
        return Line(Mark.WARN, what, "its clock is not known", needed, fix)
    found = f"round trip {sync.rtt_ms:.1f} ms, known to {sync.spread_ms:.1f} ms"
    if sync.samples >= SOME_SAMPLES:
        return Line(Mark.PASS, what, found, needed)
    return Line(
        Mark.WARN, what, f"{found}, from {sync.samples} answers", needed, "most answers are too slow: see the link"
    )
