"""Who flies and how it is wired: a program that is started, one that runs already, or the simulated autopilot."""

from __future__ import annotations

import re
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from bridge.settings import Settings
from tools.simulate.autopilot.parameters import FOR_VISION
from tools.simulate.helicopter import Helicopter
from tools.sitl.airframe import VEHICLE
from tools.sitl.ground import GroundStation
from tools.sitl.late import LateWire
from tools.sitl.lockstep import PHYSICS_PORT
from tools.sitl.pilots import ArduPilot, Own, Radio
from tools.sitl.process import Simulator, Wiring
from tools.sitl.radio import RADIO_PORT, free_port
from tools.sitl.relay import Relay
from tools.sitl.setup import parameter_file
from tools.sitl.wire import TcpWire, UdpWire
from tools.sitl.world import Pilot
from tracker.errors import OperatorError

PARAMETERS = "vision.parm"
BRIDGE_PORT_ABOVE = 2
"""ArduPilot's SERIAL1 listens two ports above SERIAL0."""

_TCP = re.compile(r"tcp:([^:]+):(\d{1,5})")


@dataclass(frozen=True, slots=True, eq=False)
class Aboard:
    """An autopilot with its two wires and the vehicle it flies; whoever made it closes it."""

    pilot: Pilot
    ground: GroundStation
    relay: Relay
    helicopter: Helicopter


@dataclass(frozen=True, slots=True)
class Conditions:
    """What an autopilot is told at its start.

    room_yaw_deg: heading of the room's x axis.  home: latitude, longitude [deg], altitude [m] of the room's origin.
    delay_ms: age of a picture when the tracker gets it.  start_ns: simulated time of the start.
    """

    room_yaw_deg: float
    home: tuple[float, float, float]
    delay_ms: int
    start_ns: int


def home_of(settings: Settings) -> tuple[float, float, float]:
    """Return latitude, longitude [deg] and altitude [m] of the room's origin.

    Raises:
        OperatorError: a config without one.
    """
    origin = settings.origin
    if origin is None:
        raise OperatorError("sitl: the config names no [origin]; ArduPilot flies with none, so add one as in lab.toml")
    return origin.latitude_deg, origin.longitude_deg, origin.altitude_m


def simulated(given: Conditions) -> Aboard:
    """Switch the project's simulated autopilot on."""
    pilot = Own({**FOR_VISION, "VISO_DELAY_MS": given.delay_ms}, given.start_ns)
    ground, relay = (UdpWire(("127.0.0.1", port)) for port in (pilot.ground_port, pilot.bridge_port))
    return Aboard(pilot, GroundStation(ground), Relay(relay), Helicopter())


def started(binary: Path, folder: Path, given: Conditions, radio: Radio, stack: ExitStack) -> Aboard:
    """Start ArduPilot's program in a folder; the stack ends it.

    Raises:
        OperatorError: no program there.
    """
    radio_port = free_port()
    pilot = ArduPilot(given.room_yaw_deg, radio, given.start_ns, 0, radio_port)
    ground, bridge = UdpWire(), UdpWire()
    aboard = Aboard(pilot, GroundStation(ground), Relay(bridge), VEHICLE)
    try:
        wiring = Wiring(pilot.port, ground.port, bridge.port, radio_port)
        simulator = Simulator(binary, folder, wiring, given.home, parameter_file(given.delay_ms, {}))
    except OperatorError:
        close(aboard)
        raise
    stack.callback(simulator.close)
    return aboard


def running(uri: str, folder: Path, given: Conditions, radio: Radio) -> Aboard:
    """Take ArduPilot's program that runs already, with its physics at 127.0.0.1 and its serial ports at TCP ports.

    The parameters it wants are left in the folder.

    Raises:
        OperatorError: a URI of another form, nobody there, or a physics port that is taken.
    """
    form = _TCP.fullmatch(uri)
    if form is None:
        raise OperatorError(f"--connect {uri}: must be tcp:HOST:PORT, SERIAL0 of an ArduPilot SITL")
    (folder / PARAMETERS).write_text(parameter_file(given.delay_ms, {}), encoding="utf-8")
    host, port = form[1], int(form[2])
    with ExitStack() as opened:
        pilot = ArduPilot(given.room_yaw_deg, radio, given.start_ns, PHYSICS_PORT, RADIO_PORT)
        opened.callback(pilot.close)
        ground = _ground_wire(host, port, folder / PARAMETERS)
        opened.pop_all()
    return Aboard(pilot, GroundStation(ground), Relay(LateWire(host, port + BRIDGE_PORT_ABOVE)), VEHICLE)


def _ground_wire(host: str, port: int, parameters: Path) -> TcpWire:
    try:
        return TcpWire(host, port)
    except OperatorError as error:
        raise OperatorError(
            f"--connect: {error}; start ArduPilot's SITL with --model JSON:127.0.0.1 --speedup 100 --wipe "
            f"--defaults {parameters.resolve()} (docs/sitl.md)"
        ) from error


def close(aboard: Aboard) -> None:
    """Let go of autopilot, ground station and wire."""
    aboard.pilot.close()
    aboard.ground.close()
    aboard.relay.close()
