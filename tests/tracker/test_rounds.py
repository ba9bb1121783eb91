"""Which frames belong together, and how long one is waited for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tracker.rounds import MEMORY, Rounds
from tracker.types import Frame, Silence

IMAGE = np.zeros((2, 2, 3), np.uint8)
PERIOD_NS = 66_666_667
WINDOW_NS = 4_000_000
MS = 1_000_000


def frame(camera: int, t_ns: int) -> Frame:
    return Frame(camera, t_ns, IMAGE)


def taken(rounds: Rounds, *events: Frame | Silence) -> list[list[tuple[int, ...]]]:
    """Return for each event the rounds it closed, as the cameras in them."""
    return [[tuple(f.camera for f in closed) for closed in rounds.take(event)] for event in events]


def pairs(count: int, cameras: Sequence[int] = (0, 1)) -> list[Frame]:
    return [frame(camera, k * PERIOD_NS) for k in range(count) for camera in cameras]


def test_a_triggered_pair_is_a_round_as_soon_as_its_second_frame_is_there() -> None:
    assert taken(Rounds(2, WINDOW_NS), *pairs(3)) == [[], [(0, 1)]] * 3


def test_the_order_of_arrival_and_a_jitter_within_the_window_do_not_matter() -> None:
    rounds = Rounds(2, WINDOW_NS)
    first = rounds.take(frame(1, WINDOW_NS))
    second = rounds.take(frame(0, 0))
    assert first == []
    assert [[(f.camera, f.t_ns) for f in closed] for closed in second] == [[(0, 0), (1, WINDOW_NS)]]


def test_frames_just_outside_the_window_are_two_instants() -> None:
    rounds = Rounds(2, WINDOW_NS)
    assert taken(rounds, frame(0, 0), frame(1, WINDOW_NS + 1)) == [[], [(0,)]]


def test_free_running_cameras_are_soon_rounds_of_their_own_at_once() -> None:
    """Half a frame apart: after MEMORY frames no camera waits for the other."""
    events = [frame(k % 2, k * PERIOD_NS // 2) for k in range(20)]
    closed = taken(Rounds(2, WINDOW_NS), *events)
    assert sum(len(rounds) for rounds in closed) == 20
    assert all(len(cameras) == 1 for rounds in closed for cameras in rounds)
    settled = closed[2 * MEMORY + 1 :]
    assert settled == [[(k % 2,)] for k in range(2 * MEMORY + 1, 20)]


def test_no_frame_is_lost_or_given_twice_whatever_the_order() -> None:
    rng = np.random.default_rng(3)
    events = [frame(int(rng.integers(3)), int(t)) for t in np.cumsum(rng.integers(0, 8 * MS, 300))]
    rounds = Rounds(3, WINDOW_NS)
    out = [f for event in events for closed in rounds.take(event) for f in closed]
    out += [f for closed in rounds.rest() for f in closed]
    assert sorted(map(id, out)) == sorted(map(id, events))
    assert rounds.rest() == []


def test_a_camera_that_drops_one_frame_is_waited_for_until_the_next_instant() -> None:
    rounds = Rounds(2, WINDOW_NS)
    taken(rounds, *pairs(4))
    dropped = taken(rounds, frame(0, 4 * PERIOD_NS), frame(0, 5 * PERIOD_NS), frame(1, 5 * PERIOD_NS))
    assert dropped == [[], [(0,)], [(0, 1)]]


def test_a_camera_gone_blind_is_waited_for_no_more_than_memory_times_and_found_again() -> None:
    rounds = Rounds(2, WINDOW_NS)
    taken(rounds, *pairs(4))
    alone = taken(rounds, *(frame(0, (4 + k) * PERIOD_NS) for k in range(2 * MEMORY)))
    assert alone[: MEMORY + 1] == [[]] + [[(0,)]] * (MEMORY - 1) + [[(0,), (0,)]]
    assert alone[MEMORY + 1 :] == [[(0,)]] * (MEMORY - 1)
    back = [frame(c, (20 + k) * PERIOD_NS) for k in range(2 * MEMORY) for c in (0, 1)]
    after = taken(rounds, *back)
    assert after[:2] == [[(0,)], [(1,)]]
    assert after[-4:] == [[], [(0, 1)]] * 2


def test_silence_closes_what_is_open() -> None:
    rounds = Rounds(2, WINDOW_NS)
    assert taken(rounds, frame(0, 0), Silence(50 * MS), Silence(100 * MS)) == [[], [(0,)], []]


def test_a_straggler_is_a_round_of_its_own_and_not_waited_with() -> None:
    """Its companions were there already: it must not wait for their next frames."""
    rounds = Rounds(2, WINDOW_NS)
    taken(rounds, *pairs(4))
    late = taken(rounds, frame(0, 4 * PERIOD_NS), Silence(4 * PERIOD_NS + 50 * MS), frame(1, 4 * PERIOD_NS))
    assert late == [[], [(0,)], [(1,)]]
    assert taken(rounds, frame(0, 5 * PERIOD_NS), frame(1, 5 * PERIOD_NS)) == [[], [(0, 1)]]


def test_a_frame_much_older_than_the_open_round_closes_it() -> None:
    rounds = Rounds(2, WINDOW_NS)
    taken(rounds, *pairs(4))
    assert taken(rounds, frame(0, 4 * PERIOD_NS), frame(1, 2 * PERIOD_NS)) == [[], [(0,)]]
    assert [[f.camera for f in closed] for closed in rounds.rest()] == [[1]]


def test_the_same_camera_twice_in_one_window_is_two_rounds() -> None:
    assert taken(Rounds(2, WINDOW_NS), frame(0, 0), frame(0, 1)) == [[], [(0,)]]


def test_three_triggered_cameras_are_one_round() -> None:
    assert taken(Rounds(3, WINDOW_NS), *pairs(2, (2, 0, 1))) == [[], [], [(0, 1, 2)]] * 2


def test_two_triggered_cameras_do_not_wait_for_a_third_that_runs_free() -> None:
    rounds = Rounds(3, WINDOW_NS)
    events = [
        f
        for k in range(10)
        for f in (frame(0, k * PERIOD_NS), frame(1, k * PERIOD_NS), frame(2, k * PERIOD_NS + PERIOD_NS // 2))
    ]
    assert taken(rounds, *events)[-6:] == [[], [(0, 1)], [(2,)]] * 2


def test_the_frames_at_the_end_are_given_when_asked_for() -> None:
    rounds = Rounds(2, WINDOW_NS)
    rounds.take(frame(1, 5))
    assert [[f.t_ns for f in closed] for closed in rounds.rest()] == [[5]]
