"""The yaw watched in flight: the simulated helicopter flies on poses whose yaw is right, or is not."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from bridge.dialect import Encoder, Identity, Reader
from bridge.dialogue import DialogueState, Terms
from bridge.links import MemoryLink, open_link
from bridge.outlet import Outlet, Spout
from bridge.pack import Packer
from tools.simulate.autopilot.origins import Origin
from tools.simulate.autopilot.vessel import Mode
from tools.simulate.helicopter import Helicopter
from tools.simulate.mission import Mission
from tools.simulate.world import Surroundings, World
from tools.sitl.wire import UdpWire
from tracker.maths import so3
from tracker.types import Estimate, Step, TrackState

START_NS = 10**9
RATE_HZ = 15


class Flight:
    """A mission flown on true poses whose yaw is wrong by yaw_error_deg, clockwise; texts: what the bridge said."""

    def __init__(self, yaw_error_deg: float, seed: int = 1) -> None:
        given, helicopter = Surroundings(origin=Origin(473_978_000, 85_456_000, 488_000)), Helicopter()
        self.world = World(Mission(40.0, given.floor_z_m + helicopter.skid_m), START_NS, given, helicopter, seed)
        self._wire = UdpWire(("127.0.0.1", self.world.autopilot.port))
        encoder = Encoder(Identity(1))
        link = open_link("memory:flight", encoder, lambda: self.now_ns)
        assert isinstance(link, MemoryLink)
        self._link = link
        self.outlet = Outlet([Spout(link, Terms(), encoder)], Packer(0.0))
        self.now_ns = START_NS
        self._R_error = so3.from_euler(0.0, 0.0, -np.radians(yaw_error_deg))
        self._noise = np.random.default_rng(seed)
        self._reader = Reader()
        self.texts: list[str] = []

    def fly(self, seconds: float) -> Iterator[DialogueState]:
        """Fly on, and say at each pose what is known of the far end."""
        self.outlet.listen(lambda: self.now_ns)
        for frame in range(round(seconds * RATE_HZ)):
            t_ns = START_NS + frame * 10**9 // RATE_HZ
            p_BinW, R_BtoW = self.world.pose_at(t_ns)
            before, _ = self.world.pose_at(t_ns - 5_000_000)
            self.now_ns = t_ns + self.world.surroundings.delay_ns
            self.world.pose_at(self.now_ns)
            for datagram in self._wire.receive():
                self._link.deliver(datagram)
            v_BinW = (p_BinW - before) / 0.005 + self._noise.normal(0.0, 0.02, 3)
            estimate = Estimate(
                t_ns, p_BinW, R_BtoW @ self._R_error, v_BinW, np.zeros(3), 1e-6 * np.eye(12), TrackState.TRACKING, 0
            )
            self.outlet.send(Step(TrackState.TRACKING, estimates=(estimate,)), self.now_ns)
            while self._link.frames:
                raw = self._link.frames.popleft()
                self._wire.send(raw)
                self.texts += [str(m.fields["text"]) for m in self._reader.feed(raw) if m.message == "STATUSTEXT"]
            (far,) = self.outlet.far_ends()
            yield far

    def close(self) -> None:
        """Let go of the sockets."""
        self._wire.close()
        self.world.close()


@pytest.mark.parametrize("yaw_error_deg", [90.0, -90.0, 180.0])
def test_a_wrong_yaw_is_told_before_the_vehicle_has_gone_far(yaw_error_deg: float) -> None:
    flight = Flight(yaw_error_deg)
    try:
        flown = flight.fly(40.0)
        told = next(far for far in flown if far.yaw)
        p_BinW, _ = flight.world.pose_at(flight.now_ns)
        next(flown)
    finally:
        flight.close()
    assert flight.world.autopilot.armed
    assert float(np.linalg.norm(p_BinW[:2])) < 2.0
    assert "steers the wrong way" in told.yaw
    assert "YAW WRONG" in told.brief
    assert flight.texts[-1] == "posebridge: yaw wrong: take over by hand and land"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_mission_flown_on_a_right_yaw_gives_no_alarm(seed: int) -> None:
    flight = Flight(0.0, seed)
    try:
        alarms = [far.yaw for far in flight.fly(45.0) if far.yaw]
    finally:
        flight.close()
    assert flight.world.autopilot.mode is Mode.LANDED
    assert alarms == []
    assert not [text for text in flight.texts if "yaw" in text]
