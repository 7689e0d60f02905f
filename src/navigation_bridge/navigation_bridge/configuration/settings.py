"""How goals are treated: the settings of the bridge. No ROS."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from navigation_bridge.configuration.known_obstacles import KnownObstacles
from navigation_bridge.configuration.sensor_poses import SensorPose
from navigation_core.safety.target_checks import FlightVolume
from navigation_core.tasks.flying.goto import GotoConfig


class BatteryPolicy(Enum):
    """What is done about a battery that will not do for the goal and the way back."""

    REJECT = "reject"
    """The goal is refused, or ends with the vehicle holding."""
    WARN = "warn"
    IGNORE = "ignore"


class StationPause(Enum):
    """What a pause by a ground station is to the active goal."""

    CANCEL = "cancel"
    """The goal's end."""
    PAUSE = "pause"
    """A pause of the goal, which the ground station may end."""


class MissedWaypoint(Enum):
    """What becomes of a waypoint of a route that was passed outside its radius."""

    CONTINUE = "continue"
    """The route is flown on, and does not succeed."""
    TURN_BACK = "turn_back"
    """It is flown to once more, twice at most."""


@dataclass(frozen=True)
class SafetyConfig:
    """What is watched beside the flight itself.

    Attributes:
        fence_margin_m: how far targets must be inside of the vehicle's own fence.
        battery_policy: what is done when the battery will not do.
        battery_reserve: fraction that must be left after the way back.
        battery_endurance_s: how long a full battery lasts, until it was measured.
        position_doubt_timeout_s: how long a goal is held because the position is in doubt.
    """

    fence_margin_m: float = 1.0
    battery_policy: BatteryPolicy = BatteryPolicy.REJECT
    battery_reserve: float = 0.2
    battery_endurance_s: float = 900.0
    position_doubt_timeout_s: float = 40.0


@dataclass(frozen=True)
class ObstacleConfig:
    """How obstacles are seen and avoided.

    Attributes:
        vehicle_radius_m: half of the vehicle's greatest width.
        margin_m: what ways are planned to keep beyond it.
        blocked_timeout_s: longest wait for a way, or for a sensor.
        sensor_timeout_s: silence of a sensor after which the vehicle is stopped.
        known: what people know.
        scan_topic: where a LaserScan comes from; empty: none.
        points_topic: where a PointCloud2 comes from; empty: none.
        sensor_pose: where the sensor of these is on the vehicle.
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
class BridgeConfig:
    """How goals are treated.

    Attributes:
        goto: settings of the flight to a point.
        volume: where targets are accepted.
        replace_active_goal: a new goal replaces the active one; else it is refused.
        setpoint_period_s: time between two setpoints.
        feedback_period_s: least time between two feedbacks.
        link_lost_abort_s: silence after which an active goal ends.
        speed_max_m_s: highest ground speed ever flown.
        safety: what is watched beside the flight itself.
        obstacles: how obstacles are seen and avoided.
        on_station_pause: what a pause by a ground station is to the active goal.
        on_missed_waypoint: what becomes of a waypoint that was passed outside its radius.
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
