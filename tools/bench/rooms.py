"""How accurate the tracker is in rooms, lights, rigs and motions other than those it was built beside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bridge.settings import Settings, rig_of
from tools.bench.crew import fly_all
from tools.bench.ring import ring_rig
from tools.bench.trial import Flown, Trial
from tracker.scene import Lamp, Look
from tracker.sources.sim import SimTiming

SETTLED_S = 0.5
LINEAR, SCREEN = Look(gamma=1.0), Look()
FREE_RUNNING_NS = (0, 33_333_333)
LAMPS = {
    "lamp above": (0.0, 0.0, 1.0),
    "lamp left": (-1.0, 0.6, 0.4),
    "lamp right": (0.8, 1.0, 0.5),
    "lamp behind cam0": (1.0, 1.0, 1.0),
}


@dataclass(frozen=True, slots=True)
class Room:
    """One case: its errors after the first half second. nees: mean over 6 of the pose's; wrong: outside 5 sigma."""

    name: str
    estimates: int
    frames: int
    mm_mean: float
    mm_max: float
    deg_mean: float
    deg_max: float
    nees: float
    wrong: int
    speed_rms_m_s: float
    rate_rms_deg_s: float


def measure_rooms(settings: Settings, seed: int) -> list[Room]:
    """Fly every case once."""
    cases = list(_cases(settings, seed))
    flown = fly_all([trial for _, trial in cases])
    return [_room(name, trial, run) for (name, trial), run in zip(cases, flown, strict=True)]


def _cases(settings: Settings, seed: int) -> Iterator[tuple[str, Trial]]:
    marker = rig_of(settings, None).rig.marker
    timing = SimTiming(15.0, 4.0)
    plain = Trial(f"random-{seed}", timing, LINEAR, seed, rig=ring_rig(marker))
    yield "linear", plain
    yield "gamma 2.2", replace(plain, look=SCREEN)
    for name, lamp in LAMPS.items():
        yield name, replace(plain, look=replace(LINEAR, lamp_inW=lamp))
    near = Lamp((0.5, -0.6, 0.9), 0.9)
    yield "lamp near", replace(plain, look=replace(LINEAR, ambient=0.2, diffuse=0.1, specular=0.01, lamps=(near,)))
    yield "hard light", replace(plain, look=replace(LINEAR, ambient=0.2, diffuse=1.1, specular=0.4))
    yield "flat light", replace(plain, look=replace(LINEAR, ambient=0.95, diffuse=0.1, specular=0.0))
    yield "dim, noisy", replace(plain, look=replace(LINEAR, full_well_e=800.0, read_noise=0.004))
    yield "sharp lens", replace(plain, look=replace(LINEAR, blur_px=0.25))
    yield "soft lens", replace(plain, look=replace(LINEAR, blur_px=0.9))
    yield "JPEG 90", replace(plain, look=replace(LINEAR, jpeg_quality=90))
    yield "JPEG 75, gamma 2.2", replace(plain, look=replace(SCREEN, jpeg_quality=75))
    yield "cameras low", replace(plain, rig=ring_rig(marker, polar_deg=65.0))
    yield "cameras far", replace(plain, rig=ring_rig(marker, distance_m=4.5, view_deg=24.0))
    yield "cameras 60 deg apart", replace(plain, rig=ring_rig(marker, spread_deg=60.0, view_deg=36.0))
    yield "3 cameras", replace(plain, rig=ring_rig(marker, 3, view_deg=36.0))
    yield "5 cameras", replace(plain, rig=ring_rig(marker, 5, view_deg=36.0))
    free_running = replace(plain, timing=replace(timing, offsets_ns=FREE_RUNNING_NS))
    yield "free running", free_running
    yield "free running, a round late", replace(free_running, lag_rounds=1)
    yield "limits, 4 ms", replace(plain, path="fast")
    yield "limits, 8 ms", replace(plain, path="fast", look=replace(LINEAR, exposure_s=0.008, sub_exposures=9))
    yield "limits, free running", replace(free_running, path="fast")
    yield "limits, free running, a round late", replace(free_running, path="fast", lag_rounds=1)


def _room(name: str, trial: Trial, run: Flown) -> Room:
    settled = run.between(SETTLED_S, np.inf)
    frames = round(trial.timing.rate_hz * trial.timing.duration_s)
    if not len(settled):
        nothing = float("nan")
        return Room(name, len(run), frames, *(nothing,) * 5, 0, nothing, nothing)
    return Room(
        name,
        len(run),
        frames,
        float(settled.position_mm.mean()),
        float(settled.position_mm.max()),
        float(settled.attitude_deg.mean()),
        float(settled.attitude_deg.max()),
        float(settled.nees(slice(0, 6)).mean() / 6.0),
        len(run.wrong()),
        float(np.sqrt((settled.errors[:, 6:9] ** 2).sum(axis=1).mean())),
        float(np.degrees(np.sqrt((settled.errors[:, 9:] ** 2).sum(axis=1).mean()))),
    )
