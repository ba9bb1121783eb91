"""ArduPilot's simulator as a child process that speaks to loopback and listens to nobody."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

from tracker.errors import OperatorError

_PATIENCE_S = 5.0


@dataclass(frozen=True, slots=True)
class Wiring:
    """UDP ports of 127.0.0.1: the simulator calls those of physics, ground station and bridge, and listens at radio."""

    physics: int
    ground: int
    bridge: int
    radio: int


class Simulator:
    """Run the binary in a folder of its own; its output goes to sitl.out there."""

    def __init__(
        self, binary: Path, folder: Path, wiring: Wiring, home: tuple[float, float, float], parameters: str
    ) -> None:
        """Start it, with all parameters at their defaults but those given.

        home: latitude, longitude [deg] and altitude [m] of the room's origin.

        Raises:
            OperatorError: no program there, or one that does not start.
        """
        if not binary.is_file() or not os.access(binary, os.X_OK):
            raise OperatorError(f"--binary {binary}: no program there; docs/sitl.md says how to get one")
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "vision.parm").write_text(parameters, encoding="utf-8")
        self.printed = folder / "sitl.out"
        with self.printed.open("wb") as out:
            self._process = subprocess.Popen(
                [binary.resolve(), *arguments(wiring, home)],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
            )

    def close(self) -> None:
        """End it."""
        self._process.terminate()
        try:
            self._process.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def arguments(wiring: Wiring, home: tuple[float, float, float]) -> list[str]:
    """Return the simulator's command line.

    Serial ports are UDP clients: none listens, where `tcp:0` would be open to the whole network. Its radio's port is
    open to all the same; it is another each time. `--speedup` is beyond
    reach, so that it never sleeps: the physics decide how time goes.
    """
    return [
        *("--model", "JSON:127.0.0.1", "--sim-port-out", str(wiring.physics)),
        *("--speedup", "100", "-I0", "--wipe", "--home", ",".join(f"{each:.7f}" for each in (*home, 0.0))),
        *("--defaults", "vision.parm", "--rc-in-port", str(wiring.radio)),
        *("--serial0", f"udpclient:127.0.0.1:{wiring.ground}"),
        *("--serial1", f"udpclient:127.0.0.1:{wiring.bridge}"),
        *("--serial2", "none:", "--serial3", "none:", "--serial4", "none:"),
    ]
