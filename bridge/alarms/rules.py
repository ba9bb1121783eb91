"""The rules: when each alarm is raised, when it is over, and what it says.

Every limit has two edges and two times, so that a figure that dances on a limit raises no flurry of alarms.
"""

from __future__ import annotations

from collections.abc import Iterator

from bridge.alarms.link_rules import LINK_RULES
from bridge.alarms.readings import CameraReading, Readings
from bridge.alarms.rule import Finding, Level, Rule, Verdict, above, below
from tracker.health.background import LIMIT_PX
from tracker.standing import TOO_BRIGHT
from tracker.types import TrackState

SETTLE_S = 3.0
RATE_SLACK = 0.97  # frames at exactly the wanted rate jitter about it
RATE_BACK = 0.985
GAP_MS, GAP_SEVERE_MS = 100.0, 300.0
NIS_HIGH, NIS_LOW = 2.0, 0.4
SILENT_MS = 500.0
UNSEEN_S = 3.0
NO_LONGER_BRIGHT = 0.3  # of a ball's pixels
BLIND_S = 5.0
SOUGHT_S = 5.0
OFFSET_MS, OFFSET_SIGMAS, OFFSET_KNOWN_MS = 3.0, 4.0, 1.5


def _track_lost(now: Readings) -> Iterator[Finding]:
    if now.state is TrackState.LOST:
        why = f"; last left out: {now.last_rejection}" if now.last_rejection else ""
        yield Finding(
            "",
            Verdict.BAD,
            f"track lost for {now.state_s:.1f} s: nothing is sent{why}",
            "land or fly by hand; bring every ball into the view of two cameras",
        )


def _marker_not_found(now: Readings) -> Iterator[Finding]:
    if now.state is TrackState.SEARCHING and now.running_s > SOUGHT_S:
        why = f"; last: {now.last_rejection}" if now.last_rejection else ""
        yield Finding(
            "",
            Verdict.BAD,
            f"marker not found in {now.running_s:.0f} s{why}",
            "run `posebridge colours`; check light, lens caps, calibration and that all balls are in two images",
        )


def _rate(now: Readings) -> Iterator[Finding]:
    need_hz = now.limits.rate_min_hz
    steady = now.state is TrackState.TRACKING and now.state_s > SETTLE_S
    verdict = below(now.rate_hz, RATE_SLACK * need_hz, RATE_BACK * need_hz) if steady else Verdict.GOOD
    if verdict is not Verdict.GOOD:
        yield Finding(
            "",
            verdict,
            f"rate {now.rate_hz:.1f} Hz, needed {need_hz:g} Hz",
            "shorten the exposure, check the cameras' frame rate and what else this computer does",
        )


def _gap_severe(now: Readings) -> Iterator[Finding]:
    verdict = above(now.gap_ms, GAP_SEVERE_MS, GAP_SEVERE_MS)
    if verdict is not Verdict.GOOD:
        yield Finding(
            "",
            verdict,
            f"a gap of {now.gap_ms or 0:.0f} ms between poses; "
            f"ArduPilot gives vision up after {GAP_SEVERE_MS:.0f} ms, PX4 after 400 ms",
            "find what covers the balls, stops a camera or holds this computer up",
        )


def _gap(now: Readings) -> Iterator[Finding]:
    verdict = above(now.gap_ms, GAP_MS, GAP_MS)
    if verdict is not Verdict.GOOD:
        yield Finding(
            "",
            verdict,
            f"a gap of {now.gap_ms or 0:.0f} ms between poses, limit {GAP_MS:.0f} ms",
            "look at what was left out and at the frames of each camera",
        )


def _latency(now: Readings) -> Iterator[Finding]:
    limit_ms = now.limits.latency_limit_ms
    verdict = above(now.latency_p99_ms, limit_ms, 0.9 * limit_ms)
    if verdict is not Verdict.GOOD:
        yield Finding(
            "",
            verdict,
            f"latency p99 {now.latency_p99_ms or 0:.0f} ms, limit {limit_ms:g} ms",
            "stop other programs on this computer, track fewer or smaller images, or lower lag_rounds",
        )


