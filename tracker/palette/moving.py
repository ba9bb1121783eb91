"""A first look at the balls' colours, without knowing where the cameras stand.

    pictures of one camera -> spots that do not stay -> as many as balls, sized and spaced as they -> their pixels

A room is calibrated by the balls' colours, and the marker's shape is known by a calibrated room; this is where one
begins. Colours from it are to be learned again once the room is known: only then are they held against the room.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.errors import OperatorError
from tracker.palette.background import learn_background
from tracker.palette.box import learn_boxes, paint_seen
from tracker.palette.chroma import chroma, paint_of
from tracker.palette.identify import MOST_COLOUR, ball_radius_m, colour_misfit
from tracker.palette.learn import MOST_PICTURES, STRAY_CHROMA, Instant
from tracker.palette.samples import EDGE_PX, BallPixels, disc_pixels, vehicle_mask
from tracker.palette.spots import Spots, find_spots
from tracker.rig import Colour, Marker, Rig
from tracker.types import Frame, Image

AWAY_M = (2.5, 5.0, 1.2)  # of the vehicle from a camera: spots of 0.6 to 1.3 times the size are found with each
STAYS = 0.3  # share of the other pictures with a spot at the same place: a thing of the room
SAME_CHROMA = 0.3
MOST_MOVING = 12  # spots of a picture, strongest first
SIZES = 2.0  # between the radii of two balls of one picture
NEAREST, FURTHEST = 1.5, 1.5  # of two centres: radii apart; times the marker's own spacing
BLUR_PX = 0.5  # of a spot's radius that is none of the ball's
LEAST_SEEN = 5  # pictures of a camera

Pictures = tuple[tuple[BallPixels, ...], ...]
"""The balls found in each picture of one camera: all, in the marker's order, or none."""


@dataclass(frozen=True, slots=True, eq=False)
class FirstLook:
    """What was found. colours: of each ball.  balls: by camera."""

    colours: tuple[Colour, ...]
    balls: tuple[Pictures, ...]

    @property
    def seen(self) -> tuple[int, ...]:
        """Return in how many pictures of each camera the balls were found."""
        return tuple(sum(bool(found) for found in camera) for camera in self.balls)


def look_first(instants: Sequence[Instant], rig: Rig) -> FirstLook:
    """Learn the balls' colours from what moves before each camera by itself.

    Args:
        instants: some seconds with the vehicle carried through the room.
        rig: the cameras' lenses, and the marker; where the cameras stand is not gone by.
    Raises:
        OperatorError: too few pictures of a camera show anything like the marker.
    """
    by_camera = [[instant[camera] for instant in instants] for camera in range(len(rig.cameras))]
    balls = tuple(_find(frames, rig) for frames in by_camera)
    for camera, found in zip(rig.cameras, balls, strict=True):
        if (count := sum(map(bool, found))) < LEAST_SEEN:
            raise OperatorError(
                f"colours: nothing like {len(rig.marker)} balls moves before {camera.name} ({count} of {len(instants)} "
                f"pictures, at least {LEAST_SEEN}); carry the vehicle about before every camera, and set hue_deg in "
                "[[marker.balls]] to about the paints'"
            )
    every = [ball for camera in balls for found in camera for ball in found]
    paints = [
        paint_seen(np.concatenate([one.bgr for one in every if one.ball == ball])) for ball in range(len(rig.marker))
    ]
    return FirstLook(tuple(learn_boxes(paints, list(map(_room, by_camera, balls)))), balls)


