"""Put figures together: what alarms judge by, and the snapshot that is shown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import gammaincinv

from bridge.alarms import Alarm, BallReading, CameraReading, Limits, Readings
from bridge.histogram import Histogram
from bridge.monitor import TOTAL, Monitor
from bridge.telemetry import snapshot as page
from bridge.telemetry.bins import KEPT, Bin
from bridge.telemetry.gauges import WINDOW, Gauges
from bridge.telemetry.states import Surroundings
from tracker.maths import so3
from tracker.standing import CameraHealth
from tracker.types import Array

EDGES_MS = tuple(10.0 ** (k / 5.0 - 2.0) for k in range(26))  # 0.01 ms to 1 s, five a decade
_EDGES_NS = tuple(round(edge_ms * 1e6) for edge_ms in EDGES_MS)
BAND = 0.95
# A snapshot is bounded whatever a config or a far end makes up: lists by these lengths, texts by theirs.
MANY, LONG_TEXT = 12, 200


def readings_of(gauges: Gauges, around: Surroundings, limits: Limits) -> Readings:
    """Return what alarms judge by."""
    # The first pose takes longer than any other: of few datagrams it would be the hundredth part.
    (p99_ms,) = gauges.recent_ms(0.99) if gauges.recent_is_whole else (None,)
    nis, dof = gauges.nis()
    balls = enumerate(gauges.names.balls)
    return Readings(
        t_ns=gauges.now_ns,
        running_s=gauges.running_s,
        state=gauges.state,
        state_s=gauges.state_s,
        rate_hz=gauges.rate_hz(),
        age_ms=gauges.age_ms(),
        gap_ms=gauges.worst_gap_ms(),
        latency_p99_ms=p99_ms,
        nis_ratio=nis / dof if dof else None,
        cameras=tuple(_camera_reading(gauges, index) for index in range(len(gauges.names.cameras))),
        balls=tuple(BallReading(name, gauges.unseen_s(index)) for index, name in balls),
        around=around,
        limits=limits,
        last_rejection=gauges.last_rejection,
        at_odds=gauges.health is not None and gauges.health.at_odds,
        epipolar_px=None if gauges.health is None else gauges.health.epipolar_px,
        from_start=gauges.health is not None and gauges.health.from_start,
    )


def snapshot_of(
    about: page.About,
    sequence: int,
    ended: bool,
    gauges: Gauges,
    monitor: Monitor,
    around: Surroundings,
    limits: Limits,
    alarms: tuple[Alarm, ...],
) -> page.Snapshot:
    """Return the state of a run as it is shown."""
    tally = monitor.tally()
    window = gauges.bins.last(WINDOW)
    p50_ms, p99_ms = gauges.recent_ms(0.5, 0.99)
    stages = [_stage(name, times) for name, times in monitor.durations().items()]
    return page.Snapshot(
        version=page.VERSION,
        sequence=sequence,
        about=replace(about, source=_short(about.source)),
        t_ns=gauges.now_ns,
        running_s=gauges.running_s,
        ended=ended,
        track=page.Track(gauges.state.value, gauges.state_s, tally.lost, tally.resets, _short(gauges.last_rejection)),
        pose=_pose(gauges),
        rate=page.Rate(
            poses=tally.estimates_sent,
            now_hz=gauges.rate_hz(),
            mean_hz=tally.rate_hz,
            need_hz=limits.rate_min_hz,
            gap_now_ms=gauges.gap_now_ms,
            gap_recent_ms=gauges.worst_gap_ms(),
            gap_ever_ms=None if gauges.gap_ever_ns is None else gauges.gap_ever_ns / 1e6,
            age_ms=gauges.age_ms(),
        ),
        latency=page.Latency(
            p50_ms,
            p99_ms,
            limits.latency_limit_ms,
            next(stage for stage in stages if stage.name == TOTAL),
            tuple(stage for stage in stages if stage.name != TOTAL)[:MANY],
        ),
        nis=_nis(gauges),
        calibration=_calibration(gauges),
        balls=tuple(_short(name) for name in gauges.names.balls[:MANY]),
        cameras=tuple(
            _camera(gauges, window, index, tally.frames.get(name, 0))
            for index, name in enumerate(gauges.names.cameras[:MANY])
        ),
        rejected=dict(tally.rejected),
        links=tuple(replace(link, name=_short(link.name), reason=_short(link.reason)) for link in around.links[:MANY]),
        log=None
        if around.log is None
        else replace(around.log, path=_short(around.log.path), error=_short(around.log.error)),
        far_ends=around.far_ends[:MANY],
        history=_history(gauges.bins.last(KEPT)),
        alarms=tuple(_short_alarm(alarm) for alarm in alarms[:MANY]),
    )


def nis_band(dof: int) -> tuple[float, float]:
    """Return between what NIS sums of `dof` degrees of freedom, over `dof`, lie with a probability of BAND.

    Source: chi-square is a gamma distribution of shape dof / 2 and scale 2.
    """
    tail = (1.0 - BAND) / 2.0
    low, high = (2.0 * float(gammaincinv(dof / 2.0, p)) / dof for p in (tail, 1.0 - tail))
    return low, high


def _camera_reading(gauges: Gauges, index: int) -> CameraReading:
    offset_ms, sigma_ms = _offset(gauges, index)
    names, health = gauges.names, _health(gauges, index)
    return CameraReading(
        name=names.cameras[index],
        silent_ms=gauges.silent_ms(index),
        blind_s=gauges.blind_s(index),
        clock_offset_ms=offset_ms,
        clock_sigma_ms=sigma_ms,
        configured_offset_ms=names.configured_offsets_ms[index],
        moved=health is not None and health.moved,
        shift_px=0.0 if health is None else health.shift_px,
        at_vehicle_mm=0.0 if health is None else health.at_vehicle_mm,
        full_share=0.0 if health is None else health.full_share,
    )


def _health(gauges: Gauges, camera: int) -> CameraHealth | None:
    return None if gauges.health is None else gauges.health.cameras[camera]


def _calibration(gauges: Gauges) -> page.Calibration:
    health = gauges.health
    if health is None:
        return page.Calibration()
    return page.Calibration(health.brief, health.epipolar_px, health.spacing_mm)


def _offset(gauges: Gauges, camera: int) -> tuple[float | None, float | None]:
    newest = gauges.newest
    if newest is None or camera >= len(newest.clock_offsets_s):
        return None, None
    return float(newest.clock_offsets_s[camera]) * 1e3, float(newest.clock_sigmas_s[camera]) * 1e3


def _pose(gauges: Gauges) -> page.Pose | None:
    newest = gauges.newest
    if newest is None:
        return None
    sigma = np.sqrt(np.maximum(np.diag(newest.covariance), 0.0))
    euler_deg = tuple(math.degrees(angle) for angle in so3.to_euler(newest.R_BtoW))
    return page.Pose(
        position_m=_triple(newest.p_BinW),
        position_sigma_m=_triple(sigma[:3]),
        euler_deg=(euler_deg[0], euler_deg[1], euler_deg[2]),
        attitude_sigma_deg=_triple(np.degrees(sigma[3:6])),
        speed_m_s=float(np.linalg.norm(newest.v_BinW)),
    )


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _stage(name: str, times: Histogram) -> page.Stage:
    return page.Stage(_short(name), times.percentiles(), times.coarse(_EDGES_NS))


def _nis(gauges: Gauges) -> page.Nis:
    newest = gauges.newest
    total, dof = gauges.nis()
    if newest is None:
        return page.Nis()
    if not dof:
        return page.Nis(float(newest.nis), newest.nis_dof)
    low, high = nis_band(dof)
    return page.Nis(float(newest.nis), newest.nis_dof, total / dof, low, high)


def _camera(gauges: Gauges, window: Sequence[Bin], index: int, frames: int) -> page.CameraView:
    recent = sum(each.frames[index] for each in window)
    offset_ms, sigma_ms = _offset(gauges, index)
    health = _health(gauges, index)
    return page.CameraView(
        name=_short(gauges.names.cameras[index]),
        frames=frames,
        rate_hz=_per_second([each.frames[index] for each in window], gauges),
        silent_ms=gauges.silent_ms(index),
        seen=tuple(
            min(1.0, sum(each.seen[index][ball] for each in window) / max(recent, 1))
            for ball in range(len(gauges.names.balls[:MANY]))
        ),
        clock_offset_ms=offset_ms,
        clock_sigma_ms=sigma_ms,
        room="" if health is None else health.witness.value,
        room_shift_px=0.0 if health is None else health.shift_px,
    )


def _per_second(counts: Sequence[int], gauges: Gauges) -> float:
    """Return the rate of a count by seconds: of whole ones, once there are any [Hz]."""
    if gauges.running_s < 2.0 or len(counts) < 3:
        return sum(counts) / max(gauges.running_s, 1e-9) if gauges.running_s > 0.2 else 0.0
    whole = counts[1 if len(counts) < WINDOW else 0 : -1]  # the run's first second had begun before it
    return sum(whole) / len(whole)


def _history(bins: Sequence[Bin]) -> page.History:
    return page.History(
        poses=tuple(each.poses for each in bins),
        gap_ms=tuple(each.gap_ns / 1e6 if each.gap_ns else None for each in bins),
        latency_ms=tuple(round(each.latency_ns / 1e6, 3) if each.latency_ns else None for each in bins),
        nis_ratio=tuple(each.nis / each.dof if each.dof else None for each in bins),
    )


def _short_alarm(alarm: Alarm) -> Alarm:
    return replace(alarm, subject=_short(alarm.subject), cause=_short(alarm.cause), remedy=_short(alarm.remedy))


def _short(text: str) -> str:
    return text if len(text) <= LONG_TEXT else text[: LONG_TEXT - 3] + "..."