def _age(now: Readings) -> Iterator[Finding]:
    limit_ms = now.limits.max_age_ms
    verdict = above(now.age_ms, limit_ms, 0.8 * limit_ms)
    if verdict is not Verdict.GOOD:
        yield Finding(
            "",
            verdict,
            f"poses are {now.age_ms or 0:.0f} ms old when they could leave, limit {limit_ms:g} ms: those are not sent",
            "lower lag_rounds; where that is 0, this computer falls behind: lower frame rates, or check latency_ms",
        )


def _nis_high(now: Readings) -> Iterator[Finding]:
    verdict = above(now.nis_ratio, NIS_HIGH, 0.9 * NIS_HIGH)
    if verdict is not Verdict.GOOD:
        yield Finding(
            "",
            verdict,
            f"NIS {now.nis_ratio or 0:.2f} times its expectation, limit {NIS_HIGH:g}: images and model disagree",
            "calibrate the cameras anew, check the balls' positions in the config and the cameras' clocks",
        )


def _nis_low(now: Readings) -> Iterator[Finding]:
    verdict = below(now.nis_ratio, NIS_LOW, 1.1 * NIS_LOW)
    if verdict is not Verdict.GOOD:
        yield Finding(
            "",
            verdict,
            f"NIS {now.nis_ratio or 0:.2f} times its expectation, limit {NIS_LOW:g}: the filter is too cautious",
            "lessen pixel_noise_px or [tracker.process] in the config",
        )


def _camera_silent(now: Readings) -> Iterator[Finding]:
    for camera in now.cameras:
        verdict = above(camera.silent_ms, SILENT_MS, SILENT_MS / 2)
        if verdict is not Verdict.GOOD:
            yield Finding(
                camera.name,
                verdict,
                f"{camera.name} has given no frame for {camera.silent_ms / 1e3:.1f} s",
                "check its cable, power and USB bus; it is taken back by itself",
            )


def _camera_blind(now: Readings) -> Iterator[Finding]:
    for camera in now.cameras:
        verdict = above(camera.blind_s, BLIND_S, 1.0)
        if verdict is not Verdict.GOOD:
            yield Finding(
                camera.name,
                verdict,
                f"{camera.name} gives frames, but no ball in them was used for {camera.blind_s:.0f} s",
                "look through it (`posebridge colours --picture`): lens, light, focus, or it was moved",
            )


def _overexposed(now: Readings) -> Iterator[Finding]:
    for camera in now.cameras:
        verdict = above(camera.full_share, TOO_BRIGHT, NO_LONGER_BRIGHT)
        if verdict is not Verdict.GOOD:
            yield Finding(
                camera.name,
                verdict,
                f"{camera.name} is overexposed: {camera.full_share:.0%} of the balls' pixels are too bright for it, "
                f"limit {TOO_BRIGHT:.0%}; poses are less exact",
                "shorten its exposure or lower its gain, or dim the lamps, until no ball is white in its picture",
            )


def _ball_unseen(now: Readings) -> Iterator[Finding]:
    for ball in now.balls:
        verdict = above(ball.unseen_s, UNSEEN_S, 1.0)
        if verdict is not Verdict.GOOD:
            yield Finding(
                ball.name,
                verdict,
                f"no camera has seen the {ball.name} ball for {ball.unseen_s:.0f} s",
                "check its paint and light, and learn the colours anew (`posebridge colours`)",
            )


def _clock_offset(now: Readings) -> Iterator[Finding]:
    for camera in now.cameras:
        found_ms, sigma_ms = camera.clock_offset_ms or 0.0, camera.clock_sigma_ms
        known = sigma_ms is not None and sigma_ms < OFFSET_KNOWN_MS and abs(found_ms) > OFFSET_SIGMAS * sigma_ms
        verdict = above(abs(found_ms), OFFSET_MS, 0.7 * OFFSET_MS) if known else Verdict.GOOD
        if verdict is not Verdict.GOOD:
            yield Finding(
                camera.name,
                verdict,
                f"{camera.name} sees {found_ms:+.1f} ms later than its stamps say (sigma {sigma_ms or 0:.1f} ms)",
                f"set clock_offset_ms = {camera.configured_offset_ms + found_ms:.1f} for {camera.name} in the config",
            )


