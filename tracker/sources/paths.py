"""Scripted paths of a simulated vehicle, all inside the paper's envelope and in sight of its cameras."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np

from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.sources.random_flight import random_flight
from tracker.sources.waving import waved_and_set_down
from tracker.types import Array

Pose = tuple[Array, Array]
"""p_BinW (3,) [m] and R_BtoW (3, 3)."""

Motion = tuple[Array, Array]
"""v_BinW (3,) [m/s] and w_BinB (3,) [rad/s]."""

PathFunction = Callable[[float], Pose]
"""Pose by the time since the start [s]."""

PROTOCOL_RATE_HZ = 15.0
DIFFERENCE_S = 1e-3
_GRAVITY = 9.81
_MAX_TILT = math.radians(20.0)
_STEP_M, _TILT_STEP, _YAW_STEP = 0.05, math.radians(5.0), math.radians(10.0)
_REPEATS = 3
WAVED, WAVED_S = "waved", 10.4  # for `posebridge calibrate room`: with the spots after it 20 s in all


class Vehicle(Protocol):
    """Something that is somewhere at every time, scripted or flown."""

    def pose_at(self, t_ns: int) -> Pose:
        """Return p_BinW (3,) [m] and R_BtoW (3, 3) at t_ns [ns].

        A vehicle that is flown simulates itself on to t_ns; it remembers at least the last second.
        """


@dataclass(frozen=True, slots=True)
class ScriptedPath:
    """A vehicle that follows a path, whatever happens. start_ns: stream time at which the path begins [ns]."""

    name: str
    path: PathFunction
    start_ns: int

    def pose_at(self, t_ns: int) -> Pose:
        """Return the pose at t_ns [ns]; before the start it waits there."""
        return self.path(max(t_ns - self.start_ns, 0) / 1e9)

    def motion_at(self, t_ns: int) -> Motion:
        """Return v_BinW (3,) [m/s] and w_BinB (3,) [rad/s] at t_ns [ns]: none before the start."""
        if t_ns <= self.start_ns:
            return np.zeros(3), np.zeros(3)
        return motion(self.path, (t_ns - self.start_ns) / 1e9)


def scripted_path(name: str, start_ns: int) -> ScriptedPath:
    """Find a path by its name: one of PATHS, random-SEED for a flight made up from a number, or `waved`: by hand.

    Raises:
        OperatorError: no path of that name.
    """
    seed = name.removeprefix("random-")
    if seed != name and seed.isdecimal():
        return ScriptedPath(name, random_flight(int(seed)), start_ns)
    if name == WAVED:
        return ScriptedPath(name, waved_and_set_down(1, WAVED_S), start_ns)
    if name not in PATHS:
        known = ", ".join((*PATHS, "random-SEED", WAVED))
        raise OperatorError(f"source sim:{name}: no path of that name; known are {known}")
    return ScriptedPath(name, PATHS[name], start_ns)


def motion(path: PathFunction, t_s: float) -> Motion:
    """Return v_BinW (3,) [m/s] and w_BinB (3,) [rad/s] of a smooth path at a time [s].

    Source: central differences over +/-h and +/-2h, whose errors of order h^2 cancel; the angle between R(t - h) and
        R(t + h) is odd in h as the distance is, so it goes the same way. What is left is about 1e-9.
    """
    (p0, R0), (p1, R1), (p2, R2), (p3, R3) = (path(t_s + k * DIFFERENCE_S) for k in (-2, -1, 1, 2))
    v_BinW = (8.0 * (p2 - p1) - (p3 - p0)) / (12.0 * DIFFERENCE_S)
    w_BinB = (8.0 * so3.log(R1.T @ R2) - so3.log(R0.T @ R3)) / (12.0 * DIFFERENCE_S)
    return v_BinW, w_BinB


def _hover(t_s: float) -> Pose:
    """Stand nearly still, with the small sway of a hovering helicopter."""
    p = np.array([0.02 * math.sin(1.1 * t_s), 0.02 * math.sin(0.83 * t_s + 1.0), 0.01 * math.sin(1.7 * t_s)])
    R = so3.from_euler(0.03 * math.sin(2.3 * t_s), 0.03 * math.sin(1.9 * t_s + 0.4), 0.1 * math.sin(0.31 * t_s))
    return p, R


def _square(t_s: float) -> Pose:
    """Fly round an upright square of 1 m in 16 s, in the plane both cameras look across; turn the nose once meanwhile.

    The plane holds the vertical and the baseline's level normal, so that all balls stay in both pictures.
    """
    side, share = divmod((t_s / 4.0) % 4.0, 1.0)
    along = share * share * (3.0 - 2.0 * share)
    corners = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
    (a, b), (c, d) = corners[int(side)], corners[(int(side) + 1) % 4]
    across, up = a + (c - a) * along, b + (d - b) * along
    p = np.array([across * math.sqrt(0.5), -across * math.sqrt(0.5), up])
    return p, so3.from_euler(0.0, 0.0, 2.0 * math.pi * t_s / 16.0)


def _figure8(t_s: float) -> Pose:
    """Fly a lying eight in 8 s, banked as its turns demand, the nose along the way."""
    w = 2.0 * math.pi / 8.0
    p = np.array([0.55 * math.sin(w * t_s), 0.25 * math.sin(2 * w * t_s), 0.15 * math.sin(w * t_s)])
    v = np.array([0.55 * w * math.cos(w * t_s), 0.5 * w * math.cos(2 * w * t_s)])
    a = np.array([-0.55 * w * w * math.sin(w * t_s), -1.0 * w * w * math.sin(2 * w * t_s)])
    heading = math.atan2(v[1], v[0])
    forwards = a[0] * math.cos(heading) + a[1] * math.sin(heading)
    leftwards = a[1] * math.cos(heading) - a[0] * math.sin(heading)
    # Tilt to the acceleration: nose down to go forward (pitch about y left), right side up to go left.
    return p, so3.from_euler(-math.atan(leftwards / _GRAVITY), math.atan(forwards / _GRAVITY), heading)


def _fast(t_s: float) -> Pose:
    """Reach the paper's limits: 1.5 m/s level, 2.5 m/s upright, 90 deg/s about the vertical, 20 deg of tilt.

    Amplitude times angular frequency is the top speed of each motion; they peak at different times.
    """
    level, upright = 0.6, 0.6
    across = level * math.sin(1.5 / level * t_s)
    p = np.array([across * math.sqrt(0.5), -across * math.sqrt(0.5), upright * math.sin(2.5 / upright * t_s)])
    tilt = _MAX_TILT * math.sin(1.5 / level * t_s)
    return p, so3.from_euler(tilt, 0.5 * tilt, math.radians(90.0) * t_s)


def _protocol(t_s: float) -> Pose:
    """Move as in the paper's section 4.2, one step a frame at 15 Hz, over and over.

    Three steps each: 50 mm along x, y, z, then 5 deg about x and y and 10 deg about z.
    """
    frame = math.floor(t_s * PROTOCOL_RATE_HZ + 0.5) % (6 * _REPEATS + 1)
    done = [min(max(frame - _REPEATS * axis, 0), _REPEATS) for axis in range(6)]
    p = np.array([-0.075, -0.075, -0.075]) + _STEP_M * np.array(done[:3])
    return p, so3.from_euler(_TILT_STEP * done[3], _TILT_STEP * done[4], _YAW_STEP * done[5])


PATHS: Mapping[str, PathFunction] = MappingProxyType(
    {"hover": _hover, "square": _square, "figure8": _figure8, "protocol": _protocol, "fast": _fast}
)
