"""What a turn of the loop adds to the log besides its step: what came in, and how far ends, clocks and links stand."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from bridge.dialogue import DialogueState
from bridge.dialogue.timesync import TIMESYNC, SyncState
from bridge.outlet import Outlet
from bridge.wire import LinkState, Received

LOOK_NS = 500_000_000
MOST = 512
"""So many messages of one turn are logged, the newest: a flood must not fill memory while the disk is slow."""

COUNTS_NS = 1_000_000_000
"""Figures that only count are logged no oftener than this; anything else within LOOK_NS of its change."""


class Heard(NamedTuple):
    """What came in by each link, by its URI, and what has changed there.

    clocks: time sync after each exchange that changed it.  far_ends: without their clocks.
    left_out: messages that came and are not in `received`, more having come than a turn may log.
    """

    received: tuple[tuple[str, Received], ...] = ()
    clocks: tuple[tuple[str, SyncState], ...] = ()
    far_ends: tuple[tuple[str, DialogueState], ...] = ()
    links: tuple[LinkState, ...] = ()
    left_out: int = 0


NOTHING = Heard()


class Hearer:
    """Collect it, a turn at a time."""

    def __init__(self) -> None:
        self._due_ns: int | None = None
        self._clocks: dict[str, SyncState] = {}
        self._far_ends: dict[str, tuple[int, DialogueState]] = {}
        self._links: dict[str, tuple[int, LinkState]] = {}

    def take(self, outlet: Outlet, now_ns: int, *, last: bool = False) -> Heard:
        """Return what is new at stream time now_ns [ns]; last: nothing comes after this, so all is told."""
        came = outlet.received()
        due = last or self._due_ns is None or not 0 <= self._due_ns - now_ns <= LOOK_NS
        if not due and not came:
            return NOTHING
        received, left_out = came[-MOST:], max(0, len(came) - MOST)
        if not due and not any(message.message == TIMESYNC for _, message in came):
            return Heard(received, left_out=left_out)
        states = outlet.link_states()
        far_ends = {link.name: state for link, state in zip(states, outlet.far_ends(), strict=True)}
        clocks = tuple(self._new_clocks(far_ends))
        if not due:
            return Heard(received, clocks, left_out=left_out)
        self._due_ns = now_ns + LOOK_NS
        changed = tuple(self._changed(far_ends, now_ns, last))
        return Heard(received, clocks, changed, self._news(states, now_ns, last), left_out)

    def _new_clocks(self, far_ends: dict[str, DialogueState]) -> list[tuple[str, SyncState]]:
        new = [
            (link, state.sync)
            for link, state in far_ends.items()
            if state.sync is not None and state.sync != self._clocks.get(link)
        ]
        self._clocks.update(new)
        return new

    def _changed(self, far_ends: dict[str, DialogueState], now_ns: int, last: bool) -> list[tuple[str, DialogueState]]:
        changed = []
        for link, state in far_ends.items():
            bare = state if state.sync is None else replace(state, sync=None)
            at_ns, told = self._far_ends.get(link, (0, None))
            if last or (bare != told and (now_ns - at_ns >= COUNTS_NS or not _only_counts(bare, told))):
                self._far_ends[link] = now_ns, bare
                changed.append((link, bare))
        return changed

    def _news(self, states: tuple[LinkState, ...], now_ns: int, last: bool) -> tuple[LinkState, ...]:
        news = []
        for state in states:
            at_ns, told = self._links.get(state.name, (0, None))
            only_counts = told is not None and (state.up, state.reason) == (told.up, told.reason)
            if last or (state != told and (not only_counts or now_ns - at_ns >= COUNTS_NS)):
                self._links[state.name] = now_ns, state
                news.append(state)
        return tuple(news)


def _only_counts(state: DialogueState, told: DialogueState | None) -> bool:
    """Say whether nothing has changed but what only counts."""
    return told is not None and _without_counts(state) == _without_counts(told)


def _without_counts(state: DialogueState) -> DialogueState:
    return replace(state, too_old=0, too_close=0, strangers=0, unsigned=0)
