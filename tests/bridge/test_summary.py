"""The figures at the end of a run, for programs and for people."""

from __future__ import annotations

import io
import json
import math

import pytest
from rich.console import Console

from bridge.summary import ClockOffset, LogSummary, Percentiles, Summary, to_json, to_text
from bridge.wire import LinkState

RUN = Summary(
    estimates_sent=300,
    rate_hz=15.0,
    latency_ms=Percentiles(300, 3.1, 5.0, 7.7, 12.0),
    stages_ms={"detect": Percentiles(300, 2.0, 3.0, 4.0, 5.0)},
    worst_gap_ms=66.7,
    frames={"cam0": 301, "cam1": 300},
    rejected={"gate": 3, "late": 1},
    lost=1,
    resets=2,
    clocks={"cam1": ClockOffset(-3.21, 0.25)},
    links=(LinkState("udpout:127.0.0.1:14550", False, "refused", 600, 4, 0),),
    log=LogSummary("flight.mcap", 1200, 0, "disk full"),
)


def text_of(summary: Summary) -> str:
    """Return what a wide terminal would show."""
    out = io.StringIO()
    Console(file=out, width=120).print(to_text(summary))
    return out.getvalue()


def test_json_holds_every_figure_under_its_name() -> None:
    figures = json.loads(to_json(RUN))
    assert figures["estimates_sent"] == 300
    assert figures["latency_ms"] == {"count": 300, "p50": 3.1, "p95": 5.0, "p99": 7.7, "max": 12.0}
    assert figures["stages_ms"]["detect"]["p99"] == 4.0
    assert figures["rejected"] == {"gate": 3, "late": 1}
    assert figures["frames"] == {"cam0": 301, "cam1": 300}
    assert figures["links"][0]["dropped"] == 4
    assert figures["clocks"] == {"cam1": {"offset_ms": -3.21, "sigma_ms": 0.25}}
    assert figures["log"] == {"path": "flight.mcap", "written": 1200, "dropped": 0, "error": "disk full"}


def test_a_run_that_sent_nothing_has_the_same_keys_and_null_for_what_is_not_known() -> None:
    nothing = json.loads(to_json(Summary(0, 0.0)))
    assert nothing.keys() == json.loads(to_json(RUN)).keys()
    assert nothing["latency_ms"] == {"count": 0, "p50": None, "p95": None, "p99": None, "max": None}
    assert nothing["worst_gap_ms"] is None


def test_a_figure_that_is_no_number_is_a_bug_not_bad_json() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        to_json(Summary(0, math.nan))


def test_text_shows_what_went_wrong_beside_what_went_well() -> None:
    text = text_of(RUN)
    for figure in (
        "300 at 15.0 Hz, worst gap 66.7 ms, track lost 1 times, 2 resets",
        "frame to datagram  3.10  5.00  7.70  12.00",
        "rejected    gate 3, late 1",
        "clocks      cam1 -3.21 +- 0.25 ms against the first camera's",
        "udpout:127.0.0.1:14550: down, refused, 600 sent, 4 dropped",
        "flight.mcap: 1200 records, 0 dropped, ended early: disk full",
    ):
        assert figure in text


def test_text_of_a_run_that_sent_nothing_has_dashes_for_figures() -> None:
    assert "frame to datagram    -    -    -    -" in text_of(Summary(0, 0.0))
