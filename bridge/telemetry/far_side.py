"""Links and far ends as a log tells of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from bridge.dialogue import DialogueState
from bridge.dialogue.timesync import SyncState
from bridge.log.turns import LoggedTurn
from bridge.wire import LinkState

_UNHEARD = DialogueState(None, False, "", None, "", "", 0, 0, 0)


class FarSide:
    """Follow them from turn to turn. Logs of older versions hold only what was sent: the links are up, no far ends."""

    def __init__(self) -> None:
        self._sent: Counter[str] = Counter()
        self._links: dict[str, LinkState] = {}
        self._far_ends: dict[str, DialogueState] = {}
        self._clocks: dict[str, SyncState] = {}

    def take(self, turn: LoggedTurn) -> None:
        """Take one turn."""
        self._sent.update(sent.link for sent in turn.sent)
        self._links |= {link.name: link for link in turn.heard.links}
        self._far_ends |= dict(turn.heard.far_ends)
        self._clocks |= dict(turn.heard.clocks)

    def links(self) -> tuple[LinkState, ...]:
        """Return the links; what they have sent is counted from the messages, which are logged sooner."""
        return tuple(self._link(name) for name in self._names())

    def far_ends(self) -> tuple[DialogueState, ...]:
        """Return the far end of each link; empty where the log tells of none."""
        if not self._far_ends:
            return ()
        return tuple(replace(self._far_ends.get(name, _UNHEARD), sync=self._clocks.get(name)) for name in self._names())

    def _names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*self._links, *self._sent)))

    def _link(self, name: str) -> LinkState:
        state, sent = self._links.get(name), self._sent[name]
        return LinkState(name, True, "", sent, 0, 0) if state is None else replace(state, sent=max(state.sent, sent))
