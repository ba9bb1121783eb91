"""Frames that are dropped, damaged, late or out of order make no pose wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest

from tests.system import flights
from tests.system.flights import FIRST_S, FRAMES, RATE_HZ, Case, during
from tools.bench.trial import Spoil
from tracker.scene import Trouble
from tracker.types import Event, Frame, Image, Reason, Rejected

FIRST = round(FIRST_S * RATE_HZ)  # pair
ONE_FRAME_S = FIRST_S + 0.5 / RATE_HZ


def dropped(events: list[Event]) -> Iterable[Event]:
    """Lose a third of all frames."""
    kept = np.random.default_rng(2).random(len(events)) > 1.0 / 3.0
    return [event for event, keep in zip(events, kept, strict=True) if keep]


def pair_dropped(events: list[Event]) -> Iterable[Event]:
    return events[: 2 * FIRST] + events[2 * FIRST + 4 :]


def undecodable(events: list[Event]) -> Iterable[Event]:
    """Let two frames of camera 0 come as bytes that are no image."""
    for k, event in enumerate(events):
        bad = isinstance(event, Frame) and k in (2 * FIRST, 2 * FIRST + 2)
        yield Rejected(Reason.UNDECODABLE, "damaged", event.t_ns, 0) if bad else event


def late(pairs: int) -> Spoil:
    """Let every tenth frame of camera 1 come some pairs late."""

    def spoil(events: list[Event]) -> Iterable[Event]:
        order = [k + (2 * pairs + 0.5 if k % 20 == 11 else 0.0) for k in range(len(events))]
        return [events[k] for k in np.argsort(order, kind="stable")]

    return spoil


def shuffled(events: list[Event]) -> Iterable[Event]:
    """Swap neighbours at random: pairs come in any order, and now and then a frame overtakes the pair before."""
    jitter = np.random.default_rng(4).uniform(0.0, 2.2, len(events))
    return [events[k] for k in np.argsort(np.arange(len(events)) + jitter)]


def another_clock(events: list[Event]) -> Iterable[Event]:
    """Let the clock of camera 1 show 50 ms more for a second."""
    for k, event in enumerate(events):
        off = isinstance(event, Frame) and event.camera == 1 and 2 * FIRST <= k < 2 * (FIRST + 15)
        yield replace(event, t_ns=event.t_ns + 50_000_000) if off else event


def stamped_ahead(events: list[Event]) -> Iterable[Event]:
    """Stamp one frame 5 s in the future."""
    for k, event in enumerate(events):
        yield replace(event, t_ns=event.t_ns + 5_000_000_000) if k == 2 * FIRST + 1 else event


def repeated(events: list[Event]) -> Iterable[Event]:
    """Let every eleventh frame show what its camera saw before, as a buffer not filled in time does."""
    return _spoiled(events, 11, lambda _, before: before.image)


def torn(events: list[Event]) -> Iterable[Event]:
    """Let the lower half of every eleventh frame show what its camera saw before."""
    return _spoiled(events, 11, lambda event, before: _halves(event.image, before.image))


def half_noise(events: list[Event]) -> Iterable[Event]:
    """Let the lower half of every ninth frame be noise, as a decoder that lost its place leaves it."""
    rng = np.random.default_rng(5)
    return _spoiled(events, 9, lambda event, _: _halves(event.image, rng.integers(0, 256, event.image.shape, np.uint8)))


def _spoiled(events: list[Event], every: int, image: Callable[[Frame, Frame], Image]) -> Iterable[Event]:
    """Give every n-th frame another image, by it and its camera's frame before."""
    frames = [event for event in events if isinstance(event, Frame)]
    for k, event in enumerate(frames):
        yield replace(event, image=image(event, frames[k - 2])) if k % every == 4 else event


def _halves(upper: Image, lower: Image) -> Image:
    middle = len(upper) // 2
    return np.concatenate((upper[:middle], lower[middle:]))


CASES = [
    Case("a third of all frames dropped", spoil=dropped, least=FRAMES // 2, last_s=FIRST_S, ends=False),
    Case("two pairs dropped", spoil=pair_dropped, least=FRAMES - 2, last_s=FIRST_S + 0.14),
    Case("two frames undecodable", spoil=undecodable, last_s=FIRST_S + 0.2),
    Case("a damaged frame", during(Trouble(broken_from=0.2), [0], last_s=ONE_FRAME_S), last_s=FIRST_S + 0.1),
    Case(
        "a damaged pair", during(Trouble(broken_from=0.4), last_s=ONE_FRAME_S), last_s=FIRST_S + 0.1, least=FRAMES - 1
    ),
    Case("a camera that damages all for a second", during(Trouble(broken_from=0.45), [1])),
    Case("frames shown twice", spoil=repeated, ends=False),
    Case("torn frames", spoil=torn, least=FRAMES - 3, ends=False),
    Case("frames half noise", spoil=half_noise, ends=False),
    Case("frames one pair late", spoil=late(1), least=FRAMES - 4),
    Case("frames three pairs late", spoil=late(3), least=FRAMES - 4),
    Case("a clock that jumps and comes back", spoil=another_clock),
    Case("a frame stamped far ahead", spoil=stamped_ahead, last_s=FIRST_S + 0.1, least=FRAMES - 1),
    Case("frames out of order", spoil=shuffled, least=FRAMES // 2, ends=False),
]
each_case = pytest.mark.parametrize("case", CASES, ids=str)


@each_case
def test_no_pose_is_wrong(case: Case) -> None:
    flights.assert_no_pose_is_wrong(case)


@each_case
def test_the_track_is_kept(case: Case) -> None:
    flights.assert_the_track_is_kept(case)


@each_case
def test_nothing_is_called_a_jump(case: Case) -> None:
    flights.assert_the_counter_tells_jumps(case)


@pytest.mark.parametrize("case", [case for case in CASES if case.ends], ids=str)
def test_accuracy_returns(case: Case) -> None:
    flights.assert_accuracy_returns(case)
