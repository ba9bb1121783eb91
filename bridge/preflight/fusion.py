"""Does the autopilot use the poses? Its own position against ours, and what its filter says of itself."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bridge.dialogue.peer import Autopilot
from bridge.dialogue.timesync import SyncState
from bridge.preflight.axes import wrapped_deg
from bridge.preflight.clockwork import our_times
from bridge.preflight.hearing import Hearing
from bridge.preflight.poses import Pose
from bridge.preflight.requests import ATTITUDE, POSITION, STATUS
from bridge.preflight.verdict import Line, Mark
from tracker.types import Array

MOST_LEVEL_M, MOST_HEIGHT_M, MOST_YAW_DEG = 0.10, 0.15, 5.0
GOOD_RATIO, MOST_RATIO = 0.5, 0.8  # ArduPilot's failsafe acts at FS_EKF_THRESH, 0.8; at 1 a measurement is refused
BRACKET_NS = 250_000_000
LEAST_REPORTS = 5
ATTITUDE_FLAG, CONSTANT_POSITION, AIDED, UNINITIALISED = 0x1, 0x80, 0x100, 0x400
# AIDED of PX4: something holds its level position now; the other flags stay for seconds after that has ended.
_NEEDED: dict[Autopilot, int] = {Autopilot.ARDUPILOT: 0x1 | 0x6 | 0x8 | 0x20, Autopilot.PX4: 0x1 | 0x6 | 0x8 | AIDED}
_FLAGS = (
    (0x1, "attitude"),
    (0x2, "level velocity"),
    (0x4, "climb"),
    (0x8, "level position"),
    (0x20, "height"),
    (AIDED, "aid by poses"),
)
_RATIOS = {
    Autopilot.ARDUPILOT: ("velocity_variance", "pos_horiz_variance", "pos_vert_variance", "compass_variance"),
    Autopilot.PX4: ("vel_ratio", "pos_horiz_ratio", "pos_vert_ratio", "mag_ratio"),
}
_RATIO_NAMES = ("v", "xy", "z", "yaw")
_LEVEL = _RATIO_NAMES.index("xy")


@dataclass(frozen=True, slots=True)
class Difference:
    """The autopilot's own pose less ours, medians. level_m, height_m: sizes; moved_m: how far the vehicle went."""

    level_m: float
    height_m: float
    yaw_deg: float
    moved_m: float


def fusion_lines(
    hearing: Hearing, poses: Sequence[Pose], sync: SyncState | None, autopilot: Autopilot, since_ns: int
) -> Iterator[Line]:
    """Yield the lines on fusion, of what was heard from an instant on [ns]."""
    yield from _difference_lines(hearing, poses, sync, since_ns)
    if autopilot in STATUS:
        yield from _filter_lines(hearing, autopilot, since_ns)


def difference(hearing: Hearing, poses: Sequence[Pose], sync: SyncState | None, since_ns: int) -> Difference | None:
    """Compare positions and yaws, each at its own instant; None where there is too little of either."""
    positions, attitudes = hearing.since(POSITION, since_ns), hearing.since(ATTITUDE, since_ns)
    ours_p, ours_a = (_ours_at(our_times(each, sync), poses) for each in (positions, attitudes))
    if min(sum(pose is not None for pose in ours) for ours in (ours_p, ours_a)) < LEAST_REPORTS:
        return None
    apart = np.array(
        [
            [message.number(axis) for axis in ("x", "y", "z")] - pose[:3]
            for message, pose in zip(positions, ours_p, strict=True)
            if pose is not None
        ]
    )
    turned = [
        wrapped_deg(math.degrees(message.number("yaw") - pose[3]))
        for message, pose in zip(attitudes, ours_a, strict=True)
        if pose is not None
    ]
    went = np.ptp(np.array([pose.p_N for pose in poses]), axis=0)
    level, height = np.hypot(apart[:, 0], apart[:, 1]), np.abs(apart[:, 2])
    return Difference(
        float(np.median(level)), float(np.median(height)), float(np.median(turned)), float(np.linalg.norm(went))
    )


def _ours_at(times_ns: Sequence[int], poses: Sequence[Pose]) -> list[Array | None]:
    """Return north, east, down [m] and yaw [rad] at each instant, None where no two poses stand close about it."""
    found: list[Array | None] = []
    stamps = [pose.t_ns for pose in poses]
    for t_ns in times_ns:
        after = int(np.searchsorted(stamps, t_ns))
        if not 0 < after < len(poses) or stamps[after] - stamps[after - 1] > BRACKET_NS:
            found.append(None)
            continue
        one, other = poses[after - 1], poses[after]
        share = (t_ns - one.t_ns) / (other.t_ns - one.t_ns)
        turn = math.remainder(float(other.euler[2] - one.euler[2]), 2.0 * math.pi)
        p_N = one.p_N + share * (other.p_N - one.p_N)
        found.append(np.array([*p_N, one.euler[2] + share * turn]))
    return found


