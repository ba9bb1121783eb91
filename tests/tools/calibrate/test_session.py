"""A live camera: what the operator is told meanwhile, and how it ends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import nullcontext

import pytest

from tests.tools.calibrate.boards import picture_of, poses
from tools.calibrate.board import BoardKind, make_board
from tools.calibrate.footage import Footage, Instant, Picture
from tools.calibrate.session import IntrinsicsRequest, look
from tracker.errors import OperatorError

BOARD = make_board(BoardKind.CHARUCO, "9x6", 25.0)
REQUEST = IntrinsicsRequest("lab", "camera:0", BOARD, 5, 3.2, None, None, None, False, False)


def shown(count: int) -> Iterator[Instant]:
    """Show the board in so many places that lie apart, each twice; then the operator presses Ctrl-C."""
    middle = poses(BOARD, 1, 21, reach=0.0)[0]
    for k in range(count):
        there = middle[0], middle[1] + (0.05 * (k - count // 2), 0.0, 0.1)
        for again in (0, 1):
            yield {0: Picture(f"{k}", 2 * k + again, picture_of(BOARD, there, again))}
    raise KeyboardInterrupt


def test_a_live_camera_tells_what_it_has_and_where_to_go_and_ctrl_c_ends_it(capsys: pytest.CaptureFixture[str]) -> None:
    gathering = look(Footage(("left",), shown(5), False, True, nullcontext()), REQUEST)
    assert len(gathering.of(0)) == 5
    first, *told = capsys.readouterr().err.splitlines()
    assert "Ctrl-C ends it" in first
    assert [line.split(" views")[0] for line in told] == [f"posebridge: left {k}" for k in range(1, 6)]
    assert all("next: " in line for line in told)


def test_ctrl_c_over_files_ends_the_command_as_everywhere() -> None:
    with pytest.raises(KeyboardInterrupt):
        look(Footage(("left",), shown(2), False, False, nullcontext()), REQUEST)


def test_coefficients_and_distances_that_cannot_be_are_refused() -> None:
    with pytest.raises(OperatorError, match="--coefficients 6: must be 4, 5 or 8"):
        IntrinsicsRequest("lab", "camera:0", BOARD, 6, 3.2, None, None, None, False, False)
    with pytest.raises(OperatorError, match="--distance_m 0 m: must be"):
        IntrinsicsRequest("lab", "camera:0", BOARD, 5, 0.0, None, None, None, False, False)
