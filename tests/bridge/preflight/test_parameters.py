"""The parameter client against an autopilot that speaks through pymavlink."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.preflight.encoding import field_of
from bridge.preflight.parameters import RETRY_NS, TRIES, ParameterClient
from tests.bridge.preflight.talk import Store, said
from tracker.errors import OperatorError

REAL32, INT32, INT8 = 9, 6, 2
LATE_NS = RETRY_NS // 4


def talk_out(client: ParameterClient, store: Store) -> int:
    """Let client and autopilot talk until nothing is due any more; return how many messages the client sent."""
    count, now_ns = 0, 0
    while client.busy:
        message = client.due(now_ns)
        if message is None:
            now_ns += LATE_NS
            continue
        count += 1
        assert count < 1000
        for answer in store.answer(message):
            client.take(answer)
    return count


def test_what_is_asked_for_is_known_afterwards() -> None:
    store = Store({"VISO_TYPE": (1, INT8), "VISO_POS_M_NSE": (0.2, REAL32), "EK3_SRC1_YAW": (6, INT8)})
    client = ParameterClient(1, 1, bytewise=False)
    client.read(store.values)
    assert talk_out(client, store) == 3
    assert {name: round(known.value, 6) for name, known in client.known.items()} == {
        name: value for name, (value, _) in store.values.items()
    }


def test_a_name_the_firmware_lacks_is_absent_after_all_tries_and_the_others_are_not_held_up() -> None:
    store = Store({"B": (2, INT8)})
    client = ParameterClient(1, 1, bytewise=False)
    client.read(["A", "B"])
    assert talk_out(client, store) == TRIES + 1
    assert client.absent == ("A",)
    assert list(client.known) == ["B"]


@pytest.mark.parametrize("lost", range(TRIES))
def test_lost_questions_are_asked_again(lost: int) -> None:
    store = Store({"A": (7, INT32)})
    store.deaf = lost
    client = ParameterClient(1, 1, bytewise=False)
    client.read(["A"])
    assert talk_out(client, store) == lost + 1
    assert client.known["A"].value == 7


def test_more_names_than_may_be_outstanding_are_all_read() -> None:
    store = Store({f"P{number}": (number, INT32) for number in range(100)})
    client = ParameterClient(1, 1, bytewise=False)
    client.read(store.values)
    talk_out(client, store)
    assert len(client.known) == 100


@pytest.mark.parametrize("bytewise", [False, True])
def test_a_write_sticks_and_is_read_back(bytewise: bool) -> None:
    store = Store({"EKF2_EV_CTRL": (0, INT32), "EKF2_EV_DELAY": (0.0, REAL32)}, bytewise)
    client = ParameterClient(1, 1, bytewise)
    client.read(store.values)
    talk_out(client, store)
    client.write("EKF2_EV_CTRL", 15)
    client.write("EKF2_EV_DELAY", 12.5)
    assert talk_out(client, store) == 4  # each set, then asked for
    assert client.written == ("EKF2_EV_CTRL", "EKF2_EV_DELAY")
    assert store.values == {"EKF2_EV_CTRL": (15, INT32), "EKF2_EV_DELAY": (12.5, REAL32)}


def test_a_write_that_does_not_stick_is_refused() -> None:
    store = Store({"VISO_TYPE": (0, INT8)})
    store.stubborn = {"VISO_TYPE"}
    client = ParameterClient(1, 1, bytewise=False)
    client.read(store.values)
    talk_out(client, store)
    client.write("VISO_TYPE", 1)
    talk_out(client, store)
    assert client.refused == ("VISO_TYPE",)
    assert client.written == ()


def test_an_autopilot_that_falls_silent_refuses_the_write() -> None:
    store = Store({"VISO_TYPE": (0, INT8)})
    client = ParameterClient(1, 1, bytewise=False)
    client.read(store.values)
    talk_out(client, store)
    store.deaf = 1000
    client.write("VISO_TYPE", 1)
    talk_out(client, store)
    assert client.refused == ("VISO_TYPE",)


def test_a_value_told_unasked_counts_but_proves_no_write() -> None:
    store = Store({"VISO_TYPE": (0, INT8)})
    client = ParameterClient(1, 1, bytewise=False)
    client.take(store.told("VISO_TYPE"))
    client.write("VISO_TYPE", 0)
    client.take(store.told("VISO_TYPE"))
    assert client.written == ()
    assert client.busy


def test_questions_are_addressed_to_the_autopilot_by_name() -> None:
    client = ParameterClient(42, 1, bytewise=False)
    client.read(["EK3_SRC1_POSXY"])
    message = client.due(0)
    assert message is not None
    asked = said(message)
    assert (asked.target_system, asked.target_component, asked.param_index) == (42, 1, -1)
    assert asked.param_id == "EK3_SRC1_POSXY"


@given(st.integers(-(2**31), 2**31 - 1))
def test_any_integer_survives_px4s_encoding_on_its_way_here(value: int) -> None:
    client = ParameterClient(1, 1, bytewise=True)
    client.take(Store({"N": (value, INT32)}, bytewise=True).told("N"))
    assert client.known["N"].value == value


@given(st.integers(-(2**20), 2**22))
def test_any_usual_integer_survives_px4s_encoding_on_its_way_there(value: int) -> None:
    assert struct.pack("<f", field_of(value, INT32, bytewise=True)) == struct.pack("<i", value)


def test_a_parameter_nobody_read_is_not_written() -> None:
    with pytest.raises(OperatorError, match="read it before writing"):
        ParameterClient(1, 1, bytewise=False).write("X", 1)


def test_a_value_its_type_cannot_hold_is_refused() -> None:
    client = ParameterClient(1, 1, bytewise=True)
    client.take(Store({"N": (0, INT32)}, bytewise=True).told("N"))
    with pytest.raises(OperatorError, match="cannot hold"):
        client.write("N", 0.5)
