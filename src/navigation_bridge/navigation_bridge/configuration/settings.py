"""Settings of the bridge for goals, each declared with the parameter that sets it. No ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from navigation_bridge.configuration.declarations import (
    also,
    group,
    inside,
    of_core,
    parameter,
    words_of,
)
from navigation_bridge.configuration.known_obstacles import (
    KnownObstacles,
    ObstaclesError,
    read_obstacles,
)
from navigation_bridge.configuration.parameter_values import (
    ConfigurationError,
    read_icao_address,
    read_peers,
)
from navigation_bridge.configuration.sensor_poses import SensorPose, SensorPoseError
from navigation_core.safety.target_checks import FlightVolume
from navigation_core.tasks.flying.goto import GotoConfig
from navigation_core.tasks.traffic.volumes import Separation
from navigation_core.trajectories.trajectory import Limits

SWITCH = {"enabled": True, "disabled": False}
"""The words of parameters that turn something on and off"""


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


class MissedWaypoint(Enum):
    """Handling of a waypoint that was passed outside its radius."""

    CONTINUE = "continue"
    """The route is continued, but does not succeed."""
    TURN_BACK = "turn_back"
    """The waypoint is approached again, at most twice."""


class TrafficConflict(Enum):
    """Handling of a target that is too near to another vehicle's, or to where one stands."""

    WAIT = "wait"
    """The goal is accepted; the vehicle waits before the target until it is free."""
    REJECT = "reject"
    """The goal is rejected."""
    REROUTE = "reroute"
    """The nearest free position is the target."""


def _read_obstacles(path: str) -> KnownObstacles:
    if not path:
        return KnownObstacles()
    try:
        return read_obstacles(Path(path).expanduser())
    except ObstaclesError as error:
        raise ConfigurationError(f"Parameter obstacles_file: {error}") from error


def _read_pose(text: str) -> SensorPose:
    try:
        return SensorPose.parse(text)
    except SensorPoseError as error:
        raise ConfigurationError(f"Parameter sensor_pose {error}") from error


def _period_s(rate_hz: float) -> float:
    return 1.0 / rate_hz


def _degrees(radians: float) -> float:
    """Return an angle in degrees, without the last digits that the conversion adds."""
    return round(math.degrees(radians), 9)


@dataclass(frozen=True)
class SafetyConfig:
    """Settings of the safety checks."""

    fence_margin_m: float = parameter(
        "fence_margin_m",
        1.0,
        "Minimum distance of targets from the vehicle's own fence, on the inside.",
        (0.0, 1000.0),
        rehearsed=True,
    )
    battery_policy: BatteryPolicy = parameter(
        "battery_policy",
        "reject",
        "Action on insufficient battery for the goal and the return: `reject` (or end) the goal, "
        "`warn`, or `ignore`.",
        words=words_of(BatteryPolicy),
        rehearsed=True,
    )
    battery_reserve: float = parameter(
        "battery_reserve",
        0.2,
        "Fraction of the battery that must remain after the goal and the return.",
        (0.0, 0.9),
        rehearsed=True,
    )
    battery_endurance_s: float = parameter(
        "battery_endurance_s",
        900.0,
        "Endurance of a full battery, used until the consumption has been measured.",
        (60.0, 86400.0),
        rehearsed=True,
    )
    position_doubt_timeout_s: float = parameter(
        "position_doubt_timeout_s",
        40.0,
        "Time for which a goal is held while the reported position is in doubt (GPS glitch, "
        "jump); then the goal ends.",
        (1.0, 600.0),
    )


