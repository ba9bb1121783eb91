"""The cameras' eyes: they look for balls as they know them, and learn from those that were found."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tracker.look import Fitted, Look, look_near
from tracker.rig import Rig
from tracker.rivals import first_rivals
from tracker.state import State
from tracker.strain import Strains
from tracker.types import Frame
from tracker.view import unknown_streak_px

LEARN_ALL = 72  # balls of each camera; then
LEARN_EVERY = 4  # rounds one ball
BLIND_PX = 0.5  # of the streak's sigma: how fast the balls move is not known
SMEAR_DOUBT = 0.1  # of an unknown smear: what it moves the centre of a shaded ball, one sigma
LONG_STREAK_PX = 0.7  # an image smeared further than this, taken for a still one, teaches wrong


class Eyes:
    """What each camera of a rig knows of how balls look to it."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._rivals = [first_rivals() for _ in rig.cameras]
        self._strains = Strains(len(rig.cameras))
        self._turn = 0
        self._taught_blindly = False

    @property
    def lessons_due(self) -> int:
        """Return how often the first images should be gone over again, since nothing else is known yet."""
        return max(rivals.lessons_due for rivals in self._rivals)

    @property
    def exposure_s(self) -> float:
        """Return how long the slowest shutter stands open, as learned [s]."""
        return max(rivals.best.response.exposure_s for rivals in self._rivals)

    def look(self, frames: Sequence[Frame], state: State) -> Look:
        """Find each ball in each image where a state expects it."""
        look = look_near(frames, self._rig, state, [rivals.best for rivals in self._rivals])
        look = self._strains.doubted(look)
        doubt_px = SMEAR_DOUBT * self._streak_px(state)
        return look.doubted(doubt_px) if doubt_px > SMEAR_DOUBT * BLIND_PX else look

    def blind(self, state: State) -> bool:
        """Say whether a state does not know how far the balls' images are smeared."""
        return self._streak_px(state) > BLIND_PX

    def _streak_px(self, state: State) -> float:
        """Return one sigma of how far the balls' images may be smeared that the state does not know of [px]."""
        return unknown_streak_px(state, self._rig, [rivals.best.response.exposure_s for rivals in self._rivals])

    def learn(self, fitted: Sequence[Fitted], *, blindly: bool) -> None:
        """Learn how balls look: from every one at first, then from one in turn every few rounds.

        blindly: how fast they moved was not known. It is better than nothing, and forgotten if they did move.
        """
        self._turn += 1
        for changed in self._strains.relit(fitted):
            self._rivals[changed] = self._rivals[changed].relit()
        if self._taught_blindly and not blindly:
            self._taught_blindly = False
            if any(math.hypot(*one.expected.streak_px) > LONG_STREAK_PX for one in fitted):
                self._rivals = [first_rivals() for _ in self._rig.cameras]
        self._taught_blindly |= blindly and not all(rivals.settled for rivals in self._rivals)
        if all(rivals.settled and rivals.best.light.count >= LEARN_ALL for rivals in self._rivals):
            fitted = [fitted[self._turn // LEARN_EVERY % len(fitted)]] if self._turn % LEARN_EVERY == 0 else []
        for one in fitted:
            index = one.frame.camera
            camera, image = self._rig.cameras[index], one.frame.image
            self._rivals[index] = self._rivals[index].learned(image, camera, one.expected, one.centre)
