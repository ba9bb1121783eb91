"""Two cameras that see the board together: where one stands to the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from tools.calibrate.board import Board
from tools.calibrate.find import Ids, View
from tools.calibrate.intrinsics import FLAGS, Intrinsics, SingleArray
from tracker.types import Array, frozen_array

FEWEST_PAIRS = 5
FEWEST_COMMON = 6  # corners
JOINT_PAIRS, JOINT_SHARE = 10, 0.8


@dataclass(frozen=True, slots=True, eq=False)
class Stereo:
    """Two cameras' relative pose.

    K, distortion: of both cameras, (3, 3) and (n,): fitted anew together if `joint`, else as they were given.
    R_C0toC1: (3, 3), p_C0inC1: (3,) [m].  rms_px: over both cameras' corners.  errors_px: (pairs, 2) rms [px].
    """

    names: tuple[str, str]
    K: tuple[Array, Array]
    distortion: tuple[Array, Array]
    R_C0toC1: Array
    p_C0inC1: Array
    rms_px: float
    errors_px: Array
    joint: bool

    @property
    def baseline_m(self) -> float:
        """Distance of the two cameras [m]."""
        return float(np.linalg.norm(self.p_C0inC1))

    @property
    def T_C1toC0(self) -> Array:
        """Pose of camera 1 in camera 0, (4, 4) [m]."""
        T = np.eye(4)
        T[:3, :3] = self.R_C0toC1.T
        T[:3, 3] = -self.R_C0toC1.T @ self.p_C0inC1
        return T


def calibrate_pair(
    one: Intrinsics, other: Intrinsics, pairs: Sequence[tuple[View, View]], board: Board, may_refit: bool
) -> Stereo | None:
    """Fit the relative pose of two cameras; None if they saw too little of the board together.

    Args:
        may_refit: fit both lenses with it where nearly every view is one of a pair; elsewhere they are kept, since
            views of one camera alone would no longer count.
    """
    coefficients = len(one.lens.distortion)
    used = [(a, b) for a, b in pairs if a in one.views and b in other.views and len(_common(a, b)) >= FEWEST_COMMON]
    if len(used) < FEWEST_PAIRS or not board.tells_its_top:
        return None
    enough = len(used) >= max(JOINT_PAIRS, JOINT_SHARE * max(len(one.views), len(other.views)))
    joint = may_refit and enough
    flags = FLAGS[coefficients] | (cv2.CALIB_USE_INTRINSIC_GUESS if joint else cv2.CALIB_FIX_INTRINSIC)
    common = [_common(a, b) for a, b in used]
    points = [board.corners_m[ids].astype(np.float32) for ids in common]
    pixels = [[_pixels(pair[side], ids) for pair, ids in zip(used, common, strict=True)] for side in (0, 1)]
    rms_px, K0, d0, K1, d1, R, t, _, _, _, _, errors = cv2.stereoCalibrateExtended(
        points, pixels[0], pixels[1], one.lens.K.copy(), one.lens.distortion.copy(), other.lens.K.copy(),
        other.lens.distortion.copy(), one.size_px, np.eye(3), np.zeros(3), flags=flags,
    )  # fmt: skip
    distortion = tuple(frozen_array(np.ravel(d)[:coefficients]) for d in (d0, d1))
    return Stereo(
        (one.name, other.name), (frozen_array(K0), frozen_array(K1)), (distortion[0], distortion[1]),
        frozen_array(R), frozen_array(np.ravel(t)), float(rms_px), frozen_array(errors), joint,
    )  # fmt: skip


def _common(a: View, b: View) -> Ids:
    return np.intersect1d(a.ids, b.ids)


def _pixels(view: View, ids: Ids) -> SingleArray:
    return view.uv_px[np.searchsorted(view.ids, ids)].astype(np.float32).reshape(-1, 1, 2)
