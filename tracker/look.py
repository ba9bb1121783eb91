"""One image to ball sightings: near where the track expects them, or everywhere."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tracker.appearance import Appearance
from tracker.camera import Camera
from tracker.centre import Centre, fit_centre
from tracker.detect import Blob, find_blobs, region_around
from tracker.measure import predicted_pixels
from tracker.patch import Expected
from tracker.rig import Rig
from tracker.state import ATTITUDE, POSITION, State
from tracker.types import Array, BallSighting, Frame, Reason, Rejected

REGION_SIGMA = 3.5
REGION_MARGIN_PX = 3.0
LEAST_AREA_SHARE, MOST_AREA_SHARE = 0.15, 4.0  # of the ball's expected disc
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


def look_near(frames: Sequence[Frame], rig: Rig, state: State, appearances: Sequence[Appearance]) -> Look:
    """Find each ball in each image, in the region where a state, with its covariance, expects it.

    Args:
        frames: of different cameras, at about one time.
        state: carried to about that time.
        appearances: how balls look to each camera of the rig.
    """
    fitted: list[Fitted] = []
    rejections: list[Rejected] = []
    for frame in frames:
        for b, what in _expectations(frame, rig, state, appearances[frame.camera]):
            if isinstance(what, Rejected):
                rejections.append(what)
                continue
            centre = fit_centre(frame.image, what)
            if isinstance(centre, Reason):
                rejections.append(_rejected(centre, f"{rig.marker.balls[b].name} at {_at(what)}", frame))
            else:
                sighting = BallSighting(frame.camera, b, frame.t_ns, centre.uv_px, centre.cov_px)
                fitted.append(Fitted(sighting, frame, what, centre))
    return Look(tuple(fitted), tuple(rejections))


def _expectations(
    frame: Frame, rig: Rig, state: State, appearance: Appearance
) -> Iterator[tuple[int, Expected | Rejected]]:
    """Yield for each ball of the marker where its colour is seen near its prediction, or why it is not."""
    camera = rig.cameras[frame.camera]
    uv_px, H = predicted_pixels(state, rig, frame.camera, frame.t_ns)
    depths = camera.in_camera(rig.marker.points_inB @ state.R_BtoW.T + state.p_BinW)[:, 2]
    spreads = H @ state.P @ H.transpose(0, 2, 1) + np.eye(2)
    speeds_px_s = H[:, :, POSITION] @ state.v_BinW + H[:, :, ATTITUDE] @ state.w_BinB
    for b, ball in enumerate(rig.marker.balls):
        if not np.isfinite(uv_px[b]).all() or depths[b] < NEAREST_M:
            yield b, _rejected(Reason.BEHIND, f"{ball.name} is not before the camera", frame)
            continue
        radius_px = camera.focal_px * ball.radius_m / float(depths[b])
        blob = _nearest_blob(frame, rig, b, uv_px[b], spreads[b], radius_px)
        if isinstance(blob, Rejected):
            yield b, blob
            continue
        u, v = blob.uv_px.tolist()
        shades = appearance.shades(camera, camera.bearings(blob.uv_px[None])[0])
        speed_px_s = float(speeds_px_s[b, 0]), float(speeds_px_s[b, 1])
        yield b, Expected((u, v), radius_px, speed_px_s, shades, appearance.response)


def _nearest_blob(frame: Frame, rig: Rig, b: int, uv_px: Array, S: Array, radius_px: float) -> Blob | Rejected:
    """Find the blob of one ball's colour nearest uv_px (2,), whose prediction has covariance S (2, 2) [px^2]."""
    ball = rig.marker.balls[b]
    half = REGION_SIGMA * np.sqrt(np.diag(S)) + radius_px + REGION_MARGIN_PX
    height_px, width_px = frame.image.shape[:2]
    region = region_around(uv_px, half, width_px, height_px)
    if region is None:
        return _rejected(Reason.AT_BORDER, f"{ball.name} is out of view", frame)
    area = math.pi * radius_px**2
    blobs = find_blobs(frame.image, region, (ball,), MOST_AREA_SHARE * area)[0]
    likely = [blob for blob in blobs if blob.area_px >= LEAST_AREA_SHARE * area]
    if not likely:
        return _rejected(Reason.NO_BALL, f"no {ball.name} where it is expected", frame)
    inverse = np.linalg.inv(S)
    return min(likely, key=lambda blob: float((blob.uv_px - uv_px) @ inverse @ (blob.uv_px - uv_px)))


def look_everywhere(frame: Frame, camera: Camera, rig: Rig) -> list[list[Blob]]:
    """Return for each ball of the marker the blobs of its colour in the whole image, largest first."""
    largest = max(ball.radius_m for ball in rig.marker.balls)
    most_px = math.pi * (camera.focal_px * largest / NEAREST_M) ** 2
    return find_blobs(frame.image, None, rig.marker.balls, most_px)


def _rejected(reason: Reason, detail: str, frame: Frame) -> Rejected:
    return Rejected(reason, detail, frame.t_ns, frame.camera)


def _at(ball: Expected) -> str:
    return f"({ball.uv_px[0]:.0f}, {ball.uv_px[1]:.0f}) px"
