"""Which gamma a camera has: several are tried side by side, each with the light that it makes one see.

Light learned under a wrong gamma hides the error, so a gamma cannot be learned in small steps as blur is: each rival
learns its own light and blur from the same balls. What their images leave unexplained is least at the camera's gamma
and grows with the square of the distance from it, so a parabola through three rivals tells it. Rivals closer together
would differ by less than by chance. A camera's gamma does not change, so the search ends there. Writing or books behind
the balls may well mislead it; so it begins again, once, when balls pass where the room behind them is known.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.camera import Camera
from tracker.image.appearance import MISFIT_MAX, Appearance
from tracker.image.centre import Centre, fit_centre
from tracker.image.light import MIDDLE, Light
from tracker.image.patch import Expected, Response, behind_is_known
from tracker.types import Array, Image

GAMMAS = (1.0, 1.6, 2.2)
MOST_GAMMA, BEYOND = 2.8, 0.3  # where the outermost is the best, rivals this far on either side of it are next
APART = 0.6  # as far on either side of a gamma found lie those that it is tried against once the room is known
SEARCHING = 0.17  # one sigma of a gamma while it is looked for: it lies nearest to this rival, they are 0.6 apart
LEAST_DOUBT, MOST_DOUBT = 0.08, 1.0  # of a gamma found
LEAST_AT_THE_END = 0.04  # of 1, where the range ends
UNLIT_PX = 0.12  # what all centres may be wrong by together while the light is not known
LEAST_PULL_PX = 0.06  # a unit of gamma: the pull is learned from few balls
BEND_DOUBT, SLOPE_DOUBT = 0.2, 0.02  # one sigma of a gamma found, times the parabola's bend, or its slope at 1
ROUND_BALLS, LONG_ROUND_BALLS = 54, 90  # balls that a set of rivals learns from before it is judged: the long round
CLEAR = 0.25  # where their misfits' logarithms differ by less than this; by chance it is about 0.05
FIRST_LESSONS, FIRST_BALLS = 4, 12
FORGETTING = 0.94  # a ball: what the light was when it was still being learned counts little


@dataclass(frozen=True, slots=True, eq=False)
class Rivals:
    """One camera's appearances under different gammas.

    appearances: one a gamma.  misfits: of each, recent mean of the logarithm.  count: balls learned since they were
    set up.  pull_px (2,): recent mean of how far a centre moves with gamma, a unit of it.
    by_room: whether only balls count, or counted, behind which the room is known.  doubt: one sigma of the gamma.
    """

    appearances: tuple[Appearance, ...]
    misfits: tuple[float, ...]
    count: int
    pull_px: Array
    by_room: bool = False
    doubt: float = SEARCHING

    @property
    def doubt_px(self) -> float:
        """Return by how much, one sigma, all centres may be wrong together since light or gamma are not known [px]."""
        by_gamma_px = self.doubt * math.hypot(*self.pull_px, LEAST_PULL_PX)
        return by_gamma_px if self.best.light.trusted else math.hypot(by_gamma_px, UNLIT_PX)

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

    def has_seen(self, balls: int) -> bool:
        """Say whether the search goes by the room, and the light was learned from so many balls before or since."""
        return self.by_room and self.best.light.count >= balls

    def under(self, gamma: float) -> Appearance:
        """Return the appearance of the gamma nearest to that."""
        return min(self.appearances, key=lambda one: abs(one.response.gamma - gamma))

    def at(self, place_m: Array) -> Rivals:
        """Return them at a place (3,) from the room's middle in W [m]; the same where the light is hardly another."""
        appearances = tuple([one.at(place_m) for one in self.appearances])
        same = all(after is before for after, before in zip(appearances, self.appearances, strict=True))
        return self if same else replace(self, appearances=appearances)

    def learned(
        self,
        image: Image,
        camera: Camera,
        ball: Expected,
        found: Centre,
        others: Sequence[Rivals] = (),
        place_m: Array = MIDDLE,
    ) -> Rivals:
        """Return the rivals after one more ball; arguments as for `Appearance.learned`, others of other cameras."""
        if found.misfit > MISFIT_MAX:
            return self
        if self._may_go_by_room and behind_is_known(ball):
            around = _around(self.best, APART, self.pull_px, by_room=True)
            return around.learned(image, camera, ball, found, others, place_m)
        if self.settled:
            if ball.response.gamma != self.best.response.gamma:
                return self  # looked at before this gamma was found
            one = self.best.learned(image, camera, ball, found, _lights(others, self.best), place_m)
            return Rivals((one,), self.misfits, self.count + 1, self.pull_px, self.by_room, self.doubt)
        if self.by_room and not behind_is_known(ball):
            return self
        appearances, misfits, centres = [], [], []
        share = max(1.0 - FORGETTING, 1.0 / (self.count + 1))
        for rival, misfit in zip(self.appearances, self.misfits, strict=True):
            own = rival.expected_like(ball, camera, found.uv_px)
            fit = fit_centre(image, own)
            if not isinstance(fit, Centre):
                return self
            appearances.append(rival.learned(image, camera, own, fit, _lights(others, rival), place_m))
            centres.append(fit.uv_px)
            misfits.append(misfit + share * (float(np.log(fit.misfit)) - misfit))
        apart = appearances[-1].response.gamma - appearances[0].response.gamma
        pull_px = self.pull_px + share * ((centres[-1] - centres[0]) / apart - self.pull_px)
        after = Rivals(tuple(appearances), tuple(misfits), self.count + 1, pull_px, self.by_room)
        return after._judged() if after._due() else after

    def in_other_light(self) -> Rivals:
        """Return the best with the light to be learned from nothing; a search by the room must begin anew."""
        by_room = self.by_room and self.settled
        return Rivals((self.best.in_other_light(),), (0.0,), 0, self.pull_px, by_room, self.doubt)

    def recentred(self, shift_m: Array) -> Rivals:
        """Return them about another middle of the room, shift_m (3,) from the one before in W."""
        return replace(self, appearances=tuple(one.recentred(shift_m) for one in self.appearances))

    @property
    def _may_go_by_room(self) -> bool:
        """Say whether gamma may be looked for again by the room: once, and in a light that is known."""
        return self.settled and not self.by_room and self.best.light.count >= ROUND_BALLS

    def _due(self) -> bool:
        """Say whether to judge them: they differ clearly, or will hardly ever."""
        clear = max(self.misfits) - min(self.misfits) > CLEAR
        return self.count >= (ROUND_BALLS if clear else LONG_ROUND_BALLS)

    def _judged(self) -> Rivals:
        """Return one appearance, of the gamma that they tell, or rivals further on where it may lie beyond them."""
        best, gammas = self.best, [appearance.response.gamma for appearance in self.appearances]
        gamma = best.response.gamma
        if (gamma == gammas[-1] and gamma < MOST_GAMMA) or (self.by_room and gamma == gammas[0] > GAMMAS[0]):
            return _around(best, BEYOND, self.pull_px, by_room=self.by_room)
        gamma, doubt = _lowest_point(gammas, self.misfits)
        return Rivals((best.with_gamma(gamma),), (0.0,), 0, self.pull_px, self.by_room, doubt)


