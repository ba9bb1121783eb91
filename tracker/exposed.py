"""How much of the balls is too bright for each camera."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from tracker.image.exposure import full_share
from tracker.rig import Rig
from tracker.standing import Health
from tracker.state import State
from tracker.types import BallSighting, Frame

NEWEST = 0.5  # of what is said of a camera, the share of its newest image: one is looked at about every second


class Exposed:
    """Keep a recent mean, by camera, of the share of its balls' pixels of which a channel is full.

    shares: by camera, 0..1; as last seen where no ball is any more.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self.shares = [0.0] * len(rig.cameras)
        self._looked: set[int] = set()

    def look(self, frames: Iterable[Frame], used: Sequence[BallSighting], state: State) -> None:
        """Look at the balls of some frames.

        used: the sightings in them that fit the state, which is of about their time.
        """
        for frame in frames:
            found = [self._share(frame, one, state) for one in used if one.camera == frame.camera]
            if found:
                before = self.shares[frame.camera]
                newest = NEWEST if frame.camera in self._looked else 1.0
                self.shares[frame.camera] = before + newest * (sum(found) / len(found) - before)
                self._looked.add(frame.camera)

    def told(self, health: Health) -> Health:
        """Return what is said of the cameras, with this."""
        cameras = [replace(one, full_share=share) for one, share in zip(health.cameras, self.shares, strict=True)]
        return replace(health, cameras=tuple(cameras))

    def _share(self, frame: Frame, sighting: BallSighting, state: State) -> float:
        camera, ball = self._rig.cameras[frame.camera], self._rig.marker.balls[sighting.ball]
        away_m = float(np.linalg.norm(state.p_BinW - camera.p_CinW))
        u, v = sighting.uv_px.tolist()
        return full_share(frame.image, u, v, camera.focal_px * ball.radius_m / away_m)
