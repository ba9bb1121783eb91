"""What a calibrated room means for a flight: good, usable, or not good; in millimetres, and why.

Each limit stands beside what a pilot feels of it: a micro helicopter holds its place to some centimetres, so 10 mm of a
calibration that bends the room are too much, and 3 mm are not felt.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tools.calibrate.grade import Grade
from tools.calibrate.room.lying import Lying
from tools.calibrate.room.radius import Size, together
from tools.calibrate.room.room import Room
from tools.calibrate.room.sides import SIDE_MM, SURE, Side

GOOD_POINT_MM, USABLE_POINT_MM = 5.0, 15.0  # one sigma, worst cell
GOOD_SPACING_MM, USABLE_SPACING_MM = 2.0, 5.0  # 95 % of the held out
GOOD_PX, USABLE_PX = 0.5, 1.5  # reprojection and epipolar, held out
GOOD_CLOCK_MS, USABLE_CLOCK_MS = 0.5, 3.0  # one sigma: at 1 m/s a millisecond is a millimetre
GOOD_VISITED, USABLE_VISITED = 0.3, 0.1  # of the cells that two cameras see
GOOD_SEEN_S, USABLE_SEEN_S = 10.0, 4.0
WILD_SHARE = 0.2
TAPE_MM = 2.0  # what a tape errs by, one sigma
FAR_MM, FAR_DEG = 500.0, 20.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """against: reasons not to fly with it.  doubts: why it is usable only.  notes: worth knowing."""

    against: tuple[str, ...]
    doubts: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def grade(self) -> Grade:
        """Return the worst of it."""
        if self.against:
            return Grade.NOT_GOOD
        return Grade.USABLE if self.doubts else Grade.GOOD


def judge(room: Room) -> Verdict:
    """Judge a room: what is good needs no words."""
    graded = list(_graded(room))
    against = [text for grade, text in graded if grade is Grade.NOT_GOOD]
    doubts = [text for grade, text in graded if grade is Grade.USABLE]
    return Verdict(tuple(against), tuple(doubts), tuple(_notes(room)))


def scale_off_mm(room: Room) -> float | None:
    """Return by how much the distance of the first two spots came out too long [mm]; None if nobody measured it."""
    if room.floor is None or room.apart_m is None:
        return None
    return 1e3 * (room.floor.along_m - room.apart_m)


def scale_tolerance_mm(room: Room) -> float:
    """Return by how much it may be off by chance [mm]."""
    spots_mm = 0.0 if room.floor_sigmas is None else room.floor_sigmas.along_mm
    return SURE * float(np.hypot(TAPE_MM, spots_mm))


def _graded(room: Room) -> Iterator[tuple[Grade, str]]:
    yield from _of_points(room)
    yield from _of_held_out(room)
    yield from _of_clocks(room)
    yield from _of_footage(room)
    for side in room.sides:
        yield from _of_side(side)
    yield from _of_sizes(room.sizes)
    yield from _of_board(room.lying)
    off_mm = scale_off_mm(room)
    if room.floor is not None and off_mm is None:
        yield Grade.USABLE, "scale unchecked: it rests on the marker's sides alone; measure the spots, --apart_mm"
    elif off_mm is not None and abs(off_mm) > scale_tolerance_mm(room):
        percent = 100.0 * off_mm / (1e3 * (room.apart_m or 1.0))
        yield (
            Grade.NOT_GOOD,
            f"scale: the first two spots came out {abs(off_mm):.1f} mm too {'far apart' if off_mm > 0 else 'close'}, "
            f"at most {scale_tolerance_mm(room):.1f} mm: the marker's sides in the config are {abs(percent):.1f} % too "
            f"{'long' if off_mm > 0 else 'short'}, or --apart_mm is wrong",
        )


def _of_board(lying: Lying | None) -> Iterator[tuple[Grade, str]]:
    if lying is None:
        return
    yield (
        _grade(lying.rms_px, GOOD_PX, USABLE_PX),
        f"the board's corners miss by {lying.rms_px:.2f} px, good is {GOOD_PX:g} px: it moved, is not flat, or "
        "--corners are not its own",
    )
    if lying.larger is None:
        yield Grade.USABLE, "scale unchecked: one camera alone saw the board; lay it where two see it"
    elif abs(lying.larger) > SURE * lying.larger_sigma:
        large, long = ("large", "long") if lying.larger > 0.0 else ("small", "short")
        yield (
            Grade.NOT_GOOD,
            f"scale: the board came out {abs(100 * lying.larger):.2f} % too {large}, at most "
            f"{100 * SURE * lying.larger_sigma:.2f} %: the marker's sides in the config are as much too {long}, or "
            "--square_mm is wrong: measure both",
        )


def _of_points(room: Room) -> Iterator[tuple[Grade, str]]:
    volume = room.volume
    if not volume.cells:
        yield (
            Grade.NOT_GOOD,
            "two cameras see no part of [room] volume_mm: the room's origin is elsewhere; correct --origin_mm, where "
            "the marker is on the first spot, or the volume",
        )
        return
    yield (
        _grade(volume.worst_point_mm, GOOD_POINT_MM, USABLE_POINT_MM),
        f"points in the volume are uncertain by up to {volume.worst_point_mm:.1f} mm, good is "
        f"{GOOD_POINT_MM:.0f} mm: wave the marker longer and in more of the volume, tilted to all sides",
    )
    yield (
        _grade(-volume.visited, -GOOD_VISITED, -USABLE_VISITED),
        f"too little of the volume: the marker was in {100 * volume.visited:.0f} % of what two cameras see of it, "
        f"good is {100 * GOOD_VISITED:.0f} %: wave it through all of it",
    )


def _of_held_out(room: Room) -> Iterator[tuple[Grade, str]]:
    held_out = room.held_out
    if not held_out.instants:
        yield Grade.NOT_GOOD, "nothing could be held out to judge by: wave the marker for 30 s or longer"
        return
    yield (
        _grade(held_out.worst_spacing_mm, GOOD_SPACING_MM, USABLE_SPACING_MM),
        f"distances of balls err by up to {held_out.worst_spacing_mm:.1f} mm, good is {GOOD_SPACING_MM:.0f} mm: "
        "check lenses (calibrate intrinsics), light and focus, and that no camera moved",
    )
    px = max(held_out.reprojection_px, held_out.epipolar_px)
    yield (
        _grade(px, GOOD_PX, USABLE_PX),
        f"the cameras contradict each other by {px:.2f} px, good is {GOOD_PX:g} px: another lens or resolution "
        "than calibrated, a camera that moved, or cameras in another order than the config's",
    )
    if held_out.wild > WILD_SHARE:
        yield (
            Grade.USABLE,
            f"at {100 * held_out.wild:.0f} % of the instants held out something else was taken for a ball: cover what "
            "has their colours, `posebridge colours` shows it",
        )


def _of_clocks(room: Room) -> Iterator[tuple[Grade, str]]:
    for c, camera in enumerate(room.cameras):
        yield (
            _grade(room.clock_ms(c), GOOD_CLOCK_MS, USABLE_CLOCK_MS),
            f"{camera.name}: its clock is known to {room.clock_ms(c):.1f} ms, good is {GOOD_CLOCK_MS:g} ms: wave "
            "the marker faster where it sees it",
        )


def _of_footage(room: Room) -> Iterator[tuple[Grade, str]]:
    for camera, seen_s in zip(room.cameras, room.seen_s, strict=True):
        yield (
            _grade(-seen_s, -GOOD_SEEN_S, -USABLE_SEEN_S),
            f"{camera.name}: saw the marker together with another camera for {seen_s:.1f} s, good is "
            f"{GOOD_SEEN_S:.0f} s: wave it longer where two see it",
        )


def _of_side(side: Side) -> Iterator[tuple[Grade, str]]:
    if abs(side.off_mm) > max(SIDE_MM, SURE * side.sigma_mm):
        yield (
            Grade.NOT_GOOD,
            f"marker: {' to '.join(side.names)} is {side.found_mm:.1f} +- {side.sigma_mm:.1f} mm, the config's "
            f"[[marker.balls]] say {side.said_mm:.1f} mm: measure it, correct position_mm, and run this again",
        )


def _of_sizes(sizes: tuple[Size, ...]) -> Iterator[tuple[Grade, str]]:
    """Doubt the radius of all balls, or else of single ones: it moves no centre, but such balls are found less well."""
    every = together(sizes)
    alike = all(abs(size.off_mm - every.off_mm) <= SURE * size.sigma_mm for size in sizes)
    for size in (every,) if alike else sizes:
        if _is_off(size):
            yield (
                Grade.USABLE,
                f"ball radius: {', '.join(size.names)} measured {size.found_mm:.2f} +- {size.sigma_mm:.2f} mm, config "
                f"says {size.said_mm:.2f} mm: measure across with a caliper, correct radius_mm in [[marker.balls]]",
            )


def _is_off(size: Size) -> bool:
    return abs(size.off_mm) > SURE * size.sigma_mm


def _notes(room: Room) -> Iterator[str]:
    if room.lying is not None:
        yield "the floor under the board is taken for level"
    elif room.floor is None:
        yield "tilt, heading and origin are those of the config's cameras; --frame spots or board measures them"
    else:
        yield (
            f"the three spots are taken for level; on them the marker leans {room.floor.lean_deg:.1f} deg, which a "
            "flight will show as roll and pitch"
        )


def _grade(value: float, good: float, usable: float) -> Grade:
    """Grade a figure of which less is better."""
    if not value <= usable:
        return Grade.NOT_GOOD
    return Grade.GOOD if value <= good else Grade.USABLE
