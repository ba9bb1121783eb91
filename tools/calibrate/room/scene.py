"""What is to be found: cameras, clocks and the marker's way. And what it is found from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tools.calibrate.room.tracks import Track
from tracker.camera import Camera
from tracker.types import Array

Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A guess at everything.

    cameras: with their poses in W.  offsets_s (cameras,): how much later than its stamps each sees [s].
    points_inB (balls, 3): the marker [m].  p_BinW (m, 3), R_BtoW (m, 3, 3): its pose at each instant.
    """

    cameras: tuple[Camera, ...]
    offsets_s: Array
    points_inB: Array
    p_BinW: Array
    R_BtoW: Array

    def balls_inW(self) -> Array:
        """Return the balls' places at each instant (m, balls, 3) [m]."""
        return np.asarray(self.points_inB @ np.swapaxes(self.R_BtoW, 1, 2) + self.p_BinW[:, None, :])


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Sightings at common instants.

    t_s (m,): the instants by camera 0's clock [s].  offsets_s (cameras,): the clock offsets that they were taken for.
    uv_px, speed (cameras, m, balls, 2): centres [px] and their speeds [px/s]; NaN where a camera did not see.
    sigma_px (cameras, m, balls): what each centre is known to by its image alone, one sigma [px].
    """

    t_s: Array
    offsets_s: Array
    uv_px: Array
    speed: Array
    sigma_px: Array

    def at(self, offsets_s: Array) -> Array:
        """Return the centres (cameras, m, balls, 2) if the clocks had other offsets, to first order [px]."""
        later = (offsets_s - self.offsets_s)[:, None, None, None]
        return np.asarray(self.uv_px - self.speed * later)

    @property
    def there(self) -> NDArray[np.bool_]:
        """Say which camera saw at which instant (cameras, m)."""
        return np.asarray(np.isfinite(self.uv_px).all(axis=(2, 3)))

    def only(self, chosen: NDArray[np.bool_] | Indices) -> Seen:
        """Return some of the instants."""
        return Seen(
            self.t_s[chosen], self.offsets_s, self.uv_px[:, chosen], self.speed[:, chosen], self.sigma_px[:, chosen]
        )


def seen_at(tracks: Sequence[Track], t_s: Array, offsets_s: Array) -> Seen:
    """Return what the cameras saw at instants (m,), each by its own clock."""
    each = [track.at(t_s - offset) for track, offset in zip(tracks, offsets_s.tolist(), strict=True)]
    uv_px, speed, sigma_px = (np.stack(values) for values in zip(*each, strict=True))
    return Seen(t_s, offsets_s, uv_px, speed, sigma_px)


def common_instants(tracks: Sequence[Track], most: int, offsets_s: Array) -> Seen:
    """Return what was seen at up to `most` instants at which two cameras or more saw, spread evenly over the way.

    The way, not the time: a marker that stands still shows the same errors over and over.
    """
    spans = [(float(track.t_s[0]), float(track.t_s[-1])) for track in tracks if len(track)]
    if not spans:
        return seen_at(tracks, np.empty(0), offsets_s)
    start_s, end_s = min(a for a, _ in spans), max(b for _, b in spans)
    period_s = min(float(np.median(np.diff(track.t_s))) for track in tracks if len(track) > 1)
    seen = seen_at(tracks, np.arange(start_s, end_s, period_s), offsets_s)
    seen = seen.only(seen.there.sum(axis=0) >= 2)
    if len(seen.t_s) <= most:
        return seen
    way_px = np.cumsum(np.nanmean(np.linalg.norm(seen.speed, axis=3), axis=(0, 2)))
    chosen = np.searchsorted(way_px, np.linspace(way_px[0], way_px[-1], most), side="left")
    return seen.only(np.unique(chosen))
