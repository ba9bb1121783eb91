"""Outlets and flights for the tests of what leaves and what arrives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import perf_counter_ns

import numpy as np

from bridge.clock import Nanoseconds
from bridge.dialogue import Terms
from bridge.outlet import Outlet, open_outlet
from bridge.pack import MESSAGES
from tests.bridge.estimates import estimate, random_covariance, step
from tracker.maths import so3
from tracker.types import Step

VISION, MOCAP, SPEED, ODOMETRY = MESSAGES
NO_LIMIT_NS = 10**18
PERIOD_NS = 33_333_333
NOTHING = step()


def terms(messages: tuple[str, ...]) -> Terms:
    return Terms(messages=messages, vehicle_id=7, max_age_ns=NO_LIMIT_NS)


def outlet_to(links: Sequence[tuple[str, tuple[str, ...]]], stopwatch: Nanoseconds = perf_counter_ns) -> Outlet:
    return open_outlet(
        [(uri, terms(messages)) for uri, messages in links],
        component_id=197,
        room_yaw_deg=0.0,
        stopwatch=stopwatch,
    )


def flight(count: int) -> Iterator[tuple[Step, int]]:
    """Give steps 30 times a second, each with one estimate, and stream times."""
    generator = np.random.default_rng(5)
    for k in range(count):
        pose = estimate(
            t_ns=k * PERIOD_NS,
            p_BinW=generator.normal(size=3),
            R_BtoW=so3.exp(generator.normal(size=3)),
            v_BinW=generator.normal(size=3),
            covariance=random_covariance(generator, 12),
            available_ns=k + 1,
        )
        yield step(pose), pose.t_ns
