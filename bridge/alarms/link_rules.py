"""The rules of links and of the autopilots at their ends."""

from __future__ import annotations

from collections.abc import Iterator

from bridge.alarms.readings import Readings
from bridge.alarms.rule import Finding, Level, Rule, Verdict
from bridge.dialogue import DialogueState

HEARD_S = 10.0
SYNC_S = 15.0


def _link_down(now: Readings) -> Iterator[Finding]:
    for link in now.around.links:
        if not link.up:
            yield Finding(
                link.name,
                Verdict.BAD,
                f"link {link.name} is down: {link.reason}",
                "check that the autopilot has power, the cable, port and baud; it is tried again by itself",
            )


def _far_ends(now: Readings) -> Iterator[tuple[str, DialogueState]]:
    """Yield each link's URI and what is known of its far end."""
    for link, far in zip(now.around.links, now.around.far_ends, strict=False):
        yield link.name, far


def _link_full(now: Readings) -> Iterator[Finding]:
    for link, far in _far_ends(now):
        if far.full:
            yield Finding(
                link,
                Verdict.BAD,
                f"link {link} is full: poses go at the rate that fits, the newest first, whole messages only",
                "raise the baud here and at the autopilot, or send fewer messages (`messages` in [[links]])",
            )


def _autopilot_silent(now: Readings) -> Iterator[Finding]:
    for link, far in _far_ends(now):
        if far.away:
            yield Finding(
                link,
                Verdict.BAD,
                f"the autopilot on {link} has fallen silent",
                "check its power and the wire back from it; it is taken back by itself",
            )


def _yaw_wrong(now: Readings) -> Iterator[Finding]:
    for link, far in _far_ends(now):
        if far.yaw:
            yield Finding(
                link,
                Verdict.BAD,
                far.yaw,
                "take over by hand and land; then see marker and room_yaw_deg by `posebridge check --frame`",
            )


def _poses_held(now: Readings) -> Iterator[Finding]:
    for link, far in _far_ends(now):
        if far.holding:
            yield Finding(
                link,
                Verdict.BAD,
                f"no poses go to {link}: {far.holding}",
                "wait for its EKF; if it stays so, see the origin in docs/autopilots.md",
            )


def _autopilot_unheard(now: Readings) -> Iterator[Finding]:
    for link, far in _far_ends(now):
        if far.peer is None and now.running_s > HEARD_S:
            yield Finding(
                link,
                Verdict.BAD,
                f"no autopilot heard on {link} in {now.running_s:.0f} s: poses go out, nobody says that they arrive",
                "connect both wires; give the port MAVLink 2 (ArduPilot: SERIALn_PROTOCOL 2) and the right baud",
            )


def _time_sync(now: Readings) -> Iterator[Finding]:
    for link, far in _far_ends(now):
        if far.peer is not None and not far.away and far.sync is None and now.running_s > SYNC_S:
            yield Finding(
                link,
                Verdict.BAD,
                f"no TIMESYNC reply on {link} was quick enough to use: the autopilot's clock is not known",
                "check that the round trip is under 10 ms: a faster baud, or fewer other streams on this port",
            )


LINK_RULES = (
    Rule("link_down", Level.ALARM, 0.5, 1.0, _link_down),
    Rule("link_full", Level.WARNING, 0.0, 0.0, _link_full),
    Rule("autopilot_silent", Level.ALARM, 0.0, 0.0, _autopilot_silent),
    Rule("yaw_wrong", Level.ALARM, 0.0, 2.0, _yaw_wrong),
    Rule("poses_held", Level.ALARM, 3.0, 0.0, _poses_held),
    Rule("autopilot_unheard", Level.WARNING, 0.0, 0.0, _autopilot_unheard),
    Rule("time_sync", Level.WARNING, 0.0, 1.0, _time_sync),
)
