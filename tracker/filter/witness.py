"""Who bears a sighting out: a ball that comes back from hiding, a camera that sees what no other sees, few sightings.

While a ball is hidden the turn about the other two is open, and whatever has its colour near where it may be fits. What
one camera sees there and another, which sees the other balls, does not, may be half a ball or two things in one: it is
taken with the doubt of such a spot's middle.

Of two cameras that contradict each other the track tells which shows what was to be expected. A torn frame that shows
the past does, an honest one that shows a sudden turn does not.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from tracker.filter.ekf import POSED
from tracker.state import ATTITUDE, POSITION, State
from tracker.types import Array, BallSighting, frozen_array

OPEN_RAD = 0.005  # one sigma of attitude: well beyond what three balls leave
GAP_S = 0.1  # longer than between cameras, or their frames
WITNESSES = 2  # balls that a camera must see to bear witness against one more: what shows one may be lost itself
DOUBT_PX = 1.5  # one sigma: half a ball's radius and more


def too_lonely(used: Sequence[BallSighting], looking: Iterable[int], balls: int) -> bool:
    """Say whether an update rests on too little: some of the balls in one camera, where another looked and saw none.

    One camera's two balls are four figures for six of a pose, and a thing of a ball's colour makes a pose of its own.
    Nor do two balls bear each other out where three cameras looked, most of which saw nothing.

    Args:
        used: the sightings of one instant.  looking: the cameras that gave a frame of it.  balls: of the marker.
    """
    if len(used) >= max(balls, POSED):  # as in nearly every round
        return False
    seeing, asked = len({sighting.camera for sighting in used}), len(set(looking))
    return len(used) < min(POSED, asked) or (len(used) < balls and seeing == 1 and asked > 1)


def doubted_alone(sightings: Sequence[BallSighting], last: State | None) -> tuple[BallSighting, ...]:
    """Return the sightings of one instant; while a turn is open, less sure where a second camera should bear them out.

    last: what the sightings before left known; None while nothing is tracked.
    """
    if last is None or not _open(last):
        return tuple(sightings)
    cameras = {sighting.camera for sighting in sightings}
    if len(cameras) < 2:
        return tuple(sightings)
    seen = {camera: {s.ball for s in sightings if s.camera == camera} for camera in cameras}
    return tuple(_doubted(one) if _denied(one.ball, seen) else one for one in sightings)


def unforeseen(used: Sequence[BallSighting], balls: int, gap_s: float, P_ahead: Array, reach_m: float) -> bool:
    """Say whether an update rests on what might be anything: a pose's sightings where the track knew of no place.

    Three sightings fit some pose whatever they show. Only the track bears them out, and not if it takes a ball to be
    anywhere within half of the vehicle's reach, where other balls may be too. All the balls in one camera are their own
    witnesses as long as there is no gap: a track just started, by cameras that see in turn, does not know its speed.

    Args:
        used: the sightings of one instant.  balls: of the marker.  gap_s: since the sightings before.
        P_ahead (n, n): the covariance of the prediction, n as of a `State`.
        reach_m: from the marker's middle to its farthest ball [m].
    """
    if len(used) > POSED:
        return False
    if len(used) == balls and len({sighting.camera for sighting in used}) == 1 and gap_s <= GAP_S:
        return False
    _, across2, _ = np.linalg.eigvalsh(P_ahead[POSITION, POSITION]).tolist()
    return bool(across2 > (reach_m / 2.0) ** 2)  # the largest is the depth, which a camera alone leaves open


class Quarrel:
    """Two cameras that contradict each other: neither is believed the first time.

    One that lies once (a torn frame, a ghost) costs a round then, and no wrong pose. One that goes on is left out.
    """

    def __init__(self) -> None:
        self._accused: int | None = None
        self._since_ns = 0

    def is_new(self, seen: Sequence[BallSighting], used: Sequence[BallSighting]) -> bool:
        """Say whether a single camera leaves out another one that was not left out before.

        seen: sightings of one instant.  used: those of them that the update believes.
        """
        believed = {sighting.camera for sighting in used}
        if len(believed) > 1:
            self._accused = None
            return False
        against = [sighting for sighting in seen if sighting.camera not in believed]
        if len(against) < WITNESSES:
            return False
        camera, _, t_ns, *_ = against[0]
        if self._accused != camera:
            self._accused, self._since_ns = camera, t_ns
        return t_ns <= self._since_ns  # the same images may be looked at again


def _open(state: State) -> bool:
    """Say whether a turn is open."""
    variance, i = state.P.item, ATTITUDE.start
    return max(variance(i, i), variance(i + 1, i + 1), variance(i + 2, i + 2)) >= OPEN_RAD**2


def _denied(ball: int, seen: Mapping[int, Collection[int]]) -> bool:
    """Say whether one camera alone sees a ball, and another does not that sees others well enough to be asked."""
    deniers = [balls for balls in seen.values() if ball not in balls]
    return len(deniers) == len(seen) - 1 and max(len(balls) for balls in deniers) >= WITNESSES


def _doubted(sighting: BallSighting) -> BallSighting:
    return sighting._replace(cov_px=frozen_array(sighting.cov_px + DOUBT_PX**2 * np.eye(2)))
