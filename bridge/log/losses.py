"""What could not be read of a log."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Loss:
    """One kind of damage.

    reason: what is wrong.  count: how often.  size_bytes: altogether.  offset: where in the file it starts.
    """

    reason: str
    count: int
    size_bytes: int
    offset: int

    def __str__(self) -> str:
        times = "" if self.count == 1 else f", {self.count} times"
        return f"{self.reason} at byte {self.offset}{times} ({self.size_bytes} bytes lost)"


class Losses:
    """A tally by reason: its size is bounded, however damaged the file."""

    def __init__(self) -> None:
        self._by_reason: dict[str, Loss] = {}

    def add(self, reason: str, size_bytes: int, offset: int) -> None:
        """Count one more."""
        known = self._by_reason.get(reason)
        if known is None:
            self._by_reason[reason] = Loss(reason, 1, size_bytes, offset)
        else:
            self._by_reason[reason] = replace(known, count=known.count + 1, size_bytes=known.size_bytes + size_bytes)

    def all(self) -> tuple[Loss, ...]:
        """Return them in the order they were first met."""
        return tuple(self._by_reason.values())
