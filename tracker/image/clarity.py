"""By how much the light that was learned may move all centres of a camera, as the images themselves tell it.

Light is learned from the same images as centres, amid the same noise, blur and JPEG. Where one look at a ball tells its
centre badly, many tell its light badly, and a light that is not quite right moves the centres of all balls alike. With
them it moves the pose, and most of it shows nowhere; but each camera errs in its own way, and the rays of two that err
pass each other. Whatever else moves all balls of a camera, gloss or clocks that are not quite known, shows so too.

Source: rooms made up from a number, through other gammas and through JPEG, and those of a renderer that shares no code
    with ours; docs/experiments/consistency.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tracker.filter.measure import camera_table, marker_points, pixels
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array, BallSighting

UNKNOWN_PX = 0.06  # one sigma of a centre before any look
LOOKS = 10  # that the means are of
PLACE = 3  # axes: of what the cameras err by, the position takes up as much
SHARE = 0.4  # of a centre's sigma, which light learned by such images leaves in all centres


class Clarity:
    """Follows how sure the centres are that each camera shows, and how well the cameras agree on them.

    cameras: how many there are.
    """

    def __init__(self, cameras: int) -> None:
        self._variance_px2 = [UNKNOWN_PX**2] * cameras
        self._looks = [0] * cameras
        self._apart_px2, self._meetings = 0.0, 0

    def take(self, seen: Sequence[BallSighting], state: State, rig: Rig) -> None:
        """Take note of the sightings of one look, through one camera or several, and of the state that they made."""
        off_px = np.array([one.uv_px for one in seen]) - _where(seen, state, rig)
        shared_px, by_noise_px2 = [], []
        for camera in sorted({one.camera for one in seen}):
            mine = [k for k, one in enumerate(seen) if one.camera == camera]
            variances_px2 = [float(seen[k].cov_px.trace()) / 2.0 for k in mine]
            self._show(camera, variances_px2)
            if len(mine) > 1:
                shared_px.append(off_px[mine].mean(axis=0))
                by_noise_px2.append(sum(variances_px2) / len(mine) ** 2)
        if len(shared_px) > 1:
            self._meet(shared_px, by_noise_px2)

    def _show(self, camera: int, variances_px2: Sequence[float]) -> None:
        """Take note of how clearly a camera showed its balls: the variances of their centres along one axis."""
        middle = sorted(variances_px2)[len(variances_px2) // 2]  # one may be hidden in part, and so be doubted
        self._looks[camera] = min(LOOKS, self._looks[camera] + 1)
        self._variance_px2[camera] += (middle - self._variance_px2[camera]) / self._looks[camera]

    def _meet(self, shared_px: Sequence[Array], by_noise_px2: Sequence[float]) -> None:
        """Take note of how far cameras that looked together contradict each other.

        Args:
            shared_px: of each camera, by how much its balls are seen off where the pose has them, their mean (2,).
            by_noise_px2: of each of these means, the variance along one axis that noise alone makes.
        Source: n cameras that err by s along each axis leave s^2 (2 n - 3), since a position takes up three of 2 n.
        """
        squares_px2 = sum(float(one @ one) for one in shared_px)
        more_px2 = squares_px2 / (2 * len(shared_px) - PLACE) - sum(by_noise_px2) / len(by_noise_px2)
        self._meetings = min(LOOKS, self._meetings + 1)
        self._apart_px2 += (more_px2 - self._apart_px2) / self._meetings

    @property
    def light_px(self) -> list[float]:
        """Return what each camera's light may move all of its centres by, one sigma along each axis [px]."""
        return [math.sqrt(max(SHARE**2 * variance, self._apart_px2)) for variance in self._variance_px2]


def _where(seen: Sequence[BallSighting], state: State, rig: Rig) -> Array:
    """Return where a state has the balls that were seen (n, 2) [px]."""
    cameras, balls = np.array([one.camera for one in seen]), np.array([one.ball for one in seen])
    lags_s = np.array([one.t_ns - state.t_ns for one in seen]) * 1e-9
    h, _ = pixels(state.mean, state.manoeuvre_s, cameras, balls, lags_s, camera_table(rig), marker_points(rig))
    return h.reshape(-1, 2)
