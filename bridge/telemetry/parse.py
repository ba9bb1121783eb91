"""Read what claims to be a snapshot. Apart from `snapshot`, so that the bridge itself does not pay for the checks."""

from __future__ import annotations

import orjson
from pydantic import TypeAdapter, ValidationError

from bridge.telemetry.snapshot import VERSION, Snapshot
from tracker.errors import OperatorError

_ADAPTER = TypeAdapter(Snapshot)


def from_bytes(data: bytes) -> Snapshot | None:
    """Return the snapshot in a datagram, None if it is none.

    Raises:
        OperatorError: a snapshot of another version of this form.
    """
    try:
        value = orjson.loads(data)
    except orjson.JSONDecodeError:
        return None
    version = value.get("version") if isinstance(value, dict) else None
    if isinstance(version, int) and version != VERSION:
        raise OperatorError(
            f"the bridge speaks telemetry version {version}, this monitor {VERSION}; use the same posebridge for both"
        )
    try:
        return _ADAPTER.validate_json(data)
    except ValidationError:
        return None
