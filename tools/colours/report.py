"""One page of text, or JSON, about a palette."""

from __future__ import annotations

import dataclasses
import json
import math

from tools.colours.verdict import Verdict, clash_line, shown_clashes
from tracker.palette.learn import BallLesson, Palette
from tracker.rig import Colour

MOST_LINES = 12  # of clashes; the rest is counted, and in the JSON


def to_text(palette: Palette, verdict: Verdict, source: str) -> str:
    """Return the page."""
    names = [camera.name for camera in palette.rig.cameras]
    before, after = palette.searched
    seen = len(palette.seen)
    lines = [
        f"Colours of {source}: marker found in {seen} of {palette.instants} instants, moved {palette.moved_m:.2f} m",
        f"The tracker's own search finds it in {after} of these {seen} with the learned colours, {before} with the old",
        "",
        f"{'ball':<10}{'':>9}{'hue deg':>16}{'saturation':>12}{'value':>8}{'to next hue':>22}"
        f"  seen in {', '.join(names)}",
    ]
    for lesson, reasons in zip(palette.balls, verdict.against, strict=True):
        lines += [row_of("old", lesson.name, lesson.old), row_of("new", "", lesson.new) + _seen(lesson)]
        lines += [f"{'':<10}not good: {reason}" for reason in reasons] or [f"{'':<10}good"]
    lines += ["", *_background(palette)]
    lines += [f"not good: {reason}" for reason in verdict.general]
    lines += [f"note: {note}" for note in verdict.notes]
    return "\n".join(
        [*lines, "", "Good to fly." if verdict.good else "NOT good to fly: mend what is not good, then repeat."]
    )


def to_json(palette: Palette, verdict: Verdict) -> str:
    """Return everything as JSON: colours in the config's own keys, areas in pixels, angles in degrees."""
    names = [camera.name for camera in palette.rig.cameras]
    balls = [
        {
            "name": lesson.name,
            "old": dataclasses.asdict(lesson.old),
            "new": dataclasses.asdict(lesson.new),
            "hues_deg": {n: None if math.isnan(h) else h for n, h in zip(names, lesson.hues_deg, strict=True)},
            "sightings": dict(zip(names, lesson.sightings, strict=True)),
            "neighbour": lesson.neighbour,
            "gap_deg": lesson.gap_deg,
            "good": not reasons,
            "reasons": reasons,
        }
        for lesson, reasons in zip(palette.balls, verdict.against, strict=True)
    ]
    clashes = [
        {**dataclasses.asdict(clash), "camera": names[clash.camera], "ball": palette.balls[clash.ball].name,
         "serious": clash.serious, "text": clash_line(clash, palette)}
        for clash in palette.clashes
    ]  # fmt: skip
    figures = {
        "good": verdict.good,
        "instants": palette.instants,
        "found": len(palette.seen),
        "moved_m": palette.moved_m,
        "searched": {"old": palette.searched[0], "new": palette.searched[1]},
        "balls": balls,
        "clashes": clashes,
        "reasons": verdict.general,
        "notes": verdict.notes,
    }
    return json.dumps(figures, indent=2)


def row_of(which: str, name: str, colour: Colour) -> str:
    """Return a box as a row of the page. which: old or new."""
    hue = f"{colour.hue_deg:.1f} +/- {colour.hue_tolerance_deg:.1f}"
    return f"{name:<10}{which:>9}{hue:>16}{colour.saturation_min:>12.2f}{colour.value_min:>8.2f}"


def _seen(lesson: BallLesson) -> str:
    gap = f"{lesson.gap_deg:.0f} deg to {lesson.neighbour}"
    return f"{gap:>22}  {', '.join(str(count) for count in lesson.sightings)}"


def _background(palette: Palette) -> list[str]:
    shown = shown_clashes(palette)
    if not shown:
        return ["Nothing in the room has a ball's colour."]
    lines = [
        f"{number:>3} {'CLASH' if clash.serious else 'close'}: {clash_line(clash, palette)}"
        for number, clash in enumerate(shown[:MOST_LINES], 1)
    ]
    more = len(palette.clashes) - len(lines)
    return lines + ([f"and {more} more, less so: see --json"] if more > 0 else [])