@dataclass(frozen=True)
class ObstacleConfig:
    """Settings of obstacle detection and avoidance."""

    vehicle_radius_m: float = parameter(
        "vehicle_radius_m",
        0.5,
        "Half of the vehicle's largest width; within this distance it touches an obstacle.",
        (0.05, 20.0),
        rehearsed=True,
    )
    margin_m: float = parameter(
        "obstacle_margin_m",
        1.0,
        "Clearance between the hull of the vehicle and obstacles in planned paths.",
        (0.1, 20.0),
        rehearsed=True,
    )
    blocked_timeout_s: float = parameter(
        "blocked_timeout_s",
        30.0,
        "Time without a free path after which a goal ends with NO_PATH, or without obstacle "
        "data with NO_OBSTACLE_DATA.",
        (1.0, 3600.0),
        rehearsed=True,
    )
    sensor_timeout_s: float = parameter(
        "obstacle_timeout_s",
        2.0,
        "Silence of the obstacle sensors after which a vehicle that avoids obstacles is stopped.",
        (0.2, 60.0),
    )
    known: KnownObstacles = parameter(
        "obstacles_file",
        "",
        "Path of a YAML file of [known obstacles](obstacles.md). Empty: none.",
        read=_read_obstacles,
    )
    scan_topic: str = parameter(
        "scan_topic",
        "",
        "Topic of a sensor_msgs/LaserScan for obstacle detection. Empty: none.",
        fixed=True,
    )
    points_topic: str = parameter(
        "points_topic",
        "",
        "Topic of a sensor_msgs/PointCloud2 for obstacle detection. Empty: none.",
        fixed=True,
    )
    sensor_pose: SensorPose = parameter(
        "sensor_pose",
        "",
        "Pose of the obstacle sensor in base_link: 'x y z roll pitch yaw', metres (forward, "
        "left, up) and degrees. Empty: at base_link.",
        read=_read_pose,
    )
    map_size_m: float = parameter(
        "obstacle_map_size_m",
        200.0,
        "Side length of the map of sensed obstacles, a square centred on the vehicle.",
        (10.0, 400.0),
        fixed=True,
        rehearsed=True,
    )
    cell_m: float = parameter(
        "obstacle_cell_m",
        0.25,
        "Cell size of the map of sensed obstacles.",
        (0.1, 2.0),
        fixed=True,
        rehearsed=True,
    )


@dataclass(frozen=True)
class CommandConfig:
    """Settings of velocity commands."""

    start_goal: bool = parameter(
        "cmd_vel_start",
        "goal",
        "When [velocity commands](velocity.md) move the vehicle: `goal` (only during a "
        "follow_velocity goal) or `command` (also from the first command while no goal is active).",
        words={"goal": False, "command": True},
    )
    stamped: bool = parameter(
        "cmd_vel_type",
        "stamped",
        "Type of the topic of velocity commands: `stamped` (geometry_msgs/TwistStamped, whose "
        "frame is base_link or map) or `plain` (geometry_msgs/Twist, in base_link).",
        words={"stamped": True, "plain": False},
        fixed=True,
    )
    timeout_s: float = parameter(
        "cmd_vel_timeout_s",
        0.5,
        "Silence of the velocity commands after which the vehicle stops and holds.",
        (0.1, 5.0),
    )


@dataclass(frozen=True)
class TrajectoryConfig:
    """Settings of trajectories of other programs."""

    start_distance_m: float = parameter(
        "trajectory_start_distance_m",
        1.0,
        "Greatest distance between the vehicle and the beginning of a "
        "[trajectory](programs.md#trajectories-of-other-planners) of another program.",
        (0.1, 20.0),
    )
    may_slow_down: bool = parameter(
        "trajectory_too_fast",
        "reject",
        "Handling of a trajectory that exceeds the limits of speed, acceleration or turn rate: "
        "`reject` it, or `slow_down` the whole of it.",
        words={"reject": False, "slow_down": True},
    )


