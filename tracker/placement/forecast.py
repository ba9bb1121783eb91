"""How well several cameras together know the pose: covariance and coverage over a set of poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.placement.views import Flags, Poses, View, arms
from tracker.rig import Marker
from tracker.types import Array

PRIOR_POSITION_M, PRIOR_ATTITUDE_RAD = 1.0, 1.0
"""What is known without cameras, one sigma: it keeps an unseen pose's covariance finite and a seen one's as it is."""
CAMERAS_NEEDED = 2


@dataclass(frozen=True, slots=True, eq=False)
class Forecast:
    """What is to be expected at s poses from one instant's pictures.

    covariance: (s, 6, 6) of position in W and rotation in B [m, rad].
    covered: (s,) every ball is in the picture of two cameras at least, what the tracker needs to start.
    clear: (s,) and none of them hidden by another ball.
    ball_m: (s,) rms distance of the balls from where the pose says they are [m]: position and attitude in one figure.
    """

    covariance: Array
    covered: Flags
    clear: Flags
    ball_m: Array

    @property
    def position_m(self) -> Array:
        """Return the rms distance (s,) of the position from the truth [m]."""
        return np.asarray(np.sqrt(np.trace(self.covariance[:, :3, :3], axis1=1, axis2=2)))

    @property
    def attitude_rad(self) -> Array:
        """Return the rms angle (s,) of the attitude from the truth [rad]."""
        return np.asarray(np.sqrt(np.trace(self.covariance[:, 3:, 3:], axis1=1, axis2=2)))


def forecast(views: Sequence[View], marker: Marker, poses: Poses) -> Forecast:
    """Add up what the cameras tell."""
    information = np.sum([view.information for view in views], axis=0)
    pictured = np.sum([view.pictured for view in views], axis=0)
    seen = np.sum([view.seen for view in views], axis=0)
    covariance = covariance_of(information)
    return Forecast(
        covariance,
        (pictured >= CAMERAS_NEEDED).all(axis=1),
        (seen >= CAMERAS_NEEDED).all(axis=1),
        ball_error(covariance, lever(marker, poses)),
    )


def covariance_of(information: Array) -> Array:
    """Return the covariance (..., 6, 6) of poses whose cameras tell so much."""
    prior = np.diag(np.repeat([PRIOR_POSITION_M**-2, PRIOR_ATTITUDE_RAD**-2], 3))
    return np.asarray(np.linalg.inv(information + prior))


def lever(marker: Marker, poses: Poses) -> Array:
    """Return L (s, 6, 6): the mean square error of the balls' places is trace(covariance L).

    Source: ball i errs by G_i e with G_i = [I, -R [m_i]x], so L is the mean of G_i' G_i.
    """
    turning = arms(marker, poses)
    G = np.concatenate((np.broadcast_to(np.eye(3), turning.shape), turning), axis=3)
    return np.asarray((G.transpose(0, 1, 3, 2) @ G).mean(axis=1))


def ball_error(covariance: Array, levers: Array) -> Array:
    """Return the rms error of the balls' places (...) [m]."""
    return np.asarray(np.sqrt((covariance * levers).sum(axis=(-2, -1))))
