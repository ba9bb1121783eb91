"""A camera that is bumped in flight is noticed, named and lived with; what is no bump is no alarm."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.settings import RigOrigin, load_settings, rig_of, shipped_configs
from tests.system.bumps import BUMP_S, CLOCKS, DURATION_S, SETTINGS, WITHIN_S, Bump, Told, flown, log_of
from tools.calibrate.formats.own import read_own
from tools.calibrate.refine.session import RefineRequest, run_refine
from tools.session import tracker_of
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.scene import Knock, Occluder, Trouble
from tracker.scene.knock import knocked, seen_from
from tracker.sources.recording import RecordingSource
from tracker.sources.sim import START_NS
from tracker.types import Event, Frame, Step

PERIOD_NS = 66_666_667

TURNED = Bump(Knock(1, turn_deg=(0.2, 0.0, 0.0)))
ASIDE = Bump(Knock(0, shift_mm=(5.0, 0.0, 0.0)), seed=2)
OF_FOUR = Bump(Knock(2, turn_deg=(0.0, 0.2, 0.0)), cameras=4)
BUMPS = [
    TURNED,
    ASIDE,
    OF_FOUR,
    Bump(Knock(0, turn_deg=(0.0, 0.2, 0.0)), gamma=2.2),
    Bump(Knock(1, turn_deg=(0.0, 0.0, 0.2))),
    Bump(Knock(0, shift_mm=(0.0, 0.0, 5.0))),
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


def refining(
    log: Path, moved: tuple[str, ...] = (), out: Path | None = None, config: str | None = None
) -> RefineRequest:
    return RefineRequest(log, moved, config, "Ada", out, overwrite=False, as_json=True)


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
    poses = flown(bump).flown
    assert poses is not None
    after = poses.between(named_s + 0.2, np.inf)
    assert len(after) > 0.9 * 15.0 * (DURATION_S - named_s - 0.2)
    assert after.wrong() == {}


@pytest.mark.parametrize("calm", CALM, ids=("clean", "gamma", "four", "hand", "lamp"))
def test_a_clean_flight_a_hand_and_a_lamp_are_no_bump(calm: Bump) -> None:
    health = [each for _, each in flown(calm).health()]
    assert len(health) > 4
    assert {each.brief for each in health} == {""}


@pytest.mark.parametrize("bump", [TURNED, ASIDE, OF_FOUR], ids=["turned", "aside", "four"])
def test_the_log_mends_the_camera(bump: Bump, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its rays to the vehicle miss it by less than a third of what they did, and by no more than refine owns up to."""
    assert bump.knock is not None
    log, rig, index = log_of(flown(bump), bump.rig(), tmp_path / "a.mcap"), bump.rig(), bump.knock.camera
    out = tmp_path / "room.toml"
    run_refine(refining(log, out=out), CLOCKS)
    figures = json.loads(capsys.readouterr().out)
    assert figures["grade"] == "good"
    assert figures["moves"][0]["name"] == f"cam{index}"
    assert figures["after"]["reprojection_px"] <= figures["before"]["reprojection_px"]
    truth, mended = knocked(rig.cameras[index], bump.knock), read_own(out)[index]
    left_mm, before_mm = (mean_miss_mm(bump, truth, camera) for camera in (mended, rig.cameras[index]))
    assert left_mm < 0.3 * before_mm
    assert left_mm < 2.0 * figures["moves"][0]["rays_mm"]
    for clock in figures["clocks"]:  # all are triggered at once
        assert abs(clock["offset_ms"]) < 4.0 * clock["sigma_ms"]
        assert clock["sigma_ms"] < 0.5


