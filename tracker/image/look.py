"""One image to ball sightings: near where the track expects them, or everywhere."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from tracker.camera import Camera
from tracker.filter.measure import camera_table
from tracker.image.album import Album
from tracker.image.appearance import Appearance
from tracker.image.behind import NO_ROOM, Room
from tracker.image.centre import Centre
from tracker.image.colour_table import ColourTable, colours_of_each
from tracker.image.detect import Blob, find_blobs
from tracker.image.hiding import never_seen
from tracker.image.mounting import things_seen
from tracker.image.patch import Expected
from tracker.image.sight import CENTRE, COV, MISFIT, SHOWN, SIZE, SPOT, UV, Known, find_ball, known_of, read_ahead
from tracker.image.template import Template
from tracker.image.tint import NEUTRAL, Gains
from tracker.image.view import (
    DEPTH,
    LONGER_U,
    LONGER_UV,
    RADIUS,
    RAY_X,
    RAY_Y,
    SPEED_U,
    SPEED_V,
    U,
    V,
    expected_views,
)
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array, BallSighting, Frame, Reason, Rejected, frozen_array

NEAREST_M = 0.3  # a ball closer to a camera than this is not looked for


class Fitted(NamedTuple):
    """A sighting, and what `Appearance` learns from.

    view: a row of `view.expected_views`.  fit (sight.SIZE,): what was found.
    appearance, drawn: what it was taken to look like.  held: see `Expected.held`.
    """

    sighting: BallSighting
    frame: Frame
    view: Sequence[float]
    fit: Array
    appearance: Appearance
    drawn: tuple[Template, Template]
    held: Array

    def expected(self, camera: Camera, room: Room = NO_ROOM) -> Expected:
        """Return what was expected of the ball, from its coloured spot's middle. camera: the frame's."""
        view, (u, v) = self.view, self.fit[SPOT].tolist()
        ray, speed_px_s = (view[RAY_X], view[RAY_Y]), (view[SPEED_U], view[SPEED_V])
        shades = self.appearance.shades(camera, *ray)
        response = self.appearance.response
        longer = view[LONGER_U], view[LONGER_UV]
        return Expected((u, v), view[RADIUS], speed_px_s, shades, response, self.drawn, ray, room, self.held, longer)

    @property
    def streak_px(self) -> float:
        """Return how far the ball's image moved during the exposure [px]."""
        return math.hypot(self.view[SPEED_U], self.view[SPEED_V]) * self.appearance.response.exposure_s

    @property
    def centre(self) -> Centre:
        """Return what the fit gave."""
        return Centre(self.fit[UV], self.fit[COV].reshape(2, 2), float(self.fit[MISFIT]))


class Glance(NamedTuple):
    """How one image was looked at, by ball.

    views: rows of `view.expected_views`.  fits (balls, sight.SIZE): of those that were found.
    appearance, drawn: what they were taken to look like; no templates where a ball was not looked for.
    held (balls, any, 3): see `Expected.held`.
    """

    frame: Frame
    views: Sequence[Sequence[float]]
    fits: Array
    appearance: Appearance
    drawn: Sequence[tuple[Template, Template] | None]
    held: Array


@dataclass(slots=True, eq=False)
class Look:
    """What the images of one instant gave, and what was left out.

    glances: by camera.  blind: it was not known how far the balls' images are smeared.
    """

    sightings: list[BallSighting] = field(default_factory=list)
    glances: dict[int, Glance] = field(default_factory=dict)
    rejections: list[Rejected] = field(default_factory=list)
    blind: bool = False

    def fitted(self, sighting: BallSighting) -> Fitted:
        """Return what a sighting was found by."""
        ball, glance = sighting.ball, self.glances[sighting.camera]
        drawn = glance.drawn[ball]
        if drawn is None:
            raise ValueError(f"ball {ball} was not looked for by camera {sighting.camera}")
        return Fitted(
            sighting, glance.frame, glance.views[ball], glance.fits[ball], glance.appearance, drawn, glance.held[ball]
        )

    def replace(self, other: Look) -> None:
        """Take over what another look at some of the images gave, in place of what they gave here."""
        anew = other.glances
        self.sightings = [one for one in self.sightings if one.camera not in anew] + other.sightings
        self.rejections = [one for one in self.rejections if one.camera not in anew] + other.rejections
        self.glances |= anew

    def doubted(self, sigma_px: float) -> Look:
        """Return it with sightings that are less sure, by one sigma on each axis [px]."""
        more = sigma_px**2 * np.eye(2)
        doubted = [one._replace(cov_px=frozen_array(one.cov_px + more)) for one in self.sightings]
        return Look(doubted, self.glances, self.rejections, self.blind)


