"""Bytes off the wire: whole valid frames come through, anything else is passed over."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.dialect import Encoder, Identity, Reader
from bridge.pack import Packer
from tests.bridge.estimates import beat, estimate
from tests.bridge.mavlink_by_hand import DEFINITIONS, crc_x25, parse


def two_frames() -> tuple[bytes, bytes]:
    encode = Encoder(Identity(7))
    mocap = Packer(0.0).messages(estimate(p_BinW=(1, 2, 3)), ["ATT_POS_MOCAP"])["ATT_POS_MOCAP"]
    return encode(mocap, 3), encode(beat(77), 4)


def test_the_reader_decodes_what_the_encoder_framed() -> None:
    raw, _ = two_frames()
    (received,) = Reader().feed(raw)
    (by_hand,) = parse(raw)
    assert (received.message, received.sequence, received.raw) == ("ATT_POS_MOCAP", 3, raw)
    assert (received.system_id, received.component_id) == (7, 197)
    assert received.fields == by_hand.fields


def test_the_reader_takes_bytes_one_by_one() -> None:
    reader = Reader()
    first, second = two_frames()
    received = [message for byte in first + second for message in reader.feed(bytes([byte]))]
    assert [message.message for message in received] == ["ATT_POS_MOCAP", "HEARTBEAT"]


def test_the_reader_takes_version_1_frames() -> None:
    version_1 = bytes.fromhex("fe 09 4e 01 01 00 00000000 02 03 51 04 03")
    checksum = crc_x25(bytes([DEFINITIONS[0].seed()]), crc_x25(version_1[1:]))
    (received,) = Reader().feed(version_1 + checksum.to_bytes(2, "little"))
    assert (received.message, received.fields["type"], received.sequence) == ("HEARTBEAT", 2, 78)


@pytest.mark.parametrize("flip", [0x01, 0x55, 0xFF])
def test_a_broken_frame_does_not_take_the_next_one_with_it(flip: int) -> None:
    first, second = two_frames()
    for k in range(len(first)):
        broken = bytearray(first)
        broken[k] ^= flip
        names = [message.message for message in Reader().feed(bytes(broken) + second + bytes(300))]
        assert names == ["HEARTBEAT"], f"byte {k}"


@settings(deadline=None)
@given(st.lists(st.binary(max_size=400) | st.sampled_from(two_frames()) | st.just(b"\xfd") | st.just(b"\xfe")))
def test_no_bytes_whatever_upset_the_reader(pieces: list[bytes]) -> None:
    reader = Reader()
    for piece in pieces:
        reader.feed(piece)
    reader.feed(bytes(300))
    assert [message.message for message in reader.feed(two_frames()[1])] == ["HEARTBEAT"]
