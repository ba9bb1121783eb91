"""What every source of frames looks like to the tracker's loop."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Protocol, Self

from tracker.camera import Camera
from tracker.types import Event

Stopwatch = Callable[[], int]
"""Read a clock that only measures durations [ns]."""

Monotonic = Callable[[], int]
"""Read the host's monotonic clock, the time base of live frames [ns]."""


class Source(Protocol):
    """Give frames of two to eight cameras, merged in the order they are to be worked on.

    A source is iterated once. Trouble with one frame is a `Rejected` among the events; only what the operator must
    mend is an `OperatorError`. After `close` the iteration ends; closing twice does no harm.
    """

    @property
    def cameras(self) -> tuple[Camera, ...] | None:
        """Return the calibration that comes with the source, None if there is none."""

    @property
    def camera_count(self) -> int:
        """Return how many cameras the source has; `Frame.camera` is below it."""

    def __iter__(self) -> Iterator[Event]:
        """Yield the events."""

    def close(self) -> None:
        """Let go of files, devices and threads."""

    def __enter__(self) -> Self:
        """Return the source itself."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the source."""


class ClosesOnExit(ABC):
    """Make a class with `close` a context manager."""

    @abstractmethod
    def close(self) -> None:
        """Let go of what the source holds."""

    def __enter__(self) -> Self:
        """Return the source itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the source."""
        self.close()
