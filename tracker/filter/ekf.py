"""The estimator: a multiplicative, iterated, gated extended Kalman filter on ball pixels.

The state's error has 24 components and one clock offset for each camera but the first (see `state`); attitude errors
multiply. A measurement is any set of ball sightings, each at its own camera's time. Nothing is stored between calls: a
state goes in, a new state comes out.

    predict  coast to the new time (predict)
    update   gate each sighting (batch) -> how brisk is the manoeuvre (manoeuvre), which state is likeliest (fit)
             -> leave out liars -> one linear update with the converged slope and learn the noise (posterior)
             where nothing is to be left out, gate and fit are one compiled call (at_once)
"""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations
from threading import get_ident
from typing import NamedTuple

import numpy as np
from filterpy.kalman import KalmanFilter

from tracker.filter.at_once import fit_at_once
from tracker.filter.batch import Batch, Sighted, make_batch, sighted
from tracker.filter.fit import Fit, fit
from tracker.filter.leap import stands_elsewhere
from tracker.filter.posterior import settled
from tracker.filter.predict import Prediction, at_origin
from tracker.maths.covariance import inverse_of
from tracker.maths.gate import chi2_limit
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array, BallSighting, Reason, Rejected

MAX_SUSPECTS = 8
AS_LIKELY = 9.0  # more of a sum of squares: three sigma
POSED = 3  # sightings that make a pose: one fits them whatever they show, and their shape tells no liar


class Update(NamedTuple):
    """An updated state, its NIS and degrees of freedom, what was used and what was left out.

    spread: by how much more the pose's variances are, since its images contradict each other; at least 1.
    P_ahead: the covariance (n, n) of the prediction; None where the state before does not tell of this one: at a start,
        and where a turn was open.
    """

    state: State
    nis: float
    dof: int
    used: tuple[BallSighting, ...]
    rejected: tuple[Rejected, ...]
    spread: float = 1.0
    P_ahead: Array | None = None


def update(ahead: Prediction, sightings: tuple[BallSighting, ...], rig: Rig, probability: float) -> Update | Rejected:
    """Correct a prediction by ball sightings, leaving out those that do not belong.

    Args:
        ahead: to about the sightings' time.
        probability: of a true sighting to pass each gate.
    Returns:
        Update; Rejected FRAME_GATE when no choice of sightings fits the prediction.
    Source: each ball is gated on its innovation (Mahalanobis distance, 2 degrees of freedom), as far as the envelope
        goes. The rest is fitted together. When the sum of squares does not fit its chi-square, the smallest set of
        sightings is left out with which it does, of equal sets the one that leaves least; sets of up to a third of all
        are tried, among those without which the sum would fall most, then whole cameras. The prior is broad against a
        pixel, so it is the marker's rigid shape that finds the liars, and more than three must be left: three fit some
        pose whatever they show. Where a gate shuts a camera out, or leaves so few, it lies or the vehicle left the
        envelope, and the others must fit the noise expected before. A camera of which most lie shows another time, or
        the other camera does: then it is between cameras, and none of its sightings is picked out.
    """
    if not sightings:
        return Rejected(Reason.FRAME_GATE, "no sighting near the prediction", ahead.state.t_ns)
    ahead = ahead.about_pivot()
    seen = sighted(sightings, ahead.state.t_ns)
    plain = fit_at_once(ahead, seen, rig, probability)
    return _chosen(ahead, seen, rig, probability) if plain is None else _updated(ahead, plain, ())


