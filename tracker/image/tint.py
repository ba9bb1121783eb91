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


class Paint(NamedTuple):
    """A ball's own colour: sums over how it was seen, with the light's gains undone.

    blue, red: of log(blue / green) and log(red / green), weighted.  blue_weight, red_weight: of the weights.
    times: how often it was seen.
    """

    blue: float = 0.0
    blue_weight: float = 0.0
    red: float = 0.0
    red_weight: float = 0.0
    times: int = 0


UNSEEN = Paint()


class Tint(NamedTuple):
    """The colour of the light in one camera.

    gains: now.
    paints: by ball, its own colour.
    settled: whether the own colour of every ball seen so far is known.
    """

    gains: Gains = NEUTRAL
    paints: Mapping[int, Paint] = MappingProxyType({})
    settled: bool = False

    def learned(self, seen: Sequence[tuple[int, Bgr]]) -> Tint:
        """Return what is known after one image.

        To first order the logarithm of a ratio errs by noise / the darker of its two channels, so its weight is that
        one's square. So little counts the red of a green ball, which is dark and takes on the room's by blur.

        Args:
            seen: ball and mean colour of its core, from `core_colour`, for each ball well fitted.
        """
        here = math.log(self.gains.blue), math.log(self.gains.red)
        learned = {}
        blue_pull = blue_pulls = red_pull = red_pulls = 0.0
        for ball, (blue, green, red) in seen:
            if not min(blue, green, red) >= LEAST_LEVEL:
                continue
            blue_log, blue_weight = math.log(blue / green), min(blue, green) ** 2
            red_log, red_weight = math.log(red / green), min(red, green) ** 2
            paint = self.paints.get(ball, UNSEEN)
            if paint.times < LEARN_BALLS:
                learned[ball] = Paint(
                    paint.blue + blue_weight * (blue_log - here[0]),
                    paint.blue_weight + blue_weight,
                    paint.red + red_weight * (red_log - here[1]),
                    paint.red_weight + red_weight,
                    paint.times + 1,
                )
            else:
                blue_pulls += blue_weight
                blue_pull += blue_weight * (blue_log - paint.blue / paint.blue_weight)
                red_pulls += red_weight
                red_pull += red_weight * (red_log - paint.red / paint.red_weight)
        paints, settled = self.paints, self.settled
        if learned:
            paints = {**paints, **learned}
            settled = all(paint.times >= LEARN_BALLS for paint in paints.values())
        if red_pulls == 0.0:
            return Tint(self.gains, paints, settled)
        now = _followed(here[0], blue_pull / blue_pulls), _followed(here[1], red_pull / red_pulls)
        return Tint(Gains(math.exp(now[0]), math.exp(now[1])), paints, settled)

    def other(self, number: int) -> Gains:
        """Return a light near the known one, to look for balls under when none are found.

        number: from 0, the nearest, on; after all it begins anew.
        """
        blue, red = AROUND[number % len(AROUND)]
        return Gains(self.gains.blue * math.exp(blue * GAIN_STEP), self.gains.red * math.exp(red * GAIN_STEP))


def _followed(here: float, seen: float) -> float:
    """Return the logarithm of a gain, moved from where it was towards what was seen."""
    return max(-MOST_LOG, min(MOST_LOG, here + FOLLOW_SHARE * (seen - here)))


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
