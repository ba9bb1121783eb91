"""Lines on who is at the far end: which autopilot, what firmware, over which port, with which origin."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from bridge.dialogue import DialogueState
from bridge.dialogue.origin import SAME_M, OriginState
from bridge.dialogue.peer import Autopilot, Peer
from bridge.preflight import ardupilot
from bridge.preflight.hearing import Hearing
from bridge.preflight.parameters import Parameter
from bridge.preflight.requests import POSITION, VERSION
from bridge.preflight.verdict import Line, Mark
from bridge.wire import Received

OLDEST: Mapping[Autopilot, tuple[int, int, str]] = {
    Autopilot.ARDUPILOT: (4, 1, "4.1: EK3_SRC1_* came with it"),
    Autopilot.PX4: (1, 14, "1.14: EKF2_EV_CTRL came with it"),
}
PX4_JUMPS = (1, 16)
"""The first PX4 that mistakes the height above the room for one above the sea."""

_KINDS = ((255, "official"), (192, "release candidate"), (128, "beta"), (64, "alpha"), (0, "development"))
_BAUDS = {1: 1200, 2: 2400, 4: 4800, 9: 9600, 19: 19200, 38: 38400, 57: 57600, 111: 111100, 115: 115200,
          230: 230400, 256: 256000, 460: 460800, 500: 500000, 921: 921600}  # fmt: skip
SLOW_BAUD = 460_800
PAIR_BYTES = 198  # VISION_POSITION_ESTIMATE and VISION_SPEED_ESTIMATE, as sent
MAVLINK_PORTS = (1, 2)


def who_lines(hearing: Hearing, peer: Peer, system_id: int | None) -> Iterator[Line]:
    """Yield the lines on the autopilot itself. system_id: the config's, None for none."""
    found = f"{peer.autopilot}, system {peer.system_id}" + (", ARMED" if hearing.armed else ", disarmed")
    if hearing.armed:
        yield Line(Mark.FAIL, "autopilot", found, "disarmed", "disarm it: a check is made on the ground")
    else:
        yield Line(Mark.PASS, "autopilot", found, "one, disarmed")
    if hearing.others:
        yield _others_line(hearing.others, system_id)
    yield _firmware_line(hearing, peer)
    if hearing.version_1:
        fix = "set SERIALn_PROTOCOL 2 of this port and reboot; PX4: MAV_PROTO_VER 2"
        yield Line(Mark.FAIL, "protocol", "MAVLink 1", "MAVLink 2: covariance and reset counter need it", fix)


def _others_line(others: set[int], system_id: int | None) -> Line:
    found = f"{', '.join(str(each) for each in sorted(others))} as well"
    if system_id is not None:
        return Line(Mark.WARN, "other autopilots", found, "none; it is ignored", "take it off this link")
    fix = "set [mavlink] system_id to the one you mean, else the first one heard is taken, or give it a link of its own"
    return Line(Mark.FAIL, "other autopilots", found, "none", fix)


def _firmware_line(hearing: Hearing, peer: Peer) -> Line:
    version = _version(hearing)
    oldest = OLDEST.get(peer.autopilot)
    needed = "known" if oldest is None else f"at least {oldest[2]}"
    if version is None:
        fix = f"it sends no {VERSION}: read the version at its ground station"
        return Line(Mark.UNKNOWN if oldest else Mark.WARN, "firmware", "not told", needed, fix)
    major, minor, patch, kind = version
    found = f"{major}.{minor}.{patch} {next(name for least, name in _KINDS if kind >= least)}"
    if oldest is not None and (major, minor) < oldest[:2]:
        return Line(Mark.FAIL, "firmware", found, needed, "update the firmware")
    return Line(Mark.PASS, "firmware", found, needed)


def _version(hearing: Hearing) -> tuple[int, int, int, int] | None:
    """Return major, minor, patch and kind of the firmware; None where it was not told."""
    version = hearing.last.get(VERSION)
    if version is None:
        return None
    major, minor, patch, kind = version.whole("flight_sw_version").to_bytes(4, "big")
    return major, minor, patch, kind


