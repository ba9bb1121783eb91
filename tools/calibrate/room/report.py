"""A calibrated room in words and as JSON."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import orjson

from tools.calibrate.grade import Grade
from tools.calibrate.room.held_out import HeldOut
from tools.calibrate.room.lying import Lying
from tools.calibrate.room.room import Room
from tools.calibrate.room.verdict import Verdict, scale_off_mm, scale_tolerance_mm
from tools.calibrate.room.volume import CELLS

LAST_LINES = {
    Grade.GOOD: "Good",
    Grade.USABLE: "Usable",
    Grade.NOT_GOOD: "NOT GOOD",
}


def to_text(room: Room, verdict: Verdict) -> str:
    """Return the page."""
    lines = [*_cameras(room), *_errors(room), *_marker(room), *_frame(room)]
    lines += [f"  NOT GOOD: {reason}" for reason in verdict.against]
    lines += [f"  usable only: {reason}" for reason in verdict.doubts]
    lines += [f"  note: {note}" for note in verdict.notes]
    return "\n".join([*lines, last_line(room, verdict)])


def last_line(room: Room, verdict: Verdict) -> str:
    """Say it in one line."""
    if not room.volume.cells:
        return f"{LAST_LINES[verdict.grade]}: see above what to mend."
    said = f"{LAST_LINES[verdict.grade]}: points are known to {room.volume.point_mm:.1f} mm, the worst to "
    return (
        said
        + f"{room.volume.worst_point_mm:.1f} mm"
        + ("." if verdict.grade is Grade.GOOD else "; see above what to mend.")
    )


def to_json(room: Room, verdict: Verdict) -> str:
    """Return the figures for programs."""
    off_mm = scale_off_mm(room)
    figures = {
        "grade": str(verdict.grade), "against": verdict.against, "doubts": verdict.doubts, "notes": verdict.notes,
        "cameras": [
            {
                "name": camera.name, "position_m": camera.p_CinW.tolist(), "R_CtoW": camera.R_CtoW.tolist(),
                "position_sigma_mm": room.position_mm(c).tolist(), "attitude_sigma_deg": room.attitude_deg(c).tolist(),
                "clock_offset_ms": camera.clock_offset_ns / 1e6, "clock_sigma_ms": room.clock_ms(c),
                "focal_px": camera.focal_px, "seen_s": room.seen_s[c],
            }
            for c, camera in enumerate(room.cameras)
        ],
        "held_out": {
            "instants": room.held_out.instants, "spacing_mm": room.held_out.spacing_mm,
            "spacing_95_mm": room.held_out.worst_spacing_mm, "reprojection_px": room.held_out.reprojection_px,
            "epipolar_px": room.held_out.epipolar_px,
        },
        "volume": {
            "visited": room.volume.visited, "point_mm": room.volume.point_mm,
            "worst_point_mm": room.volume.worst_point_mm,
        },
        "sides": [
            {"balls": list(s.names), "config_mm": s.said_mm, "found_mm": s.found_mm, "sigma_mm": s.sigma_mm}
            for s in room.sides
        ],
        "radii": [
            {"balls": list(s.names), "config_mm": s.said_mm, "found_mm": s.found_mm, "sigma_mm": s.sigma_mm}
            for s in room.sizes
        ],
        "board": None if room.lying is None else {
            "cameras": list(room.lying.names), "rms_px": room.lying.rms_px, "tilt_sigma_deg": room.lying.tilt_deg,
            "heading_sigma_deg": room.lying.heading_deg, "larger": room.lying.larger,
        },
        "scale": None if off_mm is None else {"off_mm": off_mm, "tolerance_mm": scale_tolerance_mm(room)},
    }  # fmt: skip
    return orjson.dumps(figures, option=orjson.OPT_INDENT_2).decode()


def _cameras(room: Room) -> Iterator[str]:
    for c, camera in enumerate(room.cameras):
        azimuth_deg, down_deg = _looks(camera.R_CtoW[:, 2])
        position = ", ".join(f"{1e3 * x:.1f}" for x in camera.p_CinW)
        yield (
            f"{camera.name}: at x, y, z = {position} +- {np.linalg.norm(room.position_mm(c)):.1f} mm, looks "
            f"{azimuth_deg:.2f} deg left of x, {down_deg:.2f} deg down, +- {room.attitude_deg(c).max():.3f} deg"
        )
        yield (
            f"  clock         {camera.clock_offset_ns / 1e6:.2f} +- {room.clock_ms(c):.2f} ms late; saw the marker "
            f"with another camera for {room.seen_s[c]:.0f} s; f {camera.focal_px:.1f} px"
        )


def _errors(room: Room) -> Iterator[str]:
    held_out, volume = room.held_out, room.volume
    if not held_out.instants:
        yield "held out: no instant that two cameras saw"
    else:
        yield _held_out(held_out)
    if not volume.cells:
        yield "volume: two cameras see none of it"
        return
    yield (
        f"volume: two cameras see {volume.cells} of {CELLS**3} cells, the marker was in {100 * volume.visited:.0f} % "
        f"of them; a point there is known to {volume.point_mm:.1f} mm, the worst to {volume.worst_point_mm:.1f} mm"
    )


def _held_out(held_out: HeldOut) -> str:
    return (
        f"held out: {held_out.instants} instants ({100 * held_out.wild:.0f} % mistaken), balls' distances "
        f"{held_out.spacing_mm:.2f} mm off (95 %: {held_out.worst_spacing_mm:.2f} mm), reprojection "
        f"{held_out.reprojection_px:.3f} px, epipolar {held_out.epipolar_px:.3f} px"
    )


def _marker(room: Room) -> Iterator[str]:
    sides = ", ".join(
        f"{' to '.join(side.names)} {side.found_mm:.2f} +- {side.sigma_mm:.2f} (config {side.said_mm:.2f})"
        for side in room.sides
    )
    yield f"marker: {sides} mm, their mean taken from the config"
    sizes = ", ".join(
        f"{' '.join(size.names)} {size.found_mm:.2f} +- {size.sigma_mm:.2f} (config {size.said_mm:.2f})"
        for size in room.sizes
    )
    yield f"ball radius: {sizes} mm"


def _frame(room: Room) -> Iterator[str]:
    if room.lying is not None:
        yield from _board(room.lying)
    if room.floor is None or room.floor_sigmas is None:
        return
    stands = ", ".join(f"{stand.from_s:.1f} to {stand.to_s:.1f} s" for stand in room.floor.stands)
    yield (
        f"frame: spots at {stands}; level to {room.floor_sigmas.tilt_deg:.2f} deg, heading to "
        f"{room.floor_sigmas.heading_deg:.2f} deg"
    )
    off_mm = scale_off_mm(room)
    if off_mm is not None and room.apart_m is not None:
        yield (
            f"scale: the first two spots, measured {1e3 * room.apart_m:.1f} mm apart, came out "
            f"{1e3 * room.floor.along_m:.1f} mm, at most {scale_tolerance_mm(room):.1f} mm off by chance"
        )


def _board(lying: Lying) -> Iterator[str]:
    yield (
        f"frame: board seen by {', '.join(lying.names)}, corners miss by {lying.rms_px:.2f} px; level to "
        f"{lying.tilt_deg:.2f} deg, heading to {lying.heading_deg:.2f} deg"
    )
    if lying.larger is not None:
        yield f"scale: the board came out {100 * lying.larger:+.2f} +- {100 * lying.larger_sigma:.2f} % of its size off"


def _looks(axis_inW: np.ndarray) -> tuple[float, float]:
    """Return where an optical axis points: left of x, and down [deg]."""
    x, y, z = axis_inW.tolist()
    return float(np.degrees(np.arctan2(y, x))), float(np.degrees(np.arcsin(np.clip(-z, -1.0, 1.0))))
