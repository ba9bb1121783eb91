"""The simulated world flown on its own true poses, packed and sent as the bridge does: no cameras, no tracker."""

from __future__ import annotations

from types import TracebackType
from typing import Self

import numpy as np

from bridge.dialect import Encoder, Identity
from bridge.links import open_link
from bridge.pack import Packer, heartbeat
from tools.simulate.autopilot.origins import Origin
from tools.simulate.helicopter import Helicopter
from tools.simulate.mission import Mission
from tools.simulate.world import Surroundings, World
from tracker.maths import so3
from tracker.types import Estimate, TrackState

START_NS = 10**9
ORIGIN = Origin(473_978_000, 85_456_000, 488_000)
BOTH = ("VISION_POSITION_ESTIMATE", "ATT_POS_MOCAP")


class ClosedLoop:
    """A world and a sender of noisy true poses, one every 1/15 s, `delay_ns` after they were true."""

    def __init__(
        self,
        duration_s: float = 16.0,
        seed: int = 1,
        room_yaw_deg: float = 0.0,
        messages: tuple[str, ...] = BOTH,
        component_id: int = 197,
    ) -> None:
        given, helicopter = Surroundings(room_yaw_deg=room_yaw_deg, origin=ORIGIN), Helicopter()
        self.mission = Mission(duration_s, given.floor_z_m + helicopter.skid_m)
        self.world = World(self.mission, START_NS, given, helicopter, seed)
        self._link = open_link(
            f"udpout:127.0.0.1:{self.world.autopilot.port}", Encoder(Identity(1, component_id)), lambda: 0
        )
        self._packer = Packer(room_yaw_deg)
        self._messages = messages
        self._rng = np.random.default_rng(seed)
        self._frame = 0
        self.heartbeats = True
        self.poses = True
        self.reset_counter = 0

    def fly(self, seconds: float) -> None:
        """Let time go on."""
        for _ in range(round(seconds * 15)):
            self._turn()

    def _turn(self) -> None:
        t_ns = START_NS + round(self._frame * 1e9 / 15)
        p_BinW, R_BtoW = self.world.pose_at(t_ns)
        self.world.pose_at(t_ns + self.world.surroundings.delay_ns)
        if self.heartbeats and self._frame % 15 == 0:
            self._link.send(heartbeat(t_ns))
        if self.poses:
            noisy = R_BtoW @ so3.exp(self._rng.normal(0.0, 0.004, 3))
            p_noisy = p_BinW + self._rng.normal(0.0, 0.001, 3)
            v_BinW = (p_BinW - self.world.pose_at(t_ns - 5_000_000)[0]) / 0.005 + self._rng.normal(0.0, 0.01, 3)
            estimate = Estimate(
                t_ns, p_noisy, noisy, v_BinW, np.zeros(3), 1e-6 * np.eye(12), TrackState.TRACKING, self.reset_counter
            )
            for message in self._packer.messages(estimate, self._messages).values():
                self._link.send(message)
        self._frame += 1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._link.close()
        self.world.close()
