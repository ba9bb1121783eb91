"""One image to ball sightings: near where the track expects them, or everywhere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tracker.camera import Camera
from tracker.centre import Blur, Centre, fit_centre
from tracker.detect import Blob, find_blobs, region_around
from tracker.measure import predicted_pixels
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array, BallSighting, Frame, Reason, Rejected

REGION_SIGMA = 3.5
REGION_MARGIN_PX = 3.0
LEAST_AREA_SHARE, MOST_AREA_SHARE = 0.15, 4.0  # of the ball's expected disc
NEAREST_M = 0.3  # a ball closer to a camera than this is not looked for
BLUR_MEMORY = 0.05


@dataclass(frozen=True, slots=True)
class Look:
    """What one image gave: sightings, what was left out, and the camera's blur as known now."""

    sightings: tuple[BallSighting, ...]
    rejections: tuple[Rejected, ...]
    blur: Blur


def look_near(frame: Frame, rig: Rig, state: State, blur: Blur, floor_px: float) -> Look:
    """Find each ball in the region where a state, with its covariance, expects it.

    Args:
        state: carried to about the frame's time.
        blur: the camera's blur so far.
        floor_px: see `centre.fit_centre`.
    """
    camera = rig.cameras[frame.camera]
    uv_px, H = predicted_pixels(state, camera, rig.marker, frame.t_ns)
    depths = camera.in_camera(rig.marker.points_inB @ state.R_BtoW.T + state.p_BinW)[:, 2]
    sightings: list[BallSighting] = []
    rejections: list[Rejected] = []
    for b, ball in enumerate(rig.marker.balls):
        if not np.isfinite(uv_px[b]).all() or depths[b] < NEAREST_M:
            rejections.append(
                Rejected(Reason.BEHIND, f"{ball.name} is not before the camera", frame.t_ns, frame.camera)
            )
            continue
        S = H[b] @ state.P @ H[b].T + np.eye(2)
        found = _look_for(frame, rig, b, uv_px[b], S, camera.focal_px * ball.radius_m / depths[b], blur, floor_px)
        if isinstance(found, Rejected):
            rejections.append(found)
            continue
        sightings.append(BallSighting(frame.camera, b, frame.t_ns, found.uv_px, found.cov_px))
        blur = _learned(blur, found.blur)
    return Look(tuple(sightings), tuple(rejections), blur)


def _look_for(
    frame: Frame, rig: Rig, b: int, uv_px: Array, S: Array, radius_px: float, blur: Blur, floor_px: float
) -> Centre | Rejected:
    """Find one ball near uv_px (2,), whose prediction has covariance S (2, 2) [px^2]."""
    ball = rig.marker.balls[b]
    half = REGION_SIGMA * np.sqrt(np.diag(S)) + radius_px + REGION_MARGIN_PX
    height_px, width_px = frame.image.shape[:2]
    region = region_around(uv_px, half, width_px, height_px)
    if region is None:
        return Rejected(Reason.AT_BORDER, f"{ball.name} is out of view", frame.t_ns, frame.camera)
    area = math.pi * radius_px**2
    blobs = find_blobs(frame.image, region, (ball,), MOST_AREA_SHARE * area)[0]
    likely = [blob for blob in blobs if blob.area_px >= LEAST_AREA_SHARE * area]
    if not likely:
        return Rejected(Reason.NO_BALL, f"no {ball.name} where it is expected", frame.t_ns, frame.camera)
    inverse = np.linalg.inv(S)
    nearest = min(likely, key=lambda blob: float((blob.uv_px - uv_px) @ inverse @ (blob.uv_px - uv_px)))
    found = fit_centre(frame.image, nearest.uv_px, radius_px, blur, floor_px)
    if isinstance(found, Rejected):
        return Rejected(found.reason, f"{ball.name}: {found.detail}", frame.t_ns, frame.camera)
    return found


def look_everywhere(frame: Frame, camera: Camera, rig: Rig) -> list[list[Blob]]:
    """Return for each ball of the marker the blobs of its colour in the whole image, largest first."""
    largest = max(ball.radius_m for ball in rig.marker.balls)
    most_px = math.pi * (camera.focal_px * largest / NEAREST_M) ** 2
    return find_blobs(frame.image, None, rig.marker.balls, most_px)


def _learned(blur: Blur, seen: Blur) -> Blur:
    """Let the camera's blur drift towards what a ball showed."""
    return Blur(
        blur.luma_px + BLUR_MEMORY * (seen.luma_px - blur.luma_px),
        blur.chroma_px + BLUR_MEMORY * (seen.chroma_px - blur.chroma_px),
    )