def _camera_moved(now: Readings) -> Iterator[Finding]:
    for camera in now.cameras:
        if camera.moved:
            yield Finding(
                camera.name,
                Verdict.BAD,
                f"{camera.name} {_how_it_moved(camera, now.from_start)}",
                "land, fix it; then `posebridge calibrate refine LOG`, or calibrate the room anew",
            )


def _how_it_moved(camera: CameraReading, from_start: bool) -> str:
    if camera.shift_px > LIMIT_PX:  # else it was the rays that named it
        return (
            f"was moved: the room stands {camera.shift_px:.1f} px off in its picture, "
            f"{camera.at_vehicle_mm:.0f} mm at the vehicle"
        )
    return f"{_since_when(from_start)}: its rays miss the balls"


def _since_when(from_start: bool) -> str:
    return "does not stand where the room file has it" if from_start else "was moved"


def _cameras_at_odds(now: Readings) -> Iterator[Finding]:
    if now.at_odds:
        miss = f"rays to the balls miss by {now.epipolar_px or 0:.1f} px, and nothing tells whose"
        yield Finding(
            "",
            Verdict.BAD,
            f"a camera {_since_when(now.from_start)}: {miss}",
            "land, see which hangs loose or in another's place; then calibrate the room anew; hang something with "
            "corners where they look",
        )


def _log_stopped(now: Readings) -> Iterator[Finding]:
    log = now.around.log
    if log is not None and log.error:
        yield Finding("", Verdict.BAD, log.error, "free space on the disk and start anew; the flight goes on")


def _log_dropping(now: Readings) -> Iterator[Finding]:
    log = now.around.log
    if log is not None and not log.error and log.dropped > 0:
        yield Finding(
            "",
            Verdict.BAD,
            f"the log lacks {log.dropped} steps: the disk is slower than the flight",
            "log to a faster disk",
        )


GAP_RULE = Rule("gap", Level.WARNING, 0.0, 0.0, _gap)
GAP_SEVERE_RULE = Rule("gap_severe", Level.ALARM, 0.0, 0.0, _gap_severe)
RULES = (
    Rule("track_lost", Level.ALARM, 0.3, 1.0, _track_lost),
    Rule("marker_not_found", Level.ALARM, 0.0, 0.0, _marker_not_found),
    Rule("rate", Level.ALARM, 1.0, 2.0, _rate),
    GAP_SEVERE_RULE,
    GAP_RULE,
    Rule("latency", Level.WARNING, 1.0, 2.0, _latency),
    Rule("age", Level.ALARM, 1.0, 2.0, _age),
    Rule("nis_high", Level.WARNING, 5.0, 2.0, _nis_high),
    Rule("nis_low", Level.WARNING, 5.0, 2.0, _nis_low),
    Rule("camera_silent", Level.ALARM, 0.0, 1.0, _camera_silent),
    Rule("camera_blind", Level.WARNING, 0.0, 1.0, _camera_blind),
    Rule("overexposed", Level.WARNING, 2.0, 2.0, _overexposed),
    Rule("ball_unseen", Level.WARNING, 0.0, 1.0, _ball_unseen),
    Rule("camera_moved", Level.ALARM, 0.0, 5.0, _camera_moved),
    Rule("cameras_at_odds", Level.ALARM, 0.0, 5.0, _cameras_at_odds),
    Rule("clock_offset", Level.WARNING, 2.0, 2.0, _clock_offset),
    *LINK_RULES,
    Rule("log_stopped", Level.WARNING, 0.0, 0.0, _log_stopped),
    Rule("log_dropping", Level.WARNING, 0.0, 0.0, _log_dropping),
)