def _chosen(ahead: Prediction, seen: Sighted, rig: Rig, probability: float) -> Update | Rejected:
    """Update by those sightings that belong."""
    batch, limit = make_batch(ahead, seen, rig), chi2_limit(probability, 2)
    distances2 = batch.distances2()
    near = [i for i, distance2 in enumerate(distances2) if distance2 <= limit]
    far = sorted({*range(len(distances2))}.difference(near))
    rejected = [_left_out(seen.sightings[i], rig, distances2[i], "from the prediction") for i in far]
    if not near:
        return Rejected(Reason.FRAME_GATE, "no sighting near the prediction", ahead.state.t_ns)
    batch = batch.part(near)
    if far and not _borne_out(ahead, batch, seen, rig, probability):
        detail = "much is far from the prediction, and nothing bears the rest out"
        return Rejected(Reason.FRAME_GATE, detail, ahead.state.t_ns)
    whole = fit(ahead, batch, rig)
    if whole is None:
        return Rejected(Reason.FRAME_GATE, "the fit runs away", ahead.state.t_ns)
    best = whole if _fits(whole, probability) else _without_liars(ahead, batch, whole, rig, probability)
    if best is None:
        detail = f"NIS {whole.nis:.0f} with {2 * len(near)} degrees of freedom"
        if ahead.dt == 0.0:  # no track that sightings could contradict
            detail = (
                f"the cameras do not agree on where the balls are, {detail}: has one moved since it was calibrated?"
            )
        return Rejected(Reason.FRAME_GATE, detail, ahead.state.t_ns)
    if stands_elsewhere(ahead, seen, best, rig, probability):
        detail = "the marker stands elsewhere, or a ball lies in several cameras"
        return Rejected(Reason.FRAME_GATE, detail, ahead.state.t_ns)
    for sighting, gain in zip(batch.sighted.sightings, whole.gains() if best is not whole else (), strict=False):
        if not any(sighting is one for one in best.sighted.sightings):
            rejected.append(_left_out(sighting, rig, float(gain), "from what the others say"))
    return _updated(ahead, best, tuple(rejected))


def _updated(ahead: Prediction, best: Fit, rejected: tuple[Rejected, ...]) -> Update:
    told, spread = _posterior(ahead, best)
    state = at_origin(told, ahead.pivot_inB)
    P_ahead = None if ahead.turn_open or ahead.dt == 0.0 else best.P
    return Update(state, best.nis, len(best.u), best.sighted.sightings, rejected, spread, P_ahead)


def _fits(one: Fit, probability: float) -> bool:
    """Say whether a fit's sum of squares is one that true sightings have."""
    return one.nis <= chi2_limit(probability, len(one.u))


def _borne_out(ahead: Prediction, near: Batch, seen: Sighted, rig: Rig, probability: float) -> bool:
    """Say whether what the gate lets pass is to be believed where it shuts others out.

    More than a pose needs, of every camera, bear each other out by the marker's shape. Others must be what the track
    expected, and no fewer than were shut out; one against one, nobody can tell.
    """
    kept = near.sighted
    if len(kept.sightings) > POSED and set(kept.cameras.tolist()) == set(seen.cameras.tolist()):
        return True
    if len(kept.sightings) < max(2, len(seen.sightings) / 2):
        return False
    return _expected(ahead, near, rig, probability)


def _expected(ahead: Prediction, batch: Batch, rig: Rig, probability: float) -> bool:
    """Say whether sightings fit the noise expected before: manoeuvres explain much of what one camera alone says."""
    one = fit(ahead, batch, rig, adapt=False)
    return one is not None and _fits(one, probability)


def _without_liars(ahead: Prediction, batch: Batch, whole: Fit, rig: Rig, probability: float) -> Fit | None:
    """Return the best fit without a few sightings, or without a camera that shows another time; None when none fits."""
    few = _without_few(ahead, batch, whole, rig, probability)
    if few is None or _splits_a_camera(batch.sighted, few.sighted):
        return _without_a_camera(ahead, batch, rig, probability)
    return few


