"""Poses on their way out: each at once, or so many rounds late and put right by what was seen meanwhile."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType

from tracker.filter.ekf import Update
from tracker.filter.history import History
from tracker.filter.reported import reported
from tracker.filter.smooth import smoothed
from tracker.image.eyes import Eyes
from tracker.rig import Rig
from tracker.types import Array, Estimate, TrackState, read_only

HELD = "held"  # the stage in which a pose waits for later rounds


@dataclass(slots=True)
class _Waiting:
    """A pose that was found and has not left yet.

    available_ns, since_ns: stopwatch readings when its newest frame stood in memory, and when it was found [ns].
    resets: the reset counter.  stages: what each stage took [ns].
    exposure_s, doubts_px: what was known of shutters and gammas when its images were looked at, see `reported`.
    rounds: later ones that were worked off meanwhile.
    """

    t_ns: int
    available_ns: int
    since_ns: int
    track: TrackState
    resets: int
    stages: dict[str, int]
    exposure_s: float
    doubts_px: Array
    rounds: int = 0


class Departure:
    """Holds poses back for `lag_rounds` rounds and lets them go, each newer than the one before.

    stopwatch: reads a running time [ns].
    """

    def __init__(self, lag_rounds: int, stopwatch: Callable[[], int]) -> None:
        self._lag_rounds = lag_rounds
        self._stopwatch = stopwatch
        self._waiting: deque[_Waiting] = deque()
        self._newest_ns = -(2**63)

    @property
    def is_awaited(self) -> bool:
        """Say whether a pose has not left yet."""
        return bool(self._waiting)

    def is_news(self, t_ns: int) -> bool:
        """Say whether a pose of that instant may still go out: none newer has, or waits to."""
        return t_ns > self._newest_ns

    def take(
        self, t_ns: int, available_ns: int, track: TrackState, resets: int, stages: dict[str, int], eyes: Eyes
    ) -> None:
        """Let a pose of the newest instant that was found stand in line.

        eyes: what they know now tells how well its balls' centres are known; what they learn later mends none of them.
        """
        self._newest_ns = t_ns
        since_ns = self._stopwatch() if self._lag_rounds else 0
        self._waiting.append(
            _Waiting(t_ns, available_ns, since_ns, track, resets, stages, eyes.exposure_s, eyes.doubts_px)
        )

    def passed(self, t_ns: int) -> None:
        """Take note that a round of that instant was worked off, whatever it showed."""
        for one in self._waiting:
            one.rounds += t_ns > one.t_ns

    def due(self, history: History, rig: Rig, moved_px: Array, *, all_of_them: bool) -> list[Estimate]:
        """Let those go whose time it is, or all; not one whose update was taken back and fitted no more.

        Args:
            history: of the track that found them.
            rig, moved_px: how the cameras that found them stand, see `reported`.
        """
        leaving = []
        while self._waiting and (all_of_them or self._waiting[0].rounds >= self._lag_rounds):
            one = self._waiting.popleft()
            if updates := history.since(one.t_ns):
                leaving.append(self._estimate(one, updates, rig, moved_px))
        return leaving

    def _estimate(self, one: _Waiting, updates: list[Update], rig: Rig, moved_px: Array) -> Estimate:
        state, found = smoothed(updates), updates[0]
        covariance, sigmas_s = reported(state, found.spread, rig, one.exposure_s, one.doubts_px, moved_px)
        mean, stages = read_only(state.mean), one.stages
        if self._lag_rounds:
            stages = {**stages, HELD: self._stopwatch() - one.since_ns}
        return Estimate(
            t_ns=state.t_ns,
            p_BinW=mean[:3],
            R_BtoW=mean[3:12].reshape(3, 3),
            v_BinW=mean[12:15],
            w_BinB=mean[15:18],
            covariance=covariance,
            clock_offsets_s=mean[30:],
            clock_sigmas_s=sigmas_s,
            state=one.track,
            reset_counter=one.resets,
            nis=found.nis,
            nis_dof=found.dof,
            available_ns=one.available_ns,
            stages_ns=MappingProxyType(stages),
        )
