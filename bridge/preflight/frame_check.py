"""Judge the guided frame check: nose to north, push forward, push right, lift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bridge.preflight.axes import PUSHES, Axes, axes_of, wrapped_deg
from bridge.preflight.verdict import Line, Mark
from tracker.types import Array

LEAST_PUSH_M = 0.15
MOST_SKEW_DEG = 25.0  # of a push by hand
MOST_NORTH_DEG = 30.0  # of a nose pointed by hand and a pocket compass
GOOD_YAW_DEG, MOST_YAW_DEG = 10.0, 15.0  # yaw against motion: 10 deg flew well, 20 deg circled
MOST_TILT_DEG = 8.0
MOST_SCALE = 0.15  # the autopilot's way over ours, less one
FOLLOWS = 0.3  # of our way; less is an autopilot that does not use the poses
MOST_TWIST_DEG = 15.0  # between our way and the autopilot's


@dataclass(frozen=True, slots=True, eq=False)
class Witness:
    """What one estimate said of the moves, the bridge's or the autopilot's.

    pushes: (3, 3), a row for forward, right, lift: displacement in north-east-down [m].
    roll_deg, pitch_deg, yaw_deg: forward-right-down, held still with the nose to north before the pushes [deg].
    """

    pushes: Array
    roll_deg: float
    pitch_deg: float
    yaw_deg: float


def judge_frames(bridge: Witness, autopilot: Witness | None) -> tuple[Line, ...]:
    """Return the frame check's lines.

    Args:
        autopilot: None where it sent no LOCAL_POSITION_NED or ATTITUDE.
    """
    short = [name for name, push in zip(PUSHES, bridge.pushes, strict=True) if np.linalg.norm(push) < LEAST_PUSH_M]
    if short:
        found = f"{', '.join(short)}: too short to tell"
        return (Line(Mark.FAIL, "frame: pushes", found, f"{LEAST_PUSH_M:g} m each", "repeat the frame check"),)
    axes = axes_of(bridge.pushes)
    lines = [_axes_line(axes)]
    if axes.upright and not axes.mirrored:
        lines += [_north_line(axes), _yaw_line(axes, bridge), _level_line(bridge, autopilot)]
    return (*lines, *_autopilot_lines(bridge, autopilot))


def _axes_line(axes: Axes) -> Line:
    what, needed = "frame: axes", "right-handed, z up"
    if axes.mirrored:
        return Line(Mark.FAIL, what, f"mirrored: {axes.outcomes()}", needed, _mirror_fix(axes))
    if not axes.upright:
        fix = "the room's axes are not the calibration's: turn every camera's T_BS (T_CtoW) so that z points up"
        return Line(Mark.FAIL, what, axes.outcomes(), needed, fix)
    if axes.skew_deg > MOST_SKEW_DEG:
        found = f"a push went {axes.skew_deg:.0f} deg astray"
        return Line(
            Mark.FAIL, what, found, f"within {MOST_SKEW_DEG:g} deg", "repeat it, pushing straight; else z is not up"
        )
    return Line(Mark.PASS, what, f"right-handed, z up, pushes within {axes.skew_deg:.0f} deg", needed)


def _mirror_fix(axes: Axes) -> str:
    """Name the likeliest of the mistakes that mirror a room."""
    if not axes.upright and abs(axes.P[2, 2]) > 0.5:
        return "z is upside down: negate z in the calibration's room points and calibrate anew, then check again"
    if abs(axes.P[0, 1]) > 0.5 and abs(axes.P[1, 0]) > 0.5:
        return "x and y of the room are swapped: the y axis must lie 90 deg to the left of x seen from above"
    return "one level axis of the room has the wrong sign, or two cameras are swapped: y must lie to the left of x"


def _north_line(axes: Axes) -> Line:
    what, needed = "frame: north", f"pushes lead where they should, within {MOST_NORTH_DEG:g} deg"
    turn = _rounded(axes.heading_deg)
    if abs(axes.heading_deg) <= MOST_NORTH_DEG:
        return Line(Mark.PASS, what, f"north within {abs(axes.heading_deg):.0f} deg", needed)
    size = "large" if turn > 0 else "small"
    fix = f"your room_yaw_deg is {abs(turn):.0f} too {size}: {'lower' if turn > 0 else 'raise'} it by {abs(turn):.0f}"
    return Line(Mark.FAIL, what, f"forward came out {axes.heading_deg:+.0f} deg from north", needed, fix)


def _yaw_line(axes: Axes, bridge: Witness) -> Line:
    """Compare the yaw with the way the nose was pushed: what flew an autopilot away without a failsafe."""
    what, needed = "frame: yaw against motion", f"within {GOOD_YAW_DEG:g} deg"
    error_deg = wrapped_deg(bridge.yaw_deg - axes.heading_deg)
    found = f"yaw {wrapped_deg(bridge.yaw_deg):.0f} deg, pushed to {axes.heading_deg:.0f} deg"
    if abs(error_deg) <= GOOD_YAW_DEG:
        return Line(Mark.PASS, what, f"{error_deg:+.0f} deg apart", needed)
    turn = _rounded(error_deg)
    fix = (
        f"the marker's x axis points {abs(turn):.0f} deg to the {'right' if turn > 0 else 'left'} of the nose: turn "
        f"position_mm of all balls by {-turn:+.0f} deg about z (counter-clockwise seen from above)"
    )
    if abs(error_deg) <= MOST_YAW_DEG:
        return Line(Mark.WARN, what, found, needed, f"repeat the push along the nose; if it stays: {fix}")
    return Line(Mark.FAIL, what, f"{error_deg:+.0f} deg apart ({found})", needed, fix)


def _level_line(bridge: Witness, autopilot: Witness | None) -> Line:
    what, needed = "frame: level", f"within {MOST_TILT_DEG:g} deg"
    roll, pitch = (autopilot.roll_deg, autopilot.pitch_deg) if autopilot is not None else (0.0, 0.0)
    apart = max(abs(wrapped_deg(bridge.roll_deg - roll)), abs(wrapped_deg(bridge.pitch_deg - pitch)))
    found = f"roll {bridge.roll_deg:+.0f}, pitch {bridge.pitch_deg:+.0f} deg"
    if autopilot is not None:
        found += f"; autopilot {roll:+.0f}, {pitch:+.0f} deg"
    if apart <= MOST_TILT_DEG:
        return Line(Mark.PASS, what, found, needed)
    fix = (
        "the balls' plane in [marker] is not the vehicle's: correct z of position_mm; an upside-down marker is 180 deg"
    )
    return Line(Mark.FAIL, what, found, needed, fix)


def _autopilot_lines(bridge: Witness, autopilot: Witness | None) -> tuple[Line, ...]:
    """Compare the autopilot's moves with the bridge's."""
    what = "frame: autopilot follows"
    needed = f"same way, length within {100 * MOST_SCALE:.0f} %"
    if autopilot is None:
        fix = "it sends no LOCAL_POSITION_NED or ATTITUDE: see the lines on origin and fusion"
        return (Line(Mark.FAIL, what, "no position from it", needed, fix),)
    ours, theirs = (np.linalg.norm(each.pushes, axis=1) for each in (bridge, autopilot))
    ratio = float(np.sum(theirs) / np.sum(ours))
    if ratio < FOLLOWS:
        fix = "it does not use the poses: see the lines on parameters and fusion"
        return (Line(Mark.FAIL, what, f"it moved {100 * ratio:.0f} % of the way", needed, fix),)
    cosines = np.sum(bridge.pushes * autopilot.pushes, axis=1) / np.maximum(ours * theirs, 1e-9)
    twist_deg = float(np.degrees(np.arccos(np.clip(cosines.min(), -1.0, 1.0))))
    yaw_deg = wrapped_deg(autopilot.yaw_deg - bridge.yaw_deg)
    found = f"{twist_deg:.0f} deg off the way, {100 * (ratio - 1):+.0f} % of its length, yaw {yaw_deg:+.0f} deg"
    if twist_deg > MOST_TWIST_DEG or abs(yaw_deg) > MOST_YAW_DEG:
        fix = "it turns what it gets, or another source wins: set VISO_ORIENT 0, EK3_SRC1_YAW 6, COMPASS_ENABLE 0"
        return (Line(Mark.FAIL, what, found, needed, fix),)
    if abs(ratio - 1.0) > MOST_SCALE:
        return (Line(Mark.FAIL, what, found, needed, "set VISO_SCALE 1; measure the marker's position_mm again"),)
    return (Line(Mark.PASS, what, found, needed),)


def _rounded(turn_deg: float) -> float:
    """Return a turn by hand as what was meant: quarter turns when near, else whole degrees [deg]."""
    quarter = 90.0 * round(turn_deg / 90.0)
    return quarter if quarter and abs(turn_deg - quarter) <= 15.0 else float(round(turn_deg))