def _room(frames: Sequence[Frame], balls: Pictures) -> Image:
    """Return the pixels (n, 3) of one camera's room without the vehicle, by the pictures that show where it was."""
    shown = [(frame.image, found) for frame, found in zip(frames, balls, strict=True) if found]
    chosen = shown[:: -(-len(shown) // MOST_PICTURES)]
    masks = [vehicle_mask(image.shape, found) for image, found in chosen]
    return learn_background([image for image, _ in chosen], masks).pixels


def _find(frames: Sequence[Frame], rig: Rig) -> Pictures:
    """Return the balls of each picture of one camera, as large as most of the pictures show any."""
    focal_px = rig.cameras[frames[0].camera].focal_px
    tried = (_find_of_size(frames, rig.marker, focal_px * ball_radius_m(rig) / away_m) for away_m in AWAY_M)
    return max(tried, key=lambda found: sum(map(bool, found)))


def _find_of_size(frames: Sequence[Frame], marker: Marker, radius_px: float) -> Pictures:
    """Return the balls of about one size, none where they were not found or look otherwise than usual."""
    spots = _moving([find_spots(frame.image, radius_px) for frame in frames], radius_px)
    chosen = [_trio(each, marker) for each in spots]
    seen = [each.chroma[list(choice)] for each, choice in zip(spots, chosen, strict=True) if choice]
    usual = np.median(seen, axis=0) if seen else np.empty((0, 2))
    return tuple(
        tuple(_pixels(frame, each, choice))
        if choice and np.linalg.norm(each.chroma[list(choice)] - usual, axis=1).max() < STRAY_CHROMA
        else ()
        for frame, each, choice in zip(frames, spots, chosen, strict=True)
    )


def _moving(pictures: Sequence[Spots], reach_px: float) -> list[Spots]:
    """Return the spots that few other pictures have at the same place."""
    kept = []
    for k, one in enumerate(pictures):
        others = [other for j, other in enumerate(pictures) if j != k]
        stays = np.sum([_has(other, one, reach_px) for other in others], axis=0)
        goes = np.flatnonzero(stays < STAYS * len(others))[:MOST_MOVING]
        kept.append(Spots(one.uv_px[goes], one.radius_px[goes], one.chroma[goes]))
    return kept


def _has(other: Spots, one: Spots, reach_px: float) -> NDArray[np.bool_]:
    """Say of which spots another picture has one like it at the same place."""
    near = np.linalg.norm(one.uv_px[:, None] - other.uv_px[None], axis=2) < reach_px
    alike = np.linalg.norm(one.chroma[:, None] - other.chroma[None], axis=2) < SAME_CHROMA
    return np.asarray((near & alike).any(axis=1))


def _trio(spots: Spots, marker: Marker) -> tuple[int, ...]:
    """Return the spots that are the balls by size, spacing and colour, in the marker's order; none if none are."""
    wanted = np.stack([chroma(paint_of(ball.colour)) for ball in marker.balls]).astype(np.float64)
    best: tuple[int, ...] = ()
    least = 2.0 * MOST_COLOUR * len(marker)
    for choice in _spaced(spots, marker):
        misfit = colour_misfit(spots.chroma[list(choice)], wanted)
        if misfit < least:
            best, least = choice, misfit
    return best


def _spaced(spots: Spots, marker: Marker) -> Iterator[tuple[int, ...]]:
    """Yield every choice of one spot a ball whose sizes and distances one view of the marker may have."""
    radii, points = spots.radius_px, marker.points_inB
    apart = np.linalg.norm(spots.uv_px[:, None] - spots.uv_px[None], axis=2)
    mean = (radii[:, None] + radii[None]) / 2.0
    sized = np.maximum(radii[:, None], radii[None]) < SIZES * np.minimum(radii[:, None], radii[None])
    spacing = np.linalg.norm(points[:, None] - points[None], axis=2) / np.mean([b.radius_m for b in marker.balls])
    fits = sized & (apart > NEAREST * mean) & (apart < FURTHEST * spacing[:, :, None, None] * mean)

    def grown(chosen: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        if len(chosen) == len(marker):
            yield chosen
            return
        ball = len(chosen)
        for k in range(len(spots)):
            if all(fits[other, ball, at, k] for other, at in enumerate(chosen)):
                yield from grown((*chosen, k))

    yield from grown(())


def _pixels(frame: Frame, spots: Spots, choice: Sequence[int]) -> Iterator[BallPixels]:
    for ball, k in enumerate(choice):
        radius_px = max(float(spots.radius_px[k]) - BLUR_PX, 1.0)
        inner = disc_pixels(frame.image, spots.uv_px[k], max(radius_px - EDGE_PX, 1.0))
        yield BallPixels(frame.camera, ball, spots.uv_px[k], radius_px, inner)
