"""Stamps that go on evenly, and clocks that jump."""

from __future__ import annotations

import numpy as np
import pytest

from tracker.cadence import Cadence
from tracker.types import Frame

PERIOD_MS = 66
IMAGE = np.zeros((1, 1, 3), np.uint8)


def breaks(stamps_ms: list[tuple[float | None, float | None]]) -> list[dict[int, float]]:
    """Return what each round of two cameras gives; None where a camera gave no frame."""
    cadence = Cadence(2)
    return [
        cadence.breaks([Frame(c, round(ms * 1e6), IMAGE) for c, ms in enumerate(pair) if ms is not None])
        for pair in stamps_ms
    ]


def test_even_stamps_break_nothing_even_where_frames_are_missing() -> None:
    kept = [k for k in range(30) if k % 7 not in (3, 4)]
    assert breaks([(PERIOD_MS * k, PERIOD_MS * k + 20.0) for k in kept]) == [{}] * len(kept)


@pytest.mark.parametrize("jump_ms", [-15.0, 5.0, 50.0])
def test_a_clock_that_jumps_is_told_once_each_way_and_by_how_much(jump_ms: float) -> None:
    found = breaks([(None, PERIOD_MS * k + (jump_ms if 8 <= k < 16 else 0.0)) for k in range(24)])
    assert [k for k, each in enumerate(found) if each] == [8, 16]
    assert found[8][1] == pytest.approx(abs(jump_ms) * 1e-3)


def test_cameras_that_share_an_uneven_trigger_keep_their_clocks() -> None:
    uneven = np.cumsum(np.random.default_rng(1).uniform(20.0, 90.0, 20)).tolist()
    assert breaks([(ms, ms) for ms in uneven]) == [{}] * 20


def test_a_late_frame_is_no_clock_that_jumps() -> None:
    assert breaks([(None, 66.0 * k) for k in (0, 1, 2, 4, 3, 5, 6)]) == [{}] * 7
