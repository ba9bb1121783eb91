"""What `posebridge place` says: a page for people, JSON for programs."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import orjson

from tools.place.layout import Figures, Move, view_deg
from tools.place.limits import Limits
from tools.place.proof import Proof
from tools.place.words import instructions
from tracker.camera import Camera


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """What was found: cameras, their figures, what moving one would change, and a simulated flight if one was flown."""

    cameras: tuple[Camera, ...]
    figures: Figures
    moves: tuple[Move, ...]
    proof: Proof | None
    searched: bool

    def good(self, limits: Limits) -> bool:
        """Say whether two cameras have as much of the volume in the picture as [place] coverage_min wants."""
        return self.figures.covered >= limits.coverage_min


def to_text(placement: Placement, limits: Limits) -> str:
    """Return the page."""
    f = placement.figures
    title = f"{len(placement.cameras)} cameras, " + (
        "placed by search" if placement.searched else "as the config has them"
    )
    lines = [title, ""]
    for camera in placement.cameras:
        first, second = instructions(camera, limits)
        lines += [f"  {first}", f"        {second}"]
    lines += ["", "Expected of one instant's pictures, over the volume and all headings and leans"]
    lines += [
        f"  two cameras have every ball in the picture {100 * f.covered:6.1f} % of the poses",
        f"  and no ball stands behind another          {100 * f.clear:6.1f} %",
        f"  position, rms                              {f.position_mm:6.2f} mm   {f.worst_position_mm:.2f} mm worst",
        f"  attitude, rms                              {f.attitude_deg:6.2f} deg  {f.worst_attitude_deg:.2f} deg worst",
    ]
    if placement.proof is not None:
        lines += ["", *_proof_lines(placement.proof)]
    if placement.moves:
        lines += ["", *_move_lines(placement)]
    return "\n".join([*lines, "", _verdict(placement, limits)])


def to_json(placement: Placement, limits: Limits) -> str:
    """Return the same as JSON; an error that is not known is null."""
    table = {
        "good": placement.good(limits),
        "cameras": [
            {
                "name": camera.name,
                "view_deg": view_deg(camera),
                "p_CinW_m": camera.p_CinW.tolist(),
                "R_CtoW": camera.R_CtoW.tolist(),
                "instructions": instructions(camera, limits),
            }
            for camera in placement.cameras
        ],
        "figures": asdict(placement.figures),
        "moves": [
            {
                "camera": placement.cameras[move.camera].name,
                "step_m": move.step_m.tolist(),
                "leaves_room": move.leaves_room,
                "before": asdict(move.before),
                "after": asdict(move.after),
            }
            for move in placement.moves
        ],
        "proof": asdict(placement.proof) if placement.proof else None,
    }
    return orjson.dumps(table, option=orjson.OPT_INDENT_2).decode()


def _proof_lines(proof: Proof) -> list[str]:
    return [
        f"A simulated flight through the volume: {proof.estimates} estimates of {proof.frames} instants",
        "                    flown     forecast   ratio",
        f"  position, rms  {proof.position_mm:8.3f} {proof.expected_position_mm:8.3f} mm {proof.position_ratio:7.2f}",
        f"  attitude, rms  {proof.attitude_deg:8.3f} {proof.expected_attitude_deg:8.3f} deg{proof.attitude_ratio:7.2f}",
        f"  beyond 5 sigma of the tracker's own covariance: {proof.wrong}, wanted 0",
    ]


def _move_lines(placement: Placement) -> list[str]:
    lines = [
        "A camera moved, still looking at the same point: change of the figures",
        f"  {'camera':10} {'step, m':>18} {'covered, %':>12} {'position, mm':>14} {'worst, mm':>12} "
        f"{'attitude, deg':>14}",
    ]
    for move in placement.moves:
        a, b = move.before, move.after
        step = ", ".join(f"{x:+.1f}" if x else "0" for x in move.step_m)
        lines.append(
            f"  {placement.cameras[move.camera].name:10} {step:>18} {100 * (b.covered - a.covered):+12.1f} "
            f"{_change(a.position_mm, b.position_mm):>14} {_change(a.worst_position_mm, b.worst_position_mm):>12} "
            f"{_change(a.attitude_deg, b.attitude_deg):>14}" + ("   outside the room" if move.leaves_room else "")
        )
    return lines


def _change(before: float, after: float) -> str:
    return "unknown" if math.isnan(before) or math.isnan(after) else f"{after - before:+.3f}"


def _verdict(placement: Placement, limits: Limits) -> str:
    wanted = 100 * limits.coverage_min
    if placement.good(limits):
        return f"good: two cameras cover {100 * placement.figures.covered:.1f} % of the poses, wanted {wanted:.0f} %"
    return (
        f"NOT GOOD: two cameras cover {100 * placement.figures.covered:.1f} % of the poses, wanted {wanted:.0f} %: "
        "use more cameras or pixels, other lenses or mounts, larger balls, or a smaller volume"
    )
