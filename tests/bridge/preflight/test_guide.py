"""The guided frame check's prompts, led by a vehicle carried as a person carries it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from bridge.preflight.frame_check import judge_frames
from bridge.preflight.guide import PROMPTS, Guide
from bridge.preflight.verdict import Mark
from tracker.types import Array

RATE_HZ = 15.0
STOPS = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.5, -0.5]])
LEVEL = np.zeros(3)


def carried(stops: Array, hold_s: float = 2.0, push_s: float = 1.5) -> Iterator[tuple[int, Array]]:
    """Give times [ns] and positions of a vehicle that is held at each stop and pushed smoothly to the next."""
    where = [stops[0]] * round(hold_s * RATE_HZ)
    for before, after in itertools.pairwise(stops):
        shares = np.linspace(0.0, 1.0, round(push_s * RATE_HZ))
        where += [before + (after - before) * share**2 * (3.0 - 2.0 * share) for share in shares]
        where += [after] * round(hold_s * RATE_HZ)
    random = np.random.default_rng(1)
    for k, p_N in enumerate(where):
        yield round(k * 1e9 / RATE_HZ), p_N + random.normal(0.0, 0.001, 3)


def led(stops: Array, with_autopilot: bool = True) -> tuple[Guide, list[str]]:
    """Lead a vehicle through stops; return the guide and the prompts it gave, each once."""
    guide = Guide()
    prompts = [guide.prompt]
    for t_ns, p_N in carried(stops):
        if with_autopilot:
            guide.take_autopilot(t_ns, p_N, LEVEL)
        guide.take_bridge(t_ns, p_N, LEVEL)
        if guide.prompt != prompts[-1]:
            prompts.append(guide.prompt)
    return guide, prompts


def test_each_prompt_follows_when_the_move_before_it_is_over_and_the_frames_then_pass() -> None:
    guide, prompts = led(STOPS)
    assert prompts == [*PROMPTS, ""]
    assert guide.done
    assert {line.mark for line in judge_frames(*guide.witnesses())} == {Mark.PASS}


def test_the_displacements_are_those_of_the_hand() -> None:
    guide, _ = led(STOPS)
    bridge, autopilot = guide.witnesses()
    assert autopilot is not None
    np.testing.assert_allclose(bridge.pushes, np.diff(STOPS, axis=0), atol=0.002)
    np.testing.assert_allclose(autopilot.pushes, np.diff(STOPS, axis=0), atol=0.002)


def test_a_vehicle_that_is_not_moved_is_waited_for() -> None:
    guide, prompts = led(np.zeros((4, 3)))
    assert prompts == list(PROMPTS[:2])
    assert not guide.done


def test_a_vehicle_that_never_rests_is_waited_for() -> None:
    guide = Guide()
    for k in range(600):
        guide.take_bridge(round(k * 1e9 / RATE_HZ), np.array([0.1 * np.sin(0.3 * k), 0.0, 0.0]), LEVEL)
    assert guide.prompt == PROMPTS[0]


def test_yaw_across_south_is_held_still_all_the_same() -> None:
    """At 180 deg the angle jumps between plus and minus."""
    guide = Guide()
    for k in range(60):
        yaw = np.pi - 0.001 if k % 2 else -np.pi + 0.001
        guide.take_bridge(round(k * 1e9 / RATE_HZ), np.zeros(3), np.array([0.0, 0.0, yaw]))
    assert guide.prompt == PROMPTS[1]


def test_an_autopilot_that_was_silent_at_a_stop_is_no_witness() -> None:
    guide, _ = led(STOPS, with_autopilot=False)
    assert guide.witnesses()[1] is None
