"""A source URI of the command line, opened, with the rig it is to be seen by."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.clock import Clock, ReplayClock
from bridge.links import Deliver
from bridge.log.footage import LogSource
from bridge.settings import ChosenRig, Settings, rig_of
from bridge.settings.models import CameraSettings
from tools.request import Clocks
from tracker.sources.devices import BY_PLUG, is_numbered, plugged_cameras
from tracker.sources.live import LiveSource
from tracker.sources.live_camera import LiveCamera
from tracker.sources.paths import scripted_path
from tracker.sources.protocol import Source
from tracker.sources.recording import RecordingSource
from tracker.sources.sim import START_NS, SimSource
from tracker.sources.uri import SourceKind, SourceUri, parse_source
from tracker.sources.video import VideoSource


@dataclass(frozen=True, slots=True, eq=False)
class OpenedSource:
    """A source and its rig.

    live: its frames come by themselves, in the host's monotonic time; `--pace` does not apply.
    warnings: one line each for what the operator should know but need not mend.
    clock: the stream time of a source that knows its own, for pace `fast`; None for that of its frames.
    troubles: gives more such lines once the source has ended.
    reconnect: lets what the links of a logged flight received come in again, at that clock's pace, given the inlets of
        those that end in this process, by URI.
    """

    source: Source
    chosen: ChosenRig
    live: bool
    warnings: tuple[str, ...] = ()
    clock: Clock | None = None
    troubles: Callable[[], tuple[str, ...]] = tuple
    reconnect: Callable[[Mapping[str, Deliver]], object] = dict


def open_source(text: str, settings: Settings, clocks: Clocks) -> OpenedSource:
    """Open what a source URI names and choose the rig for it.

    Raises:
        OperatorError: not a source, not there, or with cameras other than the rig's.
    """
    uri = parse_source(text)
    return _OPENERS[uri.kind](uri, settings, clocks)


def _open_recording(uri: SourceUri, settings: Settings, clocks: Clocks) -> OpenedSource:
    source = RecordingSource(Path(uri.argument), clocks.stopwatch)
    return OpenedSource(source, rig_of(settings, source.cameras, source.camera_count), live=False)


def _open_video(uri: SourceUri, settings: Settings, clocks: Clocks) -> OpenedSource:
    chosen = rig_of(settings, None, len(uri.items))
    paths = tuple(Path(item) for item in uri.items)
    return OpenedSource(
        VideoSource(paths, clocks.stopwatch, expected=chosen.rig.cameras), chosen, False, doubts_of(chosen)
    )


def _open_cameras(uri: SourceUri, settings: Settings, clocks: Clocks) -> OpenedSource:
    addresses = uri.items or ("0", "1")
    chosen = rig_of(settings, None, len(addresses))
    named = {camera.name: camera for camera in settings.rig.cameras}
    cameras = tuple(
        live_camera(address, camera.name, (camera.width_px, camera.height_px), named.get(camera.name))
        for address, camera in zip(addresses, chosen.rig.cameras, strict=True)
    )
    source = LiveSource(cameras, clocks.monotonic, clocks.stopwatch)
    return OpenedSource(source, chosen, live=True, warnings=(*source.warnings, *doubts_of(chosen, addresses)))


def _open_simulation(uri: SourceUri, settings: Settings, clocks: Clocks) -> OpenedSource:
    chosen = rig_of(settings, None)
    path = scripted_path(uri.argument, START_NS)
    return OpenedSource(SimSource(chosen.rig, path, clocks.stopwatch), chosen, live=False)


def _open_log(uri: SourceUri, settings: Settings, clocks: Clocks) -> OpenedSource:
    source = LogSource(Path(uri.argument), clocks.stopwatch)
    chosen = rig_of(settings, source.cameras, source.camera_count)
    return OpenedSource(
        source,
        chosen,
        live=False,
        clock=ReplayClock(source),
        troubles=lambda: source.troubles,
        reconnect=source.deliver_to,
    )


def doubts_of(chosen: ChosenRig, addresses: Sequence[str] = ()) -> tuple[str, ...]:
    """Warn of real cameras seen by a drawing, and of calibrated ones that may change places.

    Two that face each other, exchanged, fit as well as before: only the room is turned.
    """
    if chosen.nominal:
        return ("the cameras are not calibrated: the config's nominal ones do for a look, not for flight",)
    numbered = [address for address in addresses if is_numbered(address)]
    if not numbered:
        return ()
    named = plugged_cameras()
    devices = [f"/dev/video{address}" if address.isdecimal() else address for address in numbered]
    names = ",".join(named.get(device, device) for device in devices) if named else f"{BY_PLUG}/..."
    return (f"cameras by number change places when plugged anew (docs/rig.md): name them by their plugs, {names}",)


def live_camera(address: str, name: str, size_px: tuple[int, int], settings: CameraSettings | None) -> LiveCamera:
    """Describe a camera: its size by its calibration, the rest by the config's camera of the same name, if any."""
    width_px, height_px = size_px
    if settings is None:
        return LiveCamera(address, name, width_px=width_px, height_px=height_px)
    return LiveCamera(
        address,
        name,
        fps=settings.frame_rate_hz,
        width_px=width_px,
        height_px=height_px,
        fourcc=settings.fourcc,
        exposure_ms=settings.exposure_ms,
        latency_ms=settings.latency_ms,
        lock=settings.lock,
    )


_OPENERS: Mapping[SourceKind, Callable[[SourceUri, Settings, Clocks], OpenedSource]] = {
    SourceKind.RECORDING: _open_recording,
    SourceKind.VIDEO: _open_video,
    SourceKind.CAMERA: _open_cameras,
    SourceKind.SIM: _open_simulation,
    SourceKind.LOG: _open_log,
}
