"""How far the balls' images are from what their camera has learned to expect, and what that is worth.

A lamp that moves or clips, a look-alike that touches a ball, a shadow: the fit still finds a place, close to the wrong
one, and says that it is sure, since its robust weights and the noise about the ball hide what does not fit. What does
not fit shows as colour that the model leaves unexplained: on the ball when the light is another one, beside it when
something of that colour stands there. Compared with what each ball usually leaves in each camera it tells when to
doubt a fit, and when a camera's light should be learned anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.look import Fitted, Look
from tracker.types import Array, frozen_array

USUAL_IN, USUAL_OUT = 0.005, 0.03  # of a ball never seen before
LEAST_IN, LEAST_OUT = 0.004, 0.02  # of what is usual: below that, multiples of it mean nothing
SHARE = 0.05  # of the newest image in what is usual
MOST_STEP = 1.0  # of a logarithm: what is usual follows slowly where all is new
SPARED_IN = 3.0  # times the usual: less is chance
SHIFT_IN = 0.5  # variance of the centre for a strain of 1, in squares of the radius
STRAINED = 4.0  # times the usual, on the ball
MOST_BALLS = 0.6  # of a camera's balls: light falls on all, a hand or a look-alike on some
ROUNDS = 3  # strained in a row, until the light is another one
PAUSE = 12  # rounds until it may be so again


class Strains:
    """What each ball usually leaves unexplained in each camera, and for how long it has been more."""

    def __init__(self, cameras: int) -> None:
        self._usual: dict[tuple[int, int], Array] = {}
        self._strained = [0] * cameras

    def doubted(self, look: Look) -> Look:
        """Return a look whose fits are less sure by what they leave unexplained."""
        return Look(tuple([self._doubted(one) for one in look.fitted]), look.rejections)

    def relit(self, fitted: Sequence[Fitted]) -> set[int]:
        """Take a round's balls, and return the cameras whose light has become another one."""
        changed, lit = set(), self._lit_otherwise(fitted)
        for camera in {one.frame.camera for one in fitted}:
            now = self._strained[camera]
            self._strained[camera] = now + 1 if camera in lit else min(0, now + 1)
            if self._strained[camera] >= ROUNDS:
                self._strained[camera] = -PAUSE
                changed.add(camera)
        for one in fitted:
            self._remember(one)
        return changed

    def _lit_otherwise(self, fitted: Sequence[Fitted]) -> set[int]:
        """Return the cameras in which most balls leave more than usual: that is the light."""
        found = set()
        for camera in {one.frame.camera for one in fitted}:
            strained = [self._strain(one)[0] > STRAINED for one in fitted if one.frame.camera == camera]
            if sum(strained) > max(1, MOST_BALLS * len(strained)):
                found.add(camera)
        return found

    def _strain(self, one: Fitted) -> tuple[float, float]:
        """Return the strains on a ball and beside it, times the usual."""
        usual_in, usual_out = self._usual_of(one).tolist()
        return one.centre.strain_in / usual_in, one.centre.strain_out / usual_out

    def _usual_of(self, one: Fitted) -> Array:
        """Return the usual strain on the ball and beside it (2,)."""
        return np.maximum(self._usual.get((one.frame.camera, one.sighting.ball), _FIRST), _LEAST)

    def _remember(self, one: Fitted) -> None:
        usual = self._usual_of(one)
        now = np.maximum((one.centre.strain_in, one.centre.strain_out), 1e-6)
        step = SHARE * np.clip(np.log(now / usual), -MOST_STEP, MOST_STEP)
        self._usual[one.frame.camera, one.sighting.ball] = usual * np.exp(step)

    def _doubted(self, one: Fitted) -> Fitted:
        more = one.centre.strain_in - SPARED_IN * float(self._usual_of(one)[0])
        if more <= 0.0:
            return one
        variance = SHIFT_IN * more * one.expected.radius_px**2
        cov_px = frozen_array(one.sighting.cov_px + variance * np.eye(2))
        return replace(one, sighting=replace(one.sighting, cov_px=cov_px))


_FIRST, _LEAST = frozen_array((USUAL_IN, USUAL_OUT)), frozen_array((LEAST_IN, LEAST_OUT))
