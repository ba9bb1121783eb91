"""MAVLink 2 message signing: who holds the key is believed, nobody else."""

from bridge.signing.key import make_key
from bridge.signing.seal import Seal, open_seal
from bridge.signing.signature import Signing

__all__ = ["Seal", "Signing", "make_key", "open_seal"]
