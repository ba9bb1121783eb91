"""Plans: inside the room and the vehicle's limits, the same when read back, refused where nothing fits."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

from bridge.settings import Settings, load_settings, rig_of
from tools.cli import EXIT_OPERATOR, run_command_line
from tools.excite.manoeuvre import Kind, Manoeuvre
from tools.excite.plan import BUDGET, make_plan, seen_half_m
from tools.excite.plan_file import CSV_HZ, read_plan, write_plan
from tools.sysid.parameters import AXES, Axis
from tracker.errors import OperatorError

LAB = load_settings("lab")


def _with_volume(*volume_mm: float) -> Settings:
    return LAB.model_copy(update={"room": LAB.room.model_copy(update={"volume_mm": volume_mm})})


def test_every_axis_is_swept_and_stepped_one_after_the_other() -> None:
    moves = make_plan(LAB, 10.0).sequence.manoeuvres
    assert {(move.axis, move.kind) for move in moves} == {(axis, kind) for axis in AXES for kind in Kind}
    assert all(after.start_s > before.end_s for before, after in pairwise(moves))


@pytest.mark.parametrize("volume_mm", [(2000.0, 1000.0, 1500.0), (600.0, 500.0, 400.0), (3000.0, 3000.0, 3000.0)])
def test_no_manoeuvre_leaves_its_part_of_the_room_or_the_vehicles_limits(volume_mm: tuple[float, float, float]) -> None:
    plan = make_plan(_with_volume(*volume_mm), 10.0)
    vehicle = LAB.vehicle
    assert vehicle is not None
    assert (plan.half_m <= np.array(volume_mm) / 2e3 + 1e-9).all()
    for each in plan.planned:
        axis = each.manoeuvre.axis
        if axis in (Axis.ROLL, Axis.PITCH):
            assert each.excursion <= BUDGET * plan.half_m[:2].min()
            assert each.manoeuvre.amplitude * vehicle.full_tilt_deg <= vehicle.max_tilt_deg
        elif axis is Axis.HEAVE:
            assert each.excursion <= BUDGET * plan.half_m[2]
        assert axis is Axis.YAW or each.speed <= vehicle.max_speed_m_s


def test_a_smaller_room_gets_smaller_manoeuvres() -> None:
    large, small = (make_plan(_with_volume(*size), 10.0) for size in ((2000.0,) * 3, (400.0,) * 3))
    assert all(
        a.manoeuvre.amplitude >= b.manoeuvre.amplitude for a, b in zip(large.planned, small.planned, strict=True)
    )
    assert any(a.manoeuvre.amplitude > b.manoeuvre.amplitude for a, b in zip(large.planned, small.planned, strict=True))


def test_a_room_too_small_for_any_answer_is_refused() -> None:
    with pytest.raises(OperatorError, match=r"at least 10% are needed; give it a larger \[room\] volume_mm"):
        make_plan(_with_volume(60.0, 60.0, 60.0), 10.0)


def test_cameras_bound_the_room_where_they_see_less_than_the_volume() -> None:
    rig = rig_of(LAB, None).rig
    assert (seen_half_m(rig, np.array([5.0, 5.0, 5.0])) < 1.0).all()


def test_a_sweep_covers_its_band_and_begins_and_ends_at_rest() -> None:
    sweep = Manoeuvre(Axis.ROLL, Kind.SWEEP, 0.0, 20.0, 0.5, 0.5, 4.0)
    t_s = np.arange(0.0, 20.0, 0.001)
    sticks = np.array([sweep.stick_at(each) for each in t_s])
    crossings = t_s[1:][np.diff(np.sign(sticks)) != 0]
    frequency_hz = 0.5 / np.diff(crossings)
    assert frequency_hz[0] == pytest.approx(0.5, rel=0.25)
    assert frequency_hz[-1] == pytest.approx(4.0, rel=0.05)
    assert (np.diff(frequency_hz) > -0.05).all()
    assert abs(sticks[0]) < 1e-3
    assert abs(sticks[-1]) < 0.01
    assert np.abs(sticks).max() == pytest.approx(0.5, rel=0.01)


def test_steps_are_three_two_one_one() -> None:
    steps = Manoeuvre(Axis.YAW, Kind.STEPS_3211, 1.0, 7.0, 0.4, 0.5, 0.5)
    assert [steps.stick_at(t_s) for t_s in (0.9, 1.1, 3.9, 4.1, 5.9, 6.1, 7.1, 8.1)] == [
        0.0, 0.4, 0.4, -0.4, -0.4, 0.4, -0.4, 0.0,
    ]  # fmt: skip


def test_a_plan_reads_back_as_it_was_written(tmp_path: Path) -> None:
    plan, path = make_plan(LAB, 10.0), tmp_path / "plan.toml"
    write_plan(plan, path)
    for one, other in zip(read_plan(path).manoeuvres, plan.sequence.manoeuvres, strict=True):
        assert (one.axis, one.kind) == (other.axis, other.kind)
        assert one.start_s == pytest.approx(other.start_s, abs=1e-3)
        assert one.amplitude == pytest.approx(other.amplitude, abs=1e-4)
    table = np.loadtxt(path.with_suffix(".csv"), delimiter=",", skiprows=1)
    k = round(5.0 * CSV_HZ)
    roll, pitch, yaw, heave = plan.sequence.sticks_at(table[k, 0])
    assert table[k, 1:] == pytest.approx([roll, -pitch, -yaw, heave], abs=1e-4)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("manoeuvres = [", "not TOML"),
        ("manoeuvres = []", "manoeuvres"),
        (
            '[[manoeuvres]]\naxis = "roll"\nkind = "sweep"\nstart_s = 0\nduration_s = 5\namplitude = 3\nlow_hz = 1\n'
            "high_hz = 2",
            "manoeuvres.0.amplitude",
        ),
    ],
)
def test_a_plan_that_is_none_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, complaint: str
) -> None:
    path = tmp_path / "plan.toml"
    path.write_text(text)
    assert run_command_line(["demo", "--excite", str(path), "--out", str(tmp_path / "demo")]) == EXIT_OPERATOR
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1


def test_the_command_leaves_plan_sticks_and_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "plan.toml"
    assert run_command_line(["excite", "--out", str(out), "--sweep-s", "6"]) == 0
    assert "roll  sweep" in capsys.readouterr().out
    picture = cv2.imread(str(out.with_suffix(".png")))
    assert picture is not None
    assert picture.shape[1] > 1000
    assert out.with_suffix(".csv").exists()
    assert run_command_line(["excite", "--out", str(out), "--sweep-s", "1"]) == EXIT_OPERATOR
