"""Settings to the terms of each link's talk."""

from __future__ import annotations

from bridge.dialogue import Origin, Terms
from bridge.dialogue.streams import Wanted
from bridge.links import line_bytes_s
from bridge.settings.models import LinkSettings, MavlinkSettings, Settings


def terms_of(settings: Settings, *, logged: bool = False) -> tuple[tuple[str, Terms], ...]:
    """Return each link's URI with the terms of the talk over it.

    logged: whether a log is kept; only for that is the autopilot asked to tell of itself.
    """
    told, mavlink = settings.origin, settings.mavlink
    origin = None if told is None else Origin(told.latitude_deg, told.longitude_deg, told.altitude_m)
    age_ns = round(mavlink.max_age_ms * 1e6)
    return tuple(
        (
            link.uri,
            Terms(
                mavlink.profile,
                link.messages,
                mavlink.system_id,
                origin,
                age_ns,
                Wanted(_streams_hz(link, mavlink) if logged else 0.0, line_bytes_s(link.uri)),
            ),
        )
        for link in settings.links
    )


def _streams_hz(link: LinkSettings, mavlink: MavlinkSettings) -> float:
    """Return how often the autopilot shall tell of itself over a link, whose own word outweighs that for all [Hz]."""
    return mavlink.streams_hz if link.streams_hz is None else link.streams_hz
