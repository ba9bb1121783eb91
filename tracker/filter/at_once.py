"""The usual round in one compiled call: all sightings belong, and how the vehicle stands is plain.

It is what `batch` and `fit` do one after the other, and gives the same to the last bit; the arrays that one hands the
other never become Python's, which takes longer than to fill them.
"""

from __future__ import annotations

from tracker.filter.batch import Sighted, compared, distances2
from tracker.filter.fit import Fit, looks_alone, prepared, solved, tilt_variance
from tracker.filter.manoeuvre import envelope, strengths
from tracker.filter.measure import Indices, camera_table
from tracker.filter.predict import Prediction
from tracker.maths.compiled import compiled
from tracker.maths.gate import chi2_limit
from tracker.rig import Rig
from tracker.types import Array


def fit_at_once(ahead: Prediction, seen: Sighted, rig: Rig, probability: float) -> Fit | None:
    """Fit all sightings to a prediction; None where something is to be chosen.

    That is where one of them lies beyond its gate, the sum of squares fits no chi-square, the clocks' doubt matters, or
    a turn is open.
    """
    if ahead.turn_open:
        return None
    process, state = ahead.process, ahead.state
    plain, levels, P, dx, H, R, u, inverse, nis = _at_once(
        state.mean, state.P, ahead.P_coasted, ahead.dt, process.manoeuvre_s, seen.z, seen.covs_px, state.noise,
        seen.cameras, seen.balls, seen.lags_s, camera_table(rig), ahead.points_of(rig), envelope(process),
        chi2_limit(probability, 2), state.levels, strengths(process), tilt_variance(ahead),
    )  # fmt: skip
    if not (plain and nis <= chi2_limit(probability, len(u))):
        return None
    return Fit(seen, dx, P, levels, H, R, u, inverse, nis)


@compiled("Tuple((b1, f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], f8))"
          "(f8[::1], f8[:, ::1], f8[:, ::1], f8, f8, f8[::1], f8[:, ::1], f8[:, ::1], i8[::1], i8[::1], f8[::1],"
          " f8[:, ::1], f8[:, ::1], f8[::1], f8, f8[:, ::1], f8[:, ::1], f8)")  # fmt: skip
def _at_once(
    mean: Array, P: Array, P_coasted: Array, dt: float, T: float, z: Array, covs_px: Array, noise: Array,
    cameras: Indices, balls: Indices, lags_s: Array, table: Array, points_inB: Array, tops: Array, limit: float,
    levels: Array, of: Array, tilt: float,
) -> tuple[bool, Array, Array, Array, Array, Array, Array, Array, float]:  # fmt: skip
    """Return whether nothing is to be chosen, and of the fit levels, P, dx, H, R, u, inverse and nis.

    Arguments as `compared`, `distances2` and `prepared` take them; limit: of a sighting's squared distance.
    """
    y, H, R, A, B, path, doubt = compared(
        mean, P, P_coasted, dt, T, z, covs_px, noise, cameras, balls, lags_s, table, points_inB, False
    )
    near = True
    for distance2 in distances2(y, A, B, tops):
        near = near and distance2 <= limit
    alone = looks_alone(cameras)
    levels, P, R, doubtful = prepared(
        levels, of, y, H, A, B, R, path, doubt, P_coasted, dt, T, tilt, True, alone, False
    )
    stands, turn_open, dx, H, u, inverse, nis = solved(mean, P, T, z, R, cameras, balls, lags_s, table, points_inB)
    return near and stands and not (doubtful or turn_open), levels, P, dx, H, R, u, inverse, nis
