"""Whether the marker stands elsewhere than the track has it, where of a ball that several cameras see one is left out.

What lies does so in one camera, mostly. A ball that lies in several must lie where its rays meet, and at the right
distances from the others; where all sightings show the marker as it is, somewhere else, a thing does just that, or the
track is wrong, as with a vehicle that was moved by hand. Nobody can tell from one instant, and no pose is right then.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tracker.filter.batch import Sighted, make_batch
from tracker.filter.fit import Fit, fit
from tracker.filter.predict import Prediction
from tracker.maths.gate import chi2_limit
from tracker.rig import Rig
from tracker.state import ATTITUDE, POSITION
from tracker.types import BallSighting

OPEN_M, OPEN_RAD = 0.1, 0.5  # one sigma on each axis of a pose that the track says nothing of
POSE = 6  # figures that such a fit takes up


def stands_elsewhere(ahead: Prediction, seen: Sighted, believed: Fit, rig: Rig, probability: float) -> bool:
    """Say whether sightings left out are of balls several cameras see, one beside itself, and yet all make a marker.

    seen: what the fit was to be made of.  probability: of a true marker to pass.
    """
    used, views = believed.sighted.sightings, np.bincount(seen.balls)
    left = [one for one in seen.sightings if views[one.ball] > 1 and not any(one is other for other in used)]
    if not left:
        return False
    state = ahead.state.moved(believed.dx)
    opened = np.zeros(len(state.P))
    opened[POSITION], opened[ATTITUDE] = OPEN_M**2, OPEN_RAD**2
    P = state.P + np.diag(opened)
    anywhere = ahead._replace(state=replace(state, P=P), P_coasted=P, dt=0.0)
    if not any(_beside_itself(one, anywhere, rig) for one in left):
        return False
    whole = fit(anywhere, make_batch(anywhere, seen, rig), rig, adapt=False)
    return whole is not None and whole.nis <= chi2_limit(probability, len(whole.u) - POSE)


def _beside_itself(one: BallSighting, there: Prediction, rig: Rig) -> bool:
    """Say whether a ball is seen so far off that its middle lies outside it: more than what half hides a ball does."""
    camera, ball, state = rig.cameras[one.camera], rig.marker.balls[one.ball], there.state
    centre_inW = (state.p_BinW + state.R_BtoW @ there.points_of(rig)[one.ball])[None]
    off_px = float(np.linalg.norm(one.uv_px - camera.project(centre_inW)[0][0]))
    return off_px * float(camera.in_camera(centre_inW)[0, 2]) > camera.focal_px * ball.radius_m
