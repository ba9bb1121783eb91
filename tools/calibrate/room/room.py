"""A room, calibrated: cameras in the room's frame, and all that is known of how good they are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tools.calibrate.board import Board
from tools.calibrate.room.certainty import camera_covariance, turned
from tools.calibrate.room.floor_sigmas import FloorSigmas, floor_sigmas
from tools.calibrate.room.footage import Footage
from tools.calibrate.room.gauge import moved
from tools.calibrate.room.held_out import HeldOut, judged
from tools.calibrate.room.jacobian import CAMERA
from tools.calibrate.room.lying import Lying, lying_board
from tools.calibrate.room.radius import Size, measured_sizes
from tools.calibrate.room.scene import Scene
from tools.calibrate.room.sides import Side, measured_sides, refuse_swapped
from tools.calibrate.room.solve import Found, find_cameras
from tools.calibrate.room.spots import Floor, find_stands, floor_of
from tools.calibrate.room.volume import Volume, surveyed
from tracker.camera import Camera
from tracker.errors import OperatorError
from tracker.rig import Rig, make_rig
from tracker.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class Terms:
    """What the operator says of the room.

    by_spots: gravity and heading come from three spots; else from the board, or, without one, the config's cameras.
    origin_m (3,): where in the room the marker's middle is on the first spot, or the board's first inner corner.
    apart_m: measured distance of the first two spots, None if nobody did.  volume_m (3,): the config's.
    lenses: refine them.  board: that lies on the floor, None for none.
    """

    by_spots: bool
    origin_m: Array
    apart_m: float | None
    volume_m: Array
    lenses: bool
    board: Board | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """cameras: in the room's frame, with their clocks.  covariance (7 n, 7 n): see `certainty.camera_covariance`.

    lying: the board on the floor, where it gives the frame.  floor_sigmas: of the spots', where they do.
    seen_s: how long each camera saw the marker together with another [s].
    """

    cameras: tuple[Camera, ...]
    covariance: Array
    found: Found
    held_out: HeldOut
    volume: Volume
    sides: tuple[Side, ...]
    sizes: tuple[Size, ...]
    floor: Floor | None
    apart_m: float | None
    seen_s: tuple[float, ...]
    lying: Lying | None = None
    floor_sigmas: FloorSigmas | None = None

    def position_mm(self, c: int) -> Array:
        """Return one sigma of a camera's position (3,) in the room, against the other cameras [mm]."""
        return 1e3 * self._sigmas(c)[:3]

    def attitude_deg(self, c: int) -> Array:
        """Return one sigma of a camera's turn (3,) about its own x (right), y (down) and axis [deg]."""
        return np.asarray(np.degrees(self._sigmas(c)[3:6]))

    def clock_ms(self, c: int) -> float:
        """Return one sigma of a camera's clock against camera 0's [ms]."""
        return float(1e3 * self._sigmas(c)[6])

    def _sigmas(self, c: int) -> Array:
        return np.sqrt(np.diag(self.covariance)[CAMERA * c : CAMERA * (c + 1)])


def calibrate_room(footage: Footage, rig: Rig, terms: Terms) -> Room:
    """Find the cameras, put them into the room's frame, and measure how good they are.

    Raises:
        OperatorError: footage that tells nothing, balls in each other's places, no spots or no board where wanted.
    """
    found = find_cameras(footage, rig, lenses=terms.lenses)
    sides = measured_sides(found, rig)
    refuse_swapped(sides, rig)
    floor, lying = _frame_of(footage, found, rig, terms)
    frame = floor or lying
    scene = found.scene if frame is None else moved(found.scene, frame.R_WtoF, frame.p_WinF)
    if floor is None:
        _refuse_upside_down(scene)
    cameras = tuple(
        replace(camera, clock_offset_ns=timed.clock_offset_ns)
        for camera, timed in zip(scene.cameras, found.cameras, strict=True)
    )
    to_room = scene.cameras[0].R_CtoW @ found.adjusted.scene.cameras[0].R_CtoW.T
    covariance = turned(camera_covariance(found.adjusted), to_room)
    held_out = judged(found, rig)
    return Room(
        cameras,
        covariance,
        found,
        held_out,
        surveyed(cameras, covariance, scene.p_BinW, terms.volume_m),
        sides,
        measured_sizes(footage, make_rig(found.cameras, rig.marker)),
        floor,
        terms.apart_m,
        _seen_s(found),
        lying,
        None if floor is None else _floor_sigmas(floor, found, held_out),
    )


def _frame_of(footage: Footage, found: Found, rig: Rig, terms: Terms) -> tuple[Floor | None, Lying | None]:
    """Return the spots' frame or the board's; neither where the config's cameras give it."""
    if terms.by_spots:
        hung = np.array([camera.p_CinW for camera in found.cameras])
        stands = find_stands(found.tracks, found.scene.offsets_s, found.cameras, rig)
        return floor_of(stands, hung, terms.origin_m), None
    if terms.board is not None:
        return None, lying_board(footage.stills, found.cameras, terms.board, terms.origin_m)
    return None, None


def _floor_sigmas(floor: Floor, found: Found, held_out: HeldOut) -> FloorSigmas:
    """Return what the spots are known to; a stand errs by itself as distances of balls do in what was held out."""
    to_found = found.scene.cameras[0].R_CtoW @ found.adjusted.scene.cameras[0].R_CtoW.T
    covariance = turned(camera_covariance(found.adjusted), to_found)
    return floor_sigmas(floor, found.cameras, covariance, 1e-3 * float(np.nan_to_num(held_out.spacing_mm)))


def _refuse_upside_down(scene: Scene) -> None:
    up = float(scene.R_BtoW[:, 2, 2].mean())
    if up < 0.0:
        raise OperatorError(
            "calibrate room: MIRRORED: by the order of its colours the marker was carried upside down most of the "
            "time; two places in [[marker.balls]] are swapped, or the cameras' pictures are mirrored (switch off the "
            "driver's flip); if you did carry it so, carry it upright"
        )


def _seen_s(found: Found) -> tuple[float, ...]:
    """Return how long each camera saw the marker together with another [s]."""
    there = np.concatenate((found.seen.there, found.held_out.there), axis=1)
    shared = (there & (there.sum(axis=0) >= 2)).sum(axis=1)
    instants = np.concatenate((found.seen.t_s, found.held_out.t_s))
    span_s = max(float(np.ptp(track.t_s)) for track in found.tracks if len(track))
    return tuple((shared / max(1, len(instants)) * span_s).tolist())
