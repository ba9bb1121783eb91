"""What an autopilot is sent: one profile a kind, with the reason for each choice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bridge.dialogue.peer import Autopilot


@dataclass(frozen=True, slots=True)
class Profile:
    """What one kind of autopilot is sent.

    messages: names, at every estimate that goes.
    spacing_ns: estimates whose stamps follow the last one sent by less are left out [ns].
    needs_origin: whether it must be told a global origin before poses mean anything to it.
    least_rate_hz: below this it stops using the poses.
    """

    name: str
    messages: tuple[str, ...]
    spacing_ns: int
    needs_origin: bool
    least_rate_hz: float


PROFILES: Mapping[str, Profile] = MappingProxyType(
    {
        profile.name: profile
        for profile in (
            # Velocity besides the position: measured an eighth of the EKF error, and only with it can ArduPilot's EKF
            # failsafe act on a wrong yaw. Never ATT_POS_MOCAP beside it: it has no reset_counter, counts as 0, and
            # ArduPilot takes any change of the counter, from one message to the next too, for a reset. EKF3 drops
            # samples less than 20 ms apart: it is better that we choose which, and its link stays free.
            Profile("ardupilot", ("VISION_POSITION_ESTIMATE", "VISION_SPEED_ESTIMATE"), 20_000_000, True, 4.0),
            # ODOMETRY carries pose, velocity, rates and both covariances in one message, all of which EKF2 fuses; it
            # starts vision only with gaps under 200 ms, that is 5 Hz.
            Profile("px4", ("ODOMETRY",), 10_000_000, False, 5.0),
            # Nobody known: both poses, as the paper's controller reads either.
            Profile("generic", ("VISION_POSITION_ESTIMATE", "ATT_POS_MOCAP"), 0, False, 0.0),
        )
    }
)

AUTO = "auto"
WITHOUT_COUNTER = "ATT_POS_MOCAP"
_OWN = MappingProxyType({Autopilot.ARDUPILOT: "ardupilot", Autopilot.PX4: "px4"})


def profile_for(chosen: str, autopilot: Autopilot | None) -> Profile:
    """Return the profile of a config's choice; `auto` goes by the autopilot, unknown ones are `generic`."""
    if chosen != AUTO:
        return PROFILES[chosen]
    return PROFILES["generic" if autopilot is None else _OWN.get(autopilot, "generic")]


def kept_apart(messages: tuple[str, ...], autopilot: Autopilot) -> tuple[str, ...]:
    """Return the messages without those that would fight with the others.

    ArduPilot takes any change of the reset counter for a reset, from one message to the next too, and counts it as 0 in
    ATT_POS_MOCAP, which has none: beside another pose that says 1 it resets at every message and flies away.
    """
    if autopilot is not Autopilot.ARDUPILOT or len(messages) == 1:
        return messages
    return tuple(name for name in messages if name != WITHOUT_COUNTER)
