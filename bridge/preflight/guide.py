"""Lead the operator through the frame check: say what to do, and see from the poses when it is done."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from bridge.preflight.axes import PUSHES
from bridge.preflight.frame_check import Witness
from tracker.types import Array

STILL_NS = 1_000_000_000  # how long it must be held still
STILL_M, STILL_DEG = 0.02, 3.0  # spread that counts as still
PUSH_M = 0.25  # a push shorter than this is not over yet
_KEPT = 256

PROMPTS = (
    "point the nose north and hold the vehicle still, level",
    "push it forward along its nose by half a metre, then hold it still",
    "push it to its right by half a metre, then hold it still",
    "lift it by half a metre, then hold it still",
)


@dataclass(slots=True, eq=False)
class _Track:
    """The last poses of one witness: t_ns, position north-east-down [m], roll pitch yaw [rad]."""

    poses: deque[tuple[int, Array, Array]] = field(default_factory=lambda: deque(maxlen=_KEPT))

    def last(self, now_ns: int) -> tuple[Array, Array] | None:
        """Return positions (n, 3) and angles (n, 3) of the last second, None if there are none."""
        recent = [(p, a) for t_ns, p, a in self.poses if now_ns - t_ns <= STILL_NS]
        return (np.array([p for p, _ in recent]), np.array([a for _, a in recent])) if recent else None


class Guide:
    """Take the poses of bridge and autopilot, and give the next prompt, until all pushes are done."""

    def __init__(self) -> None:
        self._bridge, self._autopilot = _Track(), _Track()
        self._since_ns: int | None = None  # of the step, so that stillness is not the last step's
        self._held: list[tuple[Array, Array]] = []
        self._held_autopilot: list[tuple[Array, Array] | None] = []

    @property
    def done(self) -> bool:
        """All pushes are done."""
        return len(self._held) == len(PROMPTS)

    @property
    def prompt(self) -> str:
        """What the operator is to do now."""
        return "" if self.done else PROMPTS[len(self._held)]

    def take_autopilot(self, t_ns: int, p_N: Array, angles: Array) -> None:
        """Take the autopilot's position (3,) [m] and roll, pitch, yaw (3,) [rad], stamped as the bridge's are."""
        self._autopilot.poses.append((t_ns, p_N, angles))

    def take_bridge(self, t_ns: int, p_N: Array, angles: Array) -> None:
        """Take the bridge's position (3,) in north-east-down [m] and roll, pitch, yaw (3,) [rad] at t_ns [ns]."""
        self._bridge.poses.append((t_ns, p_N, angles))
        if self._since_ns is None:
            self._since_ns = t_ns
        if self.done or t_ns - self._since_ns < STILL_NS:
            return
        recent = self._bridge.last(t_ns)
        if recent is None or not _still(*recent):
            return
        held = _mean(*recent)
        if self._held and float(np.linalg.norm(held[0] - self._held[-1][0])) < PUSH_M:
            return
        theirs = self._autopilot.last(t_ns)
        self._held.append(held)
        self._held_autopilot.append(None if theirs is None else _mean(*theirs))
        self._since_ns = t_ns

    def witnesses(self) -> tuple[Witness, Witness | None]:
        """Return what bridge and autopilot saw, once done; None for an autopilot that was silent at any stop."""
        theirs = [held for held in self._held_autopilot if held is not None]
        return _witness(self._held), _witness(theirs) if len(theirs) == len(PROMPTS) else None


def _still(positions: Array, angles: Array) -> bool:
    if len(positions) < 5:
        return False
    turns = np.degrees(np.unwrap(angles, axis=0))
    return bool(np.ptp(positions, axis=0).max() < STILL_M and np.ptp(turns, axis=0).max() < STILL_DEG)


def _mean(positions: Array, angles: Array) -> tuple[Array, Array]:
    return np.mean(positions, axis=0), np.mean(np.unwrap(angles, axis=0), axis=0)


def _witness(held: list[tuple[Array, Array]]) -> Witness:
    stops = np.array([p for p, _ in held])
    roll, pitch, yaw = np.degrees(held[0][1])
    return Witness(np.diff(stops, axis=0)[: len(PUSHES)], float(roll), float(pitch), float(yaw))
