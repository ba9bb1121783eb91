"""One step of the loop, as it waits for the log, and the JSON values it turns into."""

from __future__ import annotations

import binascii
import math
from typing import Any, NamedTuple

import orjson

from bridge.heard import NOTHING, Heard
from bridge.log import triangle
from bridge.log.film import Mark
from bridge.wire import Sent
from tracker.maths import so3
from tracker.standing import Health
from tracker.types import BallSighting, Estimate, Event, Frame, Rejected, Step

Value = dict[str, Any]


class FrameTime(NamedTuple):
    """What the log always keeps of a frame: all but its image, of which only few may wait in the queue."""

    camera: int
    t_ns: int
    available_ns: int


class Entry(NamedTuple):
    """One step, what was sent for it, and what was heard meanwhile.

    now_ns: stream time when it was taken [ns].  wall_ns: the wall clock then, where one is due [ns].
    film: its frame, or what came in place of one, where the log keeps frames.
    """

    now_ns: int
    wall_ns: int | None
    frame: FrameTime | None
    rejections: tuple[Rejected, ...]
    step: Step
    sent: tuple[Sent, ...]
    heard: Heard = NOTHING
    film: Frame | Mark | None = None


def make_entry(
    event: Event | None,
    step: Step,
    sent: tuple[Sent, ...],
    now_ns: int,
    wall_ns: int | None,
    heard: Heard = NOTHING,
    film: Frame | Mark | None = None,
) -> Entry:
    """Keep what the log needs of one turn of the loop."""
    frame = FrameTime(event.camera, event.t_ns, event.available_ns) if isinstance(event, Frame) else None
    rejections = step.rejections
    if isinstance(event, Rejected) and event not in rejections:
        rejections = (event, *rejections)
    return Entry(now_ns, wall_ns, frame, rejections, step, sent, heard, film)


def encode(value: Value) -> bytes:
    """Return a value as JSON; numbers that are not finite, which JSON cannot hold, become null."""
    return orjson.dumps(value, default=dict, option=orjson.OPT_SERIALIZE_NUMPY)


def estimate_value(estimate: Estimate, q_BtoW: list[float]) -> Value:
    """Return the `/estimate` message of an estimate whose quaternion (w, x, y, z) is at hand."""
    return {
        "t_ns": estimate.t_ns,
        "state": estimate.state.value,
        "reset_counter": estimate.reset_counter,
        "p_BinW_m": estimate.p_BinW.tolist(),
        "q_BtoW": q_BtoW,
        "v_BinW_m_s": estimate.v_BinW.tolist(),
        "w_BinB_rad_s": estimate.w_BinB.tolist(),
        "covariance": triangle.pack(estimate.covariance),
        "nis": float(estimate.nis),
        "nis_dof": estimate.nis_dof,
        "available_ns": estimate.available_ns,
        "p_3sigma_m": [3.0 * math.sqrt(max(v, 0.0)) for v in estimate.covariance.diagonal()[:3].tolist()],
        "clock_offsets_ms": [1e3 * offset for offset in estimate.clock_offsets_s.tolist()[1:]],
        "clock_sigmas_ms": [1e3 * sigma for sigma in estimate.clock_sigmas_s.tolist()[1:]],
    }


def quaternion(estimate: Estimate) -> list[float]:
    """Return the estimate's attitude as w, x, y, z."""
    values: list[float] = so3.quaternion(estimate.R_BtoW).tolist()
    return values


def latency_value(estimate: Estimate, sent: tuple[Sent, ...]) -> Value:
    """Return the `/latency` message of an estimate and all that was sent with it."""
    links: dict[str, int] = {}
    for one in sent:
        if one.t_ns == estimate.t_ns and one.available_ns:
            links[one.link] = max(links.get(one.link, 0), one.sent_ns - one.available_ns)
    return {
        "t_ns": estimate.t_ns,
        "stages": [
            {"name": name, "duration_ns": took, "duration_ms": took / 1e6} for name, took in estimate.stages_ns.items()
        ],
        "links": [
            {"link": link, "latency_ns": latency, "latency_ms": latency / 1e6} for link, latency in links.items()
        ],
    }


def sightings_value(
    frame: FrameTime, sightings: tuple[BallSighting, ...], refused: tuple[BallSighting, ...] = ()
) -> Value:
    """Return the `/sightings` message of one frame."""
    return {
        "camera": frame.camera,
        "t_ns": frame.t_ns,
        "available_ns": frame.available_ns,
        "sightings": _sighting_values(sightings, used=True) + _sighting_values(refused, used=False),
    }


def _sighting_values(sightings: tuple[BallSighting, ...], *, used: bool) -> list[Value]:
    values = []
    for camera, ball, t_ns, uv_px, cov_px in sightings:
        (u, v), ((uu, uv), (_, vv)) = uv_px.tolist(), cov_px.tolist()
        values.append(
            {
                "used": used,
                "camera": camera,
                "ball": ball,
                "t_ns": t_ns,
                "u_px": u,
                "v_px": v,
                "cov_px2": [uu, uv, vv],
            }
        )
    return values


def health_value(health: Health) -> Value:
    """Return the `/health` message of what was said of the calibration."""
    return {
        "t_ns": health.t_ns,
        "at_odds": health.at_odds,
        "epipolar_px": health.epipolar_px,
        "spacing_mm": health.spacing_mm,
        "from_start": health.from_start,
        "cameras": [
            {
                "name": camera.name,
                "moved": camera.moved,
                "witness": camera.witness.value,
                "shift_px": camera.shift_px,
                "at_vehicle_mm": camera.at_vehicle_mm,
                "full_share": camera.full_share,
            }
            for camera in health.cameras
        ],
    }


def rejections_value(rejections: tuple[Rejected, ...]) -> Value:
    """Return the `/rejections` message of one step."""
    return {
        "rejections": [
            {
                "reason": rejected.reason.value,
                "detail": rejected.detail,
                "t_ns": rejected.t_ns,
                "camera": -1 if rejected.camera is None else rejected.camera,
            }
            for rejected in rejections
        ]
    }


def sent_value(sent: Sent) -> Value:
    """Return the `/mavlink/sent/...` message of one MAVLink message."""
    return {
        "link": sent.link,
        "t_ns": sent.t_ns,
        "sent_ns": sent.sent_ns,
        "available_ns": sent.available_ns,
        "latency_ns": sent.sent_ns - sent.available_ns if sent.available_ns else -1,
        "raw": binascii.b2a_base64(sent.raw, newline=False).decode(),
        "fields": sent.fields,
    }
