"""Whether footage can tell a room at all, before anything is solved."""

from __future__ import annotations

import numpy as np

from tools.calibrate.room.footage import Footage
from tools.calibrate.room.start import LEAST_SHARED
from tools.calibrate.room.tracks import Track
from tracker.errors import OperatorError
from tracker.rig import Rig

LEAST_S = 5.0
LEAST_SWAY_PX = 15.0  # standard deviation of the marker's place in a picture
CHECK = "check light and colours with `posebridge colours`"


def inspect(footage: Footage, rig: Rig, source: str) -> None:
    """Refuse footage without a marker, with a camera that never saw it, or with one that hardly moved.

    Raises:
        OperatorError: the first of these, in one line.
    """
    counts = [len(track) for track in footage.tracks]
    for camera, frames in zip(rig.cameras, footage.frames, strict=True):
        if frames == 0:
            raise OperatorError(f"{source}: {camera.name} gave no picture; check its cable, or the source")
    if max(counts) == 0:
        raise OperatorError(
            f"{source}: no marker in {sum(footage.frames)} pictures: all {len(rig.marker)} balls must be seen at once; "
            f"{CHECK}"
        )
    length_s = max(float(np.ptp(track.t_s)) for track in footage.tracks if len(track))
    if length_s < LEAST_S:
        raise OperatorError(
            f"{source}: the marker was seen for {length_s:.1f} s, at least {LEAST_S:.0f} s are needed, a minute is "
            "good: wave it longer"
        )
    for camera, count, frames, track in zip(rig.cameras, counts, footage.frames, footage.tracks, strict=True):
        if count < LEAST_SHARED:
            raise OperatorError(
                f"{source}: {camera.name} saw all {len(rig.marker)} balls in {count} of {frames} pictures, at least "
                f"{LEAST_SHARED} are needed: wave the marker where it looks, or {CHECK}"
            )
        if (sway_px := _sway_px(track)) < LEAST_SWAY_PX:
            raise OperatorError(
                f"{source}: the marker hardly moved before {camera.name} ({sway_px:.0f} px rms, at least "
                f"{LEAST_SWAY_PX:.0f} px): wave it through all of the picture, near and far"
            )


def _sway_px(track: Track) -> float:
    """Return how far the marker's middle strays in a picture, rms [px]."""
    middles = track.uv_px.mean(axis=1)
    return float(np.sqrt(middles.var(axis=0).sum()))