def test_mended_cameras_are_written_into_the_config_flown_with_or_the_logs_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, config = log_of(flown(TURNED), TURNED.rig(), tmp_path / "a.mcap"), tmp_path / "mine.toml"
    config.write_text("# Ada's room\n" + (shipped_configs()["lab"]).read_text("utf-8"), encoding="utf-8")
    mended = []
    for name, of in (("b.toml", str(config)), ("c.toml", None)):
        run_refine(refining(log, out=tmp_path / name, config=of), CLOCKS)
        mended.append(load_settings(tmp_path / name))
    assert (tmp_path / "b.toml").read_text("utf-8").startswith("# Ada's room\n")
    assert "Nominal cameras" not in (tmp_path / "b.toml").read_text("utf-8")
    for settings in mended:
        assert settings.marker == SETTINGS.marker
        assert settings.rig.measured is not None
        assert [one.name for one in settings.rig.measured.cameras] == ["cam1"]
        assert rig_of(settings, TURNED.rig().cameras).origin is RigOrigin.MEASURED
    assert mended[0].rig.cameras[1].T_CtoW == mended[1].rig.cameras[1].T_CtoW != SETTINGS.rig.cameras[1].T_CtoW
    assert mended[0].links == SETTINGS.links
    capsys.readouterr()


def test_a_log_in_which_nothing_moved_says_so(tmp_path: Path) -> None:
    log = log_of(flown(CALM[0]), CALM[0].rig(), tmp_path / "a.mcap")
    with pytest.raises(OperatorError, match="no camera moved in that flight; name one with --moved"):
        run_refine(refining(log), CLOCKS)
    with pytest.raises(OperatorError, match="--moved left: no such camera; the log has cam0, cam1"):
        run_refine(refining(log, ("left",)), CLOCKS)
    with pytest.raises(OperatorError, match="none is left to hold the room"):
        run_refine(refining(log, ("cam0", "cam1")), CLOCKS)


def test_a_config_of_other_cameras_is_refused(tmp_path: Path) -> None:
    log, config = log_of(flown(TURNED), TURNED.rig(), tmp_path / "a.mcap"), tmp_path / "mine.toml"
    lab = shipped_configs()["lab"].read_text("utf-8")
    config.write_text(lab.replace('name = "cam1"', 'name = "left"'), encoding="utf-8")
    with pytest.raises(OperatorError, match="its cameras are cam0, left, the log's cam0, cam1; name the config that"):
        run_refine(refining(log, config=str(config)), CLOCKS)


def laps(recording: Path, knock: Knock | None) -> Told:
    """Track a recording over and over for DURATION_S, one camera's pictures taken from elsewhere after BUMP_S."""
    with RecordingSource(recording, lambda: 0) as source:
        frames, cameras = [event for event in source if isinstance(event, Frame)], source.cameras or ()
    rig = rig_of(SETTINGS, cameras, len(cameras)).rig
    events: list[Event] = []
    steps: list[Step] = []
    tracker, first_ns, lap_ns = tracker_of(SETTINGS, rig, CLOCKS), frames[0].t_ns, frames[-1].t_ns - frames[0].t_ns
    for lap in range(math.ceil(DURATION_S * 1e9 / lap_ns)):
        for frame in frames:
            now = replace(frame, t_ns=frame.t_ns + lap * (lap_ns + PERIOD_NS) - first_ns + START_NS)
            if knock is not None and frame.camera == knock.camera and now.t_ns - START_NS >= BUMP_S * 1e9:
                elsewhere = knocked(cameras[frame.camera], knock)
                picture = seen_from(frame.image.astype(np.float32), cameras[frame.camera], elsewhere)
                now = replace(now, image=np.rint(picture).clip(0, 255).astype(np.uint8))
            events.append(now)
            steps.append(tracker.step(now))
    return Told(events, steps, None)


@pytest.mark.parametrize("name", ["lab_flight", "lab_protocol"])
def test_the_recordings_raise_no_alarm(name: str, request: pytest.FixtureRequest) -> None:
    health = [each for _, each in laps(request.getfixturevalue(name), None).health()]
    assert len(health) > 4
    assert {each.brief for each in health} == {""}


@pytest.mark.parametrize("camera", [0, 1])
def test_in_real_pictures_a_turned_camera_is_named_before_a_bare_wall_and_before_a_full_one(
    lab_flight: Path, camera: int
) -> None:
    named = laps(lab_flight, Knock(camera, turn_deg=(0.2, 0.0, 0.0))).named()
    assert list(named) == [f"cam{camera}"]
    assert BUMP_S < named[f"cam{camera}"] <= BUMP_S + WITHIN_S
