"""A camera that is bumped in flight is noticed, named and lived with; what is no bump is no alarm."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.system.bumps import BUMP_S, DURATION_S, WITHIN_S, Bump, flown, log_of
from tools.calibrate.formats.own import read_own
from tools.calibrate.refine.session import RefineRequest, run_refine
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.scene import Knock, Occluder, Trouble
from tracker.scene.knock import knocked
from tracker.sources.sim import START_NS

TURNED = Bump(Knock(1, turn_deg=(0.2, 0.0, 0.0)))
ASIDE = Bump(Knock(0, shift_mm=(5.0, 0.0, 0.0)), seed=2)
BUMPS = [
    TURNED,
    ASIDE,
    Bump(Knock(0, turn_deg=(0.0, 0.2, 0.0)), gamma=2.2),
    Bump(Knock(1, turn_deg=(0.0, 0.0, 0.2))),
    Bump(Knock(0, shift_mm=(0.0, 0.0, 5.0))),
    Bump(Knock(2, turn_deg=(0.0, 0.2, 0.0)), cameras=4),
    Bump(Knock(1, shift_mm=(0.0, 5.0, 0.0)), cameras=4),
]


def mean_miss_mm(bump: Bump, truth: Camera, believed: Camera) -> float:
    """Return by how far rays of a camera, believed to stand elsewhere, miss the vehicle where it flew [mm]."""
    times_ns = (START_NS + np.linspace(0.0, DURATION_S, 100) * 1e9).astype(np.int64).tolist()
    places = np.array([bump.trial().vehicle().pose_at(t_ns)[0] for t_ns in times_ns])
    rays = believed.bearings(truth.project(places)[0]) @ believed.R_CtoW.T
    return float(1e3 * np.linalg.norm(np.cross(places - believed.p_CinW, rays), axis=1).mean())


def hand(camera: int, t_s: float) -> Trouble:
    """Return an arm that goes through one picture after the other."""
    u_px = round(90.0 * (t_s - 6.0 - 3.0 * camera))
    return Trouble(occluders=(Occluder(camera, u_px, 60, 180, 420),)) if 0 <= u_px < 640 else Trouble()


def lamp(_camera: int, t_s: float) -> Trouble:
    """Return a lamp that is switched off, and later another one of another colour on."""
    return Trouble(gains_bgr=(0.5, 0.5, 0.5) if t_s < 12.0 else (0.8, 1.0, 1.1)) if t_s >= 7.0 else Trouble()


CALM = [
    Bump(None, seed=3),
    Bump(None, seed=4, gamma=2.2),
    Bump(None, cameras=4),
    Bump(None, other=hand),
    Bump(None, other=lamp),
]


@pytest.mark.parametrize("bump", BUMPS, ids=lambda bump: f"{bump.cameras}-{bump.knock}")
def test_a_bumped_camera_is_named_within_ten_seconds_and_no_other(bump: Bump) -> None:
    assert bump.knock is not None
    named = flown(bump).named()
    assert list(named) == [f"cam{bump.knock.camera}"]
    assert BUMP_S < named[f"cam{bump.knock.camera}"] <= BUMP_S + WITHIN_S


@pytest.mark.parametrize("bump", BUMPS, ids=lambda bump: f"{bump.cameras}-{bump.knock}")
def test_once_it_is_named_no_pose_is_wrong(bump: Bump) -> None:
    named_s = next(iter(flown(bump).named().values()))
    after = flown(bump).flown.between(named_s + 0.2, np.inf)
    assert len(after) > 0.9 * 15.0 * (DURATION_S - named_s - 0.2)
    assert after.wrong() == {}


@pytest.mark.parametrize("calm", CALM, ids=("clean", "gamma", "four", "hand", "lamp"))
def test_a_clean_flight_a_hand_and_a_lamp_are_no_bump(calm: Bump) -> None:
    health = [each for _, each in flown(calm).health()]
    assert len(health) > 4
    assert {each.brief for each in health} == {""}


@pytest.mark.parametrize("bump", [TURNED, ASIDE], ids=["turned", "aside"])
def test_the_log_mends_the_camera(bump: Bump, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its rays to the vehicle, by which its picture truly goes now, must meet it to a millimetre again."""
    assert bump.knock is not None
    log, rig, index = log_of(flown(bump), bump.rig(), tmp_path / "a.mcap"), bump.rig(), bump.knock.camera
    out = tmp_path / "room.toml"
    run_refine(RefineRequest(log, (), out, overwrite=False, as_json=True))
    figures = json.loads(capsys.readouterr().out)
    assert figures["grade"] == "good"
    assert figures["moves"][0]["name"] == f"cam{index}"
    assert figures["after"]["reprojection_px"] <= figures["before"]["reprojection_px"]
    truth, mended = knocked(rig.cameras[index], bump.knock), read_own(out)[index]
    assert mean_miss_mm(bump, truth, mended) < 1.0 < mean_miss_mm(bump, truth, rig.cameras[index])


def test_a_log_in_which_nothing_moved_says_so(tmp_path: Path) -> None:
    log = log_of(flown(CALM[0]), CALM[0].rig(), tmp_path / "a.mcap")
    with pytest.raises(OperatorError, match="no camera moved in that flight; name one with --moved"):
        run_refine(RefineRequest(log, (), None, overwrite=False, as_json=False))
    with pytest.raises(OperatorError, match="--moved left: no such camera; the log has cam0, cam1"):
        run_refine(RefineRequest(log, ("left",), None, overwrite=False, as_json=False))
    with pytest.raises(OperatorError, match="none is left to hold the room"):
        run_refine(RefineRequest(log, ("cam0", "cam1"), None, overwrite=False, as_json=False))
