"""A picture of what would be detected, and of what clashes."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np

from tools.colours.verdict import clash_line, shown_clashes
from tracker.errors import OperatorError
from tracker.image.look import look_everywhere
from tracker.palette.background import Clash
from tracker.palette.learn import Palette, Seen
from tracker.palette.mask import colour_mask
from tracker.types import Array, Frame, Image

Bgr = tuple[int, int, int]
WHITE, GREY, PAPER = (255, 255, 255), (170, 170, 170), (24, 24, 24)
CLASH, CLOSE, FALSE = (255, 0, 255), (230, 190, 60), (60, 60, 255)
ZOOM, INSET_PX, SEAM = 6, 25, 6
LINE_PX, MOST_LINES = 18, 12
PNG = ".png"
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def draw_palette(palette: Palette, path: Path) -> None:
    """Write a PNG: every camera's picture with its detections and clashes, the balls enlarged below, a legend.

    Raises:
        OperatorError: the file cannot be written.
    """
    seen = max(palette.seen, key=lambda one: len(one.balls))
    columns = [_column(palette, seen, frame) for frame in seen.instant]
    height = max(len(column) for column in columns)
    panels = []
    for column in columns:
        panels += [_padded(column, height), np.full((height, SEAM, 3), PAPER, dtype=np.uint8)]
    sheet = np.hstack(panels[:-1])
    write_picture(np.vstack((sheet, _legend(palette, sheet.shape[1]))), path)


def write_picture(sheet: Image, path: Path) -> None:
    """Write a PNG; not by OpenCV, whose library speaks up for itself on a full disk.

    Raises:
        OperatorError: the file cannot be written.
    """
    try:
        path.write_bytes(cv2.imencode(PNG, sheet)[1].tobytes())
    except OSError as error:
        raise OperatorError(
            f"--picture {path}: cannot be written ({error.strerror}); free space or name a writable path"
        ) from error


def _column(palette: Palette, seen: Seen, frame: Frame) -> Image:
    """Return one camera's picture, the balls enlarged below it."""
    image: Image = frame.image.copy()
    camera = palette.rig.cameras[frame.camera]
    clashes = list(enumerate(shown_clashes(palette), 1))
    for number, clash in clashes:
        if clash.camera == frame.camera:
            _hatch(image, clash, str(number))
    places = {ball.ball: ball for ball in seen.balls if ball.camera == frame.camera}
    for ball, blobs in enumerate(look_everywhere(frame, camera, palette.rig)):
        for blob in blobs:
            at = places.get(ball)
            true = at is not None and float(np.linalg.norm(blob.uv_px - at.uv_px)) < at.radius_px + 1.5
            name = palette.balls[ball].name
            if true:
                circle(image, blob.uv_px, f"{name} {blob.area_px:.0f} px", WHITE)
            elif not any(clash.camera == frame.camera and _within(blob.uv_px, clash) for _, clash in clashes):
                circle(image, blob.uv_px, f"{name}? {blob.area_px:.0f} px", FALSE)
    write_on(image, camera.name, (10, 22), WHITE, 0.6)
    return np.vstack((image, _strip(palette, seen, frame)))


def _within(uv_px: Array, clash: Clash) -> bool:
    region = clash.region
    return bool(region.left - 2 <= uv_px[0] <= region.right + 1 and region.top - 2 <= uv_px[1] <= region.bottom + 1)


