"""Plain records that the layers exchange through `simulation`.

`autopilot`, `world` and `dynamics` know nothing of one another; these are the words they
share. No behaviour here beyond construction. Numbers are floats of one vehicle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple, TypeAlias

from mavlink_sitl.geodesy import GeoPoint

GRAVITY_M_S2 = 9.80665
Vector = tuple[float, float, float]
"""North, East and down, or forward, right and down"""
ZERO: Vector = (0.0, 0.0, 0.0)


class Result(IntEnum):
    """The result of a command; the numbers are MAV_RESULT's."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4


class Severity(IntEnum):
    """The severity of a text; the numbers are MAV_SEVERITY's."""

    EMERGENCY = 0
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


class LandedState(IntEnum):
    """The numbers are MAV_LANDED_STATE's."""

    UNDEFINED = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class SystemStatus(IntEnum):
    """The numbers are MAV_STATE's."""

    UNINIT = 0
    BOOT = 1
    CALIBRATING = 2
    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5


class Motion(NamedTuple):
    """The estimated position and motion of one vehicle.

    Positions are NED metres from the estimator's origin, velocities NED m/s, angles radians
    (roll right, pitch up, yaw clockwise from North).
    """

    north_m: float
    east_m: float
    down_m: float
    velocity_north_m_s: float
    velocity_east_m_s: float
    velocity_down_m_s: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    roll_rate_rad_s: float
    pitch_rate_rad_s: float
    yaw_rate_rad_s: float

    @property
    def speed_m_s(self) -> float:
        """Over ground."""
        return math.hypot(self.velocity_north_m_s, self.velocity_east_m_s)


class GpsReading(NamedTuple):
    """A reading of the GPS receiver. fix_type as in GPS_FIX_TYPE; eph and epv are 1/100."""

    fix_type: int
    satellites: int
    point: GeoPoint
    speed_m_s: float
    course_deg: float
    time_s: float
    eph: int
    epv: int
    horizontal_accuracy_m: float


class BatteryReading(NamedTuple):
    """A reading of the power monitor."""

    voltage_v: float
    current_a: float
    consumed_mah: float
    consumed_wh: float
    remaining_percent: float


class FurtherBattery(NamedTuple):
    """A battery beside the first, as BATTERY_STATUS reports it; nothing empties it.

    Attributes:
        number: its id, from 1.
        remaining_percent: its charge, -1 when unknown.
        charge_state: MAV_BATTERY_CHARGE_STATE.
        function: MAV_BATTERY_FUNCTION.
        voltage_v: of the pack.
    """

    number: int
    remaining_percent: int
    charge_state: int = 1
    function: int = 0
    voltage_v: float = 12.6


class RangeReading(NamedTuple):
    """Readings of the range sensors in metres; infinity where nothing is in range.

    Attributes:
        sectors_m: clockwise from the nose in equal steps, the whole way round.
        down_m: to the ground or a roof, along the vehicle's own axis.
        reach_m: of the sensor that looks around.
        reach_down_m: of the one that looks down.
    """

    sectors_m: tuple[float, ...]
    down_m: float
    reach_m: float
    reach_down_m: float


class Sighting(NamedTuple):
    """One sighting of the mark by a camera.

    Attributes:
        measured_us: simulated time of the picture, microseconds.
        body_frd_m: the mark from the vehicle's middle, along its forward, right and down axes.
    """

    measured_us: int
    body_frd_m: Vector


class Observation(NamedTuple):
    """The inputs of an autopilot at one of its updates."""

    time_s: float
    """Simulated time, not time since boot."""
    motion: Motion
    gps_fix: bool
    battery: BatteryReading
    touching_ground: bool
    impact_m_s: float
    thrust_over_hover: float
    airspeed_m_s: float | None = None
    """Indicated, of vehicles with a sensor."""
    gps_off_m: float = 0.0
    """How far the receiver is, over ground, from what the estimator has believed of it."""

    def indicated_m_s(self, true_over_indicated: float) -> float:
        """The indicated airspeed: measured, or as the speed over ground makes it."""
        if self.airspeed_m_s is None:
            return self.motion.speed_m_s / true_over_indicated
        return self.airspeed_m_s


class YawMode(IntEnum):
    """The reference of the yaw controller."""

    HOLD = 0
    ANGLE = 1
    RATE = 2
    LOOK_AHEAD = 3


class Motors(IntEnum):
    """The permitted motor state."""

    OFF = 0
    IDLE = 1
    FLY = 2
    MANUAL = 3
    """Throttle straight from the stick, level."""


