"""Link URIs: which transport, to where."""

from __future__ import annotations

from dataclasses import dataclass

from tracker.errors import OperatorError

BITS_PER_BYTE = 10  # on a serial line: a start bit, eight data bits, a stop bit
FORMS = "udpout:HOST:PORT, udpin:HOST:PORT, serial:DEVICE:BAUD, tcp:HOST:PORT"
_MEMORY = "memory:"
_NUMBERED = ("udpout", "udpin", "serial", "tcp")


@dataclass(frozen=True, slots=True)
class Address:
    """A parsed URI. place: host, device or name.  number: port or baud, 0 for memory."""

    uri: str
    scheme: str
    place: str
    number: int


def parse(uri: str) -> Address:
    """Read a link URI. The place may hold colons (an IPv6 host, a by-path device): the last one parts it off.

    Raises:
        OperatorError: a form not known, a port outside 1..65535, a baud that is not positive.
    """
    scheme, _, rest = uri.partition(":")
    if scheme == "memory":
        return Address(uri, scheme, rest, 0)
    place, _, digits = rest.rpartition(":")
    number = _whole_number(digits)
    if scheme not in _NUMBERED or not place or number is None:
        raise OperatorError(f"link {uri!r}: not a link; known forms are {FORMS}")
    if scheme == "serial" and number <= 0:
        raise OperatorError(f"link {uri}: baud {number} must be positive; 57600, 115200 and 921600 are usual")
    if scheme != "serial" and not 1 <= number <= 65535:
        raise OperatorError(f"link {uri}: port {number} must be 1 to 65535; 14550 is the usual UDP port")
    return Address(uri, scheme, place.strip("[]") if scheme != "serial" else place, number)


def on_paper(uri: str) -> str:
    """Return the URI of the link that ends in this process in another's place, its own name for one that does."""
    return uri if uri.startswith(_MEMORY) else _MEMORY + uri


def line_bytes_s(uri: str) -> float | None:
    """Return what a link's line carries each way by its URI [B/s]; None where that is no limit, or not known.

    A link on paper counts as the one it stands for.
    """
    scheme, _, rest = uri.removeprefix(_MEMORY).partition(":")
    baud = _whole_number(rest.rpartition(":")[2])
    return None if scheme != "serial" or baud is None or baud <= 0 else baud / BITS_PER_BYTE


def _whole_number(digits: str) -> int | None:
    try:
        return int(digits)
    except ValueError:
        return None
