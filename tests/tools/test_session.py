"""A whole run, put together as the command line does, on clocks that only a test moves."""

from __future__ import annotations

import base64
import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from bridge.dialogue.streams import Wanted
from bridge.log.reader import LogReader
from bridge.settings import Settings, load_settings
from bridge.settings.terms import terms_of
from tests.system.recordings import short_copy
from tools.request import Clocks, Pace, RunRequest
from tools.session import run_session, tlog_beside
from tracker.errors import OperatorError
from tracker.sources.groundtruth import read_ground_truth

PAIRS = 6
PERIOD_NS = 66_666_667
POSE = "/mavlink/sent/VISION_POSITION_ESTIMATE"


@dataclass
class Time:
    """Time that goes on only by sleeping."""

    now_ns: int = 5_000_000_000
    slept_s: list[float] = field(default_factory=list)

    def read(self) -> int:
        return self.now_ns

    def sleep(self, seconds: float) -> None:
        self.slept_s.append(seconds)
        self.now_ns += max(1, round(seconds * 1e9))

    def clocks(self) -> Clocks:
        return Clocks(monotonic=self.read, stopwatch=self.read, wall=self.read, sleep_s=self.sleep)


@pytest.fixture(scope="module")
def recording(lab_protocol: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy the first pairs of the protocol."""
    return short_copy(lab_protocol, tmp_path_factory.mktemp("short"), PAIRS)


def settings(method: str = "ekf") -> Settings:
    lab = load_settings("lab").with_links(("memory:a",))
    return lab.model_copy(update={"tracker": lab.tracker.model_copy(update={"method": method})})


def fly(
    recording: Path, folder: Path, pace: Pace = Pace.FAST, time: Time | None = None, method: str = "ekf"
) -> tuple[Path, Path]:
    """Run a session and return its log and its summary."""
    log, summary = folder / "a.mcap", folder / "a.json"
    request = RunRequest(
        settings(method), f"recording:{recording}", log, pace, summary, overwrite=True, quiet=True
    )  # fmt: skip
    run_session(request, (time or Time()).clocks())
    return log, summary


def sent(log: Path) -> list[tuple[str, int, bytes]]:
    """Return topic, time and frame of every MAVLink message in a log."""
    return [
        (record.topic, record.value["t_ns"], base64.b64decode(record.value["raw"]))
        for record in LogReader(log).records()
        if record.topic.startswith("/mavlink/sent/")
    ]


@pytest.mark.parametrize("method", ["ekf", "paper"])
def test_every_pair_is_estimated_sent_and_logged(recording: Path, tmp_path: Path, method: str) -> None:
    log, summary = fly(recording, tmp_path, method=method)
    figures = json.loads(summary.read_text(encoding="utf-8"))
    times = read_ground_truth(recording).t_ns[:PAIRS].tolist()
    assert figures["estimates_sent"] == PAIRS
    assert figures["frames"] == {"cam0": PAIRS, "cam1": PAIRS}
    assert figures["rate_hz"] == pytest.approx(15.0, rel=1e-3)
    assert [record.value["t_ns"] for record in LogReader(log).records({"/estimate"})] == times
    assert [t_ns for topic, t_ns, _ in sent(log) if topic == POSE] == times
    assert figures["log"]["error"] == ""
    assert LogReader(log).metadata()["run"]["calibration"] == "source"


def test_the_same_recording_gives_the_same_bytes(recording: Path, tmp_path: Path) -> None:
    (tmp_path / "again").mkdir()
    first, _ = fly(recording, tmp_path, time=Time(1_000))
    second, _ = fly(recording, tmp_path / "again", time=Time(9_000_000))
    assert sent(first) == sent(second)
    assert len(sent(first)) == 2 * PAIRS + 1  # two poses a pair and one heartbeat


def test_at_real_pace_frames_come_when_they_were_taken(recording: Path, tmp_path: Path) -> None:
    time = Time()
    log, _ = fly(recording, tmp_path, Pace.REAL, time)
    assert sum(time.slept_s) == pytest.approx((PAIRS - 1) * PERIOD_NS * 1e-9, abs=1e-6)
    arrivals = [(record.log_ns, record.value["t_ns"]) for record in LogReader(log).records({"/estimate"})]
    assert len(arrivals) == PAIRS
    assert all(log_ns == t_ns for log_ns, t_ns in arrivals)


def test_both_paces_send_the_same_poses(recording: Path, tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    fast, _ = fly(recording, tmp_path)
    real, _ = fly(recording, tmp_path / "real", Pace.REAL)
    assert [s for s in sent(fast) if s[0] == POSE] == [s for s in sent(real) if s[0] == POSE]


def test_fast_pace_never_sleeps(recording: Path, tmp_path: Path) -> None:
    time = Time()
    fly(recording, tmp_path, time=time)
    assert time.slept_s == []


def test_a_ctrl_c_in_the_middle_closes_the_log_and_writes_the_figures(recording: Path, tmp_path: Path) -> None:
    time = Time()

    def interrupt(seconds: float) -> None:
        if len(time.slept_s) == 3:
            raise KeyboardInterrupt
        time.sleep(seconds)

    log, summary = tmp_path / "a.mcap", tmp_path / "a.json"
    request = RunRequest(settings(), f"recording:{recording}", log, Pace.REAL, summary, False, True)
    with pytest.raises(KeyboardInterrupt):
        run_session(request, Clocks(time.read, time.read, time.read, interrupt))
    reader = LogReader(log)
    assert len(list(reader.records({"/estimate"}))) == 4
    assert reader.lost == ()
    assert json.loads(summary.read_text(encoding="utf-8"))["estimates_sent"] == 4


def test_a_source_that_does_not_open_leaves_no_log_behind(tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match="no such directory"):
        fly(tmp_path / "gone", tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_run_without_log_and_summary_writes_nothing(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    request = RunRequest(settings("paper"), f"recording:{recording}", None, Pace.FAST, None, False, True)
    run_session(request, Time().clocks())
    assert list(tmp_path.iterdir()) == []


def test_a_tlog_lies_beside_the_log_but_a_pipe_gets_none(tmp_path: Path) -> None:
    assert tlog_beside(tmp_path / "flight.mcap") == tmp_path / "flight.tlog"
    os.mkfifo(tmp_path / "pipe")
    assert tlog_beside(tmp_path / "pipe") is None
    with pytest.raises(OperatorError, match=r"a \.tlog is written beside the MCAP log; name it .*flight\.mcap"):
        tlog_beside(tmp_path / "flight.tlog")


@pytest.mark.parametrize("logged", [True, False])
def test_the_autopilot_is_asked_for_streams_only_when_a_log_is_kept(logged: bool) -> None:
    lab = load_settings("lab").with_links(("udpout:127.0.0.1:9", "serial:/dev/ttyUSB0:57600"))
    streams = [terms.streams for _, terms in terms_of(lab, logged=logged)]
    assert streams == [Wanted(50.0 * logged), Wanted(50.0 * logged, 5760.0)]


def test_a_link_with_a_slow_radio_behind_it_may_be_asked_for_less_than_the_others() -> None:
    lab = load_settings("lab").with_links(("udpout:127.0.0.1:9", "udpout:127.0.0.1:10"))
    one, other = lab.links
    slow = lab.model_copy(update={"links": (one, other.model_copy(update={"streams_hz": 4.0}))})
    assert [terms.streams.rate_hz for _, terms in terms_of(slow, logged=True)] == [50.0, 4.0]
