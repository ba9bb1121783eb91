"""The reference path that comes with a recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tracker.errors import OperatorError
from tracker.sources.asl_table import Row, read_rows
from tracker.sources.layout import find_mav0
from tracker.types import Array, frozen_array

POSE_COLUMNS = 8
QUATERNION_TOLERANCE = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class GroundTruth:
    """Where the body really was.

    t_ns: (n,) strictly increasing [ns].  p_BinW: (n, 3) position [m].  R_BtoW: (n, 3, 3) attitude.
    """

    t_ns: NDArray[np.int64]
    p_BinW: Array
    R_BtoW: Array

    def __len__(self) -> int:
        return len(self.t_ns)


def read_ground_truth(directory: Path) -> GroundTruth:
    """Read `state_groundtruth_estimate0/data.csv` of a recording; columns after the pose do not matter.

    Args:
        directory: the recording: the folder that holds mav0, or mav0 itself.
    Raises:
        OperatorError: file missing, malformed line, quaternion far from unit length, times that do not increase.
    """
    path = find_mav0(directory) / "state_groundtruth_estimate0" / "data.csv"
    rows = list(read_rows(path, POSE_COLUMNS))
    if not rows:
        raise OperatorError(f"{path}: holds no poses; record the ground truth again")
    t_ns = np.array([row.t_ns for row in rows], dtype=np.int64)
    if not (np.diff(t_ns) > 0).all():
        late = rows[int(np.argmax(np.diff(t_ns) <= 0)) + 1]
        raise OperatorError(f"{late.where}: time {late.t_ns} ns is not after the one before; sort the file")
    t_ns.flags.writeable = False
    poses = np.array([_pose(row) for row in rows])
    q_xyzw = poses[:, [4, 5, 6, 3]]
    return GroundTruth(t_ns, frozen_array(poses[:, :3]), frozen_array(Rotation.from_quat(q_xyzw).as_matrix()))


def _pose(row: Row) -> list[float]:
    """Return x y z [m] and the quaternion w x y z of one line."""
    try:
        pose = [float(field) for field in row.fields[: POSE_COLUMNS - 1]]
    except ValueError as error:
        raise OperatorError(f"{row.where}: {error}; mend or remove the line") from error
    length = float(np.linalg.norm(pose[3:]))
    if not np.isfinite(pose).all() or abs(length - 1.0) > QUATERNION_TOLERANCE:
        raise OperatorError(
            f"{row.where}: quaternion w x y z has length {length:.3g}, must be 1 within {QUATERNION_TOLERANCE:g}, "
            "and all numbers finite; mend or remove the line"
        )
    return pose
