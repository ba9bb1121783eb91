"""Which gamma a camera has: several are tried side by side, each with the light that it makes one see.

Light learned under a wrong gamma hides the error, so a gamma cannot be learned in small steps as blur is: each rival
learns its own light and blur from the same balls, and the one whose images fit best is believed. Then the rivals come
closer. The search ends after a few seconds of tracking; a camera's gamma does not change.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tracker.camera import Camera
from tracker.image.appearance import MISFIT_MAX, Appearance
from tracker.image.centre import Centre, fit_centre
from tracker.image.patch import Expected, Response
from tracker.types import Image

GAMMAS = (1.0, 1.6, 2.2)
LEAST_GAMMA, MOST_GAMMA = 1.0, 2.8
LAST_STEP = 0.1
ROUND_BALLS = 36  # balls that a set of rivals learns from before the best is chosen
FIRST_LESSONS, FIRST_BALLS = 4, 12
FORGETTING = 0.94  # a ball: what the light was when it was still being learned counts little


@dataclass(frozen=True, slots=True, eq=False)
class Rivals:
    """One camera's appearances under different gammas.

    appearances: one a gamma.  misfits: of each, recent mean of the logarithm.  count: balls learned since they were
    set up.  step: between gammas; 0 when the search is over and one is left.
    """

    appearances: tuple[Appearance, ...]
    misfits: tuple[float, ...]
    count: int
    step: float

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
            return replace(self, appearances=(self.appearances[0].learned(image, camera, ball, found),))
        appearances, misfits = [], []
        for rival, misfit in zip(self.appearances, self.misfits, strict=True):
            own = rival.expected_like(ball, camera, found.uv_px)
            fit = fit_centre(image, own)
            if not isinstance(fit, Centre):
                return self
            appearances.append(rival.learned(image, camera, own, fit))
            share = max(1.0 - FORGETTING, 1.0 / (self.count + 1))
            misfits.append(misfit + share * (float(np.log(fit.misfit)) - misfit))
        after = Rivals(tuple(appearances), tuple(misfits), self.count + 1, self.step)
        return after._closer() if after.count >= ROUND_BALLS else after

    def _closer(self) -> Rivals:
        """Return the best with two nearer rivals, or alone when they would be too near to tell apart."""
        best, step = self.best, self.step / 2.0
        if step < LAST_STEP:
            return Rivals((best,), (0.0,), 0, 0.0)
        gammas = [best.response.gamma + k * step for k in (-1, 0, 1)]
        kept = [best.with_gamma(gamma) for gamma in gammas if LEAST_GAMMA <= gamma <= MOST_GAMMA]
        return Rivals(tuple(kept), (0.0,) * len(kept), 0, step)


def first_rivals() -> Rivals:
    """Return the rivals before anything was seen."""
    appearances = tuple(Appearance(Response(gamma=gamma)) for gamma in GAMMAS)
    return Rivals(appearances, (0.0,) * len(GAMMAS), 0, GAMMAS[1] - GAMMAS[0])
