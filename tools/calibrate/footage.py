"""Pictures to calibrate by, put together to instants. No rig is needed: it is what is to be found."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from bridge.log.footage import LogSource
from bridge.settings import Settings
from tools.open_source import live_camera
from tools.request import Clocks
from tracker.errors import OperatorError
from tracker.rig import MAX_CAMERAS
from tracker.sources.image import decode_image
from tracker.sources.live import LiveSource
from tracker.sources.live_camera import LiveCamera
from tracker.sources.protocol import Source
from tracker.sources.recording import RecordingSource
from tracker.sources.uri import SourceKind, SourceUri, parse_source
from tracker.sources.video import VideoSource
from tracker.types import Event, Frame, Image

IMAGES = "images:"
APART_NS = 20_000_000  # frames further apart are of no one instant
STEP_NS = 200_000_000  # a hand-held board shows little new in less
PATIENCE_NS = 10_000_000_000  # of a live source that gives nothing


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One camera's picture. name: to call it by.  t_ns: when it was taken [ns]; 0 for image files."""

    name: str
    t_ns: int
    image: Image


Instant = Mapping[int, Picture]
"""Pictures of one instant, by camera."""


@dataclass(frozen=True, slots=True, eq=False)
class Footage:
    """A source of instants.

    names: the cameras'.  chosen: somebody chose the pictures, so that all are wanted.
    live: it goes on until stopped.  opened: to be closed; entered before `instants` is read.
    """

    names: tuple[str, ...]
    instants: Iterator[Instant]
    chosen: bool
    live: bool
    opened: AbstractContextManager[object]
    warnings: tuple[str, ...] = ()


def open_footage(text: str, settings: Settings, clocks: Clocks) -> Footage:
    """Open `images:GLOB[,GLOB]`, one glob a camera, or any source URI that can show a board.

    Raises:
        OperatorError: no such source, no such files, or one that cannot show a board.
    """
    if text.strip().startswith(IMAGES):
        return read_images(text.strip().removeprefix(IMAGES))
    uri = parse_source(text)
    if uri.kind is SourceKind.SIM:
        raise OperatorError(f"source {text}: simulated rooms hold no board; give images:GLOB, video:, camera: or more")
    source = _source(uri, settings, clocks)
    cameras = source.cameras
    names = tuple(c.name for c in cameras) if cameras else _names(settings, source.camera_count)
    live = uri.kind is SourceKind.CAMERA
    warnings = source.warnings if isinstance(source, LiveSource) else ()
    return Footage(names, instants_of(source, source.camera_count), False, live, source, warnings)


def instants_of(events: Iterable[Event], camera_count: int) -> Iterator[Instant]:
    """Put frames together: those within 20 ms of the first; the next instant begins 0.2 s later or more.

    Ends with its source, or when that has given no frame for 10 s.
    """
    held: dict[int, Picture] = {}
    begun_ns: int | None = None
    last_ns: int | None = None
    for event in events:
        last_ns = event.t_ns if last_ns is None or isinstance(event, Frame) else last_ns
        if not isinstance(event, Frame):
            if event.t_ns - last_ns > PATIENCE_NS:
                break
            continue
        if begun_ns is not None and event.t_ns - begun_ns > APART_NS and held:
            yield held
            held = {}
        if begun_ns is None or event.t_ns - begun_ns >= STEP_NS:
            begun_ns = event.t_ns
        if event.t_ns - begun_ns <= APART_NS:
            held.setdefault(event.camera, Picture(f"{event.t_ns / 1e9:.3f} s", event.t_ns, event.image))
            if len(held) == camera_count:
                yield held
                held = {}
    if held:
        yield held


def _source(uri: SourceUri, settings: Settings, clocks: Clocks) -> Source:
    if uri.kind is SourceKind.RECORDING:
        return RecordingSource(Path(uri.argument), clocks.stopwatch)
    if uri.kind is SourceKind.VIDEO:
        return VideoSource(tuple(Path(item) for item in uri.items), clocks.stopwatch, fewest=1)
    if uri.kind is SourceKind.LOG:
        return LogSource(Path(uri.argument), clocks.stopwatch)
    return LiveSource(tuple(_live(uri, settings)), clocks.monotonic, clocks.stopwatch, fewest=1)


def _live(uri: SourceUri, settings: Settings) -> Iterator[LiveCamera]:
    """Describe the cameras, set up as the config has them: another focus or size would be another calibration."""
    known = settings.rig.cameras
    addresses = uri.items or ("0", "1")
    for k, (address, name) in enumerate(zip(addresses, _names(settings, len(addresses)), strict=True)):
        if k < len(known):
            yield live_camera(address, name, (known[k].width_px, known[k].height_px), known[k])
        else:
            yield LiveCamera(address, name)


def _names(settings: Settings, count: int) -> tuple[str, ...]:
    """Name the cameras as the config does, in its order."""
    known = [camera.name for camera in settings.rig.cameras]
    return tuple(known[k] if k < len(known) else f"cam{k}" for k in range(count))


def read_images(argument: str) -> Footage:
    """Open image files: `GLOB[,GLOB]`, a glob or a folder a camera.

    Raises:
        OperatorError: too many globs, or one that matches nothing.
    """
    patterns = [item.strip() for item in argument.split(",") if item.strip()]
    if not 1 <= len(patterns) <= MAX_CAMERAS:
        raise OperatorError(
            f"images: {len(patterns)} globs; 1 to {MAX_CAMERAS} work, one a camera: images:LEFT*,RIGHT*"
        )
    files = [_matching(pattern) for pattern in patterns]
    names = tuple(f"cam{k}" for k in range(len(files)))
    return Footage(names, _read(files), chosen=True, live=False, opened=nullcontext())


def _matching(pattern: str) -> list[Path]:
    path = Path(pattern).expanduser()
    found = sorted(path.iterdir()) if path.is_dir() else sorted(_globbed(path))
    files = [one for one in found if one.is_file()]
    if not files:
        raise OperatorError(f"images {pattern}: no such files; give a folder or a glob, in quotes: 'images:left*.jpg'")
    return files


def _globbed(path: Path) -> Iterator[Path]:
    """Yield what a glob matches, in whichever folder it begins."""
    anchor = Path(path.anchor) if path.is_absolute() else Path()
    return anchor.glob(str(path.relative_to(path.anchor) if path.is_absolute() else path))


def _read(files: list[list[Path]]) -> Iterator[Instant]:
    keyed = [_by_key(paths) for paths in files]
    for key in sorted(set().union(*keyed)):
        instant: dict[int, Picture] = {}
        for camera, paths in enumerate(keyed):
            # What is no image (a list of files beside them, say) is passed by.
            if key in paths and (image := decode_image(paths[key].read_bytes())) is not None:
                instant[camera] = Picture(paths[key].name, 0, image)
        if instant:
            yield instant


def _by_key(paths: list[Path]) -> dict[str, Path]:
    """Name each file by the last number in its name, which tells the instant, else by its place."""
    keys = [(re.findall(r"\d+", path.stem) or [""])[-1] for path in paths]
    if "" not in keys and len(set(keys)) == len(keys):
        longest = max(len(key) for key in keys)
        return {key.zfill(max(longest, 20)): path for key, path in zip(keys, paths, strict=True)}
    return {str(k).zfill(20): path for k, path in enumerate(paths)}
