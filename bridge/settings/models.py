"""What a config may say: one frozen model a section. config/lab.toml explains every key.

Keys carry their unit as a suffix (`_mm`, `_deg`, `_ms`, `_px`, `_m_s2`), which the error messages read back.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from bridge.settings.section import (
    Byte,
    Name,
    NotNegative,
    Pixels,
    Positive,
    Range,
    Real,
    Row,
    Section,
    Share,
    Triple,
    refuse_twins,
)
from bridge.settings.tracking import TrackerSettings
from bridge.settings.vehicle import VehicleSettings

MessageName = Literal["VISION_POSITION_ESTIMATE", "ATT_POS_MOCAP", "VISION_SPEED_ESTIMATE", "ODOMETRY"]
COLOUR_KEYS = ("hue_deg", "hue_tolerance_deg", "saturation_min", "value_min", "bgr")


class RoomSettings(Section):
    """How the room lies to north, and how large the part of it is that the vehicle may use, about the room's origin."""

    room_yaw_deg: Annotated[float, Strict(), Field(ge=-360, le=360)]
    volume_mm: Annotated[tuple[Positive, ...], Field(min_length=3, max_length=3)] = (2000.0, 1000.0, 1500.0)


class CameraSettings(Section):
    """One camera's nominal calibration, and how to set a live one up (see `tracker.sources.live_camera`)."""

    name: Name
    width_px: Pixels
    height_px: Pixels
    fx_px: Positive
    fy_px: Positive
    cx_px: Real
    cy_px: Real
    distortion: Annotated[tuple[Real, ...], Field(min_length=4, max_length=8)]
    T_CtoW: Annotated[tuple[Row, ...], Field(min_length=4, max_length=4)]
    frame_rate_hz: Positive | None = None
    fourcc: Annotated[str, Field(min_length=4, max_length=4)] | None = None
    exposure_ms: Positive | None = None
    latency_ms: Annotated[float, Strict(), Field(ge=0, le=1000)] | None = None
    lock: bool = True
    clock_offset_ms: Annotated[float, Strict(), Field(ge=-1000, le=1000)] = 0.0
    readout_ms: Annotated[float, Strict(), Field(ge=-100, le=100)] = 0.0


class MeasuredCameraSettings(Section):
    """What one camera's place and clock are known to, one sigma: x, y, z of the room; turns about its own axes."""

    name: Name
    position_sigma_mm: Triple
    attitude_sigma_deg: Triple
    clock_sigma_ms: NotNegative


class MeasuredSettings(Section):
    """How the rig's cameras were measured: they count before a source's own. Written by `posebridge calibrate room`."""

    on: Name
    by: str = ""
    source: Name
    verdict: Literal["good", "usable", "not good"]
    reasons: tuple[str, ...] = ()
    frame: Literal["spots", "board", "config"]
    point_mm: Real
    worst_point_mm: Real
    spacing_mm: Real
    spacing_95_mm: Real
    reprojection_px: Real
    epipolar_px: Real
    cameras: tuple[MeasuredCameraSettings, ...] = ()


class RigSettings(Section):
    """The cameras: a calibration directory, absolute once loaded, or those listed: nominal, or measured."""

    calibration: str = ""
    measured: MeasuredSettings | None = None
    cameras: tuple[CameraSettings, ...] = ()

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        refuse_twins("camera name", [camera.name for camera in self.cameras])
        return self


class BallSettings(Section):
    """One painted ball of the marker."""

    name: Name
    position_mm: Triple
    radius_mm: Positive
    hue_deg: Annotated[float, Strict(), Field(ge=0, lt=360)]
    hue_tolerance_deg: Annotated[float, Strict(), Field(gt=0, le=90)]
    saturation_min: Share
    value_min: Share
    bgr: Annotated[tuple[Byte, ...], Field(min_length=3, max_length=3)]

    @model_validator(mode="before")
    @classmethod
    def _has_a_colour(cls, table: object) -> object:
        lacking = [key for key in COLOUR_KEYS if isinstance(table, Mapping) and key not in table]
        if lacking:
            raise ValueError(f"colour missing: the tracker tells balls apart by paint; add {', '.join(lacking)}")
        return table


class MarkerSettings(Section):
    """The balls on the vehicle."""

    balls: tuple[BallSettings, ...]

    @model_validator(mode="after")
    def _hues_lie_apart(self) -> Self:
        refuse_twins("ball name", [ball.name for ball in self.balls])
        for i, one in enumerate(self.balls):
            for other in self.balls[i + 1 :]:
                distance_deg = abs((one.hue_deg - other.hue_deg + 180) % 360 - 180)
                needed_deg = one.hue_tolerance_deg + other.hue_tolerance_deg
                if distance_deg < needed_deg:
                    raise ValueError(
                        f"hues of {one.name} and {other.name} lie {distance_deg:g} deg apart, their tolerances need "
                        f"{needed_deg:g} deg; lessen hue_tolerance_deg or repaint one ball"
                    )
        return self


