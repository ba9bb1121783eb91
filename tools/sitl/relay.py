"""The wire between bridge and autopilot, with losses on demand, moved on in simulated time."""

from __future__ import annotations

import numpy as np

from tools.sitl.wire import UdpWire, Wire


class Relay:
    """Pass bytes both ways, piece by piece.

    far: the wire to the autopilot.  loss: share of pieces lost, either way.  bridge_port: where the bridge sends.
    """

    def __init__(self, far: Wire, seed: int = 0) -> None:
        self._near = UdpWire()
        self._far = far
        self._rng = np.random.default_rng(seed)
        self.loss = 0.0
        self.lost = 0
        self.bridge_port = self._near.port

    def pump(self) -> None:
        """Pass on what has come."""
        self._pass(self._near, self._far)
        self._pass(self._far, self._near)

    def close(self) -> None:
        """Close both ends."""
        self._near.close()
        self._far.close()

    def _pass(self, source: Wire, out: Wire) -> None:
        for piece in source.receive():
            if self._rng.random() < self.loss:
                self.lost += 1
            else:
                out.send(piece)