def _difference_lines(hearing: Hearing, poses: Sequence[Pose], sync: SyncState | None, since_ns: int) -> Iterator[Line]:
    needed = f"ours, within {1e3 * MOST_LEVEL_M:.0f} mm level, {1e3 * MOST_HEIGHT_M:.0f} mm in height"
    if not poses:
        fix = "no poses to compare with: see the lines on poses"
        yield Line(Mark.UNKNOWN, "its position", "no poses", needed, fix)
        return
    if not hearing.since(POSITION, since_ns):
        fix = "its filter has no position: see the lines on parameters and origin, and what it says"
        yield Line(Mark.FAIL, "its position", f"it sends no {POSITION}", needed, fix)
        return
    apart = difference(hearing, poses, sync, since_ns)
    if apart is None:
        fix = "poses or its messages came with too many gaps: see the lines on poses, then check again"
        yield Line(Mark.UNKNOWN, "its position", "too few to compare", needed, fix)
        return
    moved = "at rest" if apart.moved_m < 0.05 else f"moved {apart.moved_m:.1f} m"
    found = f"{1e3 * apart.level_m:.0f} mm level, {1e3 * apart.height_m:.0f} mm in height, {moved}"
    if apart.level_m > MOST_LEVEL_M:
        fix = "it does not use the poses, or turns them: see the parameters above, then run --frame"
        yield Line(Mark.FAIL, "its position", found, needed, fix)
    elif apart.height_m > MOST_HEIGHT_M:
        fix = "ArduPilot: set EK3_SRC1_POSZ 6 and EK3_OGN_HGT_MASK 4, reboot; PX4: set EKF2_HGT_REF 3"
        yield Line(Mark.FAIL, "its position", found, needed, fix)
    else:
        yield Line(Mark.PASS, "its position", found, needed)
    yaw_needed = f"ours, within {MOST_YAW_DEG:g} deg"
    if abs(apart.yaw_deg) > MOST_YAW_DEG:
        fix = "another source sets its yaw: set EK3_SRC1_YAW 6, COMPASS_ENABLE 0; PX4: EKF2_EV_CTRL 15, EKF2_MAG_TYPE 5"
        yield Line(Mark.FAIL, "its yaw", f"{apart.yaw_deg:+.1f} deg", yaw_needed, fix)
    else:
        yield Line(Mark.PASS, "its yaw", f"{apart.yaw_deg:+.1f} deg", yaw_needed)


def _filter_lines(hearing: Hearing, autopilot: Autopilot, since_ns: int) -> Iterator[Line]:
    name = STATUS[autopilot]
    reports = hearing.since(name, since_ns)
    if not reports:
        fix = f"it sends no {name}: older firmware, or a link too poor for it"
        yield Line(Mark.UNKNOWN, "filter", "not told", "position, height, velocity and attitude", fix)
        return
    flags = reports[-1].whole("flags")
    lacking = [what for bit, what in _FLAGS if bit & _NEEDED[autopilot] and not flags & bit]
    needed = "attitude, velocity, position and height"
    assumed = autopilot is Autopilot.ARDUPILOT and flags & CONSTANT_POSITION  # PX4 sets that whenever it is at rest
    if autopilot is Autopilot.ARDUPILOT and flags & UNINITIALISED:
        fix = "wait until it says EKF3 active; keep it still after power-on"
        yield Line(Mark.FAIL, "filter", f"0x{flags:x}: not started", needed, fix)
    elif lacking or assumed:
        what = f"lacks {', '.join(lacking)}" if lacking else "holds position by assuming it stands"
        fix = "it uses no poses yet: see the parameters above and what it says below"
        yield Line(Mark.FAIL, "filter", f"0x{flags:x}: {what}", needed, fix)
    else:
        yield Line(Mark.PASS, "filter", f"0x{flags:x}: has them all", needed)
    yield _ratio_line([[report.number(field) for field in _RATIOS[autopilot]] for report in reports])


def _ratio_line(ratios: list[list[float]]) -> Line:
    """Judge the worst test ratios: innovations against what the filter expected of them; no number is no innovation."""
    what, needed = "innovations", f"worst below {GOOD_RATIO:g}; from {MOST_RATIO:g} on it is failing"
    table = np.array(ratios)
    worst = np.nan_to_num(table, nan=0.0).max(axis=0)
    used = np.isfinite(table).any(axis=0)
    columns = zip(_RATIO_NAMES, worst, used, strict=True)
    found = ", ".join(f"{name} {value:.2f}" if seen else f"{name} none" for name, value, seen in columns)
    if not used[_LEVEL]:
        fix = "it takes no position: see the line on the filter"
        return Line(Mark.UNKNOWN, what, found, needed, fix)
    if worst.max() < GOOD_RATIO:
        return Line(Mark.PASS, what, found, needed)
    name = _RATIO_NAMES[int(worst.argmax())]
    fix = f"{name} contradicts its gyro and accelerometer: run --wiggle for the delay and --frame for the axes"
    return Line(Mark.FAIL if worst.max() >= MOST_RATIO else Mark.WARN, what, found, needed, fix)
