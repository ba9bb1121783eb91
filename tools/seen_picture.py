"""A picture of what the cameras saw and what the tracker made of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from tracker.errors import OperatorError
from tracker.rig import Rig
from tracker.types import BallSighting, Estimate, Frame, Image

ZOOM = 8
INSET_PX = 21  # of the image, shown ZOOM times as large
SIGMA = 10.0  # ellipses are drawn this many standard deviations wide, or they would not be seen
WHITE, INK = (255, 255, 255), (40, 40, 40)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def draw_seen(
    frames: Sequence[Frame], sightings: Sequence[BallSighting], estimate: Estimate, rig: Rig, path: Path
) -> None:
    """Write a PNG of one instant: each camera's image, its sightings enlarged below, the body's axes drawn in.

    Args:
        frames: one of each camera.
        sightings: used for `estimate`, of those frames.
    Raises:
        OperatorError: the file cannot be written.
    """
    columns = [_column(frame, [s for s in sightings if s.camera == frame.camera], estimate, rig) for frame in frames]
    if not cv2.imwrite(str(path), np.hstack(columns)):
        raise OperatorError(f"{path}: the picture cannot be written; name a writable path")


def _column(frame: Frame, sightings: Sequence[BallSighting], estimate: Estimate, rig: Rig) -> Image:
    """Return one camera's image over its enlarged sightings."""
    image = frame.image.copy()
    camera = rig.cameras[frame.camera]
    _draw_axes(image, estimate, rig, frame.camera)
    cv2.putText(image, camera.name, (12, 26), _FONT, 0.7, WHITE, 2, cv2.LINE_AA)
    side = INSET_PX * ZOOM
    strip = np.full((side + 28, image.shape[1], 3), 24, dtype=np.uint8)
    for k, sighting in enumerate(sightings[: image.shape[1] // (side + 8)]):
        u, v = (round(float(x)) for x in sighting.uv_px)
        cv2.rectangle(image, (u - 14, v - 14), (u + 14, v + 14), WHITE, 1, cv2.LINE_AA)
        left = 8 + k * (side + 16)
        strip[4 : 4 + side, left : left + side] = _inset(frame.image, sighting)
        ball = rig.marker.balls[sighting.ball]
        paint = ball.colour.bgr
        sigma = float(np.sqrt(np.trace(sighting.cov_px) / 2.0))
        cv2.putText(strip, f"{ball.name}  {sigma:.2f} px", (left, side + 22), _FONT, 0.5, paint, 1, cv2.LINE_AA)
    return np.vstack((image, strip))


def _inset(image: Image, sighting: BallSighting) -> Image:
    """Return the pixels round a sighting, enlarged, with its centre and SIGMA-sigma ellipse."""
    u, v = (round(float(x)) for x in sighting.uv_px)
    half = INSET_PX // 2
    padded = cv2.copyMakeBorder(image, half, half, half, half, cv2.BORDER_REPLICATE)
    part = padded[v : v + INSET_PX, u : u + INSET_PX]
    large = np.asarray(cv2.resize(part, None, fx=ZOOM, fy=ZOOM, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)
    centre = [round((float(sighting.uv_px[i]) - (u, v)[i] + half + 0.5) * ZOOM) for i in (0, 1)]
    values, vectors = np.linalg.eigh(sighting.cov_px)
    axes = [max(1, round(SIGMA * float(np.sqrt(value)) * ZOOM)) for value in values]
    angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
    cv2.ellipse(large, (centre[0], centre[1]), (axes[0], axes[1]), angle, 0, 360, WHITE, 1, cv2.LINE_AA)
    cv2.drawMarker(large, (centre[0], centre[1]), INK, cv2.MARKER_CROSS, 9, 1)
    return large


def _draw_axes(image: Image, estimate: Estimate, rig: Rig, camera: int) -> None:
    """Draw the body's axes, 10 cm long: x red, y green, z blue."""
    origin = estimate.p_BinW
    points = np.vstack((origin, origin + 0.1 * estimate.R_BtoW.T))
    uv_px, _ = rig.cameras[camera].project(points)
    if not np.isfinite(uv_px).all():
        return
    start = (round(float(uv_px[0, 0])), round(float(uv_px[0, 1])))
    for end, colour in zip(uv_px[1:], ((60, 60, 230), (60, 200, 60), (230, 120, 60)), strict=True):
        cv2.arrowedLine(image, start, (round(float(end[0])), round(float(end[1]))), colour, 2, cv2.LINE_AA, 0, 0.2)
