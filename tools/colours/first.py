"""What is said of colours that were seen one camera at a time, before anybody knows where the cameras stand."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tools.colours.picture import WHITE, circle, write_on, write_picture
from tools.colours.report import row_of
from tracker.palette.learn import Instant
from tracker.palette.moving import FirstLook
from tracker.rig import Rig

NEXT = (
    "Good to calibrate the room with: `posebridge calibrate room`. NOT good to fly: learn them again in the calibrated "
    "room, then they are held against what else is in it."
)


def first_text(look: FirstLook, rig: Rig, source: str) -> str:
    """Return the page."""
    seen = ", ".join(f"{camera.name} {count}" for camera, count in zip(rig.cameras, look.seen, strict=True))
    rows = [
        row
        for ball, colour in zip(rig.marker.balls, look.colours, strict=True)
        for row in (row_of("old", ball.name, ball.colour), row_of("new", "", colour))
    ]
    return "\n".join(
        [
            f"Colours of {source}: nobody knows where the cameras stand, so each was looked through by itself",
            f"Balls by what moves: {seen} of {len(look.balls[0])} pictures",
            "",
            f"{'ball':<10}{'':>9}{'hue deg':>16}{'saturation':>12}{'value':>8}",
            *rows,
            "",
            NEXT,
        ]
    )


def first_json(look: FirstLook, rig: Rig) -> str:
    """Return the same as JSON, colours in the config's own keys."""
    balls = [
        {"name": ball.name, "old": dataclasses.asdict(ball.colour), "new": dataclasses.asdict(colour)}
        for ball, colour in zip(rig.marker.balls, look.colours, strict=True)
    ]
    seen = {camera.name: count for camera, count in zip(rig.cameras, look.seen, strict=True)}
    return json.dumps({"good": False, "calibrated": False, "seen": seen, "balls": balls, "reasons": [NEXT]}, indent=2)


def draw_first(look: FirstLook, instants: Sequence[Instant], rig: Rig, path: Path) -> None:
    """Write a PNG: of every camera the last picture in which the balls were found, with their names.

    Raises:
        OperatorError: the file cannot be written.
    """
    panels = []
    for index, (camera, found) in enumerate(zip(rig.cameras, look.balls, strict=True)):
        last = max(k for k, balls in enumerate(found) if balls)
        image = instants[last][index].image.copy()
        for ball in found[last]:
            circle(image, ball.uv_px, f"{rig.marker.balls[ball.ball].name}, radius {ball.radius_px:.1f} px", WHITE)
        write_on(image, camera.name, (10, 22), WHITE, 0.6)
        panels.append(image)
    tallest = max(len(image) for image in panels)
    padded = [np.pad(image, ((0, tallest - len(image)), (0, 0), (0, 0))) for image in panels]
    write_picture(np.hstack(padded), path)
