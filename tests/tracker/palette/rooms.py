"""Simulated rooms with truth: what stands in them, what casts colour on them, and where the vehicle flew."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import cv2
import numpy as np

from tests.tracker.paper_rig import paper_rig
from tests.tracker.rigs import TUNING
from tracker.palette.learn import Instant
from tracker.pipeline import Tracker
from tracker.rig import Rig
from tracker.scene import Look, SceneRenderer
from tracker.sources.paths import scripted_path
from tracker.types import Array, Frame, Image, frozen_array

RIG = paper_rig()
PERIOD_NS = 66_666_667
PLAIN = (188, 192, 190)
Casts = Mapping[int, tuple[float, float, float]]
"""By camera: factors on blue, green, red of what its sensor gives."""

Thing = tuple[int, tuple[int, int, int, int], tuple[int, int, int]]
"""Camera, left, top, right, bottom [px] and bgr of something flat in the room."""

SIDE_LIGHT = Look(lamp_inW=(0.9, -0.4, 0.1), ambient=0.25, diffuse=1.0)


def backdrops(things: Sequence[Thing] = ()) -> list[Image]:
    """Return a grey room for each camera, darker towards the floor, with things in it."""
    rooms = []
    for camera, view in enumerate(RIG.cameras):
        fall = np.linspace(1.0, 0.6, view.height_px)[:, None, None]
        room = np.rint(np.broadcast_to(np.array(PLAIN) * fall, (view.height_px, view.width_px, 3))).astype(np.uint8)
        for where, (left, top, right, bottom), bgr in things:
            if where == camera:
                centre, axes = ((left + right) // 2, (top + bottom) // 2), ((right - left) // 2, (bottom - top) // 2)
                cv2.ellipse(room, centre, axes, 0, 0, 360, bgr, cv2.FILLED)
        rooms.append(room)
    return rooms


@lru_cache(maxsize=8)
def flown(
    things: tuple[Thing, ...] = (), look: Look | None = None, path: str = "figure8", count: int = 14, step: int = 8
) -> tuple[Instant, ...]:
    """Return the instants of a flight, every `step` frame periods."""
    renderer = SceneRenderer(RIG, look, 1, backdrops(things))
    vehicle = scripted_path(path, 0)
    times = [k * step * PERIOD_NS for k in range(count)]
    return tuple(
        tuple(Frame(c, t, renderer.render(c, [vehicle.pose_at(t)]), t) for c in range(len(RIG.cameras))) for t in times
    )


def cast(instants: Sequence[Instant], casts: Casts) -> list[Instant]:
    """Put a colour cast or another exposure on some cameras."""
    return [
        tuple(Frame(f.camera, f.t_ns, _cast(f.image, casts.get(f.camera, (1.0, 1.0, 1.0)))) for f in instant)
        for instant in instants
    ]


def _cast(image: Image, gains: tuple[float, float, float]) -> Image:
    return np.asarray(np.clip(np.rint(image * np.array(gains)), 0, 255), dtype=np.uint8)


def places(instants: Sequence[Instant], path: str = "figure8") -> Array:
    """Return the true positions (n, 3) [m]."""
    vehicle = scripted_path(path, 0)
    return frozen_array([vehicle.pose_at(instant[0].t_ns)[0] for instant in instants])


def tracked(instants: Sequence[Instant], rig: Rig, path: str = "figure8") -> tuple[int, float]:
    """Run the tracker; return how many poses it gave and their rms error [m]."""
    tracker, vehicle = Tracker(rig, TUNING, lambda: 0), scripted_path(path, 0)
    steps = [tracker.step(frame) for instant in instants for frame in instant]
    estimates = [estimate for step in (*steps, tracker.finish()) for estimate in step.estimates]
    errors = [estimate.p_BinW - vehicle.pose_at(estimate.t_ns)[0] for estimate in estimates]
    return len(estimates), float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1)))) if errors else float("inf")
