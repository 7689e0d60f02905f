"""Requests of clients, as sent. No ROS."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from navigation_core.geometry import Vector3
from navigation_core.trajectories.timed_point import TimedPoint

# Upper limit, to catch typing errors.
LAPS_MAX = 1000


@dataclass(frozen=True)
class NavigateRequest:
    """A goal of ``custom_interfaces/action/Navigate`` as it was sent.

    Attributes:
        frame_id: "map", "" (which means map), "base_link" or "wgs84".
        position: target in that frame: ENU or FLU metres, or latitude and longitude in degrees
            and altitude above mean sea level in metres.
        orientation_xyzw: target orientation; all zero = face the direction of travel.
        avoid_obstacles: whether the client asked for obstacle avoidance.
        max_speed_m_s: highest ground speed; 0 = the configured default.
    """

    frame_id: str
    position: Vector3
    orientation_xyzw: tuple[float, float, float, float]
    avoid_obstacles: bool
    max_speed_m_s: float


class ActKind(Enum):
    """Kinds of acts at a waypoint, by the numbers of ``custom_interfaces/msg/WaypointAct``."""

    PHOTO = 0
    TRIGGER_DISTANCE = 1
    POINT = 2
    GRIPPER = 3
    SERVO = 4
    WAIT = 5


class PointMode(Enum):
    """Where a gimbal is pointed, by the numbers of ``custom_interfaces/msg/WaypointAct``."""

    ANGLE = 0
    POSITION = 1
    NEUTRAL = 2


@dataclass(frozen=True)
class ActRequest:
    """An act at a waypoint as it was sent; each kind reads its own attributes.

    Attributes:
        kind: what is done; None for an unknown number.
        required: whether the goal ends if the vehicle does not do it.
        distance_m: distance between photos; 0 ends them.
        point: where the gimbal is pointed; None for an unknown number.
        pitch_rad: angle above the horizon.
        yaw_rad: counter-clockwise from the nose, or from east if it is locked.
        yaw_locked: whether the yaw is from east of the map.
        target: what the gimbal points at, as the position of the waypoint.
        grabs: whether the gripper closes; None for an unknown number.
        channel: servo output, from 1.
        pulse_us: its pulse width.
        duration_s: how long to hold.
    """

    kind: ActKind | None
    required: bool = False
    distance_m: float = 0.0
    point: PointMode | None = PointMode.ANGLE
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    yaw_locked: bool = False
    target: Vector3 = (0.0, 0.0, 0.0)
    grabs: bool | None = False
    channel: int = 0
    pulse_us: int = 0
    duration_s: float = 0.0


class AltitudeReference(Enum):
    """Altitude reference of a geodetic waypoint."""

    AMSL = "above mean sea level"
    HOME = "above home"
    GROUND = "above the ground below the vehicle"


@dataclass(frozen=True)
class WaypointRequest:
    """One waypoint as it was sent.

    Attributes:
        position: ENU metres, or latitude and longitude in degrees and a height in metres.
        altitude_reference: reference of the height of a geodetic position; None in the map frame.
        acceptance_radius_m: distance within which it is reached; 0 = the configured default.
        hold_time_s: time to hold there; 0 = fly through.
        yaw_enu_rad: heading, or None for the direction of travel.
        max_speed_m_s: highest ground speed on the leg to it; 0 = the goal's.
        acts: what is done there.
    """

    position: Vector3
    altitude_reference: AltitudeReference | None = None
    acceptance_radius_m: float = 0.0
    hold_time_s: float = 0.0
    yaw_enu_rad: float | None = None
    max_speed_m_s: float = 0.0
    acts: tuple[ActRequest, ...] = ()


@dataclass(frozen=True)
class WaypointsRequest:
    """A goal of ``custom_interfaces/action/NavigateWaypoints`` as it was sent.

    Attributes:
        waypoints: the route.
        by_mission: whether the autopilot flies it as a mission; otherwise the bridge does.
        laps: number of times the route is flown; 0 = once.
        max_speed_m_s: highest ground speed; 0 = the configured default.
        avoid_obstacles: whether the client asked for obstacle avoidance.
        first: where an interrupted route continues, from 0 over all laps.
        interrupted_id: ``route_id`` of that route; 0 = not compared.
        yaw_rate_rad_s: with which it turns on and on, counter-clockwise; 0 = not.
    """

    waypoints: tuple[WaypointRequest, ...]
    by_mission: bool = False
    laps: int = 0
    max_speed_m_s: float = 0.0
    avoid_obstacles: bool = False
    first: int = 0
    interrupted_id: int = 0
    yaw_rate_rad_s: float = 0.0

    @property
    def route_id(self) -> int:
        """A number of 32 bits, never 0, that other waypoints or laps would not have."""
        return zlib.crc32(repr((self.waypoints, max(self.laps, 1))).encode()) or 1


class OrbitYaw(Enum):
    """The yaw on a circle, by the numbers of ``custom_interfaces/action/Orbit``."""

    CENTRE = 0
    TANGENT = 1
    KEEP = 2


@dataclass(frozen=True)
class OrbitRequest:
    """A goal of ``custom_interfaces/action/Orbit`` as it was sent.

    Attributes:
        frame_id: frame of the centre, as of a `NavigateRequest`.
        centre: centre in that frame; its altitude is not used.
        radius_m: radius; positive is anticlockwise seen from above, negative clockwise.
        height_m: height above the ground; NaN = the present altitude.
        laps: number of laps; 0 = until the goal is cancelled.
        max_speed_m_s: highest ground speed; 0 = the configured default.
        yaw: yaw on the circle; None for a number that means nothing.
        avoid_obstacles: whether the client asked for obstacle avoidance.
    """

    frame_id: str
    centre: Vector3
    radius_m: float
    height_m: float = math.nan
    laps: float = 1.0
    max_speed_m_s: float = 0.0
    yaw: OrbitYaw | None = OrbitYaw.CENTRE
    avoid_obstacles: bool = False


class FollowYaw(Enum):
    """The yaw beside a target, by the numbers of ``custom_interfaces/action/Follow``."""

    TARGET = 0
    TANGENT = 1
    KEEP = 2


class OffsetFrame(Enum):
    """The axes of an offset, by the numbers of ``custom_interfaces/action/Follow``."""

    TARGET = 0
    """Forward, left and up of the target."""
    MAP = 1
    """East, north and up."""


@dataclass(frozen=True)
class TargetSource:
    """Where the samples of a target come from: one of these.

    Attributes:
        topic: name of a topic of poses; empty for none.
        frame: name of a frame of TF; empty for none.
        system_id: MAVLink system id; 0 for none.
    """

    topic: str = ""
    frame: str = ""
    system_id: int = 0

    def __str__(self) -> str:
        """Return its name for sentences."""
        if self.topic:
            return f"topic '{self.topic}'"
        return f"frame '{self.frame}'" if self.frame else f"MAVLink system {self.system_id}"


@dataclass(frozen=True)
class FollowRequest:
    """A goal of ``custom_interfaces/action/Follow`` as it was sent.

    Attributes:
        source: where the target's samples come from.
        offset_m: from the target to the place that is kept, in metres.
        offset_frame: its axes; None for a number that means nothing.
        least_distance_m: least distance to the target; 0 = the clearance to obstacles.
        max_speed_m_s: highest ground speed; 0 = the configured default.
        max_duration_s: longest duration; 0 = until the goal is cancelled.
        lost_timeout_s: longest time without the target; 0 = 10 s.
        yaw: yaw of what flies; None for a number that means nothing.
        topic_types: types with which the topic is published; empty while nobody publishes it.
    """

    source: TargetSource
    offset_m: Vector3
    offset_frame: OffsetFrame | None = OffsetFrame.TARGET
    least_distance_m: float = 0.0
    max_speed_m_s: float = 0.0
    max_duration_s: float = 0.0
    lost_timeout_s: float = 0.0
    yaw: FollowYaw | None = FollowYaw.TARGET
    topic_types: tuple[str, ...] = ()


@dataclass(frozen=True)
class TakeoffRequest:
    """A goal of ``custom_interfaces/action/Takeoff``; height 0 = the configured default."""

    height_m: float


@dataclass(frozen=True)
class LandRequest:
    """A goal of ``custom_interfaces/action/Land`` as it was sent.

    Attributes:
        target_topic: name of a topic with the poses of a target to land on; empty for none.
        target_required: whether the vehicle holds instead of landing without the target.
        retries: how often it climbs and searches again once it has lost the target.
        search_height_m: height above the ground at which it searches; 0 = as high as it is.
        topic_types: types with which the topic is published; empty while nobody publishes it.
    """

    target_topic: str = ""
    target_required: bool = False
    retries: int = 0
    search_height_m: float = 0.0
    topic_types: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReturnRequest:
    """A goal of ``custom_interfaces/action/ReturnToLaunch``."""


@dataclass(frozen=True)
class VelocityRequest:
    """A goal of ``custom_interfaces/action/FollowVelocity``.

    Attributes:
        max_speed_m_s: highest ground speed; 0 = the configured default.
    """

    max_speed_m_s: float = 0.0


@dataclass(frozen=True)
class TrajectoryRequest:
    """A goal of ``custom_interfaces/action/FollowTrajectory``, or a message of its topic.

    Attributes:
        frame_id: frame of the points: "map", "" (which means map) or "base_link".
        points: its points in that frame; none for those of the topic only.
        begins_s: moment from which its time counts, in seconds of the bridge's clock; None for at
            once.
        fault: why the message is none, a sentence; empty if it is one.
        frame_fault: why its frame cannot be used, a sentence; empty if it can, or is not known.
    """

    frame_id: str = ""
    points: tuple[TimedPoint, ...] = ()
    begins_s: float | None = None
    fault: str = ""
    frame_fault: str = ""


Request: TypeAlias = (
    NavigateRequest
    | FollowRequest
    | WaypointsRequest
    | OrbitRequest
    | TakeoffRequest
    | LandRequest
    | ReturnRequest
    | VelocityRequest
    | TrajectoryRequest
)
