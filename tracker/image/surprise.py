"""Whether balls still look as they were learned to look.

What a fit leaves unexplained is told with every ball. Noise, size and place move it from ball to ball, and a thing in
front of one ball moves that ball's; light that falls from elsewhere moves that of all balls in all cameras, to one and
a half times or twice what it was, and it stays there. So it is held against what each camera's balls commonly left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

USUAL, NEWEST = 120, 10  # looks through a camera that the means are of
KNOWN = 20  # looks until what a camera's balls leave is known
MOST = 1.0  # of one look's logarithm: a picture alone, however spoiled, surprises little
LITTLE = 0.1  # more than chance
GREAT = 0.28  # of a mean logarithm: flights in unchanging light came to 0.22, lamps switched on to 0.35 at least


class Surprise:
    """Holds what balls leave unexplained of late against what they left before.

    cameras: how many there are.
    """

    def __init__(self, cameras: int) -> None:
        self._usual = [0.0] * cameras  # mean of the logarithm
        self._looks = [0] * cameras
        self._newest = 0.0
        self._share = 1.0 / (NEWEST * cameras)

    def take(self, camera: int, misfits: Sequence[float]) -> None:
        """Take note of what the balls left that fitted in a look through a camera; of a single one nothing.

        misfits: chi2 per degree of freedom, any order.
        """
        middle = sorted(misfits)[len(misfits) // 2] if len(misfits) > 1 else 0.0
        if not middle > 0.0:
            return
        left = math.log(middle)
        looks = self._looks[camera]
        if looks >= KNOWN:
            self._newest += self._share * (min(left - self._usual[camera], MOST) - self._newest)
        self._looks[camera] = looks + 1
        self._usual[camera] += (left - self._usual[camera]) / min(looks + 1, USUAL)

    @property
    def is_some(self) -> bool:
        """Say whether balls fit worse than by chance: light that changes slowly is to be followed more closely."""
        return self._newest > LITTLE

    @property
    def is_great(self) -> bool:
        """Say whether balls have come to fit so much worse that light must be learned anew."""
        return self._newest > GREAT
