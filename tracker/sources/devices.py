"""The cameras that are plugged in, by names that stay: the kernel numbers them anew at each start and each plugging."""

from __future__ import annotations

from pathlib import Path

BY_PLUG = Path("/dev/v4l/by-path")
_FIRST_STREAM = "*-video-index0"  # a camera's other nodes carry no pictures


def plugged_cameras(folder: Path = BY_PLUG) -> dict[str, str]:
    """Return the device of each camera, such as /dev/video2, with its name by the plug it is in; devices in order."""
    named: dict[str, str] = {}
    for link in sorted(folder.glob(_FIRST_STREAM)):
        named.setdefault(str(link.resolve()), str(link))  # newer systems name a plug twice
    return dict(sorted(named.items()))


def is_numbered(address: str) -> bool:
    """Say whether an address is a device's number, or its path by number."""
    return address.isdecimal() or address.startswith("/dev/video")
