"""What we send, read by software that others fly with: MAVProxy, a ground station, and MAVSDK, which parses by libmav.

Each is told all four messages over UDP and must read back every field of every one, and whose they are.
"""

from __future__ import annotations

import json
import re
import select
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, perf_counter_ns
from typing import Any

import numpy as np
import pytest

from bridge.dialogue import Terms
from bridge.outlet import open_outlet
from bridge.pack import MESSAGES
from bridge.wire import Sent
from tests.bridge.estimates import estimate, random_covariance, step
from tests.bridge.tlogs import frames_in
from tracker.maths import so3

HOST = "127.0.0.1"
VEHICLE, COMPONENT = 7, 197
PERIOD_S = 0.02
PATIENCE_S = 60.0
ENOUGH = 10
STAMPS = {name: "time_usec" if name in ("ATT_POS_MOCAP", "ODOMETRY") else "usec" for name in MESSAGES}

Read = tuple[str, Mapping[str, Any]]
"""A message as a receiver read it: its name, its fields by MAVLink's names."""


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])


def fly_until(port: int, enough: Callable[[], bool]) -> dict[tuple[str, int], Sent]:
    """Send random poses to a port until the receiver has enough; return what went, by message and stamp [us]."""
    generator = np.random.default_rng(11)
    outlet = open_outlet(
        [(f"udpout:{HOST}:{port}", Terms(messages=MESSAGES, vehicle_id=VEHICLE, max_age_ns=10**18))],
        component_id=COMPONENT, room_yaw_deg=30.0, stopwatch=perf_counter_ns,
    )  # fmt: skip
    sent: list[Sent] = []
    deadline = monotonic() + PATIENCE_S
    while not enough():
        assert monotonic() < deadline, "the receiver has not read enough in a minute"
        t_ns = perf_counter_ns()
        pose = estimate(
            t_ns, generator.normal(size=3), so3.exp(generator.normal(size=3)), generator.normal(size=3),
            random_covariance(generator, 12), reset_counter=3,
        )  # fmt: skip
        sent += outlet.send(step(pose), t_ns)
        select.select([], [], [], PERIOD_S)
    sent += outlet.close()
    return {(each.message, each.t_ns // 1000): each for each in sent}


def assert_read_as_sent(read: list[Read], sent: Mapping[tuple[str, int], Sent]) -> None:
    """Hold every field of every pose that was read against the one that was sent with that stamp."""
    poses = [(name, fields) for name, fields in read if name in MESSAGES]
    assert {name for name, _ in poses} == set(MESSAGES)
    for name, fields in poses:
        expected = sent[name, int(fields[STAMPS[name]])].fields
        assert fields.keys() >= expected.keys()
        for field, value in expected.items():
            assert fields[field] == pytest.approx(value, rel=1e-7, abs=0.0), f"{name}.{field}"


def counts_enough(read: list[Read]) -> bool:
    return all(sum(name == wanted for name, _ in read) >= ENOUGH for wanted in MESSAGES)


@contextmanager
def mavproxy_at(port: int, folder: Path) -> Iterator[tuple[list[str], Path]]:
    """Run MAVProxy on a port without modules, printing all it hears; give its lines as they come, and its own log."""
    arguments = [
        sys.executable, "-m", "MAVProxy.mavproxy", f"--master=udpin:{HOST}:{port}", "--non-interactive",
        "--logfile=heard.tlog", f"--state-basedir={folder}", "--default-modules=", "--cmd=watch *",
    ]  # fmt: skip
    surroundings = {"HOME": str(folder), "PATH": "/usr/bin:/bin", "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(
        arguments, cwd=folder, env=surroundings, text=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    ) as process:  # fmt: skip
        lines: list[str] = []

        def follow() -> None:
            assert process.stdout is not None
            lines.extend(process.stdout)

        reader = threading.Thread(target=follow)
        reader.start()
        try:
            yield lines, folder / "heard.tlog"
        finally:
            process.terminate()
            reader.join()


def messages_in(lines: list[str]) -> list[Read]:
    """Read `< NAME {field : value, ...}`, as MAVProxy's `watch` prints what it heard."""
    found = (re.fullmatch(r"< (\w+) (\{.*\})", line.strip()) for line in list(lines))
    return [(match[1], json.loads(re.sub(r"(\w+) : ", r'"\1" : ', match[2]))) for match in found if match]


def vehicles_in(lines: list[str]) -> set[tuple[int, int]]:
    """Return system and component id of the vehicles that MAVProxy says it has found."""
    found = (re.match(r"Detected vehicle (\d+):(\d+)", line) for line in list(lines))
    return {(int(match[1]), int(match[2])) for match in found if match}


def test_mavproxy_reads_what_was_sent(mavproxy: None, tmp_path: Path) -> None:
    port = free_port()
    with mavproxy_at(port, tmp_path) as (lines, log):
        sent = fly_until(port, lambda: counts_enough(messages_in(lines)) and bool(vehicles_in(lines)))
    assert_read_as_sent(messages_in(lines), sent)
    assert vehicles_in(lines) == {(VEHICLE, COMPONENT)}
    frames = [frame for frame in frames_in(log.read_bytes()) if frame[5:7] == bytes((VEHICLE, COMPONENT))]
    raw = {each.raw for each in sent.values()}
    assert len(frames) > ENOUGH
    assert all(frame in raw for frame in frames)


def test_mavsdk_reads_what_was_sent(mavsdk: Any) -> None:
    """MAVSDK's telemetry plugin tells of an autopilot only; its `mavlink_direct` gives every message of every part."""
    from mavsdk.plugins.mavlink_direct import MavlinkDirect

    port, read, whose = free_port(), list[Read](), set[tuple[int, int]]()
    receiver = mavsdk.Mavsdk(mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.GROUND_STATION))
    receiver.add_any_connection(f"udpin://{HOST}:{port}")
    plugins: list[Any] = []

    def take(message: Any, _: object) -> None:
        read.append((message.message_name, json.loads(message.fields_json)))
        whose.add((message.system_id, message.component_id))

    def enough() -> bool:
        systems = receiver.get_systems()
        if systems and not plugins:
            plugins.append(MavlinkDirect(systems[0]))
            plugins[0].subscribe_message("", take)
        return counts_enough(list(read))

    try:
        sent = fly_until(port, enough)
    finally:
        for plugin in plugins:
            plugin.destroy()
        receiver.destroy()
    assert_read_as_sent(read, sent)
    assert whose == {(VEHICLE, COMPONENT)}
