"""Footage in, colours out, top to bottom.

    instants -> spots of any colour -> the marker by its shape -> pixels of each ball -> a box for each
             -> the room without the vehicle -> what in it clashes -> would the tracker find the marker?

Pure: the same pictures give the same colours.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.errors import OperatorError
from tracker.image.look import look_everywhere
from tracker.palette.background import Background, Clash, find_clashes, learn_background
from tracker.palette.box import Paint, gap_deg, learn_boxes, paint_seen
from tracker.palette.identify import Identified, ball_radius_m, expected_radius_px, identify
from tracker.palette.samples import BallPixels, ball_pixels, vehicle_mask
from tracker.palette.spots import find_spots
from tracker.rig import Colour, Rig, make_marker, make_rig
from tracker.start.acquire import first_state
from tracker.tuning import Tuning
from tracker.types import Array, Frame, Image, Rejected

Instant = tuple[Frame, ...]
"""One frame of each camera, of about one time."""

CARRIED_M_S = 1.0  # a vehicle is carried slower than this: between cameras without a shared trigger it moves
STRAY_CHROMA = 0.5  # a ball whose colour lies further from its camera's median was something else
DEPTH_MARGIN = 1.3  # the room is larger than what was flown through
MOST_PICTURES = 31  # for a background
MOST_PIXELS = 1_500_000  # of background to choose boxes by
SAME_PLACE_M = 0.03  # a pose found by the tracker's search this near to ours is the marker


class NoMarkerError(OperatorError):
    """The marker was found in no instant: it was not shown, or the cameras do not stand where the rig says."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """An instant in which the marker was found: its frames, pose and balls."""

    instant: Instant
    p_BinW: Array
    R_BtoW: Array
    balls: tuple[BallPixels, ...]


@dataclass(frozen=True, slots=True, eq=False)
class BallLesson:
    """What was learned of one ball.

    old, new: the configured and the learned box.  paint: what was seen.  sightings: by camera.
    hues_deg: median by camera, NaN where it was not seen.  neighbour: the ball nearest in hue; gap_deg: to it.
    """

    name: str
    old: Colour
    new: Colour
    paint: Paint
    sightings: tuple[int, ...]
    hues_deg: tuple[float, ...]
    neighbour: str
    gap_deg: float


@dataclass(frozen=True, slots=True, eq=False)
class Palette:
    """All that the footage taught.

    rig: with the learned colours.  instants: how many were looked at.  seen: those with the marker.
    backgrounds: by camera.  radii_px: least and largest radius of a ball by camera.  searched: in how many of `seen`
        the tracker's own search finds the marker, with the old and with the new colours.
    brightness: median value, 0..1, of the balls by camera.
    """

    rig: Rig
    instants: int
    seen: tuple[Seen, ...]
    balls: tuple[BallLesson, ...]
    backgrounds: tuple[Background, ...]
    radii_px: tuple[tuple[float, float], ...]
    clashes: tuple[Clash, ...]
    searched: tuple[int, int]
    brightness: tuple[float, ...]

    @property
    def moved_m(self) -> float:
        """Return the diagonal of the box that the vehicle moved in [m]."""
        places = np.stack([one.p_BinW for one in self.seen])
        return float(np.linalg.norm(np.ptp(places, axis=0)))

    @property
    def unknown(self) -> float:
        """Return the share of all pictures that the vehicle hid for too long to know the room behind it."""
        return float(np.mean([(room.known == 0).mean() for room in self.backgrounds]))


def learn(instants: Sequence[Instant], rig: Rig, tuning: Tuning) -> Palette:
    """Learn colours and backgrounds.

    Args:
        instants: some seconds with the vehicle carried through the room; a few dozen will do.
        rig: cameras, and the marker with the colours to start from.
        tuning: the tracker's limits.
    Raises:
        NoMarkerError: the marker was found in none of them.
    """
    seen = _find_marker(instants, rig, tuning)
    pixels = _pixels(seen, rig)
    paints = [paint_seen(np.concatenate(list(by_camera.values()))) for by_camera in pixels]
    rooms = tuple(_background(camera, seen) for camera in range(len(rig.cameras)))
    stride = 1 + sum(len(room.pixels) for room in rooms) // MOST_PIXELS
    colours = learn_boxes(paints, [room.pixels[::stride] for room in rooms])
    radii_px = tuple(_radii_px(camera, rig, seen) for camera in range(len(rig.cameras)))
    clashes = [
        clash
        for camera, room in enumerate(rooms)
        for clash in find_clashes(camera, room, colours, paints, radii_px[camera])
    ]
    learned = with_colours(rig, colours)
    return Palette(
        rig=learned,
        instants=len(instants),
        seen=tuple(seen),
        balls=tuple(_lesson(ball, rig, colours[ball], paints, pixels[ball], seen) for ball in range(len(paints))),
        backgrounds=rooms,
        radii_px=radii_px,
        clashes=tuple(sorted(clashes, key=lambda clash: (not clash.serious, -clash.area_px))),
        searched=(_searched(seen, rig, tuning), _searched(seen, learned, tuning)),
        brightness=tuple(_brightness(camera, seen) for camera in range(len(rig.cameras))),
    )


def with_colours(rig: Rig, colours: Sequence[Colour]) -> Rig:
    """Return a rig whose balls have other colours."""
    balls = tuple(replace(ball, colour=colour) for ball, colour in zip(rig.marker.balls, colours, strict=True))
    return make_rig(rig.cameras, make_marker(balls))


def _find_marker(instants: Sequence[Instant], rig: Rig, tuning: Tuning) -> list[Seen]:
    """Return the instants with the marker in them."""
    radii_px = [expected_radius_px(rig, camera) for camera in rig.cameras]
    found: list[tuple[Instant, Identified]] = []
    for instant in instants:
        spots = {frame.camera: find_spots(frame.image, radii_px[frame.camera]) for frame in instant}
        slack_m = CARRIED_M_S * 1e-9 * float(np.ptp([frame.t_ns for frame in instant]))
        one = identify(spots, rig, slack_m, tuning.tilt_limit_rad)
        if one is not None:
            found.append((instant, one))
    seen = []
    for instant, one in _alike(found):
        balls = [ball for frame in instant for ball in ball_pixels(frame, rig, one.p_BinW, one.R_BtoW)]
        seen.append(Seen(instant, one.p_BinW, one.R_BtoW, tuple(balls)))
    missing = [
        ball.name for b, ball in enumerate(rig.marker.balls) if all(x.ball != b for one in seen for x in one.balls)
    ]
    if missing:
        raise NoMarkerError(
            f"colours: no marker in any of {len(instants)} instants ({', '.join(missing)} not seen by two cameras at "
            "the marker's sides); carry the vehicle upright through the room where two cameras see it, and check the "
            "calibration and [[marker.balls]] position_mm, radius_mm"
        )
    return seen


def _alike(found: Sequence[tuple[Instant, Identified]]) -> list[tuple[Instant, Identified]]:
    """Leave out the instants in which a ball's colour is not what its camera saw of it in most of the others."""
    cameras = {camera for _, one in found for camera in one.chroma}
    usual = {
        camera: np.median([one.chroma[camera] for _, one in found if camera in one.chroma], axis=0)
        for camera in cameras
    }
    return [
        (instant, one)
        for instant, one in found
        if all(np.linalg.norm(seen - usual[c], axis=1).max() < STRAY_CHROMA for c, seen in one.chroma.items())
    ]