def _without_few(ahead: Prediction, batch: Batch, whole: Fit, rig: Rig, probability: float) -> Fit | None:
    """Return the best fit without up to a third of the sightings, None when none fits.

    Where two cameras contradict each other about one ball, and the rest hardly tells which lies, neither is believed.
    """
    everyone = range(len(batch.sighted.sightings))
    suspects = np.argsort(-whole.gains())[:MAX_SUSPECTS].tolist()
    for count in range(1, min(len(everyone) // 3, len(everyone) - POSED - 1) + 1):
        fitting = []
        for left_out in combinations(suspects, count):
            one = fit(ahead, batch.part([i for i in everyone if i not in left_out]), rig)
            if one is not None and _fits(one, probability):
                fitting.append((one.nis, left_out, one))
        if fitting:
            nis, left_out, best = min(fitting, key=lambda each: each[0])
            likely = [each for each_nis, each, _ in fitting if each_nis <= nis + AS_LIKELY]
            neither = _neither(batch.sighted, left_out, likely)
            return fit(ahead, batch.part([i for i in everyone if i not in neither]), rig) if neither else best
    return None


def _neither(seen: Sighted, left_out: tuple[int, ...], likely: list[tuple[int, ...]]) -> set[int]:
    """Return a sighting that was left out alone and others of its ball that may as likely be the liar; or none."""
    if len(left_out) != 1:
        return set()
    rivals = {i for each in likely for i in each if seen.balls[i] == seen.balls[left_out[0]]}
    return rivals if 1 < len(rivals) < len(seen.sightings) - POSED else set()


def _splits_a_camera(seen: Sighted, kept: Sighted) -> bool:
    """Say whether most of a camera's sightings were left out, and some kept."""
    all_of, left = np.bincount(seen.cameras), np.bincount(kept.cameras, minlength=int(seen.cameras.max()) + 1)
    return bool(((left > 0) & (2 * left < all_of)).any())


def _without_a_camera(ahead: Prediction, batch: Batch, rig: Rig, probability: float) -> Fit | None:
    """Return the fit without the one camera that contradicts the track, such as one with wrong stamps.

    Manoeuvres explain much of what one camera alone says. So the noise is that expected before, and unless exactly one
    choice fits, nobody can tell who lies.
    """
    fitting = []
    for camera in sorted(set(batch.sighted.cameras.tolist())):
        others = [i for i, sighting in enumerate(batch.sighted.sightings) if sighting.camera != camera]
        one = fit(ahead, batch.part(others), rig, adapt=False) if others else None
        if one is not None and _fits(one, probability):
            fitting.append(one)
    return fitting[0] if len(fitting) == 1 else None


def _left_out(sighting: BallSighting, rig: Rig, distance2: float, where: str) -> Rejected:
    """Say which ball was left out and how far off it was."""
    name = rig.marker.balls[sighting.ball].name
    return Rejected(Reason.GATE, f"{name}: {np.sqrt(distance2):.1f} sigma {where}", sighting.t_ns, sighting.camera)


def _posterior(ahead: Prediction, best: Fit) -> tuple[State, float]:
    """Take the likeliest state, and the covariance of one linear step there from the prior, by filterpy; and `spread`.

    Of a measurement's value that covariance knows nothing, so the step is given none.
    """
    prior, step = ahead.state, _linear_step(len(best.P), get_ident())
    step.x, step.P, step.R = np.zeros((len(best.P), 1)), best.P, best.R
    step.update(0.0, H=best.H)
    mean, P, noise, spread = settled(
        prior.mean, best.P, ahead.dt, best.H, best.R, best.dx, step.P, prior.noise, best.sighted.cameras, best.u,
        best.inverse,
    )  # fmt: skip
    return State(prior.t_ns, mean, P, best.levels, noise, prior.manoeuvre_s), spread


@lru_cache(maxsize=8)
def _linear_step(size: int, _thread: int) -> KalmanFilter:
    """Return filterpy's filter for a thread's states of a size: every update brings it the prior, it keeps nothing.

    It is given a compiled inverse: LAPACK's takes longer to call than a matrix of so few sightings takes to invert.
    """
    step = KalmanFilter(dim_x=size, dim_z=1)  # a measurement brings its own size
    step.inv = inverse_of
    return step
