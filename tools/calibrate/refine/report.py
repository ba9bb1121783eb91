"""A refined calibration in words and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

import orjson

from tools.calibrate.grade import Grade
from tools.calibrate.refine.judge import Judged

LAST = {
    Grade.GOOD: "Good: fly with the room file.",
    Grade.USABLE: "Usable: fly with care, and calibrate the room anew when there is time.",
    Grade.NOT_GOOD: "Not good: calibrate the room anew (posebridge calibrate room).",
}


def to_text(judged: Judged) -> str:
    """Return the page."""
    return "\n".join([*_moves(judged), *_clocks(judged), *_held_out(judged), judged.reason, LAST[judged.grade]])


def to_json(judged: Judged) -> str:
    """Return the figures for programs."""
    figures = {"grade": judged.grade.value, **asdict(judged)}
    return orjson.dumps(figures, option=orjson.OPT_INDENT_2).decode()


def _moves(judged: Judged) -> Iterator[str]:
    for move in judged.moves:
        turn, shift = (" ".join(f"{x:+.{n}f}" for x in v) for v, n in ((move.turn_deg, 3), (move.shift_mm, 1)))
        yield (
            f"{move.name}: turned {turn} deg about its x, y, z; went {shift} mm along them; its rays meet the vehicle "
            f"to {move.rays_mm:.2f} mm"
        )


def _clocks(judged: Judged) -> Iterator[str]:
    if judged.clocks:
        late = ", ".join(f"{one.name} {one.offset_ms:.2f} +- {one.sigma_ms:.2f} ms" for one in judged.clocks)
        yield f"clocks: {late} late by the first camera's"


def _held_out(judged: Judged) -> Iterator[str]:
    if not judged.instants:
        yield "held out: nothing, the flight was too short since"
        return
    was, now = judged.before, judged.after
    yield (
        f"held out: {judged.instants} instants; balls off their places {was.reprojection_px:.2f} -> "
        f"{now.reprojection_px:.2f} px, rays miss by {was.epipolar_px:.2f} -> {now.epipolar_px:.2f} px, "
        f"balls' distances {was.spacing_mm:.2f} -> {now.spacing_mm:.2f} mm off"
    )
