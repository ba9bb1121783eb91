"""A .tlog taken apart by hand: eight bytes of time, then a frame, again and again."""

from __future__ import annotations


def frames_in(tlog: bytes) -> list[bytes]:
    """Return the whole frames of a .tlog; one that was cut off at its end is left out."""
    frames, at = [], 0
    while at + 11 <= len(tlog):
        marker, length, flags = tlog[at + 8 : at + 11]
        size = 8 + length if marker == 0xFE else 12 + length + 13 * (flags & 1)
        if at + 8 + size > len(tlog):
            break
        frames.append(tlog[at + 8 : at + 8 + size])
        at += 8 + size
    return frames
