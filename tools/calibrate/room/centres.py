"""Every ball's image fitted again, in two passes: one to learn how each camera shows balls, one to measure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tools.calibrate.room.again import Again, again, taught
from tools.calibrate.room.balls import sigma_px
from tools.calibrate.room.encoding import NOTHING, Encoding, fitted
from tools.calibrate.room.footage import Footage
from tools.calibrate.room.gamma import learned
from tools.calibrate.room.tracks import Track, track_of
from tracker.image.centre import Centre, fit_centre
from tracker.image.rivals import Rivals, settled_on
from tracker.rig import Rig
from tracker.types import Array, Image

DOUBT = 3.0  # times the sigma of the first look


def looked_again(footage: Footage, rig: Rig) -> tuple[Track, ...]:
    """Fit every ball's image again, by who knows the cameras by now.

    Args:
        footage, rig: see `again`.
    Returns:
        Each camera's track of what two cameras saw together; times count from footage.start_ns by the rig's clocks.
    """
    cameras = again(footage, rig)
    rivals = taught(cameras)
    encodings = learned(cameras, rivals)
    return tuple(track_of(_measured(*each), len(rig.marker)) for each in zip(cameras, rivals, encodings, strict=True))


def _measured(camera: Again, rivals: Rivals, encoding: Encoding | None) -> Iterator[tuple[float, Array]]:
    """Yield the stamps and centres of a camera's images, fitted once it is known how it shows balls."""
    if encoding is not None:
        rivals = settled_on(encoding.appearance)
    for k in camera.known():
        image, balls = camera.image(k), range(len(camera.rig.marker))
        centres = [_refitted(camera, image, rivals, encoding, k, ball) for ball in balls]
        yield float(camera.t_s[k]), np.stack(centres)


def _refitted(camera: Again, image: Image, rivals: Rivals, encoding: Encoding | None, k: int, ball: int) -> Array:
    """Return a ball's centre and one sigma (3,) [px]; that of the first look, believed less, where none fits."""
    expected = camera.expected(rivals, k, ball)
    fit = fit_centre(image, expected)
    if not isinstance(fit, Centre):
        return np.asarray(camera.clips[k].centres_px[ball] * (1.0, 1.0, DOUBT))
    if encoding is not None:
        there = replace(expected, uv_px=(float(fit.uv_px[0]), float(fit.uv_px[1])))
        fit = fitted(image, there, encoding, ball, NOTHING) or fit
    return np.append(fit.uv_px, sigma_px(fit))
