"""Settings of the bridge for the handling of goals. No ROS."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from navigation_bridge.configuration.known_obstacles import KnownObstacles
from navigation_bridge.configuration.sensor_poses import SensorPose
from navigation_core.safety.target_checks import FlightVolume
from navigation_core.tasks.flying.goto import GotoConfig
from navigation_core.traffic.volumes import Separation


class BatteryPolicy(Enum):
    """Action on insufficient battery for the goal and the return."""

    REJECT = "reject"
    """The goal is rejected, or ends with the vehicle holding."""
    WARN = "warn"
    IGNORE = "ignore"


class StationPause(Enum):
    """Effect of a pause by a ground station on the active goal."""

    CANCEL = "cancel"
    """The goal ends."""
    PAUSE = "pause"
    """The goal is paused until the ground station resumes it."""


class PublishTf(Enum):
    """Which transforms the server publishes."""

    ALL = "all"
    """The tree of the vehicle, and the sensors that have a pose among the parameters."""
    VEHICLE = "vehicle"
    """The same without these sensors, which a model of the robot has."""
    NONE = "none"
    """None: something else publishes the frames."""


class MissedWaypoint(Enum):
    """Handling of a waypoint that was passed outside its radius."""

    CONTINUE = "continue"
    """The route is continued, but does not succeed."""
    TURN_BACK = "turn_back"
    """The waypoint is approached again, at most twice."""


@dataclass(frozen=True)
class SafetyConfig:
    """Settings of the safety checks.

    Attributes:
        fence_margin_m: minimum distance of targets from the vehicle's own fence.
        battery_policy: action on insufficient battery.
        battery_reserve: fraction that must remain after the return.
        battery_endurance_s: endurance of a full battery, until the consumption is measured.
        position_doubt_timeout_s: time for which a goal is held while the position is in doubt.
    """

    fence_margin_m: float = 1.0
    battery_policy: BatteryPolicy = BatteryPolicy.REJECT
    battery_reserve: float = 0.2
    battery_endurance_s: float = 900.0
    position_doubt_timeout_s: float = 40.0


@dataclass(frozen=True)
class ObstacleConfig:
    """Settings of obstacle detection and avoidance.

    Attributes:
        vehicle_radius_m: half of the vehicle's greatest width.
        margin_m: planned clearance of the hull.
        blocked_timeout_s: longest wait for a path or a sensor.
        sensor_timeout_s: silence of a sensor after which the vehicle is stopped.
        known: configured obstacles.
        scan_topic: topic of a LaserScan; empty: none.
        points_topic: topic of a PointCloud2; empty: none.
        sensor_pose: pose of the sensor of these topics on the vehicle.
        map_size_m: side of the map of sensed obstacles.
        cell_m: side of its cells.
    """

    vehicle_radius_m: float = 0.5
    margin_m: float = 1.0
    blocked_timeout_s: float = 30.0
    sensor_timeout_s: float = 2.0
    known: KnownObstacles = field(default_factory=KnownObstacles)
    scan_topic: str = ""
    points_topic: str = ""
    sensor_pose: SensorPose = field(default_factory=SensorPose)
    map_size_m: float = 200.0
    cell_m: float = 0.25


@dataclass(frozen=True)
class CommandConfig:
    """Settings of velocity commands.

    Attributes:
        timeout_s: age from which a command counts no more, so that the vehicle stops.
        start_goal: whether a command may start a goal; otherwise only a client's goal does.
        stamped: whether the topic has the type TwistStamped; otherwise Twist.
    """

    timeout_s: float = 0.5
    start_goal: bool = False
    stamped: bool = True


class TrafficConflict(Enum):
    """Handling of a target that is too near to another vehicle's, or to where one stands."""

    WAIT = "wait"
    """The goal is accepted; the vehicle waits before the target until it is free."""
    REJECT = "reject"
    """The goal is rejected."""
    REROUTE = "reroute"
    """The nearest free position is the target."""


@dataclass(frozen=True)
class TrafficConfig:
    """Settings of the separation from other vehicles.

    Attributes:
        on: whether the vehicle keeps apart from others.
        separation: the distances that it keeps; equal for all vehicles of a server.
        conflict: handling of a target that is too near to another vehicle's.
        timeout_s: longest time that a goal waits for other vehicles.
        peers: servers that must have been heard before a vehicle moves.
        topic: of other traffic; empty: none.
        announces: whether others are announced to the autopilot and to ground stations.
        adsb_address: the ICAO address of the vehicle's own transponder; 0 for unknown.
    """

    on: bool = True
    separation: Separation = field(default_factory=Separation)
    conflict: TrafficConflict = TrafficConflict.WAIT
    timeout_s: float = 120.0
    peers: tuple[str, ...] = ()
    topic: str = ""
    announces: bool = False
    adsb_address: int = 0


@dataclass(frozen=True)
class BridgeConfig:
    """Settings for goals.

    Attributes:
        goto: settings of the flight to a point.
        volume: where targets are accepted.
        replace_active_goal: a new goal replaces the active one; otherwise it is rejected.
        setpoint_period_s: time between two setpoints.
        feedback_period_s: minimum time between two feedbacks.
        link_lost_abort_s: silence after which an active goal ends.
        speed_max_m_s: highest ground speed ever flown.
        safety: settings of the safety checks.
        obstacles: settings of obstacle detection and avoidance.
        on_station_pause: effect of a pause by a ground station.
        on_missed_waypoint: handling of a waypoint that was passed outside its radius.
        commands: settings of velocity commands.
        traffic: settings of the separation from other vehicles.
    """

    goto: GotoConfig
    volume: FlightVolume
    replace_active_goal: bool
    setpoint_period_s: float
    feedback_period_s: float
    link_lost_abort_s: float
    speed_max_m_s: float
    safety: SafetyConfig = SafetyConfig()
    obstacles: ObstacleConfig = field(default_factory=ObstacleConfig)
    on_station_pause: StationPause = StationPause.CANCEL
    on_missed_waypoint: MissedWaypoint = MissedWaypoint.CONTINUE
    commands: CommandConfig = CommandConfig()
    traffic: TrafficConfig = field(default_factory=TrafficConfig)