def _pixels(seen: Sequence[Seen], rig: Rig) -> list[Mapping[int, Image]]:
    """Return for each ball, by camera that saw it, its pixels bgr (n, 3)."""
    pixels: list[Mapping[int, Image]] = []
    for ball in range(len(rig.marker)):
        parts: dict[int, list[Image]] = {}
        for one in seen:
            for each in one.balls:
                if each.ball == ball:
                    parts.setdefault(each.camera, []).append(each.bgr)
        pixels.append({camera: np.concatenate(parts[camera]) for camera in sorted(parts)})
    return pixels


def _background(camera: int, seen: Sequence[Seen]) -> Background:
    """Learn one camera's room from the instants with the marker: only there is it known where the vehicle was."""
    chosen = [seen[round(k)] for k in np.linspace(0, len(seen) - 1, min(MOST_PICTURES, len(seen)))]
    images = [frame.image for one in chosen for frame in one.instant if frame.camera == camera]
    vehicles = [
        vehicle_mask(image.shape, [ball for ball in one.balls if ball.camera == camera])
        for one, image in zip(chosen, images, strict=True)
    ]
    return learn_background(images, vehicles)


def _radii_px(camera: int, rig: Rig, seen: Sequence[Seen]) -> tuple[float, float]:
    """Return the least and largest radius of a ball at the distances that the vehicle had, and a little beyond [px]."""
    view = rig.cameras[camera]
    depths_m = [
        float(z) for one in seen for z in view.in_camera(rig.marker.points_inB @ one.R_BtoW.T + one.p_BinW)[:, 2]
    ]
    ahead_m = [z for z in depths_m if z > 0.1] or [1.0]
    scale = view.focal_px * ball_radius_m(rig)
    return scale / (max(ahead_m) * DEPTH_MARGIN), scale / min(ahead_m) * DEPTH_MARGIN


def _lesson(
    ball: int, rig: Rig, colour: Colour, paints: Sequence[Paint], pixels: Mapping[int, Image], seen: Sequence[Seen]
) -> BallLesson:
    gaps = {
        other: min(gap_deg(paints[ball], paints[other]), gap_deg(paints[other], paints[ball]))
        for other in range(len(paints))
        if other != ball
    }
    neighbour = min(gaps, key=lambda other: gaps[other])
    cameras = range(len(rig.cameras))
    return BallLesson(
        name=rig.marker.balls[ball].name,
        old=rig.marker.balls[ball].colour,
        new=colour,
        paint=paints[ball],
        sightings=tuple(sum(x.ball == ball and x.camera == c for one in seen for x in one.balls) for c in cameras),
        hues_deg=tuple(paint_seen(pixels[c]).middle_deg if c in pixels else float("nan") for c in cameras),
        neighbour=rig.marker.balls[neighbour].name,
        gap_deg=gaps[neighbour],
    )


def _searched(seen: Sequence[Seen], rig: Rig, tuning: Tuning) -> int:
    """Count the instants in which the tracker's search of whole frames finds the marker where it is."""
    count = 0
    for one in seen:
        blobs = {f.camera: (f, look_everywhere(f, rig.cameras[f.camera], rig)) for f in one.instant}
        start = first_state(blobs, rig, tuning.process)
        if not isinstance(start, Rejected):
            turned = float(np.trace(start.R_BtoW.T @ one.R_BtoW))
            count += bool(np.linalg.norm(start.p_BinW - one.p_BinW) < SAME_PLACE_M and turned > 2.0)
    return count


def _brightness(camera: int, seen: Sequence[Seen]) -> float:
    values = [
        float(np.median(ball.bgr.max(axis=1))) / 255.0 for one in seen for ball in one.balls if ball.camera == camera
    ]
    return float(np.median(values)) if values else float("nan")