@dataclass(frozen=True)
class Limits:
    """The kinematic limits of a vehicle; m/s, m/s2 and m/s3, all above 0."""

    speed_xy_m_s: float = 10.0
    speed_up_m_s: float = 2.5
    speed_down_m_s: float = 1.5
    acceleration_xy_m_s2: float = 2.5
    acceleration_z_m_s2: float = 1.0
    jerk_xy_m_s3: float = 5.0
    jerk_z_m_s3: float = 5.0
    fading_1_s: float = 0.0
    """Gain from the last error of a desired velocity to its acceleration, if that is larger than
    jerk over acceleration."""


@dataclass(frozen=True)
class Guidance:
    """The controllers' reference until the next one. Plain floats, NED, SI units.

    Horizontally and vertically the target is a position, a velocity or an acceleration, with
    those of higher order as feed-forward: `track_position_*` and `track_velocity_*` are 1 or
    0 and switch the loops. A tracked position moves on with `velocity_*`, and that grows
    with `acceleration_*`.
    """

    motors: Motors = Motors.OFF
    throttle: float = 0.0
    """Only for Motors.MANUAL: 0..1 of full thrust."""
    track_position_xy: float = 0.0
    track_velocity_xy: float = 1.0
    track_position_z: float = 0.0
    track_velocity_z: float = 1.0
    north_m: float = 0.0
    east_m: float = 0.0
    down_m: float = 0.0
    velocity_north_m_s: float = 0.0
    velocity_east_m_s: float = 0.0
    velocity_down_m_s: float = 0.0
    acceleration_north_m_s2: float = 0.0
    acceleration_east_m_s2: float = 0.0
    acceleration_down_m_s2: float = 0.0
    direct_lean: float = 0.0
    """1 to lean as `lean_*` say, whatever the position; else 0."""
    lean_north: float = 0.0
    """Tangent of the angle by which the thrust leans to the North."""
    lean_east: float = 0.0
    limits: Limits = Limits()
    yaw_mode: YawMode = YawMode.HOLD
    yaw_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    restart_xy: bool = False
    """Start shaping from where the vehicle is now instead of from the running target."""
    restart_z: bool = False
    unshaped: bool = False
    """Desired are exactly this position, velocity and acceleration, which are within the limits
    already (AC_PosControl::set_pos_vel_accel)."""
    straight: float = 0.0
    """1 to limit the speeds over ground and up or down so that the way there is straight."""

    def at(self, place_ned_m: Vector) -> Guidance:
        """The same, but to a place, and there to stay."""
        north, east, down = place_ned_m
        return replace(
            self,
            track_position_xy=1.0,
            track_position_z=1.0,
            north_m=north,
            east_m=east,
            down_m=down,
        )

    def moving(self, velocity_ned_m_s: Vector, acceleration_ned_m_s2: Vector = ZERO) -> Guidance:
        """The same, with another velocity and acceleration."""
        v_north, v_east, v_down = velocity_ned_m_s
        a_north, a_east, a_down = acceleration_ned_m_s2
        return replace(
            self,
            velocity_north_m_s=v_north,
            velocity_east_m_s=v_east,
            velocity_down_m_s=v_down,
            acceleration_north_m_s2=a_north,
            acceleration_east_m_s2=a_east,
            acceleration_down_m_s2=a_down,
        )

    def exactly(
        self, place_ned_m: Vector, velocity_ned_m_s: Vector, acceleration_ned_m_s2: Vector
    ) -> Guidance:
        """The same, but on a track: desired are exactly this place and motion."""
        moving = self.at(place_ned_m).moving(velocity_ned_m_s, acceleration_ned_m_s2)
        return replace(moving, unshaped=True)


class NavigationReport(NamedTuple):
    """For NAV_CONTROLLER_OUTPUT; degrees clockwise from North, metres, m/s."""

    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    bearing_deg: float = 0.0
    target_bearing_deg: float = 0.0
    distance_m: float = 0.0
    altitude_error_m: float = 0.0
    airspeed_error_m_s: float = 0.0
    cross_track_m: float = 0.0


@dataclass(frozen=True)
class StatusText:
    """Words for people; any length."""

    severity: Severity
    text: str


@dataclass(frozen=True)
class ModeChanged:
    """The mode is another one now."""

    name: str
    previously_position_controlled: bool


@dataclass(frozen=True)
class ItemReached:
    """An item of the mission is done."""

    seq: int


@dataclass(frozen=True)
class PhotoTaken:
    """The camera has taken a photo; photos are counted from 1."""

    number: int


@dataclass(frozen=True)
class HomeChanged:
    """Home was set."""


@dataclass(frozen=True)
class ParameterSaved:
    """The firmware has saved a parameter by itself, and reports it on all links."""

    name: str
    value: float
    type: int
    """MAV_PARAM_TYPE"""


@dataclass(frozen=True)
class RebootRequested:
    """The firmware is about to start again."""


Event: TypeAlias = (
    StatusText
    | ModeChanged
    | HomeChanged
    | ItemReached
    | ParameterSaved
    | PhotoTaken
    | RebootRequested
)