class MavlinkSettings(Section):
    """Who the bridge is on MAVLink, what kind of autopilot it talks to, how old a pose may get, what a log asks for."""

    system_id: Annotated[int, Strict(), Field(ge=1, le=254)] | None = None
    component_id: Annotated[int, Strict(), Field(ge=1, le=255)] = 197
    profile: Literal["auto", "ardupilot", "px4", "generic"] = "auto"
    max_age_ms: Positive = 100.0
    streams_hz: Annotated[float, Strict(), Field(ge=0, le=400)] = 50.0
    signing_key: str = ""


class MonitorSettings(Section):
    """Where a running bridge can be watched, and what its alarms go by."""

    port: Annotated[int, Strict(), Field(ge=0, le=65_528)] = 14_730
    rate_min_hz: Positive = 15.0
    latency_limit_ms: Positive = 60.0


class OriginSettings(Section):
    """Where the room's origin lies on the globe."""

    latitude_deg: Annotated[float, Strict(), Field(ge=-90, le=90)]
    longitude_deg: Annotated[float, Strict(), Field(ge=-180, le=180)]
    altitude_m: Annotated[float, Strict(), Field(ge=-500, le=9000)]

    @model_validator(mode="after")
    def _is_a_place(self) -> Self:
        if not self.latitude_deg and not self.longitude_deg:
            raise ValueError(
                "latitude_deg and longitude_deg = 0 deg: autopilots refuse that place; give the room's own"
            )
        if not self.altitude_m:
            raise ValueError("altitude_m = 0 m: leaves ArduPilot's height wrong by metres; give the room's own, or 1")
        return self


class LogSettings(Section):
    """Whether a log keeps the frames themselves, and how much of the disk they may take."""

    frames: Literal["off", "jpeg", "png"] = "off"
    frames_mb: Positive = 4000.0
    jpeg_quality: Annotated[int, Strict(), Field(ge=1, le=100)] = 95


class LinkSettings(Section):
    """One way to an autopilot, and what goes over it: the profile's messages and the streams of all, unless it says."""

    uri: Name
    streams_hz: Annotated[float, Strict(), Field(ge=0, le=400)] | None = None
    messages: Annotated[tuple[MessageName, ...], Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _messages_differ(self) -> Self:
        refuse_twins("message", self.messages or ())
        return self


class MountSettings(Section):
    """A box of the room in which a camera may stand, flat or a line if it likes."""

    name: Name
    x_m: Range
    y_m: Range
    z_m: Range


class PlaceSettings(Section):
    """What `posebridge place` may choose from; nothing else reads it."""

    room_x_m: Range = (-2.5, 2.5)
    room_y_m: Range = (-2.5, 2.5)
    room_z_m: Range = (-1.2, 2.4)
    volume_x_m: Range = (-1.0, 1.0)
    volume_y_m: Range = (-0.5, 0.5)
    volume_z_m: Range = (-0.75, 0.75)
    walls: tuple[Literal["x-", "x+", "y-", "y+", "ceiling"], ...] = ("x-", "x+", "y-", "y+", "ceiling")
    wall_z_m: Range = (0.0, 2.3)
    clearance_m: NotNegative = 0.1
    mounts: tuple[MountSettings, ...] = ()
    apart_m: NotNegative = 0.3
    lenses_deg: Annotated[tuple[Annotated[float, Strict(), Field(gt=1, lt=150)], ...], Field(min_length=1)] = (
        30.0, 45.0, 60.0, 75.0,
    )  # fmt: skip
    width_px: Pixels = 640
    height_px: Pixels = 480
    tilt_deg: Annotated[float, Strict(), Field(ge=0, le=80)] = 20.0
    grey_noise: Annotated[float, Strict(), Field(gt=0, le=1)] = 0.03
    blur_px: Positive = 0.5
    least_radius_px: Positive = 2.0
    coverage_min: Share = 0.99


class Settings(Section):
    """A whole config."""

    room: RoomSettings
    rig: RigSettings
    marker: MarkerSettings
    tracker: TrackerSettings = TrackerSettings()
    mavlink: MavlinkSettings = MavlinkSettings()
    origin: OriginSettings | None = None
    monitor: MonitorSettings = MonitorSettings()
    log: LogSettings = LogSettings()
    vehicle: VehicleSettings | None = None
    place: PlaceSettings = PlaceSettings()
    links: tuple[LinkSettings, ...] = ()

    @model_validator(mode="after")
    def _links_differ(self) -> Self:
        refuse_twins("link", [link.uri for link in self.links])
        return self

    def with_links(self, uris: tuple[str, ...]) -> Settings:
        """Return these settings with the command line's links, if any, each with its profile's messages.

        The URIs are checked when the links open, as those of the config are.
        """
        if not uris:
            return self
        return self.model_copy(update={"links": tuple(LinkSettings.model_construct(uri=uri) for uri in uris)})

    def with_frames(self, frames: str | None, frames_mb: float | None) -> Settings:
        """Return these settings with the command line's word on the frames in the log, where it has one.

        The command line has checked both.
        """
        said = {"frames": frames, "frames_mb": frames_mb}
        log = self.log.model_copy(update={key: value for key, value in said.items() if value is not None})
        return self.model_copy(update={"log": log})
