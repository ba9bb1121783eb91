"""The values that travel between the stages, all frozen.

Frames: W is the room (right-handed, z up), B the body (x forward, y left, z up), C a camera (x right, y down,
z along the optical axis). `R_BtoW` turns body coordinates into room coordinates, `p_BinW` is the body's origin in
the room. Lengths are metres, angles radians, times integer nanoseconds of one monotonic clock at mid-exposure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tracker.standing import Health

Array = NDArray[np.float64]
Image = NDArray[np.uint8]


def frozen_array(values: ArrayLike) -> Array:
    """Return a read-only float64 copy of `values`."""
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def read_only(array: Array) -> Array:
    """Return a view of an array, of which it is known that nobody writes to it any more, for reading alone."""
    view = array.view()
    view.flags.writeable = False
    return view


class Reason(StrEnum):
    """Why something was left out. Each value is a key of the summary's `rejected` counts."""

    UNDECODABLE = "undecodable"  # an image file or packet that is no image
    WRONG_SIZE = "wrong_size"  # an image whose size is not the calibration's
    REPEATED = "repeated"  # an image that its camera gave before: the camera hangs, whatever its stamps say
    EARLY = "early"  # a frame stamped far ahead of all others, alone
    LATE = "late"  # a frame older than the filter can go back to
    NO_BALL = "no_ball"  # a ball expected in a region, nothing of its colour there
    AT_BORDER = "at_border"  # a ball cut by the image's border
    GATE = "gate"  # a sighting too far from the prediction
    FRAME_GATE = "frame_gate"  # a camera's sightings, taken together, too far from the prediction
    ALONE = "alone"  # some of the balls in one camera, and none in another that looked as well
    PARALLAX = "parallax"  # rays too parallel to triangulate
    BEHIND = "behind"  # rays that meet behind a camera
    GEOMETRY = "geometry"  # triangulated balls that are not the marker
    SINGULAR = "singular"  # attitude from three points is undefined at pitch +/-90 deg
    NOT_FOUND = "not_found"  # no marker in the whole frames
    DISCONNECTED = "disconnected"  # a live camera that gives no frames


class TrackState(StrEnum):
    """What the tracker knows of the vehicle."""

    SEARCHING = "searching"  # never seen
    TRACKING = "tracking"  # seen in the last frames
    LOST = "lost"  # seen once, not now


@dataclass(frozen=True, slots=True)
class Rejected:
    """Something left out: counted, logged, never raised."""

    reason: Reason
    detail: str
    t_ns: int = 0
    camera: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One camera's image.

    camera: index into the rig's cameras.
    t_ns: middle of the exposure [ns].
    image: (height, width, 3) BGR, 8 bit.
    available_ns: stopwatch reading when the image stood in memory [ns]; latency counts from here.
    encoded: the image file it was decoded from, empty if it did not come as one.
    """

    camera: int
    t_ns: int
    image: Image
    available_ns: int = 0
    encoded: bytes = b""


@dataclass(frozen=True, slots=True)
class Silence:
    """No frame came for a while: time went on all the same.

    t_ns: the source's clock now, the same clock as `Frame.t_ns` [ns].
    """

    t_ns: int


Event = Frame | Silence | Rejected


class BallSighting(NamedTuple):  # made for each ball that is found: a tuple costs a quarter of a dataclass
    """Where one camera saw one ball.

    uv_px: (2,) centre in the distorted image, pixel centres at integers [px].
    cov_px: (2, 2) covariance of uv_px [px^2].
    """

    camera: int
    ball: int
    t_ns: int
    uv_px: Array
    cov_px: Array


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """A triangulated point: p_inW (3,) [m], its covariance (3, 3) [m^2] and the rays' rms miss distance [m]."""

    p_inW: Array
    covariance: Array
    miss_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Where the vehicle is, and how well that is known.

    t_ns: the instant the state holds for, mid-exposure of the newest frame of its round [ns].
    p_BinW: (3,) position [m].  R_BtoW: (3, 3) attitude.
    v_BinW: (3,) velocity in W [m/s].  w_BinB: (3,) angular rate of B against W, in B [rad/s].
    covariance: (12, 12) of the errors (position in W, rotation vector in B with R = R_hat exp(theta), velocity in W,
        rate in B) [m, rad, m/s, rad/s].
    reset_counter: grows by one, modulo 256, each time the estimate really jumps.
    nis, nis_dof: normalised innovation squared of the last update and its degrees of freedom (0: no update).
    available_ns: stopwatch reading when that frame stood in memory [ns].
    stages_ns: stopwatch time each stage took for this estimate [ns].
    clock_offsets_s, clock_sigmas_s: (cameras,) how much later than its stamp each camera saw, by camera 0's clock, and
        one sigma of that [s]; empty when it is not estimated.
    """

    t_ns: int
    p_BinW: Array
    R_BtoW: Array
    v_BinW: Array
    w_BinB: Array
    covariance: Array
    state: TrackState
    reset_counter: int
    nis: float = 0.0
    nis_dof: int = 0
    available_ns: int = 0
    stages_ns: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    clock_offsets_s: Array = field(default_factory=lambda: frozen_array(()))
    clock_sigmas_s: Array = field(default_factory=lambda: frozen_array(()))


class Step(NamedTuple):  # made for each event
    """What one event did to the tracker.

    estimates are in order of time, each newer than any given before; usually none or one. Where poses wait (see
    `departure`), they are of earlier events than the sightings.
    refused: sightings that did not fit.  health: of the calibration, where the event told something new of it.
    """

    state: TrackState
    sightings: tuple[BallSighting, ...] = ()
    rejections: tuple[Rejected, ...] = ()
    estimates: tuple[Estimate, ...] = ()
    refused: tuple[BallSighting, ...] = ()
    health: Health | None = None
