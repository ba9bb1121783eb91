"""The cadence of each camera's stamps, and where it breaks.

A clock offset that was learned, or known since one trigger makes all cameras see at once, holds as long as the stamps
go on evenly. A camera whose stamps leap by 50 ms has had its clock set, or its driver queued: from then on nobody
knows its offset, and the motion must tell it anew.
"""

from __future__ import annotations

from collections.abc import Sequence

from tracker.types import Frame

TOGETHER_NS = 50_000  # stamps this close come from one trigger, however uneven
EVEN_NS = 500_000  # a beat: a stamp that lies no further off keeps time, as a good driver's does
MOST_NS = 100_000_000  # of a jump that the motion can still tell
SHORTER = 0.75  # of the usual interval; twice in a row, it was no usual one
FADING = 0.1  # share of the newest interval in what is usual


class Cadence:
    """Each camera's last stamp and usual interval."""

    def __init__(self, cameras: int) -> None:
        self._last_ns: list[int | None] = [None] * cameras
        self._usual_ns = [0.0] * cameras
        self._short = [False] * cameras

    def breaks(self, frames: Sequence[Frame]) -> dict[int, float]:
        """Take a round and return by camera how far its clock may have jumped [s]; none did that shares its stamp."""
        found = {}
        for frame in frames:
            jump_ns = self._jump(frame)
            if jump_ns > 0.0 and not _shared(frame, frames):
                found[frame.camera] = min(jump_ns, MOST_NS) * 1e-9
        return found

    def _jump(self, frame: Frame) -> float:
        """Return how far the camera's clock may have jumped before a frame [ns], 0 when its stamp keeps time."""
        last_ns, usual_ns = self._last_ns[frame.camera], self._usual_ns[frame.camera]
        if last_ns is not None and frame.t_ns <= last_ns:
            return 0.0  # late, not of another clock
        self._last_ns[frame.camera] = frame.t_ns
        if last_ns is None:
            return 0.0
        interval_ns = float(frame.t_ns - last_ns)
        short = interval_ns < SHORTER * usual_ns
        again, self._short[frame.camera] = short and self._short[frame.camera], short
        if usual_ns <= 0.0 or again:  # the first intervals may have had gaps
            self._usual_ns[frame.camera] = interval_ns
            return 0.0
        beats = max(1, round(interval_ns / usual_ns))
        off_ns = interval_ns - beats * usual_ns
        if abs(off_ns) > EVEN_NS * beats:
            return abs(interval_ns - usual_ns)
        self._usual_ns[frame.camera] += FADING * off_ns / beats
        return 0.0


def _shared(frame: Frame, frames: Sequence[Frame]) -> bool:
    """Say whether another camera of a round shares a frame's stamp."""
    others = [other for other in frames if other.camera != frame.camera]
    return any(abs(other.t_ns - frame.t_ns) <= TOGETHER_NS for other in others)
