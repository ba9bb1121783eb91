"""The second look at the same images, by who knows by now where the cameras stand and how each shows a ball.

A fit that does not know light, blur and shutter is drawn a tenth of a pixel or two towards the light, everywhere alike,
which turns cameras and stretches rooms. The tracker itself would do, but its gates would choose which sightings count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from tools.calibrate.room.footage import Clip, Footage
from tools.calibrate.room.start import triangulated_from
from tools.calibrate.room.tracks import Track, track_of
from tracker.image.appearance import Appearance
from tracker.image.centre import Centre, fit_centre
from tracker.image.holder import held_towards
from tracker.image.patch import Expected
from tracker.image.rivals import Rivals, first_rivals, settled_on
from tracker.rig import Rig
from tracker.types import Array, Image

LESSONS, SWEEPS = 240, 6
"""Images of each camera to learn from, and in how many sweeps over the footage: what was learned last counts most, and
must not be where the marker happened to end."""


@dataclass(frozen=True, slots=True, eq=False)
class Again:
    """One camera's images, with what is known by now of the balls in them.

    rig: cameras and clocks as known.  camera: which one.  clips: its images, at times t_s (m,) by the rig's clocks [s].
    views (m, balls, 3): each ball's depth [m] and speed u, v [px/s]; NaN where two cameras did not see it.
    """

    rig: Rig
    camera: int
    clips: Sequence[Clip]
    t_s: Array
    views: Array

    def known(self) -> list[int]:
        """Return the images in which every ball's depth and speed are known."""
        told = np.isfinite(self.views).all(axis=(1, 2)) & (np.nan_to_num(self.views[:, :, 0]) > 0.0).all(axis=1)
        return np.flatnonzero(told).tolist()

    def lessons(self) -> list[int]:
        """Return some images, spread over the footage."""
        known = self.known()
        return known[:: max(1, len(known) // LESSONS)]

    def lesson(self, rivals: Rivals, k: int, others: Sequence[Rivals]) -> Rivals:
        """Learn from all balls of one image; others: what other cameras know of the room's light."""
        image = self.image(k)
        for ball in range(len(self.rig.marker)):
            expected = self.expected(rivals, k, ball)
            found = fit_centre(image, expected)
            if isinstance(found, Centre):
                rivals = rivals.learned(image, self.rig.cameras[self.camera], expected, found, others)
        return rivals

    def expected(self, rivals: Rivals, k: int, ball: int) -> Expected:
        """Return what is expected of a ball in an image."""
        camera, known, seen = self.rig.cameras[self.camera], rivals.best, self.clips[k].centres_px[ball]
        u_px, v_px, _ = seen.tolist()
        depth_m, *speed_px_s = self.views[k, ball].tolist()
        x, y, z = camera.bearings(seen[None, :2])[0].tolist()
        radius_px = camera.focal_px * self.rig.marker.balls[ball].radius_m / depth_m
        amid_u, amid_v, _ = self.clips[k].centres_px.mean(axis=0).tolist()  # where the tubes meet that hold the balls
        return Expected(
            (u_px, v_px),
            radius_px,
            (speed_px_s[0], speed_px_s[1]),
            known.shades(camera, x / z, y / z),
            known.response,
            ray=(x / z, y / z),
            held=held_towards((u_px, v_px), (amid_u, amid_v), radius_px),
        )

    def image(self, k: int) -> Image:
        """Return an image."""
        camera = self.rig.cameras[self.camera]
        return self.clips[k].frame(camera.width_px, camera.height_px).image


def taught(cameras: Sequence[Again]) -> list[Rivals]:
    """Learn how each camera shows balls, all in the light of one room."""
    return _together(cameras, [first_rivals() for _ in cameras], [camera.lessons() for camera in cameras])


def taught_anew(cameras: Sequence[Again], known: Sequence[Appearance]) -> list[Appearance]:
    """Learn light anew under gammas that are known; half of the images do for that."""
    lessons = [camera.lessons()[::2] for camera in cameras]
    return [rivals.best for rivals in _together(cameras, [settled_on(one) for one in known], lessons)]


def _together(cameras: Sequence[Again], rivals: list[Rivals], lessons: Sequence[Sequence[int]]) -> list[Rivals]:
    """Let cameras learn in turn, so that each has what the others know of the light."""
    for sweep in range(SWEEPS):
        for images in zip_longest(*(each[sweep::SWEEPS] for each in lessons)):
            for c, k in enumerate(images):
                if k is not None:
                    rivals[c] = cameras[c].lesson(rivals[c], k, rivals[:c] + rivals[c + 1 :])
    return rivals


def again(footage: Footage, rig: Rig) -> tuple[Again, ...]:
    """Return each camera's images once more.

    Args:
        footage: with the images kept.
        rig: cameras and clocks as known by now, well enough to tell how large a ball must look.
    """
    clips = [[clip for clip in footage.clips if clip.camera == c] for c in range(len(rig.cameras))]
    times = [_times_s(each, rig, footage.start_ns) for each in clips]
    tracks = tuple(
        track_of(((t_s, clip.centres_px) for t_s, clip in zip(of.tolist(), each, strict=True)), len(rig.marker))
        for of, each in zip(times, clips, strict=True)
    )
    return tuple(
        Again(rig, c, each, of, _views(tracks, of, c, rig))
        for c, (each, of) in enumerate(zip(clips, times, strict=True))
    )


def _times_s(clips: Sequence[Clip], rig: Rig, start_ns: int) -> Array:
    return np.array([(x.t_ns + rig.cameras[x.camera].clock_offset_ns - start_ns) * 1e-9 for x in clips])


def _views(tracks: Sequence[Track], t_s: Array, c: int, rig: Rig) -> Array:
    """Return each ball's depth [m] and speed u, v [px/s] in one camera at instants (m,): (m, balls, 3), NaN unknown."""
    each = [track.roughly(t_s) for track in tracks]
    uv_px = np.stack([uv.reshape(-1, 2) for uv, _ in each])
    depths_m = rig.cameras[c].in_camera(triangulated_from(uv_px, rig.cameras))[:, 2]
    return np.concatenate((depths_m.reshape(len(t_s), -1, 1), each[c][1]), axis=2)