@dataclass(frozen=True, slots=True, eq=False)
class Gaze:
    """What one camera looks for: balls as they look to it now.

    known, colours: of the camera and of each ball, as compiled code takes them.  album: their templates.
    undoing: the colour of the light that is undone, see `Gains.undoing`.  room: what is known to stand behind.
    lately (balls, LATE): what the last looks showed of each ball, see `hiding.COUNT`; `Eyes` goes on adding to it.
    """

    appearance: Appearance
    known: Known
    colours: tuple[ColourTable, ...]
    album: Album
    undoing: tuple[int, int]
    lately: Array
    room: Room = NO_ROOM

    def at_such(self, appearance: Appearance) -> Gaze:
        """Return it for balls that look so."""
        return replace(self, appearance=appearance, known=known_of(appearance.response))

    def in_light(self, rig: Rig, gains: Gains) -> Gaze:
        """Return it for a light of this colour."""
        undoing = gains.undoing
        return replace(self, colours=colours_of_each(rig.marker.balls, undoing), undoing=undoing)


Gazes = Sequence[Gaze] | Mapping[int, Gaze]
"""By camera."""


def gaze_of(rig: Rig, appearance: Appearance, album: Album, gains: Gains = NEUTRAL, room: Room = NO_ROOM) -> Gaze:
    """Return what a camera looks for to which balls look so, in a light of this colour."""
    undoing = gains.undoing
    colours = colours_of_each(rig.marker.balls, undoing)
    return Gaze(appearance, known_of(appearance.response), colours, album, undoing, never_seen(len(rig.marker)), room)


def look_near(frames: Sequence[Frame], rig: Rig, state: State, gazes: Gazes, things: Array) -> Look:
    """Find each ball in each image, in the region where a state, with its covariance, expects it.

    Args:
        frames: of different cameras, at about one time.
        state: carried to about that time.
        gazes: of each camera of the rig.
        things: about the balls, see `Mounting.things`.
    """
    look = Look()
    for frame in frames:
        _find_balls(frame, rig, state, gazes[frame.camera], things, look)
    return look


def _find_balls(frame: Frame, rig: Rig, state: State, gaze: Gaze, things: Array, look: Look) -> None:
    """Add each ball of the marker as seen in one image near its prediction, or why it is not."""
    image, camera, t_ns, appearance = frame.image, frame.camera, frame.t_ns, gaze.appearance
    room, known, colours, serve, eye = gaze.room, gaze.known, gaze.colours, gaze.album.serve, rig.cameras[camera]
    rows = expected_views(state, rig, camera, t_ns)
    read_ahead(image, room.mean, rows)
    held = things_seen(state.mean, camera_table(rig)[camera], rows, things)
    views, fits = rows.tolist(), np.empty((len(rows), SIZE))
    drawn: list[tuple[Template, Template] | None] = []
    fixed = fits.view()
    fixed.flags.writeable = False
    look.glances[camera] = Glance(frame, views, fixed, appearance, drawn, held)
    uvs_px, covs_px2 = fixed[:, CENTRE], fixed[:, COV].reshape(-1, 2, 2)
    for b, view in enumerate(views):
        if not (math.isfinite(view[U] + view[V]) and view[DEPTH] >= NEAREST_M):
            drawn.append(None)
            fits[b, SHOWN] = np.nan
            look.rejections.append(Rejected(Reason.BEHIND, f"{_name(rig, b)} is not before the camera", t_ns, camera))
            continue
        templates = serve(b, view, appearance)
        drawn.append(templates)
        failed = find_ball(image, room, b, colours[b], rows, known, templates, held, gaze.lately, fits)
        if failed is None:
            row_ns = t_ns + round(eye.delay_ns(fits[b, UV][1])) if eye.readout_ns else t_ns
            look.sightings.append(BallSighting(camera, b, row_ns, uvs_px[b], covs_px2[b]))
        else:
            detail = f"no {_name(rig, b)} at ({view[U]:.0f}, {view[V]:.0f}) px, where it is expected"
            look.rejections.append(Rejected(failed, detail, t_ns, camera))


def _name(rig: Rig, ball: int) -> str:
    return rig.marker.balls[ball].name


def look_everywhere(
    frame: Frame, camera: Camera, rig: Rig, gains: Gains = NEUTRAL, room: Room = NO_ROOM
) -> list[list[Blob]]:
    """Return for each ball of the marker the blobs of its colour in the whole image, in a light, largest first.

    room: what is known to stand behind, which is taken off first.
    """
    largest = max(ball.radius_m for ball in rig.marker.balls)
    most_px = math.pi * (camera.focal_px * largest / NEAREST_M) ** 2
    return find_blobs(frame.image, None, rig.marker.balls, most_px, gains, room)
