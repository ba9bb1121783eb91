"""Where a state says the balls should be seen, with the Jacobian by the state's error."""

from __future__ import annotations

import numpy as np

from tracker import so3
from tracker.camera import Camera
from tracker.rig import Marker
from tracker.state import ATTITUDE, POSITION, RATE, VELOCITY, State
from tracker.types import Array


def predicted_pixels(state: State, camera: Camera, marker: Marker, t_ns: int) -> tuple[Array, Array]:
    """Project every ball of the marker into one camera at that camera's own time.

    Args:
        state: may be of another time than t_ns; velocity and rate bridge the difference.
    Returns:
        uv_px: (n, 2); NaN for a ball behind the camera.
        H: (n, 2, 12) d uv / d error of the state.
    Source: with tau = t - t_state, E = exp(w tau) and m a ball in B, the ball stands at p + v tau + R E m. An error
        turns it by d(R exp(theta) E m) = -R [E m]x theta and d(R exp((w + d) tau) m) = -R E [m]x J_r(w tau) tau d.
    """
    tau = (t_ns - state.t_ns) * 1e-9
    turn = state.w_BinB * tau
    E = so3.exp(turn)
    arm = marker.points_inB @ E.T
    points_inW = arm @ state.R_BtoW.T + state.p_BinW + tau * state.v_BinW
    uv_px, J = camera.project(points_inW)
    H = np.empty((len(marker), 2, 12))
    H[:, :, POSITION] = J
    H[:, :, ATTITUDE] = -J @ (state.R_BtoW @ _hats(arm))
    H[:, :, VELOCITY] = tau * J
    H[:, :, RATE] = -J @ (state.R_BtoW @ E @ _hats(marker.points_inB) @ so3.right_jacobian(turn)) * tau
    return uv_px, H


def _hats(vectors: Array) -> Array:
    """Return the (n, 3, 3) cross product matrices of (n, 3)."""
    hats = np.zeros((len(vectors), 3, 3))
    hats[:, 0, 1], hats[:, 0, 2], hats[:, 1, 2] = -vectors[:, 2], vectors[:, 1], -vectors[:, 0]
    return hats - hats.transpose(0, 2, 1)
