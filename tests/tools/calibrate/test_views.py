"""Which views are kept, and which pictures are of one instant."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.tools.calibrate.boards import SIZE_PX, picture_of, poses, view_of
from tools.calibrate.board import BoardKind, make_board
from tools.calibrate.find import Finder, edge_width_px
from tools.calibrate.footage import instants_of, read_images
from tools.calibrate.views import BLURRED_PX, MOST, Gathering, coverage, where_to_go
from tracker.types import Event, Frame, Silence

BOARD = make_board(BoardKind.CHARUCO, "9x6", 25.0)
SEEN = poses(BOARD, 90, 11)
MS = 1_000_000


def gathering(chosen: bool = False) -> Gathering:
    return Gathering({0: SIZE_PX, 1: SIZE_PX}, chosen)


def test_a_view_like_one_that_is_there_is_not_kept_but_a_sharper_one_takes_its_place() -> None:
    one, other = view_of(BOARD, SEEN[0], 0.0, 0), view_of(BOARD, SEEN[0], 0.1, 1)
    kept = gathering()
    assert kept.take({0: one})
    assert not kept.take({0: other})
    assert kept.of(0) == [one]
    sharper = replace(other, edge_px=1.2)
    assert not kept.take({0: sharper})
    assert kept.of(0) == [sharper]


def test_an_instant_new_to_one_camera_is_kept_for_all() -> None:
    kept = gathering()
    kept.take({0: view_of(BOARD, SEEN[0], 0.0, 0), 1: view_of(BOARD, SEEN[1], 0.0, 0)})
    assert kept.take({0: view_of(BOARD, SEEN[0], 0.0, 0), 1: view_of(BOARD, SEEN[2], 0.0, 0)})
    assert (len(kept.of(0)), len(kept.of(1))) == (2, 2)


def test_however_long_it_takes_few_views_are_held_and_they_lie_apart() -> None:
    kept = gathering()
    for k, pose in enumerate(SEEN * 2):
        kept.take({0: view_of(BOARD, pose, 0.1, k)})
    assert 30 < len(kept.of(0)) <= MOST


def test_blurred_views_are_left_out_even_of_chosen_pictures() -> None:
    kept = gathering(chosen=True)
    assert not kept.take({0: replace(view_of(BOARD, SEEN[0], 0.0, 0), edge_px=BLURRED_PX + 0.1)})
    assert (kept.kept, kept.blurred, kept.shown) == ([], 1, {0: 1})


def test_motion_widens_the_edges_a_sharp_picture_does_not_have() -> None:
    finder = Finder(BOARD)
    image = picture_of(BOARD, SEEN[3], 0)
    view = finder.find(image, "sharp")
    assert view is not None
    assert view.edge_px < 3.6
    dragged = np.asarray(cv2.blur(image, (9, 1)), dtype=np.uint8)
    assert edge_width_px(dragged, view.uv_px, view.outline_px) > BLURRED_PX


def test_corners_of_a_drawn_board_are_found_where_the_lens_puts_them() -> None:
    finder, off_px = Finder(BOARD), []
    for k, pose in enumerate(SEEN[:8]):
        view = finder.find(picture_of(BOARD, pose, k), "drawn")
        assert view is not None
        assert len(view.ids) >= 40
        off_px.append(view.uv_px - view_of(BOARD, pose, 0.0, k).uv_px[view.ids])
    assert np.sqrt(np.mean(np.vstack(off_px) ** 2)) < 0.25
    assert np.abs(np.vstack(off_px).mean(axis=0)).max() < 0.05  # pixel centres lie at integers


def test_a_board_half_outside_is_used_with_the_corners_that_are_seen() -> None:
    image = picture_of(BOARD, SEEN[5], 0)
    view = Finder(BOARD).find(image, "whole")
    assert view is not None
    middle = int(view.uv_px[:, 0].mean())
    half = Finder(BOARD).find(np.ascontiguousarray(image[:, :middle]), "half")
    assert half is not None
    assert 8 <= len(half.ids) < len(view.ids)
    np.testing.assert_allclose(half.outline_px, view.outline_px, atol=12.0)


def test_the_operator_is_sent_where_no_corner_was() -> None:
    counts = np.ones((6, 8))
    counts[:2, :2] = 0
    assert where_to_go(counts) == "top left"
    assert coverage([], SIZE_PX).sum() == 0


def test_frames_of_one_instant_go_together_and_instants_lie_apart() -> None:
    image = np.zeros((4, 4, 3), np.uint8)
    times = [(0, 0), (1, 5), (0, 33), (1, 38), (0, 210), (0, 243), (0, 450), (1, 455)]
    events: list[Event] = [Frame(camera, ms * MS, image) for camera, ms in times]
    found = [{camera: p.t_ns // MS for camera, p in instant.items()} for instant in instants_of(events, 2)]
    assert found == [{0: 0, 1: 5}, {0: 210}, {0: 450, 1: 455}]


def test_a_camera_that_gives_nothing_is_not_waited_for_forever() -> None:
    events = [Silence(k * 1000 * MS) for k in range(100)]
    asked = iter(events)
    assert list(instants_of(asked, 1)) == []
    assert next(asked).t_ns > 0


@pytest.mark.parametrize("names", [("left{}.png", "right{}.png"), ("a-{}-x.png", "b_{}.png")])
def test_image_files_are_of_one_instant_by_the_number_in_their_names(names: tuple[str, str], tmp_path: Path) -> None:
    for name, numbers in zip(names, ((1, 2, 10), (2, 10, 11)), strict=True):
        for number in numbers:
            cv2.imwrite(str(tmp_path / name.format(number)), np.zeros((40, 40), np.uint8))
    globs = [name.format("*") for name in names]
    footage = read_images(f"{tmp_path}/{globs[0]},{tmp_path}/{globs[1]}")
    assert [sorted(instant) for instant in footage.instants] == [[0], [0, 1], [0, 1], [1]]
