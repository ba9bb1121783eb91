"""What others ask of the autopilot by MAVLink: parameters, message rates, the origin, commands.

Requests to another system id are passed over. Vision and heartbeats are not requests: ArduPilot takes them from any
system id unless told otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Protocol

from bridge.dialect import enum, make_message
from bridge.wire import FieldValue, Message, Received
from tools.simulate.autopilot.origins import Origin
from tools.simulate.autopilot.parameters import Parameter, Parameters
from tools.simulate.autopilot.port import Port
from tools.simulate.autopilot.reports import NUMBERS, Snapshot, report

ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
"""MAV_RESULT."""

SET_GLOBAL_ORIGIN = 611
"""MAV_CMD_DO_SET_GLOBAL_ORIGIN, younger than the dialect pymavlink ships."""


class Vessel(Protocol):
    """What requests may reach of the autopilot."""

    @property
    def parameters(self) -> Parameters:
        """Return its parameters."""

    def snapshot(self) -> Snapshot:
        """Return how it stands now."""

    def set_origin(self, origin: Origin) -> bool:
        """Set the filter's origin; say whether it was taken."""

    def command(self, number: int, values: tuple[float, ...]) -> int | None:
        """Do a command that moves the vehicle or its modes; return its MAV_RESULT, None for one not known."""


def answer(message: Received, port: Port, vessel: Vessel, system_id: int) -> None:
    """Answer a message on the port it came by, if it asks for anything."""
    asked = message.fields.get("target_system", 0)
    if message.message in _ANSWERS and asked in (0, system_id):
        for reply in _ANSWERS[message.message](message.fields, port, vessel):
            port.send(reply)


def _timesync(fields: Mapping[str, FieldValue], _port: Port, vessel: Vessel) -> list[Message]:
    if fields["tc1"] != 0:
        return []  # an answer to its own question: logged there, used for nothing
    now_ns = vessel.snapshot().now_ns
    return [make_message("TIMESYNC", now_ns, tc1=now_ns, ts1=fields["ts1"])]


def _parameter_read(fields: Mapping[str, FieldValue], _port: Port, vessel: Vessel) -> list[Message]:
    index = _number(fields, "param_index")
    parameter = vessel.parameters.get(str(fields["param_id"]), round(index))
    return [] if parameter is None else [_value(parameter)]


def _parameter_list(_fields: Mapping[str, FieldValue], _port: Port, vessel: Vessel) -> list[Message]:
    return [_value(parameter) for parameter in vessel.parameters]


def _parameter_set(fields: Mapping[str, FieldValue], _port: Port, vessel: Vessel) -> list[Message]:
    parameter = vessel.parameters.set(str(fields["param_id"]), _number(fields, "param_value"))
    return [] if parameter is None else [_value(parameter)]


def _value(parameter: Parameter) -> Message:
    return make_message(
        "PARAM_VALUE",
        0,
        param_id=parameter.name,
        param_value=parameter.value,
        param_type=parameter.kind,
        param_count=parameter.count,
        param_index=parameter.index,
    )


def _set_origin(fields: Mapping[str, FieldValue], _port: Port, vessel: Vessel) -> list[Message]:
    """Answer with GPS_GLOBAL_ORIGIN; a refusal is silent."""
    place = Origin(*(round(_number(fields, name)) for name in ("latitude", "longitude", "altitude")))
    return _told("GPS_GLOBAL_ORIGIN", vessel) if vessel.set_origin(place) else []


def _command_long(fields: Mapping[str, FieldValue], port: Port, vessel: Vessel) -> list[Message]:
    values = tuple(_number(fields, f"param{k}") for k in range(1, 8))
    return _command(round(_number(fields, "command")), values, port, vessel)


def _command_int(fields: Mapping[str, FieldValue], port: Port, vessel: Vessel) -> list[Message]:
    number = round(_number(fields, "command"))
    values = tuple(_number(fields, name) for name in ("param1", "param2", "param3", "param4", "x", "y", "z"))
    if number == SET_GLOBAL_ORIGIN:
        place = Origin(round(values[4]), round(values[5]), round(1000 * values[6]))
        taken = vessel.set_origin(place)
        return [_ack(number, ACCEPTED if taken else FAILED)] + (_told("GPS_GLOBAL_ORIGIN", vessel) if taken else [])
    return _command(number, values, port, vessel)


def _command(number: int, values: tuple[float, ...], port: Port, vessel: Vessel) -> list[Message]:
    if number == enum("MAV_CMD_SET_MESSAGE_INTERVAL"):
        return [_ack(number, _set_interval(round(values[0]), values[1], port))]
    if number == enum("MAV_CMD_REQUEST_MESSAGE"):
        told = _told(NUMBERS.get(round(values[0]), ""), vessel)
        return [_ack(number, ACCEPTED if told else FAILED), *told]
    result = vessel.command(number, values)
    return [_ack(number, UNSUPPORTED if result is None else result)]


def _set_interval(message_id: int, interval_us: float, port: Port) -> int:
    """Set a message's rate: -1 stops it, 0 is the default, here none."""
    name = NUMBERS.get(message_id)
    if name is None:
        return FAILED
    if interval_us > 0:
        port.wanted[name] = round(1000 * interval_us)
    else:
        port.wanted.pop(name, None)
    return ACCEPTED


def _told(name: str, vessel: Vessel) -> list[Message]:
    message = report(name, vessel.snapshot())
    return [] if message is None else [message]


def _ack(number: int, result: int) -> Message:
    return make_message("COMMAND_ACK", 0, command=number, result=result)


def _number(fields: Mapping[str, FieldValue], name: str) -> float:
    value = fields[name]
    return float(value) if isinstance(value, int | float) else 0.0


_ANSWERS: Mapping[str, Callable[[Mapping[str, FieldValue], Port, Vessel], list[Message]]] = MappingProxyType(
    {
        "TIMESYNC": _timesync,
        "PARAM_REQUEST_READ": _parameter_read,
        "PARAM_REQUEST_LIST": _parameter_list,
        "PARAM_SET": _parameter_set,
        "SET_GPS_GLOBAL_ORIGIN": _set_origin,
        "COMMAND_LONG": _command_long,
        "COMMAND_INT": _command_int,
    }
)
