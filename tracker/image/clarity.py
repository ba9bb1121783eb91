"""How clearly each camera shows balls, and what that leaves unknown of the light it learned from them.

Light is learned from the same images as centres, amid the same noise, blur and JPEG. Where one look at a ball tells its
centre badly, many tell its light badly, and a light that is not quite right moves the centres of all balls alike.

Source: rooms made up from a number, through other gammas and through JPEG, and those of a renderer that shares no code
    with ours; docs/experiments/light.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

UNKNOWN_PX = 0.06  # one sigma of a centre before any look
LOOKS = 10  # that the mean is of
SHARE = 0.3  # of a centre's sigma, which light learned by such images leaves in all centres


class Clarity:
    """Follows how sure the centres are that each camera shows.

    cameras: how many there are.
    """

    def __init__(self, cameras: int) -> None:
        self._variance_px2 = [UNKNOWN_PX**2] * cameras
        self._looks = [0] * cameras

    def take(self, camera: int, variances_px2: Sequence[float]) -> None:
        """Take note of a look through a camera. variances_px2: of its balls' centres along one axis, any order."""
        if not variances_px2:
            return
        middle = sorted(variances_px2)[len(variances_px2) // 2]  # one may be hidden in part, and so be doubted
        self._looks[camera] = min(LOOKS, self._looks[camera] + 1)
        self._variance_px2[camera] += (middle - self._variance_px2[camera]) / self._looks[camera]

    @property
    def light_px(self) -> list[float]:
        """Return what each camera's light may move all of its centres by, one sigma along each axis [px]."""
        return [SHARE * math.sqrt(variance) for variance in self._variance_px2]
