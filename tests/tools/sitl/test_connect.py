"""`--connect`: a port that opens late, a simulator that has flown before, parameters that are not the flight's."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator, Mapping
from itertools import repeat
from pathlib import Path

import numpy as np
import pytest

from tools.sitl.aboard import Conditions, close, simulated
from tools.sitl.flight import FlightError
from tools.sitl.held import hold
from tools.sitl.late import LateWire
from tools.sitl.lockstep import Lockstep
from tools.sitl.wire import UdpWire
from tools.sitl.world import World
from tracker.errors import OperatorError

START_NS = 10**9


@pytest.fixture
def closed_port() -> Iterator[socket.socket]:
    """Hold a TCP port of loopback at which nobody listens yet."""
    with socket.socket() as port:
        port.bind(("127.0.0.1", 0))
        yield port


def asked(wire: LateWire, times: int) -> list[bytes]:
    """Return what a wire has when asked so often."""
    return [piece for _ in repeat(None, times) for piece in wire.receive()]


def test_a_port_that_opens_late_is_found_and_carries_both_ways(closed_port: socket.socket) -> None:
    wire = LateWire(*closed_port.getsockname())
    wire.send(b"lost")
    assert asked(wire, 500) == []
    closed_port.listen()
    assert asked(wire, 50) == []
    autopilot, _ = closed_port.accept()
    with autopilot:
        wire.send(b"pose")
        assert autopilot.recv(100) == b"pose"
        autopilot.sendall(b"heartbeat")
        assert b"".join(asked(wire, 100)) == b"heartbeat"
    wire.close()


def test_a_port_that_never_opens_is_told_in_one_line(closed_port: socket.socket) -> None:
    wire = LateWire(*closed_port.getsockname())
    with pytest.raises(OperatorError, match=r"SERIAL1 did not open at tcp:127\.0\.0\.1:\d+ within 20 s of its clock"):
        asked(wire, 20_000)


def test_a_simulator_whose_clock_runs_already_is_refused() -> None:
    lockstep = Lockstep(np.eye(3))
    simulator = UdpWire(("127.0.0.1", lockstep.port))
    simulator.send(struct.pack("<HHI16H", 18458, 1200, 7, *[1500] * 16))
    with pytest.raises(OperatorError, match=r"has flown before .*step 7.*start it anew"):
        lockstep.servos()
    simulator.close()
    lockstep.close()


def read(wanted: Mapping[str, float]) -> bool:
    """Have the simulated autopilot's parameters read; return whether all are as wanted."""
    aboard = simulated(Conditions(0.0, (47.0, 8.0, 400.0), 30, START_NS))
    world = World(aboard.pilot, aboard.ground, aboard.relay, aboard.helicopter, START_NS, (0.0, 0.0), 0.0)
    world.start(hold(world, wanted, Path("vision.parm")))
    try:
        world.pose_at(START_NS + 5 * 10**9)
    finally:
        close(aboard)
    return world.done


def test_the_right_parameters_let_the_flight_begin() -> None:
    assert read({"VISO_TYPE": 1, "VISO_DELAY_MS": 30, "VISO_POS_M_NSE": 0.1})


def test_wrong_and_missing_parameters_are_named_with_the_file_that_has_them() -> None:
    complaint = r"VISO_DELAY_MS 30 instead of 45, NONE_SUCH missing instead of 2; .*--defaults /.*/vision\.parm"
    with pytest.raises(FlightError, match=complaint):
        read({"VISO_TYPE": 1, "VISO_DELAY_MS": 45, "NONE_SUCH": 2})