def circle(image: Image, uv_px: Array, label: str, colour: Bgr) -> None:
    """Draw a circle round a place, with a label beside it."""
    u, v = (round(float(x)) for x in uv_px)
    cv2.circle(image, (u, v), 11, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.circle(image, (u, v), 11, colour, 1, cv2.LINE_AA)
    _label(image, label, (u, v), 14, colour)


def _label(image: Image, label: str, at: tuple[int, int], reach: int, colour: Bgr) -> None:
    """Write a label to the right of a place, or to its left where the picture ends."""
    (width, _), _ = cv2.getTextSize(label, _FONT, 0.42, 1)
    left = at[0] + reach if at[0] + reach + width < image.shape[1] else max(at[0] - reach - width, 2)
    write_on(image, label, (left, min(max(at[1] + 4, 12), image.shape[0] - 4)), colour, 0.42)


def write_on(image: Image, text: str, at: tuple[int, int], colour: Bgr, size: float) -> None:
    """Write on a darkened ground, legible on any picture."""
    (width, height), base = cv2.getTextSize(text, _FONT, size, 1)
    ground = image[max(at[1] - height - 3, 0) : at[1] + base, max(at[0] - 2, 0) : at[0] + width + 2]
    ground[:] = ground // 3
    cv2.putText(image, text, at, _FONT, size, colour, 1, cv2.LINE_AA)


def _hatch(image: Image, clash: Clash, number: str) -> None:
    """Box a region, with stripes across, and give it the number of its line in the legend."""
    colour = CLASH if clash.serious else CLOSE
    left, top = max(clash.region.left - 3, 0), max(clash.region.top - 3, 0)
    right, bottom = min(clash.region.right + 2, image.shape[1] - 1), min(clash.region.bottom + 2, image.shape[0] - 1)
    part = image[top : bottom + 1, left : right + 1]
    lines = part.copy()
    if clash.serious:
        for start in range(-part.shape[0], part.shape[1], 8):
            cv2.line(lines, (start, part.shape[0]), (start + part.shape[0], 0), colour, 1)
    part[:] = cv2.addWeighted(part, 0.45, lines, 0.55, 0.0)
    cv2.rectangle(image, (left, top), (right, bottom), colour, 1)
    _label(image, number, (right, (top + bottom) // 2), 5, colour)


def _strip(palette: Palette, seen: Seen, frame: Frame) -> Image:
    """Return the balls of one picture enlarged, each with the outline of what its box holds."""
    side = ZOOM * INSET_PX
    strip = np.full((side + 30, frame.image.shape[1], 3), PAPER, dtype=np.uint8)
    balls = [ball for ball in seen.balls if ball.camera == frame.camera]
    for k, ball in enumerate(balls[: max(1, frame.image.shape[1] // (side + 12))]):
        left = 10 + k * (side + 12)
        lesson = palette.balls[ball.ball]
        strip[4 : 4 + side, left : left + side] = _inset(frame.image, ball.uv_px, palette, ball.ball)
        label = f"{lesson.name}, radius {ball.radius_px:.1f} px"
        cv2.putText(strip, label, (left, side + 22), _FONT, 0.42, _bright(lesson.new.bgr), 1, cv2.LINE_AA)
    return strip


def _inset(image: Image, uv_px: Array, palette: Palette, ball: int) -> Image:
    half = INSET_PX // 2
    u, v = (round(float(x)) for x in uv_px)
    padded = cv2.copyMakeBorder(image, half, half, half, half, cv2.BORDER_REPLICATE)[v:, u:][:INSET_PX, :INSET_PX]
    hsv: Image = np.asarray(cv2.cvtColor(padded, cv2.COLOR_BGR2HSV), dtype=np.uint8)
    mask = cv2.resize(
        colour_mask(hsv, palette.balls[ball].new), None, fx=ZOOM, fy=ZOOM, interpolation=cv2.INTER_NEAREST
    )
    large = cv2.resize(padded, None, fx=ZOOM, fy=ZOOM, interpolation=cv2.INTER_NEAREST)
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(large, outlines, -1, WHITE, 1)
    return np.asarray(large, dtype=np.uint8)


def _legend(palette: Palette, width: int) -> Image:
    """Return the meaning of the marks, and the clashes in words."""
    shown = shown_clashes(palette)
    lines: list[tuple[str, Bgr]] = [
        ("circle: found, with the area of its blob; below: enlarged, outlined what the learned box holds", WHITE),
        ("red circle: found, but not the marker's ball", FALSE),
        ("hatched: background that is taken for a ball or hides one     thin box: background that nearly is", CLASH),
    ]
    lines += [
        (f"{number}: {clash_line(clash, palette)}", CLASH if clash.serious else CLOSE)
        for number, clash in enumerate(shown[:MOST_LINES], 1)
    ]
    if len(shown) > MOST_LINES:
        lines.append((f"and {len(shown) - MOST_LINES} more", GREY))
    legend = np.full((LINE_PX * len(lines) + 12, width, 3), PAPER, dtype=np.uint8)
    for k, (line, colour) in enumerate(lines):
        size = 0.45
        (length, _), _ = cv2.getTextSize(line, _FONT, size, 1)
        size *= min(1.0, (width - 20) / length)
        cv2.putText(legend, line, (10, LINE_PX * (k + 1)), _FONT, size, colour, 1, cv2.LINE_AA)
    return legend


def _padded(column: Image, height: int) -> Image:
    return np.vstack((column, np.full((height - len(column), column.shape[1], 3), PAPER, dtype=np.uint8)))


def _bright(bgr: Bgr) -> Bgr:
    """Return a colour bright enough to read on the dark strip."""
    factor = 220.0 / max(*bgr, 1)
    blue, green, red = (math.floor(min(255.0, channel * factor)) for channel in bgr)
    return blue, green, red
