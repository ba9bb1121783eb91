"""What the light's colour does to the balls' colours in one camera, followed while tracking.

A lamp switched on, a cloud, or a camera's white balance multiplies blue and red against green, for all balls alike. The
colours of the config hold for one light; here is how far the light is from it now. It is told by the balls themselves:
their own colours do not change, so what changes in all of them is the light.

Source: von Kries's diagonal model (Finlayson, Drew, Funt, "Diagonal transforms suffice for color constancy", ICCV
    1993). A camera's gamma turns gains of light into gains of grey levels, to the power of 1 / gamma.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from tracker.image.exposure import CLIPPED
from tracker.maths.compiled import compiled
from tracker.types import Image

CORE_SHARE = 0.6  # of the radius: further out the background shines in
UNITY = 16  # of the fixed point that pixels are multiplied in: a colour's box is far wider than a sixteenth
SLIGHT = math.exp(0.12)  # a gain within this factor changes no ball's colour so far that its box would not hold it
LEARN_BALLS = 4  # of each colour, until its own colour is taken as known
FOLLOW_SHARE = 0.5  # of a newly seen light
MOST_LOG = 0.7  # a gain beyond exp(0.7), twice, is a mistake
GAIN_STEP = 0.18  # of the logarithm, between lights that are tried: a sixth, well within the width of a colour's box
RINGS = 2  # of lights round the known one
_STEPS = range(-RINGS, RINGS + 1)
AROUND = sorted(((b, r) for b in _STEPS for r in _STEPS if b or r), key=lambda at: (at[0] ** 2 + at[1] ** 2, at))
"""Steps of blue and red to lights round the known one, the nearest first."""
LEAST_LEVEL = 4.0  # grey levels: a channel darker than that tells nothing
Bgr = tuple[float, float, float]


class Gains(NamedTuple):  # this and `Tint` are made in every round: a tuple costs a quarter of a dataclass
    """How much stronger than under the config's light blue and red are, against green."""

    blue: float = 1.0
    red: float = 1.0

    @property
    def undoing(self) -> tuple[int, int]:
        """Return what to multiply blue and red by to undo them, in 1 / UNITY; slight ones are left alone."""
        return _undoing(self.blue), _undoing(self.red)


def _undoing(gain: float) -> int:
    return UNITY if 1.0 / SLIGHT < gain < SLIGHT else round(UNITY / gain)


NEUTRAL = Gains()


class Tint(NamedTuple):
    """The colour of the light in one camera.

    gains: now.
    colours: by ball, sums of weight, log(blue / green) weighted and log(red / green) weighted, gains undone, and how
        often it was seen: the ball's own colour.
    settled: whether the own colour of every ball seen so far is known.
    """

    gains: Gains = NEUTRAL
    colours: Mapping[int, tuple[float, float, float, int]] = MappingProxyType({})
    settled: bool = False

    def learned(self, seen: Sequence[tuple[int, Bgr]]) -> Tint:
        """Return what is known after one image.

        Args:
            seen: ball and mean colour of its core, from `core_colour`, for each ball well fitted.
        """
        here = math.log(self.gains.blue), math.log(self.gains.red)
        learned = {}
        pull = pull_blue = pull_red = 0.0
        for ball, bgr in seen:
            ratios = _ratios(bgr)
            if ratios is None:
                continue
            weight, blue, red = ratios
            total, sum_blue, sum_red, count = self.colours.get(ball, (0.0, 0.0, 0.0, 0))
            if count < LEARN_BALLS:
                own_blue, own_red = blue - here[0], red - here[1]
                learned[ball] = total + weight, sum_blue + weight * own_blue, sum_red + weight * own_red, count + 1
            else:
                pull += weight
                pull_blue += weight * (blue - sum_blue / total)
                pull_red += weight * (red - sum_red / total)
        colours, settled = self.colours, self.settled
        if learned:
            colours = {**colours, **learned}
            settled = all(count >= LEARN_BALLS for *_, count in colours.values())
        if pull == 0.0:
            return Tint(self.gains, colours, settled)
        now = _followed(here[0], pull_blue / pull), _followed(here[1], pull_red / pull)
        return Tint(Gains(math.exp(now[0]), math.exp(now[1])), colours, settled)

    def other(self, number: int) -> Gains:
        """Return a light near the known one, to look for balls under when none are found.

        number: from 0, the nearest, on; after all it begins anew.
        """
        blue, red = AROUND[number % len(AROUND)]
        return Gains(self.gains.blue * math.exp(blue * GAIN_STEP), self.gains.red * math.exp(red * GAIN_STEP))


def _followed(here: float, seen: float) -> float:
    """Return the logarithm of a gain, moved from where it was towards what was seen."""
    return max(-MOST_LOG, min(MOST_LOG, here + FOLLOW_SHARE * (seen - here)))


def _ratios(bgr: Bgr) -> tuple[float, float, float] | None:
    """Return weight, log(blue / green) and log(red / green) of a colour; None where a channel is too dark to tell.

    Source: to first order log x errs by noise / x, so the weight is the square of the darkest channel.
    """
    blue, green, red = bgr
    darkest = min(blue, green, red)
    if not darkest >= LEAST_LEVEL:
        return None
    return darkest * darkest, math.log(blue / green), math.log(red / green)


@compiled("UniTuple(f8, 3)(Array(u1, 3, 'C', readonly=True), f8, f8, f8)")
def core_colour(image: Image, u: float, v: float, radius_px: float) -> Bgr:
    """Return the mean colour of the middle of a ball, clipped pixels left out; NaN where all are.

    Args:
        image: (height, width, 3) BGR.
        u, v: the ball's centre.  radius_px: its radius [px].
    """
    reach = max(CORE_SHARE * radius_px, 0.8)
    blue = green = red = 0.0
    count = 0
    for row in range(max(0, math.ceil(v - reach)), min(image.shape[0], math.floor(v + reach) + 1)):
        for column in range(max(0, math.ceil(u - reach)), min(image.shape[1], math.floor(u + reach) + 1)):
            pixel = image[row, column]
            if (column - u) ** 2 + (row - v) ** 2 > reach**2 or max(pixel[0], pixel[1], pixel[2]) >= CLIPPED:
                continue
            blue, green, red = blue + pixel[0], green + pixel[1], red + pixel[2]
            count += 1
    return blue / count, green / count, red / count
