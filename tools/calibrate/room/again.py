"""The second look at the same images, by who knows by now where the cameras stand and how each shows a ball.

A fit that does not know light, blur and shutter is drawn a tenth of a pixel or two towards the light, everywhere alike,
which turns cameras and stretches rooms. The tracker itself would do, but its gates would choose which sightings count.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tools.calibrate.room.balls import sigma_px
from tools.calibrate.room.footage import Clip, Footage
from tools.calibrate.room.start import triangulated_from
from tools.calibrate.room.tracks import Track, track_of
from tracker.image.centre import Centre, fit_centre
from tracker.image.patch import Expected
from tracker.image.rivals import Rivals, first_rivals
from tracker.rig import Rig
from tracker.types import Array, Image

LESSONS, SWEEPS = 240, 6
"""Images of each camera to learn from, and in how many sweeps over the footage: what was learned last counts most, and
must not be where the marker happened to end."""
DOUBT = 3.0  # times the sigma of the first look


def looked_again(footage: Footage, rig: Rig) -> tuple[Track, ...]:
    """Fit every ball's image again, in two passes: one to learn how each camera shows balls, one to measure.

    Args:
        footage: with the images kept.
        rig: cameras and clocks as known by now, well enough to tell how large a ball must look.
    Returns:
        Each camera's track of what two cameras saw together; times count from footage.start_ns by the rig's clocks.
    """
    clips = [[clip for clip in footage.clips if clip.camera == c] for c in range(len(rig.cameras))]
    times = [_times_s(each, rig, footage.start_ns) for each in clips]
    tracks = tuple(
        track_of(((t_s, clip.centres_px) for t_s, clip in zip(of.tolist(), each, strict=True)), len(rig.marker))
        for of, each in zip(times, clips, strict=True)
    )
    return tuple(
        track_of(_measured(each, of, _views(tracks, of, c, rig), rig), len(rig.marker))
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


def _measured(clips: Sequence[Clip], t_s: Array, views: Array, rig: Rig) -> Iterator[tuple[float, Array]]:
    """Yield the stamps and centres of one camera's images, fitted once it is known how it shows balls."""
    known = [k for k in np.flatnonzero(np.isfinite(views).all(axis=(1, 2))).tolist() if (views[k, :, 0] > 0.0).all()]
    rivals = first_rivals()
    lessons = known[:: max(1, len(known) // LESSONS)]
    for k in (k for sweep in range(SWEEPS) for k in lessons[sweep::SWEEPS]):
        rivals = _taught(rivals, clips[k], views[k], rig)
    for k in known:
        image, balls = _image(clips[k], rig), range(len(rig.marker))
        yield float(t_s[k]), np.stack([_refitted(image, rivals, clips[k], views[k], ball, rig) for ball in balls])


def _refitted(image: Image, rivals: Rivals, clip: Clip, views: Array, ball: int, rig: Rig) -> Array:
    """Return a ball's centre and one sigma (3,) [px]; that of the first look, believed less, where none fits now."""
    fit = fit_centre(image, _expected(rivals, clip, views, ball, rig))
    if isinstance(fit, Centre):
        return np.append(fit.uv_px, sigma_px(fit))
    return np.asarray(clip.centres_px[ball] * (1.0, 1.0, DOUBT))


def _taught(rivals: Rivals, clip: Clip, views: Array, rig: Rig) -> Rivals:
    """Return the rivals after one more image."""
    image = _image(clip, rig)
    for ball in range(len(rig.marker)):
        expected = _expected(rivals, clip, views, ball, rig)
        found = fit_centre(image, expected)
        if isinstance(found, Centre):
            rivals = rivals.learned(image, rig.cameras[clip.camera], expected, found)
    return rivals


def _expected(rivals: Rivals, clip: Clip, views: Array, ball: int, rig: Rig) -> Expected:
    camera, known = rig.cameras[clip.camera], rivals.best
    u_px, v_px, _ = clip.centres_px[ball].tolist()
    depth_m, *speed_px_s = views[ball].tolist()
    x, y, z = camera.bearings(clip.centres_px[ball : ball + 1, :2])[0].tolist()
    return Expected(
        (u_px, v_px),
        camera.focal_px * rig.marker.balls[ball].radius_m / depth_m,
        (speed_px_s[0], speed_px_s[1]),
        known.shades(camera, x / z, y / z),
        known.response,
        ray=(x / z, y / z),
    )


def _image(clip: Clip, rig: Rig) -> Image:
    camera = rig.cameras[clip.camera]
    return clip.frame(camera.width_px, camera.height_px).image