def _lights(others: Sequence[Rivals], rival: Appearance) -> Iterator[Light]:
    """Yield what other cameras know of the light under a gamma such as a rival's: another would mislead it."""
    return (other.under(rival.response.gamma).light for other in others)


def _lowest_point(gammas: Sequence[float], misfits: Sequence[float]) -> tuple[float, float]:
    """Return where the parabola through three equally spaced points is lowest, within them, and one sigma of it.

    Where JPEG, smear or a small ball hide what gamma does, the parabola is flat, and its lowest point far from the
    truth; so what is said of it goes with its bend, or with its slope where it is lowest at 1, where the range ends.
    """
    left, middle, right = misfits
    apart, bend = gammas[1] - gammas[0], left - 2.0 * middle + right
    if bend > 0.0:
        at = min(gammas[2], max(gammas[0], gammas[1] + (left - right) / bend * apart / 2.0))
    else:
        at = gammas[0] if left < right else gammas[2]
    if at == GAMMAS[0]:
        return at, _within(LEAST_AT_THE_END, SLOPE_DOUBT, (middle - left) / apart)
    return at, _within(LEAST_DOUBT, BEND_DOUBT, bend / apart**2)


def _within(least: float, doubt: float, per: float) -> float:
    """Return a doubt divided by what tells against it, no less than that and no more than MOST_DOUBT."""
    return max(least, min(MOST_DOUBT, doubt / per)) if per > 0.0 else MOST_DOUBT


def _around(best: Appearance, apart: float, pull_px: Array, *, by_room: bool) -> Rivals:
    """Return rivals as far apart as that, the best in their middle unless its gamma is near the least there is."""
    lowest = max(GAMMAS[0], best.response.gamma - apart)
    appearances = tuple(best.with_gamma(gamma) for gamma in (lowest, lowest + apart, lowest + 2.0 * apart))
    return Rivals(appearances, (0.0, 0.0, 0.0), 0, pull_px, by_room)


def first_rivals() -> Rivals:
    """Return the rivals before anything was seen."""
    return Rivals(tuple(Appearance(Response(gamma=gamma)) for gamma in GAMMAS), (0.0,) * len(GAMMAS), 0, np.zeros(2))


def settled_on(appearance: Appearance) -> Rivals:
    """Return one appearance whose gamma is known."""
    return Rivals((appearance,), (0.0,), 0, np.zeros(2), doubt=0.0)