def origin_line(state: DialogueState, hearing: Hearing, configured: bool) -> Line:
    """Return the line on the origin. configured: the config has one to tell."""
    what, needed = "origin", "set, and proved by its global position"
    found = hearing.last.get("GPS_GLOBAL_ORIGIN")
    if state.peer is not None and state.peer.autopilot is Autopilot.PX4 and found is not None:
        return _px4_origin_line(found, _version(hearing))
    if not state.origin:
        return Line(Mark.PASS, what, f"not needed by profile {state.profile}", "")
    place = hearing.last.get("GLOBAL_POSITION_INT")
    if state.origin == OriginState.SET and place is not None and place.whole("lat") and place.whole("lon"):
        where = ", ".join(f"{place.whole(axis) / 1e7:.5f}" for axis in ("lat", "lon"))
        return Line(Mark.PASS, what, f"set, it is at {where}", needed)
    if state.origin in (OriginState.SET, OriginState.LOST) and POSITION not in hearing.last:
        fix = "it has no position yet, and proves its origin only with one: mend the other lines first"
        return Line(Mark.UNKNOWN, what, "acknowledged, not proved", needed, fix)
    if state.origin == OriginState.SET:
        fix = "it acknowledged one, and does not know where it is: wait 15 s with poses; if that stays, reboot it"
        return Line(Mark.FAIL, what, "set, not proved", needed, fix)
    if state.origin == OriginState.MISSING:
        fix = "add [origin] to the config, or set it on the ground station's map"
        return Line(Mark.FAIL, what, "none, and the config names none", needed, fix)
    if state.origin in (OriginState.LOST, OriginState.REFUSED):
        return Line(Mark.FAIL, what, state.origin, needed, "reboot the autopilot: the bridge then tells it anew")
    if state.origin == OriginState.UNCONFIRMED:
        fix = "see how much the link loses, or set the origin on the ground station's map"
        return Line(Mark.FAIL, what, state.origin, needed, fix)
    fix = "wait until its filter has started (keep it still), then check again"
    return Line(Mark.FAIL if configured else Mark.UNKNOWN, what, state.origin, needed, fix)


def _px4_origin_line(origin: Received, version: tuple[int, int, int, int] | None) -> Line:
    """Judge a PX4's origin: it needs none, and an altitude in it is dangerous (see `bridge.dialogue.origin`)."""
    what, needed = "origin", "none, or one of altitude 0"
    altitude_m = origin.whole("altitude") / 1e3
    where = ", ".join(f"{origin.whole(axis) / 1e7:.5f}" for axis in ("latitude", "longitude"))
    found = f"it is at {where}, {altitude_m:.0f} m"
    if abs(altitude_m) < SAME_M or (version is not None and version[:2] < PX4_JUMPS):
        return Line(Mark.PASS, what, found, needed)
    fix = (
        f"after a gap in the poses its height jumps by {altitude_m:.0f} m and it climbs as far: set no origin at the "
        "ground station and reboot; [origin] of the config it is told with altitude 0"
    )
    return Line(Mark.FAIL, what, found, needed, fix)


def port_line(known: Mapping[str, Parameter]) -> Line | None:
    """Return the line on ArduPilot's serial ports that speak MAVLink, None where none were told."""
    speaking = _speaking(known)
    if not speaking:
        return None
    found = ", ".join(f"SERIAL{port} {baud}" for port, baud in speaking.items())
    return Line(Mark.PASS, "MAVLink ports", found, "SERIALn_PROTOCOL 2, the wire's own baud")


def port_note(known: Mapping[str, Parameter]) -> str:
    """Return what is to be known of slow ports where the link is no serial one, empty for nothing.

    ArduPilot takes the time that a message needs at SERIALn_BAUD off its stamp, though it came by a faster way: right
    on a wire, early by as much behind Wi-Fi or in a simulator.
    """
    slow = {port: baud for port, baud in _speaking(known).items() if port > 0 and baud < SLOW_BAUD}
    if not slow:
        return ""
    port, baud = next(iter(slow.items()))
    early_ms = 1e4 * PAIR_BYTES / baud
    return (
        f"If this link ends at SERIAL{port} by a way faster than {baud} baud (Wi-Fi, a simulator), its stamps are "
        f"{early_ms:.0f} ms early: set SERIAL{port}_BAUD 921."
    )


def _speaking(known: Mapping[str, Parameter]) -> dict[int, int]:
    """Return the baud of each port that speaks MAVLink."""
    return {
        port: _baud(known[f"SERIAL{port}_BAUD"].value)
        for port in ardupilot.PORTS
        if f"SERIAL{port}_BAUD" in known
        and f"SERIAL{port}_PROTOCOL" in known
        and known[f"SERIAL{port}_PROTOCOL"].value in MAVLINK_PORTS
    }


def _baud(value: float) -> int:
    """Return the baud that a SERIALn_BAUD means: its old codes, thousands, or the number itself."""
    code = round(value)
    return _BAUDS.get(code, code * 1000 if code <= 2000 else code)
