"""Which gamma a camera has: several are tried side by side, each with the light that it makes one see.

Light learned under a wrong gamma hides the error, so a gamma cannot be learned in small steps as blur is: each rival
learns its own light and blur from the same balls. What their images leave unexplained is least at the camera's gamma
and grows with the square of the distance from it, so a parabola through three rivals tells it. Rivals closer together
would differ by less than by chance. A camera's gamma does not change, so the search ends there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.camera import Camera
from tracker.image.appearance import MISFIT_MAX, Appearance
from tracker.image.centre import Centre, fit_centre
from tracker.image.patch import Expected, Response
from tracker.types import Array, Image

GAMMAS = (1.0, 1.6, 2.2)
MOST_GAMMA, BEYOND = 2.8, 0.3  # where the highest is the best, rivals this far on either side of it are next
SEARCHING, FOUND, AT_THE_END = 0.3, 0.12, 0.04
"""One sigma of a gamma: of the best rival, of one that three told, and of 1, where the range ends."""
ROUND_BALLS, LONG_ROUND_BALLS = 54, 90  # balls that a set of rivals learns from before it is judged: the long round
CLEAR = 0.25  # where their misfits' logarithms differ by less than this; by chance it is about 0.05
FIRST_LESSONS, FIRST_BALLS = 4, 12
FORGETTING = 0.94  # a ball: what the light was when it was still being learned counts little


@dataclass(frozen=True, slots=True, eq=False)
class Rivals:
    """One camera's appearances under different gammas.

    appearances: one a gamma.  misfits: of each, recent mean of the logarithm.  count: balls learned since they were
    set up.  pull_px (2,): recent mean of how far a centre moves with gamma, a unit of it.
    """

    appearances: tuple[Appearance, ...]
    misfits: tuple[float, ...]
    count: int
    pull_px: Array

    @property
    def doubt_px(self) -> float:
        """Return by how much, one sigma, all centres may be wrong together since gamma is not known exactly [px]."""
        gamma = self.best.response.gamma
        doubt = SEARCHING if not self.settled else AT_THE_END if gamma == GAMMAS[0] else FOUND
        return doubt * math.hypot(*self.pull_px)

    @property
    def best(self) -> Appearance:
        """Return the appearance that fits best."""
        return self.appearances[self.misfits.index(min(self.misfits))]

    @property
    def lessons_due(self) -> int:
        """Return how often to go over the first images again, since nothing else is known yet."""
        return FIRST_LESSONS if self.best.light.count <= FIRST_BALLS else 0

    @property
    def settled(self) -> bool:
        """Say whether the search is over."""
        return len(self.appearances) == 1

    def learned(self, image: Image, camera: Camera, ball: Expected, found: Centre) -> Rivals:
        """Return the rivals after one more ball; arguments as for `Appearance.learned`."""
        if found.misfit > MISFIT_MAX:
            return self
        if self.settled:
            known = self.appearances[0].learned(image, camera, ball, found)
            return replace(self, appearances=(known,), count=self.count + 1)
        appearances, misfits, centres = [], [], []
        share = max(1.0 - FORGETTING, 1.0 / (self.count + 1))
        for rival, misfit in zip(self.appearances, self.misfits, strict=True):
            own = rival.expected_like(ball, camera, found.uv_px)
            fit = fit_centre(image, own)
            if not isinstance(fit, Centre):
                return self
            appearances.append(rival.learned(image, camera, own, fit))
            centres.append(fit.uv_px)
            misfits.append(misfit + share * (float(np.log(fit.misfit)) - misfit))
        apart = appearances[-1].response.gamma - appearances[0].response.gamma
        pull_px = self.pull_px + share * ((centres[-1] - centres[0]) / apart - self.pull_px)
        after = Rivals(tuple(appearances), tuple(misfits), self.count + 1, pull_px)
        return after._judged() if after._due() else after

    def _due(self) -> bool:
        """Say whether to judge them: they differ clearly, or will hardly ever."""
        clear = max(self.misfits) - min(self.misfits) > CLEAR
        return self.count >= (ROUND_BALLS if clear else LONG_ROUND_BALLS)

    def _judged(self) -> Rivals:
        """Return one appearance, of the gamma that they tell, or rivals further up where it may lie beyond them."""
        best = self.best
        gammas = [appearance.response.gamma for appearance in self.appearances]
        highest = best.response.gamma == gammas[-1]
        if highest and gammas[-1] < MOST_GAMMA:
            return _rivals((best.with_gamma(gammas[-1] + k * BEYOND) for k in (-1, 0, 1)), self.pull_px)
        return _rivals([best.with_gamma(_lowest_point(gammas, self.misfits))], self.pull_px)


def _lowest_point(gammas: Sequence[float], misfits: Sequence[float]) -> float:
    """Return where the parabola through three equally spaced points is lowest, within them."""
    left, middle, right = misfits
    bend = left - 2.0 * middle + right
    if bend <= 0.0:
        return gammas[0] if left < right else gammas[2]
    at = gammas[1] + (left - right) / bend * (gammas[1] - gammas[0]) / 2.0
    return min(gammas[2], max(gammas[0], at))


def _rivals(appearances: Iterable[Appearance], pull_px: Array) -> Rivals:
    together = tuple(appearances)
    return Rivals(together, (0.0,) * len(together), 0, pull_px)


def first_rivals() -> Rivals:
    """Return the rivals before anything was seen."""
    return _rivals((Appearance(Response(gamma=gamma)) for gamma in GAMMAS), np.zeros(2))


def settled_on(appearance: Appearance) -> Rivals:
    """Return one appearance whose gamma is known."""
    return _rivals([appearance], np.zeros(2))
