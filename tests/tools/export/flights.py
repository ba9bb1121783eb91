"""Logs with an autopilot's messages in them, whose truth is a formula."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from bridge.log import topics
from bridge.log.container import Container
from bridge.log.entry import encode, estimate_value
from tests.bridge.estimates import estimate
from tracker.maths import so3
from tracker.types import Array, frozen_array

S, MS = 1_000_000_000, 1_000_000
START_NS = 50 * S
LINK = "udpin:127.0.0.1:14550"
SERVO, ATTITUDE = "/mavlink/received/SERVO_OUTPUT_RAW", "/mavlink/received/ATTITUDE"


class Line(NamedTuple):
    """One record of a log."""

    topic: str
    log_ns: int
    value: dict[str, Any]


def write(path: Path, lines: Iterable[Line], metadata: dict[str, str] | None = None) -> Path:
    """Write records as they are, in order of their log times."""
    channels: dict[str, int] = {}
    with path.open("wb") as file:
        container = Container(file)
        container.add_metadata("run", metadata or {"pace": "real"})
        for line in sorted(lines, key=lambda line: line.log_ns):
            if line.topic not in channels:
                topic = topics.json_topic(line.topic, line.topic)
                channels[line.topic] = container.add_channel(
                    topic.name, topic.message_encoding, topic.schema_name, topic.schema_encoding, topic.schema
                )
            container.add_message(channels[line.topic], line.log_ns, line.log_ns, encode(line.value))
        container.finish()
    return path


def truth_m(t_ns: int) -> float:
    """Return where the vehicle is along x [m]: a slow swing."""
    return math.sin(2 * math.pi * 0.5 * (t_ns - START_NS) / S)


def pose(t_ns: int, reset_counter: int = 0, x_m: float | None = None) -> Line:
    """Return an estimate of that flight, that turns steadily about z."""
    R_BtoW = so3.exp(frozen_array([0.0, 0.0, 1.0 * (t_ns - START_NS) / S]))
    position: Array = frozen_array([truth_m(t_ns) if x_m is None else x_m, 0.0, 1.0])
    one = estimate(t_ns, p_BinW=position, R_BtoW=R_BtoW, reset_counter=reset_counter)
    return Line("/estimate", t_ns + 20 * MS, estimate_value(one, so3.quaternion(R_BtoW).tolist()))


def poses(times_ns: Iterable[int]) -> list[Line]:
    """Return the estimates at these times."""
    return [pose(t_ns) for t_ns in times_ns]


def servo(t_ns: int, boot_ns: int, arrived_ns: int, us: float | None = None) -> Line:
    """Return a SERVO_OUTPUT_RAW measured at t_ns by an autopilot started at boot_ns; servo 1 follows the truth."""
    one_us = round(1500 + 400 * truth_m(t_ns)) if us is None else us
    fields = {"time_usec": (t_ns - boot_ns) // 1000, "servo1_raw": one_us, "servo2_raw": 0}
    return received(SERVO, fields, t_ns - boot_ns, arrived_ns)


def attitude(t_ns: int, boot_ns: int, arrived_ns: int, yaw_rad: float) -> Line:
    """Return a level ATTITUDE."""
    fields = {
        "time_boot_ms": (t_ns - boot_ns) // MS, "roll": 0.0, "pitch": 0.0, "yaw": yaw_rad,
        "rollspeed": 0.0, "pitchspeed": 0.0, "yawspeed": 0.5,
    }  # fmt: skip
    return received(ATTITUDE, fields, t_ns - boot_ns, arrived_ns)


def received(topic: str, fields: dict[str, Any], autopilot_ns: int, arrived_ns: int, system_id: int = 1) -> Line:
    """Return a message that came in, as the recorder logs it."""
    value = {
        "link": LINK, "system_id": system_id, "component_id": 1, "sequence": 0, "arrived_ns": arrived_ns,
        "autopilot_ns": autopilot_ns, "raw": base64.b64encode(b"\xfd\x00").decode(), "fields": fields,
    }  # fmt: skip
    return Line(topic, arrived_ns + 5 * MS, value)


def timesync(t_ns: int, boot_ns: int, restarts: int = 0) -> Line:
    """Return the state of the time sync at a stream time."""
    value = {
        "link": LINK, "t_ns": t_ns, "offset_ns": boot_ns, "skew_ppm": 0.0, "rtt_ms": 2.0, "spread_ms": 0.1,
        "samples": 9, "refused": 0, "restarts": restarts,
    }  # fmt: skip
    return Line("/timesync", t_ns, value)


def clock(t_ns: int, wall_ns: int) -> Line:
    """Return a reading of the wall clock."""
    return Line("/clock", t_ns, {"stream_ns": t_ns, "wall_ns": wall_ns})


def every(period_ns: int, duration_s: float, start_ns: int = START_NS) -> Sequence[int]:
    """Return regular times."""
    return range(start_ns, start_ns + round(duration_s * S), period_ns)
