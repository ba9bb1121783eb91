"""One image to ball sightings: near where the track expects them, or everywhere."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.camera import Camera
from tracker.image.album import Album
from tracker.image.appearance import Appearance
from tracker.image.centre import Centre
from tracker.image.colour_table import colours_of
from tracker.image.detect import Blob, find_blobs
from tracker.image.patch import Expected
from tracker.image.sight import COV, MISFIT, SIZE, SPOT, UV, find_ball, known_of
from tracker.image.template import Template
from tracker.image.tint import NEUTRAL, Gains
from tracker.image.view import DEPTH, RADIUS, RAY_X, RAY_Y, SPEED_U, SPEED_V, U, V, expected_views
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array, BallSighting, Frame, Reason, Rejected, frozen_array

NEAREST_M = 0.3  # a ball closer to a camera than this is not looked for


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A sighting, and what `Appearance` learns from.

    view: a row of `view.expected_views`.  fit (sight.SIZE,): what was found.
    appearance, drawn: what it was taken to look like.
    """

    sighting: BallSighting
    frame: Frame
    view: Sequence[float]
    fit: Array
    appearance: Appearance
    drawn: tuple[Template, Template]

    def expected(self, camera: Camera) -> Expected:
        """Return what was expected of the ball, from its coloured spot's middle. camera: the frame's."""
        view, (u, v) = self.view, self.fit[SPOT].tolist()
        ray, speed_px_s = (view[RAY_X], view[RAY_Y]), (view[SPEED_U], view[SPEED_V])
        shades = self.appearance.shades(camera, *ray)
        return Expected((u, v), view[RADIUS], speed_px_s, shades, self.appearance.response, self.drawn, ray)

    @property
    def streak_px(self) -> float:
        """Return how far the ball's image moved during the exposure [px]."""
        return math.hypot(self.view[SPEED_U], self.view[SPEED_V]) * self.appearance.response.exposure_s

    @property
    def centre(self) -> Centre:
        """Return what the fit gave."""
        return Centre(self.fit[UV], self.fit[COV].reshape(2, 2), float(self.fit[MISFIT]))


@dataclass(frozen=True, slots=True)
class Look:
    """What the images of one instant gave, and what was left out."""

    fitted: tuple[Fitted, ...]
    rejections: tuple[Rejected, ...]

    def doubted(self, sigma_px: float) -> Look:
        """Return it with sightings that are less sure, by one sigma on each axis [px]."""
        more = sigma_px**2 * np.eye(2)
        doubted = (replace(one.sighting, cov_px=frozen_array(one.sighting.cov_px + more)) for one in self.fitted)
        fitted = tuple(replace(one, sighting=sighting) for one, sighting in zip(self.fitted, doubted, strict=True))
        return Look(fitted, self.rejections)


def look_near(
    frames: Sequence[Frame],
    rig: Rig,
    state: State,
    appearances: Sequence[Appearance],
    albums: Sequence[Album],
    gains: Sequence[Gains] = (),
) -> Look:
    """Find each ball in each image, in the region where a state, with its covariance, expects it.

    Args:
        frames: of different cameras, at about one time.
        state: carried to about that time.
        appearances, albums: how balls look to each camera of the rig, and their templates.
        gains: of the light in each camera; none for the config's light.
    """
    fitted: list[Fitted] = []
    rejections: list[Rejected] = []
    for frame in frames:
        c = frame.camera
        light = gains[c] if gains else NEUTRAL
        for found in _balls_of(frame, rig, state, appearances[c], albums[c], light):
            if isinstance(found, Rejected):
                rejections.append(found)
            else:
                fitted.append(found)
    return Look(tuple(fitted), tuple(rejections))


def _balls_of(
    frame: Frame, rig: Rig, state: State, appearance: Appearance, album: Album, gains: Gains
) -> Iterator[Fitted | Rejected]:
    """Yield each ball of the marker as seen near its prediction, or why it is not."""
    rows = expected_views(state, rig, frame.camera, frame.t_ns)
    known, fits = known_of(appearance.response), np.empty((len(rows), SIZE))
    fixed = fits.view()
    fixed.flags.writeable = False
    for b, (ball, view) in enumerate(zip(rig.marker.balls, rows.tolist(), strict=True)):
        if not (math.isfinite(view[U]) and math.isfinite(view[V]) and view[DEPTH] >= NEAREST_M):
            yield Rejected(Reason.BEHIND, f"{ball.name} is not before the camera", frame.t_ns, frame.camera)
            continue
        drawn = album.serve(b, view, appearance)
        failed = find_ball(frame.image, colours_of((ball,), gains), rows[b], known, drawn, fits[b])
        if failed is not None:
            detail = f"no {ball.name} at ({view[U]:.0f}, {view[V]:.0f}) px, where it is expected"
            yield Rejected(failed, detail, frame.t_ns, frame.camera)
        else:
            fit = fixed[b]
            sighting = BallSighting(frame.camera, b, frame.t_ns, fit[UV], fit[COV].reshape(2, 2))
            yield Fitted(sighting, frame, view, fit, appearance, drawn)


def look_everywhere(frame: Frame, camera: Camera, rig: Rig, gains: Gains = NEUTRAL) -> list[list[Blob]]:
    """Return for each ball of the marker the blobs of its colour in the whole image, in a light, largest first."""
    largest = max(ball.radius_m for ball in rig.marker.balls)
    most_px = math.pi * (camera.focal_px * largest / NEAREST_M) ** 2
    return find_blobs(frame.image, None, rig.marker.balls, most_px, gains)
