"""Signatures, with pymavlink's own signing at the far end."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega

from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.dialogue import Terms
from bridge.links import MemoryLink, open_link
from bridge.outlet import Outlet, Spout
from bridge.pack import Packer, heartbeat
from bridge.signing import Signing
from bridge.signing.stamps import Stamps
from tests.bridge.estimates import estimate, step

SECRET = bytes(range(1, 33))
START = 10**13
MINUTE = 60 * 100_000


class Far:
    """pymavlink with its own signing, as a ground station or an autopilot has it."""

    def __init__(self, secret: bytes = SECRET, timestamp: int = START, link_id: int = 7, system_id: int = 1) -> None:
        self.mav = ardupilotmega.MAVLink(None, system_id, 1)
        self.mav.signing.secret_key = secret
        self.mav.signing.timestamp = timestamp
        self.mav.signing.link_id = link_id
        self.mav.signing.sign_outgoing = True

    def says(self) -> bytes:
        return bytes(self.mav.heartbeat_encode(4, 3, 0, 0, 4).pack(self.mav))

    def reads(self, data: bytes) -> list[str]:
        try:
            return [message.get_type() for message in self.mav.parse_buffer(data) or []]
        except ardupilotmega.MAVError:
            return []


@pytest.fixture
def stamps(tmp_path: Path) -> Stamps:
    return Stamps(tmp_path / "s", START, lambda: 0)


def unsigned() -> bytes:
    return Encoder(Identity(1, 1))(heartbeat(0), 0)


@pytest.mark.parametrize(
    "name", ["HEARTBEAT", "VISION_POSITION_ESTIMATE", "ODOMETRY", "STATUSTEXT", "TIMESYNC", "VISION_SPEED_ESTIMATE"]
)
def test_pymavlink_with_the_key_takes_what_we_sign(name: str, stamps: Stamps) -> None:
    encode = Encoder(Identity(1), Signing(SECRET, 3, stamps))
    far = Far()
    for sequence in range(5):
        assert far.reads(encode(make_message(name, 0), sequence)) == [name]
    assert far.mav.signing.goodsig_count == 5


def test_pymavlink_with_another_key_takes_nothing_of_it(stamps: Stamps) -> None:
    encode = Encoder(Identity(1), Signing(SECRET, 3, stamps))
    far = Far(bytes(reversed(SECRET)))
    assert far.reads(encode(heartbeat(0), 0)) != ["HEARTBEAT"]
    assert far.mav.signing.goodsig_count == 0


def test_what_pymavlink_signs_with_the_key_is_heard(stamps: Stamps) -> None:
    signing, far = Signing(SECRET, 0, stamps), Far()
    heard = Reader(signing).feed(b"".join(far.says() for _ in range(20)))
    assert len(heard) == 20
    assert signing.refused == 0


def test_unsigned_wrongly_signed_and_version_1_frames_are_refused_and_counted(stamps: Stamps) -> None:
    signing = Signing(SECRET, 0, stamps)
    reader = Reader(signing)
    old = ardupilotmega.MAVLink(None, 1, 1)
    version_1 = bytes(old.heartbeat_encode(4, 3, 0, 0, 4).pack(old, force_mavlink1=True))
    assert not reader.feed(unsigned() + Far(bytes(32)).says() + Far(SECRET[::-1]).says() + version_1)
    assert signing.refused == 4
    assert len(reader.feed(Far().says())) == 1


def test_a_replayed_frame_is_refused(stamps: Stamps) -> None:
    signing, far = Signing(SECRET, 0, stamps), Far()
    reader, first, second = Reader(signing), far.says(), far.says()
    assert [len(reader.feed(each)) for each in (first, second, first, second)] == [1, 1, 0, 0]
    assert signing.refused == 2


def test_a_new_stream_may_lie_a_minute_behind_us_and_no_more(stamps: Stamps) -> None:
    signing = Signing(SECRET, 0, stamps)
    stamps.take()
    assert not Reader(signing).feed(Far(timestamp=START - MINUTE - 1).says())
    assert Reader(signing).feed(Far(timestamp=START - MINUTE + 10).says())


def test_a_forged_frame_of_the_far_future_shuts_no_true_one_out(stamps: Stamps) -> None:
    """pymavlink's own check remembers the timestamp before it has looked at the signature."""
    signing, far = Signing(SECRET, 0, stamps), Far()
    forged = Far(bytes(range(32)), timestamp=1 << 47).says()
    reader = Reader(signing)
    assert len(reader.feed(far.says())) == 1
    assert not reader.feed(forged)
    assert len(reader.feed(far.says())) == 1


def test_our_timestamps_go_above_the_far_ends(stamps: Stamps) -> None:
    signing = Signing(SECRET, 0, stamps)
    Reader(signing).feed(Far(timestamp=START + 12345).says())
    assert stamps.take() > START + 12345


def test_a_radio_may_say_how_it_fares_unsigned(stamps: Stamps) -> None:
    signing = Signing(SECRET, 0, stamps)
    frame = Encoder(Identity(51, 68))(make_message("RADIO_STATUS", 0, rssi=100), 0)
    (heard,) = Reader(signing).feed(frame)
    assert heard.message == "RADIO_STATUS"


@given(position=st.integers(0, 45), bit=st.integers(0, 7))
def test_a_signed_frame_with_any_bit_changed_is_not_heard(
    tmp_path_factory: pytest.TempPathFactory, position: int, bit: int
) -> None:
    stamps = Stamps(tmp_path_factory.mktemp("stamps") / "s", START, lambda: 0)
    frame = bytearray(Far().says())
    frame[position % len(frame)] ^= 1 << bit
    assert not Reader(Signing(SECRET, 0, stamps)).feed(bytes(frame))


def test_two_links_of_one_bridge_never_give_the_same_signature(stamps: Stamps) -> None:
    encoders = [Encoder(Identity(1), Signing(SECRET, number, stamps)) for number in range(2)]
    blocks = [encode(heartbeat(0), 0)[-13:] for _ in range(50) for encode in encoders]
    assert {block[0] for block in blocks} == {0, 1}
    assert len({block[1:7] for block in blocks}) == len(blocks)


def test_an_outlet_that_signs_tells_how_much_it_refused(stamps: Stamps) -> None:
    signing = Signing(SECRET, 0, stamps)
    encoder = Encoder(Identity(1), signing)
    link = open_link("memory:a", encoder, lambda: 0)
    assert isinstance(link, MemoryLink)
    outlet = Outlet([Spout(link, Terms(max_age_ns=10**12), encoder, signing)], Packer(0.0))
    outlet.listen(lambda: 0)
    link.deliver(unsigned())
    outlet.send(step(estimate()), 1_000_000_000)
    (far,) = outlet.far_ends()
    assert (far.peer, far.unsigned) == (None, 1)
    assert "1 messages REFUSED" in str(far)
    link.deliver(Far().says())
    outlet.send(step(), 2_000_000_000)
    (far,) = outlet.far_ends()
    assert far.peer is not None
    assert Far(timestamp=0).reads(b"".join(link.frames))
