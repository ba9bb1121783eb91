"""Frames in the log: kept as they came where that is exact, within their budget, never at the flight's cost."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from bridge.heard import Heard
from bridge.log.film import MEGABYTE, WAITING_FRAMES, Film, FilmTerms, FrameFormat, Mark, MarkKind
from bridge.log.footage import LogSource
from bridge.log.reader import LogReader
from bridge.wire import Received
from tests.bridge.recordings import LINK, cameras, record, recorder, turns
from tracker.errors import OperatorError
from tracker.sources.image import decode_image
from tracker.types import Event, Frame, Image, Reason, Rejected, Silence, Step, TrackState

PNG = FilmTerms(FrameFormat.PNG, 100 * MEGABYTE)
JPEG = FilmTerms(FrameFormat.JPEG, 100 * MEGABYTE)
SEARCHING = Step(TrackState.SEARCHING)


def image(seed: int) -> Image:
    """Return a small picture that is not all noise."""
    noise = np.random.default_rng(seed).integers(0, 255, (30, 40, 3), np.uint8)
    return np.asarray(cv2.GaussianBlur(noise, (5, 5), 1.0), dtype=np.uint8)


def flight(count: int) -> list[Frame]:
    """Return the frames of two cameras in turn."""
    return [Frame(k % 2, 1_000 + k, image(k), k) for k in range(count)]


def film_of(path: Path, events: list[Event], terms: FilmTerms, **options: bool) -> list[Event]:
    """Record events and return what a replay gives."""
    with recorder(path, film=terms, **options) as log:
        for k, event in enumerate(events):
            log.take(event, SEARCHING, (), 2_000 + k)
        log.take(None, SEARCHING, (), 9_000)
        log.take(None, SEARCHING, (), 9_500)
    return list(LogSource(path, lambda: 7))


def test_png_frames_come_back_pixel_for_pixel_in_their_order_with_their_times(tmp_path: Path) -> None:
    frames = flight(50)
    events = film_of(tmp_path / "a.mcap", list(frames), PNG)
    assert len(events) == 50
    for frame, event in zip(frames, events, strict=True):
        assert isinstance(event, Frame)
        assert (event.camera, event.t_ns, event.available_ns) == (frame.camera, frame.t_ns, 7)
        np.testing.assert_array_equal(event.image, frame.image)
        assert not event.image.flags.writeable


def test_viewers_get_each_camera_on_a_topic_of_its_own_in_its_own_frame(tmp_path: Path) -> None:
    film_of(tmp_path / "a.mcap", list(flight(4)), JPEG)
    records = list(LogReader(tmp_path / "a.mcap").records({f"/camera/{camera.name}" for camera in cameras()}))
    assert [record.topic for record in records] == ["/camera/cam0", "/camera/cam1"] * 2
    assert [record.publish_ns for record in records] == [1_000, 1_001, 1_002, 1_003]
    assert {(record.value.format, record.value.frame_id) for record in records} == {
        ("jpeg", "camera/cam0"),
        ("jpeg", "camera/cam1"),
    }


def test_what_came_between_the_frames_is_replayed_between_them(tmp_path: Path) -> None:
    first, second = flight(2)
    gone = Rejected(Reason.DISCONNECTED, "cam1: no frames", 1_500, 1)
    events = film_of(tmp_path / "a.mcap", [first, Silence(1_400), gone, second], PNG)
    assert [type(event) for event in events] == [Frame, Silence, Rejected, Frame]
    assert events[1:3] == [Silence(1_400), gone]


def test_a_replay_knows_when_the_flight_took_each_event(tmp_path: Path) -> None:
    film_of(tmp_path / "a.mcap", [*flight(2), Silence(1_400)], PNG)
    source = LogSource(tmp_path / "a.mcap", lambda: 0)
    assert [source.now_ns for _ in source] == [2_000, 2_001, 2_002]
    assert source.now_ns == 9_000, "the end has its time too, and the closing of the links is none"


def test_what_came_in_comes_in_again_before_the_turn_that_took_it_at_its_own_time(tmp_path: Path) -> None:
    with recorder(tmp_path / "a.mcap", film=PNG) as log:
        for k, frame in enumerate(flight(3)):
            came = Received("HEARTBEAT", 1, 1, k, {}, bytes([k]), 1_900 + k)
            log.take(frame, SEARCHING, (), 2_000 + k, Heard(((LINK, came), ("tcp:another:1", came))))
    source = LogSource(tmp_path / "a.mcap", lambda: 0)
    told: list[tuple[int, bytes | int]] = []
    source.deliver_to({f"memory:{LINK}": lambda data: told.append((source.now_ns, data))})
    for event in source:
        assert isinstance(event, Frame)
        told.append((source.now_ns, event.t_ns))
    assert told == [turn for k in range(3) for turn in ((1_900 + k, bytes([k])), (2_000 + k, 1_000 + k))]


@pytest.mark.parametrize(
    ("suffix", "terms", "passed"),
    [(".jpg", JPEG, True), (".jpg", PNG, True), (".png", PNG, True), (".png", JPEG, False)],
)
def test_a_frame_that_came_as_a_file_is_kept_as_that_file_unless_it_is_to_be_smaller(
    suffix: str, terms: FilmTerms, passed: bool
) -> None:
    _, data = cv2.imencode(suffix, image(1))
    pixels = decode_image(data.tobytes())
    assert pixels is not None
    kept = Film(terms).develop(Frame(0, 1, pixels, 0, data.tobytes()))
    assert kept is not None
    assert (kept == data.tobytes()) is passed
    assert kept.startswith(b"\xff\xd8" if suffix == ".jpg" or terms is JPEG else b"\x89PNG")


def test_frames_end_with_their_budget_and_the_log_says_so_once_and_goes_on(tmp_path: Path) -> None:
    frames = flight(20)
    size = len(Film(PNG).develop(frames[0]) or b"")
    terms = FilmTerms(FrameFormat.PNG, 5 * size + size // 2)
    events = film_of(tmp_path / "a.mcap", list(frames), terms)
    assert 4 <= len(events) <= 6
    reader = LogReader(tmp_path / "a.mcap")
    records = list(reader.records())
    remarks = [record.value.message for record in records if record.topic == "/log"]
    assert sum("are used up" in remark for remark in remarks) == 1
    assert len([record for record in records if record.topic == "/sightings"]) == 20
    images = [record.value.data for record in records if record.topic.startswith("/camera/")]
    assert sum(map(len, images)) <= terms.budget_bytes
    assert reader.metadata()["recorder"]["frames_stored"] == str(len(events))


def test_a_replay_says_how_many_frames_the_log_lacks(tmp_path: Path) -> None:
    film_of(tmp_path / "a.mcap", list(flight(20)), FilmTerms(FrameFormat.PNG, 10_000))
    source = LogSource(tmp_path / "a.mcap", lambda: 0)
    given = len(list(source))
    assert source.missing == 20 - given > 0
    assert any(f"{20 - given} frames of its flight are not in it" in trouble for trouble in source.troubles)


def test_a_slow_encoder_costs_frames_and_never_makes_the_loop_wait() -> None:
    film = Film(PNG)
    kept = [film.admit(frame, wait=False) for frame in flight(WAITING_FRAMES + 3)]
    assert all(isinstance(one, Frame) for one in kept[:WAITING_FRAMES])
    assert kept[WAITING_FRAMES:] == [
        Mark(MarkKind.MISSED, 1_000 + k, k % 2) for k in range(WAITING_FRAMES, WAITING_FRAMES + 3)
    ]
    assert "3 frames are not in the log" in film.trouble()
    film.develop(kept[0])  # type: ignore[arg-type]  # a frame, as just seen
    assert isinstance(film.admit(flight(1)[0], wait=False), Frame)


def test_the_state_of_the_recording_tells_of_frames_that_ended(tmp_path: Path) -> None:
    log = recorder(tmp_path / "a.mcap", film=FilmTerms(FrameFormat.PNG, 10))
    log.take(flight(1)[0], SEARCHING, (), 5)
    log.close()
    assert log.state().frames.startswith("frames ended after 0")
    assert log.state().error is None


def test_a_log_without_frames_is_no_source(tmp_path: Path) -> None:
    record(tmp_path / "a.mcap", turns(2))
    with pytest.raises(OperatorError, match="holds no frames; record one with `run --log FILE --log-frames png`"):
        LogSource(tmp_path / "a.mcap", lambda: 0)


def test_the_calibration_in_a_log_reads_back_bit_for_bit(tmp_path: Path) -> None:
    film_of(tmp_path / "a.mcap", [], PNG)
    for one, other in zip(LogSource(tmp_path / "a.mcap", lambda: 0).cameras, cameras(), strict=True):
        for name in ("K", "distortion", "R_CtoW", "p_CinW"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
