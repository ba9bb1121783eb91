"""What an operator reads when a link does not open."""

from __future__ import annotations

import itertools
import socket
from pathlib import Path

import pytest

from bridge.dialect import Encoder, Identity
from bridge.links import line_bytes_s, open_link
from bridge.links.uri import Address, parse
from tests.bridge.estimates import beat
from tests.contracts.far_ends import SerialFar, UdpCaller
from tracker.errors import OperatorError


def refusal(uri: str) -> str:
    """Return the one line with which the URI is refused."""
    with pytest.raises(OperatorError) as refused:
        open_link(uri, Encoder(Identity(1)), itertools.count().__next__)
    line = str(refused.value)
    assert "\n" not in line
    return line


@pytest.mark.parametrize(
    ("uri", "address"),
    [
        ("udpout:192.168.1.5:14550", ("udpout", "192.168.1.5", 14550)),
        ("udpin:[::1]:14551", ("udpin", "::1", 14551)),
        ("tcp:sitl.lan:5760", ("tcp", "sitl.lan", 5760)),
        ("serial:/dev/ttyUSB0:57600", ("serial", "/dev/ttyUSB0", 57600)),
        ("serial:/dev/serial/by-path/pci-0:1:1.0:921600", ("serial", "/dev/serial/by-path/pci-0:1:1.0", 921600)),
        ("memory:", ("memory", "", 0)),
    ],
)
def test_a_link_uri_names_a_transport_a_place_and_a_number(uri: str, address: tuple[str, str, int]) -> None:
    assert parse(uri) == Address(uri, *address)


@pytest.mark.parametrize(
    "uri", ["", "udp:host:1", "carrier:pigeon:1", "udpout:14550", "tcp:host:", "serial:/dev/ttyUSB0", "udpin::1"]
)
def test_an_unknown_form_is_answered_with_the_known_ones(uri: str) -> None:
    line = refusal(uri)
    for form in ("udpout:HOST:PORT", "udpin:HOST:PORT", "serial:DEVICE:BAUD", "tcp:HOST:PORT"):
        assert form in line


@pytest.mark.parametrize(
    ("uri", "words"),
    [
        ("serial:/dev/ttyUSB0:0", "baud 0 must be positive"),
        ("serial:/dev/ttyUSB0:-9600", "baud -9600 must be positive"),
        ("udpout:127.0.0.1:65536", "port 65536 must be 1 to 65535"),
        ("udpin:127.0.0.1:0", "port 0 must be 1 to 65535"),
        ("udpout:no such host:14550", "does not resolve"),
        ("udpin:two..dots:14550", "does not resolve"),
        ("tcp:no such host:5760", "does not resolve"),
        ("tcp:two..dots:5760", "does not resolve"),
        ("udpin:192.0.2.1:14550", "cannot listen there"),  # a documentation address: never this host's
        ("udpout:255.255.255.255:14550", "cannot send there"),
        ("serial:/dev/null:57600", "check that it is a serial port"),
    ],
)
def test_what_cannot_open_is_named_with_its_value_and_limit(uri: str, words: str) -> None:
    line = refusal(uri)
    assert uri in line
    assert words in line


def test_a_serial_device_that_is_not_there_is_answered_with_those_that_are(tmp_path: Path) -> None:
    assert "serial ports found: " in refusal(f"serial:{tmp_path}/ttyNone:57600")


def test_a_tcp_port_where_nobody_listens_is_refused() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    assert "nobody listens there" in refusal(f"tcp:127.0.0.1:{port}")


def test_a_udp_port_in_use_is_refused() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        assert "in use" in refusal(f"udpin:127.0.0.1:{other.getsockname()[1]}")


def test_a_serial_port_in_use_is_refused(tmp_path: Path) -> None:
    far = SerialFar(tmp_path)
    link = open_link(far.uri, Encoder(Identity(1)), itertools.count().__next__)
    assert "is in use" in refusal(far.uri)
    link.close()
    far.vanish()


def test_udpin_sends_nothing_until_it_has_heard_somebody_then_to_the_first_heard(tmp_path: Path) -> None:
    first = UdpCaller(tmp_path)
    clock_ns = [0]
    link = open_link(first.uri, Encoder(Identity(1)), lambda: clock_ns[0])
    link.send(beat(1))
    assert (link.state().up, link.state().reason, link.state().dropped) == (False, "nobody heard yet", 1)
    first.meet(link)
    link.send(beat(2))
    assert [frame.sequence for frame in first.frames(1)] == [0]
    first.vanish()
    first.come_back()  # the same host from another port
    first.write(b"too early")
    assert link.receive() == b""
    clock_ns[0] = 2_000_000_000
    first.meet(link)
    link.send(beat(3))
    assert [frame.sequence for frame in first.frames(1)] == [1]
    assert link.state().up
    link.close()
    first.vanish()


@pytest.mark.parametrize(
    ("uri", "bytes_s"),
    [
        ("serial:/dev/ttyUSB0:57600", 5760.0),
        ("serial:/dev/serial/by-path/pci-0:1:921600", 92160.0),
        ("udpout:127.0.0.1:14550", None),
        ("tcp:127.0.0.1:5760", None),
        ("memory:a", None),
        ("memory:serial:/dev/ttyUSB0:57600", 5760.0),
        ("serial:/dev/ttyUSB0:fast", None),
    ],
)
def test_a_serial_line_carries_a_tenth_of_its_baud_in_bytes(uri: str, bytes_s: float | None) -> None:
    assert line_bytes_s(uri) == bytes_s