@dataclass(frozen=True)
class TrafficConfig:
    """Settings of the separation from other vehicles."""

    on: bool = parameter(
        "separation",
        "enabled",
        "Whether vehicles [keep apart](fleet.md#keeping-apart) from each other: those of this "
        "server, of other servers and other traffic.",
        words=SWITCH,
        server_wide=True,
    )
    separation: Separation = group(
        Separation,
        horizontal_m=of_core(
            "separation_horizontal_m",
            "Least horizontal distance between two vehicles that are not separated vertically.",
            (1.0, 1000.0),
            server_wide=True,
        ),
        vertical_m=of_core(
            "separation_vertical_m",
            "Least difference of altitudes of two vehicles that are not separated horizontally.",
            (1.0, 1000.0),
            server_wide=True,
        ),
    )
    conflict: TrafficConflict = parameter(
        "traffic_conflict",
        "wait",
        "Handling of a [target too near](fleet.md#targets) to another vehicle's target, or to "
        "where one stands: `wait` until it is free, `reject` the goal, or `reroute` it to the "
        "nearest free position.",
        words=words_of(TrafficConflict),
    )
    timeout_s: float = parameter(
        "traffic_timeout_s",
        120.0,
        "Longest time that a goal waits for other vehicles; it then ends with TRAFFIC.",
        (1.0, 3600.0),
    )
    peers: tuple[str, ...] = parameter(
        "traffic_peers",
        [],
        "Names of [other servers](fleet.md#several-servers) (their namespaces, or their vehicle's) "
        "that must have been heard before a vehicle of this one moves. Empty: those that are "
        "heard.",
        read=read_peers,
        server_wide=True,
    )
    topic: str = parameter(
        "traffic_topic",
        "",
        "Topic (custom_interfaces/TrafficReport) of [other vehicles](fleet.md#others) in the air "
        "or on the ground, in addition to ADSB_VEHICLE messages. Empty: none.",
    )
    announces: bool = parameter(
        "announce_adsb",
        "disabled",
        "Whether the other vehicles are [announced](fleet.md#others) to this vehicle's autopilot "
        "and to ground stations as ADSB_VEHICLE.",
        words=SWITCH,
    )
    adsb_address: int = parameter(
        "adsb_address",
        "",
        "ICAO address of the vehicle's own transponder, 6 hexadecimal digits such as 4B1A2C: "
        "ADSB_VEHICLE messages with it are about the vehicle itself. Empty: they are "
        "[recognised by their motion](fleet.md#others).",
        read=read_icao_address,
    )


