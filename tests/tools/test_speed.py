"""`posebridge bench speed` accounts for all of a pair's time; how long that is, no test can say."""

from __future__ import annotations

import dataclasses
import gc
import json
import sys
import time

import pytest
from typer.testing import CliRunner

from bridge.settings import load_settings
from tools.bench.pairs import GARBAGE, LOG, LOOP, MACHINE, Pair, shares_of, slow_of, stages_of
from tools.bench.speed import Speed, measure_speed
from tools.cli import app
from tools.request import Clocks, CpuClocks
from tools.steady import steady

PAIRS = 12
US = 1_000


@pytest.fixture(scope="module")
def measured() -> Speed:
    clocks = Clocks(time.monotonic_ns, time.perf_counter_ns, time.time_ns, time.sleep)
    cpu = CpuClocks(time.process_time_ns, time.thread_time_ns)
    return measure_speed(load_settings("lab"), clocks, cpu, PAIRS, warm_up=5)


def test_every_pair_is_tracked_packed_sent_logged_and_counted(measured: Speed) -> None:
    assert measured.pairs == measured.pair_ms.count == PAIRS
    assert {"intake", "pack", "link", "monitor", "record", "telemetry", "loop"} < set(measured.stages_ms)
    assert measured.run.estimates_sent == PAIRS
    assert measured.run.frames == {"cam0": PAIRS, "cam1": PAIRS}
    assert measured.run.log is not None
    assert measured.run.log.dropped == 0
    assert measured.acquire_ms.count > 0
    assert measured.snapshot_ms.count > 0
    assert measured.log_bytes > 0


def test_the_stages_share_out_the_whole_time(measured: Speed) -> None:
    assert measured.shares.keys() == measured.stages_ms.keys()
    assert sum(measured.shares.values()) == pytest.approx(1.0)
    assert all(share > 0.0 for share in measured.shares.values())
    assert sum(measured.slow.causes.values()) == measured.slow.worst == 1


def test_json_holds_the_same_figures_under_the_same_names() -> None:
    result = CliRunner().invoke(app, ["bench", "speed", "--pairs", "3", "--json"])
    assert result.exit_code == 0
    figures = json.loads(result.output)
    assert figures.keys() == {field.name for field in dataclasses.fields(Speed)}
    assert figures["pairs"] == 3
    assert figures["slow"].keys() == {"limit_ms", "over_limit", "worst", "causes"}


def usual(wall: int = 500 * US) -> Pair:
    return Pair(wall, 480 * US, 450 * US, 0, stages())


def stages(find: int = 300 * US) -> dict[str, int]:
    return {"find": find, "filter": 150 * US}


@pytest.mark.parametrize(
    ("slow", "cause"),
    [
        (Pair(5000 * US, 4950 * US, 4900 * US, 0, stages(4700 * US)), "find"),
        (Pair(5000 * US, 4950 * US, 4900 * US, 0, stages()), LOOP),
        (Pair(5000 * US, 4950 * US, 4900 * US, 4000 * US, stages(4700 * US)), GARBAGE),
        (Pair(5000 * US, 4950 * US, 900 * US, 0, stages(4700 * US)), LOG),
        (Pair(5000 * US, 900 * US, 880 * US, 0, stages(4700 * US)), MACHINE),
    ],
)
def test_a_slow_pair_is_laid_to_what_took_most_of_its_extra_time(slow: Pair, cause: str) -> None:
    pairs = [usual()] * 99 + [slow]
    told = slow_of(pairs)
    assert (told.over_limit, told.worst, told.causes) == (1, 1, {cause: 1})


def test_parts_add_up_and_come_the_largest_first() -> None:
    pairs = [usual(), usual(700 * US)]
    assert sum(pairs[1].parts.values()) == 700 * US
    assert shares_of(pairs) == {"find": 0.5, "filter": 0.25, LOOP: 0.25}
    assert list(stages_of(pairs)) == ["find", "filter", LOOP]


def test_flight_sets_the_interpreter_and_gives_it_back() -> None:
    before = sys.getswitchinterval(), gc.get_threshold(), gc.get_freeze_count()
    with steady():
        assert sys.getswitchinterval() < before[0]
        assert gc.get_freeze_count() > 10_000
        assert gc.isenabled()
    assert (sys.getswitchinterval(), gc.get_threshold(), gc.get_freeze_count()) == before
