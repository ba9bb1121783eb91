"""Settings to the terms of each link's talk."""

from __future__ import annotations

from bridge.dialogue import Origin, Terms
from bridge.settings.models import Settings


def terms_of(settings: Settings) -> tuple[tuple[str, Terms], ...]:
    """Return each link's URI with the terms of the talk over it."""
    told, mavlink = settings.origin, settings.mavlink
    origin = None if told is None else Origin(told.latitude_deg, told.longitude_deg, told.altitude_m)
    age_ns = round(mavlink.max_age_ms * 1e6)
    return tuple(
        (link.uri, Terms(mavlink.profile, link.messages, mavlink.system_id, origin, age_ns)) for link in settings.links
    )
