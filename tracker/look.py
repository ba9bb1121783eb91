"""One image to ball sightings: near where the track expects them, or everywhere."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.appearance import Appearance
from tracker.camera import Camera
from tracker.centre import Centre
from tracker.colour_table import colours_of
from tracker.detect import Blob, find_blobs
from tracker.patch import Expected
from tracker.rig import Rig
from tracker.sight import Sight, find_ball
from tracker.state import State
from tracker.tint import NEUTRAL, Gains
from tracker.types import BallSighting, Frame, Reason, Rejected, frozen_array
from tracker.view import DEPTH, RAY_X, RAY_Y, U, V, expected_views

NEAREST_M = 0.3  # a ball closer to a camera than this is not looked for


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A sighting with its frame, what was expected of the ball and what the fit gave: what `Appearance` learns from."""

    sighting: BallSighting
    frame: Frame
    expected: Expected
    centre: Centre


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
    gains: Sequence[Gains] = (),
) -> Look:
    """Find each ball in each image, in the region where a state, with its covariance, expects it.

    Args:
        frames: of different cameras, at about one time.
        state: carried to about that time.
        appearances: how balls look to each camera of the rig.
        gains: of the light in each camera; none for the config's light.
    """
    fitted: list[Fitted] = []
    rejections: list[Rejected] = []
    for frame in frames:
        light = gains[frame.camera] if gains else NEUTRAL
        for b, found in _balls_of(frame, rig, state, appearances[frame.camera], light):
            if isinstance(found, Rejected):
                rejections.append(found)
            else:
                sighting = BallSighting(frame.camera, b, frame.t_ns, found.centre.uv_px, found.centre.cov_px)
                fitted.append(Fitted(sighting, frame, found.expected, found.centre))
    return Look(tuple(fitted), tuple(rejections))


def _balls_of(
    frame: Frame, rig: Rig, state: State, appearance: Appearance, gains: Gains
) -> Iterator[tuple[int, Sight | Rejected]]:
    """Yield each ball of the marker as seen near its prediction, or why it is not."""
    camera = rig.cameras[frame.camera]
    views = expected_views(state, rig, frame.camera, frame.t_ns).tolist()
    for b, (ball, view) in enumerate(zip(rig.marker.balls, views, strict=True)):
        if not (math.isfinite(view[U]) and math.isfinite(view[V]) and view[DEPTH] >= NEAREST_M):
            yield b, Rejected(Reason.BEHIND, f"{ball.name} is not before the camera", frame.t_ns, frame.camera)
            continue
        shades = appearance.shades(camera, view[RAY_X], view[RAY_Y])
        found = find_ball(frame.image, colours_of((ball,), gains), view, shades, appearance.response)
        if isinstance(found, Reason):
            detail = f"no {ball.name} at ({view[U]:.0f}, {view[V]:.0f}) px, where it is expected"
            yield b, Rejected(found, detail, frame.t_ns, frame.camera)
        else:
            yield b, found


def look_everywhere(frame: Frame, camera: Camera, rig: Rig, gains: Gains = NEUTRAL) -> list[list[Blob]]:
    """Return for each ball of the marker the blobs of its colour in the whole image, in a light, largest first."""
    largest = max(ball.radius_m for ball in rig.marker.balls)
    most_px = math.pi * (camera.focal_px * largest / NEAREST_M) ** 2
    return find_blobs(frame.image, None, rig.marker.balls, most_px, gains)
