"""The reference path of a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tracker.errors import OperatorError
from tracker.maths import so3
from tracker.sources.groundtruth import read_ground_truth


def test_the_ground_truth_is_read(lab_flight: Path) -> None:
    truth = read_ground_truth(lab_flight)
    assert len(truth) == 90
    assert truth.t_ns[0] == 1_700_000_020_000_000_000
    np.testing.assert_allclose(truth.p_BinW[0], (-0.508772469, -0.243133527, -0.065839397))
    np.testing.assert_allclose(
        truth.R_BtoW @ truth.R_BtoW.transpose(0, 2, 1), np.tile(np.eye(3), (90, 1, 1)), atol=1e-12
    )
    expected = (0.440714963, 0.005042521, -0.003475043, -0.897626213)
    np.testing.assert_allclose(so3.quaternion(truth.R_BtoW[0]), expected, atol=1e-8)


def test_columns_after_the_pose_do_not_matter(recording: Path) -> None:
    before = read_ground_truth(recording)
    table = recording / "mav0" / "state_groundtruth_estimate0" / "data.csv"
    table.write_text("\n".join(line + ",1,2,3,4,5,6,7,8,9" for line in table.read_text().splitlines()))
    np.testing.assert_array_equal(read_ground_truth(recording).p_BinW, before.p_BinW)


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ("9,0,0,0,0.5,0,0,0", "length 0.5"),
        ("9,0,0,0,one,0,0,0", "could not convert"),
        ("9,nan,0,0,1,0,0,0", "finite"),
        ("9,0,0,0,1,0,0", "must have 8 columns"),
        ("5,0,0,0,1,0,0,0", "is not after the one before"),
        ("", "holds no poses"),
    ],
)
def test_a_ground_truth_that_cannot_be_is_told(recording: Path, row: str, expected: str) -> None:
    table = recording / "mav0" / "state_groundtruth_estimate0" / "data.csv"
    table.write_text(f"6,0,0,0,1,0,0,0\n{row}\n" if row else "#timestamp\n")
    with pytest.raises(OperatorError, match=expected):
        read_ground_truth(recording)
