"""All cameras calibrated together, and what it is worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tools.calibrate.board import Board
from tools.calibrate.intrinsics import Intrinsics, calibrate_camera
from tools.calibrate.stereo import Stereo, calibrate_pair
from tools.calibrate.verdict import Verdict, judge, judge_pair
from tools.calibrate.views import Gathering
from tracker.camera import Camera, make_camera
from tracker.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """cameras, verdicts, shown: by camera; shown counts pictures with a board.  pairs: neighbours that saw it together.

    distance_m: from a camera to where is flown, by which millimetres are told [m].
    """

    cameras: tuple[Intrinsics, ...]
    verdicts: tuple[Verdict, ...]
    shown: tuple[int, ...]
    pairs: tuple[tuple[Stereo, Verdict], ...]
    distance_m: float

    @property
    def good(self) -> bool:
        """Say whether nothing speaks against it."""
        return all(verdict.good for verdict in (*self.verdicts, *(verdict for _, verdict in self.pairs)))

    def rig(self) -> tuple[Camera, ...]:
        """Return the cameras, in camera 0's frame where each neighbour's place is known, else each in the origin.

        Raises:
            OperatorError: a lens that is none, such as a centre outside the image.
        """
        chained = len(self.pairs) == len(self.cameras) - 1
        joint = self.pairs[0][0] if len(self.pairs) == 1 and self.pairs[0][0].joint else None
        T_CtoW: Array = np.eye(4)
        cameras = []
        for k, camera in enumerate(self.cameras):
            if chained and k:
                T_CtoW = T_CtoW @ self.pairs[k - 1][0].T_C1toC0
            # Where two lenses were fitted with the pose between them, it holds for these lenses only.
            K = joint.K[k] if joint else camera.lens.K
            distortion = joint.distortion[k] if joint else camera.lens.distortion
            values = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
            cameras.append(make_camera(camera.name, camera.size_px, values, tuple(distortion.tolist()), T_CtoW))
        return tuple(cameras)


def calibrate_all(
    names: Sequence[str], gathering: Gathering, board: Board, coefficients: int, distance_m: float
) -> Calibration:
    """Fit every camera, then every two neighbours that saw the board together.

    Raises:
        OperatorError: a camera with too few views, or views that determine nothing.
    """
    cameras = tuple(
        calibrate_camera(name, gathering.of(k), board, gathering.sizes_px[k], coefficients)
        for k, name in enumerate(names)
    )
    pairs = []
    for k, (one, other) in enumerate(pairwise(cameras)):
        seen = [(views[k], views[k + 1]) for views in gathering.kept if k in views and k + 1 in views]
        pair = calibrate_pair(one, other, seen, board, may_refit=len(cameras) == 2)
        if pair is not None:
            pairs.append((pair, judge_pair(pair, one, other)))
    verdicts = tuple(judge(camera, distance_m) for camera in cameras)
    shown = tuple(gathering.shown.get(k, 0) for k in range(len(names)))
    return Calibration(cameras, verdicts, shown, tuple(pairs), distance_m)
