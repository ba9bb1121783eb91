"""The log: what is in it, read by others and by us, whole and broken."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import McapReader, make_reader
from mcap_protobuf.decoder import DecoderFactory

from bridge.log import topics, triangle
from bridge.log.reader import LogReader
from tests.bridge.recordings import CONFIG, LINK, START_NS, WALL_NS, cameras, record, turns
from tracker.errors import OperatorError
from tracker.maths import so3

COUNT = 90
FORMAT_PAGE = Path(__file__).parents[2] / "docs" / "log-format.md"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "whole.mcap"
    record(path, turns(COUNT))
    return path


@pytest.fixture
def plain(whole: Path) -> Iterator[McapReader]:
    """Read the log as anybody would, with mcap's own reader."""
    with whole.open("rb") as stream:
        yield make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])


def decoded(reader: McapReader, topic: str) -> list[Any]:
    return [message.decoded_message for message in reader.iter_decoded_messages([topic])]


def first_json(path: Path, topic: str) -> Any:
    return next(LogReader(path).records({topic})).value


def test_the_plain_mcap_reader_finds_each_pose_with_its_times(plain: McapReader) -> None:
    messages = list(plain.iter_decoded_messages(["/pose"]))
    assert len(messages) == COUNT
    for (_, step, _, now_ns), message in zip(turns(COUNT), messages, strict=True):
        estimate, pose = step.estimates[0], message.decoded_message.pose
        w, x, y, z = so3.quaternion(estimate.R_BtoW)
        assert message.schema is not None
        assert message.schema.name == "foxglove.PoseInFrame"
        assert message.decoded_message.frame_id == "room"
        assert message.decoded_message.timestamp.ToNanoseconds() == estimate.t_ns
        assert (message.message.log_time, message.message.publish_time) == (now_ns, estimate.t_ns)
        assert [pose.position.x, pose.position.y, pose.position.z] == estimate.p_BinW.tolist()
        assert [pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z] == [w, x, y, z]


def test_viewers_find_the_room_its_cameras_and_the_marker(plain: McapReader) -> None:
    (transforms,) = decoded(plain, "/tf/cameras")
    assert [one.child_frame_id for one in transforms.transforms] == ["camera/cam0", "camera/cam1"]
    assert transforms.transforms[1].translation.x == 1.0
    (scene,) = decoded(plain, "/marker")
    assert [ball.pose.position.x for ball in scene.entities[0].spheres] == [0.0, 0.1, 0.0]
    assert scene.entities[0].frame_id == "body"
    assert {one.parent_frame_id + one.child_frame_id for one in decoded(plain, "/tf")} == {"roombody"}
    for camera, model in zip(cameras(), ("plumb_bob", "rational_polynomial"), strict=True):
        (calibration,) = decoded(plain, f"/calibration/{camera.name}")
        assert calibration.distortion_model == model
        assert list(calibration.K) == camera.K.ravel().tolist()


def test_the_config_the_calibration_and_the_command_are_in_the_log(whole: Path, plain: McapReader) -> None:
    attachments = {one.name: one for one in plain.iter_attachments()}
    assert attachments["config.toml"].data == CONFIG
    assert attachments["config.toml"].media_type == "application/toml"
    assert [one["name"] for one in json.loads(attachments["calibration.json"].data)["cameras"]] == ["cam0", "cam1"]
    assert {one.name: dict(one.metadata) for one in plain.iter_metadata()} == LogReader(whole).metadata()
    assert LogReader(whole).metadata()["run"] == {"source": "recording:somewhere"}
    assert LogReader(whole).attachments()["config.toml"] == CONFIG


def test_an_estimate_comes_back_bit_for_bit(whole: Path) -> None:
    records = LogReader(whole).records({"/estimate"})
    for (_, step, _, _), record_ in zip(turns(COUNT), records, strict=True):
        estimate, value = step.estimates[0], record_.value
        assert value["p_BinW_m"] == estimate.p_BinW.tolist()
        assert value["v_BinW_m_s"] == estimate.v_BinW.tolist()
        assert value["w_BinB_rad_s"] == estimate.w_BinB.tolist()
        assert value["q_BtoW"] == so3.quaternion(estimate.R_BtoW).tolist()
        upper = np.triu(estimate.covariance)
        np.testing.assert_array_equal(triangle.unpack(value["covariance"]), upper + np.triu(upper, 1).T)
        assert (value["state"], value["reset_counter"]) == ("tracking", estimate.reset_counter)
        assert (value["clock_offsets_ms"], value["clock_sigmas_ms"]) == ([250.0], [500.0])
        assert (value["nis"], value["nis_dof"], value["available_ns"]) == (estimate.nis, 6, estimate.available_ns)