@dataclass(frozen=True)
class BridgeConfig:
    """Settings for goals.

    The core's dataclasses know no parameters: those that set their fields are declared here, and
    the fields have the defaults.
    """

    goto: GotoConfig = group(
        GotoConfig,
        may_arm=of_core(
            "arming",
            "Permission of goals to [arm and take off](navigate.md#the-flight): `auto` (both), "
            "`pilot` (take off only after the vehicle has been armed by someone else) or `never` "
            "(neither; an armed rover or boat may drive).",
            words={"auto": True, "pilot": False, "never": False},
            default="never",
            rehearsed=True,
        ),
        may_take_off=also("arming", lambda word: word in ("auto", "pilot")),
        limits=inside(
            Limits,
            speed_horizontal_m_s=of_core(
                "speed_default_m_s",
                "Ground speed of a goal whose max_speed is 0.",
                (0.1, 50.0),
                rehearsed=True,
            ),
            speed_up_m_s=of_core(
                "speed_up_m_s", "Maximum climb speed.", (0.1, 20.0), rehearsed=True
            ),
            speed_down_m_s=of_core(
                "speed_down_m_s", "Maximum descent speed.", (0.1, 20.0), rehearsed=True
            ),
            acceleration_horizontal_m_s2=of_core(
                "acceleration_horizontal_m_s2",
                "Maximum horizontal acceleration.",
                (0.1, 20.0),
                rehearsed=True,
            ),
            acceleration_vertical_m_s2=of_core(
                "acceleration_vertical_m_s2",
                "Maximum vertical acceleration.",
                (0.1, 20.0),
                rehearsed=True,
            ),
            jerk_m_s3=of_core("jerk_m_s3", "Maximum jerk.", (0.1, 100.0), rehearsed=True),
            yaw_rate_rad_s=of_core(
                "yaw_rate_deg_s",
                "Maximum yaw rate.",
                (1.0, 360.0),
                default=_degrees(Limits.yaw_rate_rad_s),
                read=math.radians,
                rehearsed=True,
            ),
        ),
        arrival_radius_m=of_core(
            "arrival_radius_m",
            "Distance from the target within which the vehicle has arrived.",
            (0.05, 50.0),
            rehearsed=True,
        ),
        arrival_speed_m_s=of_core(
            "arrival_speed_m_s",
            "Speed below which the vehicle has stopped at the target.",
            (0.05, 5.0),
            rehearsed=True,
        ),
        arrival_dwell_s=of_core(
            "arrival_dwell_s",
            "Time within arrival_radius_m and below arrival_speed_m_s before a goal succeeds.",
            (0.0, 60.0),
            rehearsed=True,
        ),
        settle_timeout_s=of_core(
            "settle_timeout_s",
            "Timeout for the arrival, from the end of the planned flight.",
            (1.0, 600.0),
            rehearsed=True,
        ),
        cancel_timeout_s=of_core(
            "cancel_timeout_s",
            "Timeout for the vehicle to stop after a cancel; then CANCELED is reported anyway.",
            (1.0, 60.0),
        ),
        takeoff_height_m=of_core(
            "takeoff_height_m",
            "Maximum height above ground of an automatic take-off; lower goals take off to their "
            "own height.",
            (0.5, 100.0),
            rehearsed=True,
        ),
        takeoff_height_min_m=of_core(
            "takeoff_height_min_m",
            "Minimum height above ground of an automatic take-off.",
            (0.5, 100.0),
            rehearsed=True,
        ),
        position_timeout_s=of_core(
            "position_timeout_s",
            "Age of the last position at which a goal ends; from 1 s the vehicle holds, and goals "
            "are rejected.",
            (1.5, 60.0),
        ),
    )
    speed_max_m_s: float = parameter(
        "speed_max_m_s",
        10.0,
        "Maximum ground speed, regardless of the goal.",
        (0.1, 50.0),
        rehearsed=True,
    )
    volume: FlightVolume = group(
        FlightVolume,
        radius_max_m=of_core(
            "volume_radius_m",
            "Horizontal distance from the map origin within which targets are accepted.",
            (1.0, 100000.0),
            default=500.0,
            rehearsed=True,
        ),
        altitude_min_m=of_core(
            "volume_altitude_min_m",
            "Minimum height above ground of a target.",
            (0.0, 10000.0),
            default=0.5,
            rehearsed=True,
        ),
        altitude_max_m=of_core(
            "volume_altitude_max_m",
            "Maximum height above ground of a target.",
            (0.5, 10000.0),
            default=120.0,
            rehearsed=True,
        ),
    )
    replace_active_goal: bool = parameter(
        "on_new_goal",
        "replace",
        "Handling of a goal that arrives while another is active: `replace` the active goal, or "
        "`reject` the new one.",
        words={"replace": True, "reject": False},
    )
    on_station_pause: StationPause = parameter(
        "on_station_pause",
        "cancel",
        "Effect of a pause by a ground station on the active goal: `cancel` it, or `pause` it "
        "until the ground station resumes it.",
        words=words_of(StationPause),
    )
    on_missed_waypoint: MissedWaypoint = parameter(
        "on_missed_waypoint",
        "continue",
        "Handling of a waypoint that the vehicle passes outside its radius: `continue` (fly the "
        "rest, then end with WAYPOINT_MISSED) or `turn_back` (fly to it again, at most twice). In "
        "a mission the autopilot always continues.",
        words=words_of(MissedWaypoint),
        rehearsed=True,
    )
    setpoint_period_s: float = parameter(
        "setpoint_rate_hz",
        20.0,
        "Rate of SET_POSITION_TARGET_LOCAL_NED while flying.",
        (2.0, 100.0),
        read=_period_s,
        fixed=True,
    )
    feedback_period_s: float = parameter(
        "feedback_rate_hz",
        10.0,
        "Maximum rate of action feedback; a new status is reported at once.",
        (0.5, 100.0),
        read=_period_s,
    )
    link_lost_abort_s: float = parameter(
        "link_lost_abort_s",
        10.0,
        "Time without HEARTBEAT after which the active goal ends with LINK_LOST.",
        (2.0, 600.0),
    )
    safety: SafetyConfig = group(SafetyConfig)
    obstacles: ObstacleConfig = group(ObstacleConfig)
    commands: CommandConfig = group(CommandConfig)
    trajectories: TrajectoryConfig = group(TrajectoryConfig)
    traffic: TrafficConfig = group(TrafficConfig)
