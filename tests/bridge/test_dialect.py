"""Bytes of messages and messages of bytes, beside pymavlink and a parser that is not ours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from bridge.dialect import Encoder, Identity, Reader, make_message
from bridge.pack import MESSAGES, Packer, heartbeat
from tests.bridge.estimates import estimate, random_covariance
from tests.bridge.mavlink_by_hand import parse
from tracker.errors import OperatorError

Floats = Sequence[float]
DIAGONAL = (0, 6, 11, 15, 18, 20)
IDENTITY = Identity(7)
Z_UP = np.array([0.0, 0.0, 1.0])


def test_the_heartbeat_is_that_of_an_onboard_controller() -> None:
    (frame,) = parse(Encoder(Identity(42, 191))(heartbeat(0), 255))
    assert (frame.name, frame.system_id, frame.component_id, frame.sequence) == ("HEARTBEAT", 42, 191, 255)
    assert frame.fields == {
        "custom_mode": 0, "type": 18, "autopilot": 8, "base_mode": 0, "system_status": 4, "mavlink_version": 3,
    }  # fmt: skip


@pytest.mark.parametrize("p_BinW", [(0.0, 0.0, 0.0), (1.0, -2.0, 3.0)])
@pytest.mark.parametrize("cut", [1.0, 0.0])
@pytest.mark.parametrize("sequence", [0, 255])
def test_frames_are_byte_for_byte_those_that_pymavlink_packs(p_BinW: Floats, cut: float, sequence: int) -> None:
    covariance = cut * random_covariance(np.random.default_rng(3), 12)
    messages = Packer(30.0).messages(estimate(p_BinW=p_BinW, covariance=covariance), MESSAGES)
    theirs = common.MAVLink(None, srcSystem=7, srcComponent=197)
    theirs.seq = sequence
    classes = {each.msgname: each for each in common.mavlink_map.values()}
    for message in (*messages.values(), heartbeat(0)):
        expected = bytes(classes[message.name](**message.fields).pack(theirs))
        assert Encoder(Identity(7))(message, sequence) == expected


def test_a_frame_says_who_speaks_and_in_which_order() -> None:
    (frame,) = parse(Encoder(IDENTITY)(heartbeat(0), 5))
    assert (frame.system_id, frame.component_id, frame.sequence) == (7, 197, 5)


@pytest.mark.parametrize(("system_id", "component_id"), [(0, 197), (255, 197), (-1, 197), (1, 0), (1, 256)])
def test_an_identity_of_nobody_or_of_the_ground_station_is_refused(system_id: int, component_id: int) -> None:
    with pytest.raises(OperatorError, match="must be 1 to"):
        Identity(system_id, component_id)


@pytest.mark.parametrize("name", sorted(dialect_class.msgname for dialect_class in common.mavlink_map.values()))
def test_every_message_of_the_dialect_can_be_made_with_nothing_in_it(name: str) -> None:
    (received,) = Reader().feed(Encoder(IDENTITY)(make_message(name, 0), 0))
    assert received.message == name
    values = [each for value in received.fields.values() for each in (value if isinstance(value, list) else [value])]
    assert set(values) <= {0, ""}


def test_a_message_is_made_of_its_named_fields_and_no_other_name_is_taken() -> None:
    made = make_message("PARAM_SET", 0, param_id="VISO_DELAY_MS_AND_MORE", param_value=0.1, target_system=3)
    (received,) = Reader().feed(Encoder(IDENTITY)(made, 0))
    assert received.fields["param_id"] == "VISO_DELAY_MS_AN"  # 16 bytes
    assert received.fields == dict(made.fields)
    with pytest.raises(KeyError, match="has no field value"):
        make_message("PARAM_SET", 0, value=1.0)