def test_what_was_sent_is_there_raw_and_decoded_with_its_latency(whole: Path) -> None:
    value = first_json(whole, "/mavlink/sent/VISION_POSITION_ESTIMATE")
    assert (value["link"], value["t_ns"], value["latency_ns"]) == (LINK, START_NS, 5_000_000)
    assert base64.b64decode(value["raw"]) == b"\xfd\x01\x02"
    assert value["fields"] == {"usec": START_NS // 1000, "x": 0.5, "covariance": [None, 0.25]}
    latency = first_json(whole, "/latency")
    assert latency["stages"] == [
        {"name": "detect", "duration_ns": 400_000, "duration_ms": 0.4},
        {"name": "ekf", "duration_ns": 90_000, "duration_ms": 0.09},
    ]
    assert latency["links"] == [{"link": LINK, "latency_ns": 5_000_000, "latency_ms": 5.0}]


def test_the_clocks_are_noted_once_a_second(whole: Path) -> None:
    clocks = [record_.value for record_ in LogReader(whole).records({"/clock"})]
    assert {clock["wall_ns"] for clock in clocks} == {WALL_NS}
    assert [round((clock["stream_ns"] - START_NS) / 1e9) for clock in clocks] == [0, 1, 2]


def test_sightings_stand_with_their_frame(whole: Path) -> None:
    value = first_json(whole, "/sightings")
    assert (value["camera"], value["t_ns"], len(value["sightings"])) == (0, START_NS, 3)
    assert value["sightings"][2]["cov_px2"] == [0.2, 0.1, 0.3]


def test_json_schemas_stay_within_what_foxglove_reads(plain: McapReader) -> None:
    summary = plain.get_summary()
    assert summary is not None
    schemas = [json.loads(one.data) for one in summary.schemas.values() if one.encoding == "jsonschema"]
    assert len(schemas) == 7
    nodes = list(schemas)
    for node in nodes:
        assert node["type"] in {"object", "array", "string", "number", "integer", "boolean"}
        nodes += node["properties"].values() if node["type"] == "object" else []
        nodes += [node["items"]] if node["type"] == "array" else []


def test_every_json_message_has_exactly_the_fields_of_its_schema(whole: Path, plain: McapReader) -> None:
    summary = plain.get_summary()
    assert summary is not None
    schemas = {channel.topic: summary.schemas[channel.schema_id] for channel in summary.channels.values()}
    for record_ in LogReader(whole).records():
        if schemas[record_.topic].encoding == "jsonschema":
            assert set(record_.value) == set(json.loads(schemas[record_.topic].data)["properties"])


def test_the_manual_names_every_topic_and_field() -> None:
    manual = FORMAT_PAGE.read_text(encoding="utf-8")
    for topic in topics.FIXED:
        assert f"`{topic.name}`" in manual
        properties = json.loads(topic.schema)["properties"] if topic.schema_encoding == "jsonschema" else {}
        inner = [name for each in properties.values() for name in each.get("items", {}).get("properties", ())]
        assert [name for name in (*properties, *inner) if f"`{name}`" not in manual] == []


def test_a_log_cut_anywhere_in_its_last_chunk_gives_all_before_it(
    whole: Path, plain: McapReader, tmp_path: Path
) -> None:
    summary = plain.get_summary()
    assert summary is not None
    data, cut = whole.read_bytes(), tmp_path / "cut.mcap"
    last = max(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)
    end = last.chunk_start_offset + last.chunk_length
    everything = [record_.value["t_ns"] for record_ in LogReader(whole).records({"/estimate"})]
    before: set[int] = set()
    for size in {*range(last.chunk_start_offset, end, 61), last.chunk_start_offset + 4, end - 1}:
        cut.write_bytes(data[:size])
        reader = LogReader(cut)
        times = [record_.value["t_ns"] for record_ in reader.records({"/estimate"})]
        before.add(len(times))
        assert times == everything[: len(times)]
        (loss,) = reader.lost
        assert loss.size_bytes == size - last.chunk_start_offset
    assert len(before) == 1
    assert 0 < before.pop() < COUNT


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_a_log_cut_or_spoilt_anywhere_is_read_as_far_as_it_goes(
    tmp_path_factory: pytest.TempPathFactory, whole: Path, data: st.DataObject
) -> None:
    content = bytearray(whole.read_bytes())
    for _ in range(data.draw(st.integers(0, 3), label="spoilt")):
        content[data.draw(st.integers(8, len(content) - 1))] = data.draw(st.integers(0, 255))
    del content[data.draw(st.integers(8, len(content)), label="size") :]
    path = tmp_path_factory.getbasetemp() / "spoilt.mcap"
    path.write_bytes(content)
    reader = LogReader(path)
    known = {step.estimates[0].t_ns for _, step, _, _ in turns(COUNT)}
    assert {record_.value["t_ns"] for record_ in reader.records({"/estimate"})} <= known
    for loss in reader.lost:
        assert "\n" not in str(loss)
    reader.attachments()
    reader.metadata()


@pytest.mark.parametrize(
    ("content", "complaint"), [(b"", "is empty"), (b"\x89MCAP", "is no MCAP"), (b"t_ns,x_m\n" * 9, "is no MCAP")]
)
def test_a_file_that_is_no_log_is_refused(tmp_path: Path, content: bytes, complaint: str) -> None:
    (tmp_path / "a.mcap").write_bytes(content)
    with pytest.raises(OperatorError, match=complaint):
        LogReader(tmp_path / "a.mcap")


def test_a_path_with_no_file_is_refused(tmp_path: Path) -> None:
    for path, complaint in ((tmp_path, "no regular file"), (tmp_path / "b.mcap", "no such file")):
        with pytest.raises(OperatorError, match=complaint):
            LogReader(path)
