"""Signatures on one link: made on what goes out, asked of what comes in."""

from __future__ import annotations

import hmac
from hashlib import sha256

from bridge.signing.stamps import Stamps

SIGNED = 0x01  # the incompatibility flag
BLOCK_BYTES = 13
_SIGNATURE_BYTES = 6
_MARKER_2 = 0xFD
_MINUTE = 60 * 100_000
_MOST_STREAMS = 256
RADIO_STATUS = 109
"""Telemetry radios make it themselves and hold no key: the one message that is taken unsigned."""

Stream = tuple[int, int, int]


class Signing:
    """One link's signatures.

    secret: 32 bytes.  link_id: 0..255, different for every link of one system.  stamps: shared by all links.
    refused: frames that came in with no right signature, or a replayed one.

    Source: MAVLink's message signing: the first 48 bits of SHA-256 over the key, the frame, the link's id and the
    timestamp. A stream is known by link, system and component; its timestamps grow, and a new one may lie a minute
    behind our own newest at most. A stream's timestamp is remembered only once its signature is right, so that a forged
    frame cannot shut a true one out.
    """

    def __init__(self, secret: bytes, link_id: int, stamps: Stamps) -> None:
        self._secret = secret
        self._link_id = link_id % 256
        self._stamps = stamps
        self._streams: dict[Stream, int] = {}
        self.refused = 0

    def sign(self, frame: bytes) -> bytes:
        """Return a whole frame, its `SIGNED` flag already set and in its checksum, with the signature behind it."""
        block = bytes((self._link_id,)) + self._stamps.take().to_bytes(6, "little")
        return frame + block + self._signature(frame + block)

    def admits(self, frame: bytes, message_id: int, system_id: int, component_id: int) -> bool:
        """Say whether a whole, valid frame is to be believed, and count it if not."""
        if message_id == RADIO_STATUS or self._is_right(frame, system_id, component_id):
            return True
        self.refused += 1
        return False

    def _is_right(self, frame: bytes, system_id: int, component_id: int) -> bool:
        if frame[0] != _MARKER_2 or not frame[2] & SIGNED:
            return False
        if not hmac.compare_digest(self._signature(frame[:-_SIGNATURE_BYTES]), frame[-_SIGNATURE_BYTES:]):
            return False
        timestamp = int.from_bytes(frame[-BLOCK_BYTES + 1 : -_SIGNATURE_BYTES], "little")
        stream = frame[-BLOCK_BYTES], system_id, component_id
        last = self._streams.get(stream)
        if last is None and len(self._streams) >= _MOST_STREAMS:
            return False
        if timestamp <= (self._stamps.newest - _MINUTE if last is None else last):
            return False
        self._streams[stream] = timestamp
        self._stamps.heard(timestamp)
        return True

    def _signature(self, signed: bytes) -> bytes:
        return sha256(self._secret + signed).digest()[:_SIGNATURE_BYTES]
