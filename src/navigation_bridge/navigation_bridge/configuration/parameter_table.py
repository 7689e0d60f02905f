"""Table of all parameters of the navigation server.

The ROS parameters, ``--help`` and the tests are made from it; tests hold ``docs/parameters.md`` and
the JSON Schema to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

__all__ = ["FIXED", "PARAMETERS", "SERVER_WIDE", "SPECS", "ParameterSpec", "ParameterValue"]

ParameterValue: TypeAlias = bool | int | float | str | list[str]


@dataclass(frozen=True)
class ParameterSpec:
    """One parameter.

    Attributes:
        name: ROS parameter name, with its unit.
        default: value used when nothing is configured; its type is the parameter's type.
        description: one sentence.
        minimum: smallest legal number, or None.
        maximum: largest legal number, or None.
        choices: legal strings, or None for any.
    """

    name: str
    default: ParameterValue
    description: str
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] | None = None


PARAMETERS: tuple[ParameterSpec, ...] = (
    ParameterSpec(
        "link_url",
        "udpin://127.0.0.1:14550",
        "Link to the autopilot, in MAVSDK or pymavlink notation: udpin://HOST:PORT, "
        "udpout://HOST:PORT, tcp://HOST:PORT, serial:///dev/NAME:BAUD; or tlog:PATH to replay a"
        " recording.",
    ),
    ParameterSpec(
        "vehicles",
        [],
        "Vehicle names; each is a ROS namespace with its own navigation_server node and "
        "settings. Empty: one vehicle without a namespace.",
    ),
    ParameterSpec(
        "gcs_links",
        [],
        "Links to ground stations, in the notation of link_url. Traffic between vehicles and "
        "ground stations is forwarded.",
    ),
    ParameterSpec(
        "signing_key_file",
        "",
        "Path of the MAVLink 2 signing key. Empty: messages are not signed, and unsigned "
        "commands are accepted.",
    ),
    ParameterSpec(
        "record_tlog",
        "",
        "Path of a telemetry log of all MAVLink traffic in both directions. Empty: no recording.",
    ),
    ParameterSpec(
        "log_directory",
        "autopilot_logs",
        "Folder for logs downloaded from the autopilot; it is made with the first one.",
    ),
    ParameterSpec(
        "log_transfer",
        "auto",
        "Protocol for logs of the autopilot: log_request (LOG_REQUEST_*), ftp (MAVFTP), or auto "
        "(MAVFTP if LOG_REQUEST_LIST is not answered).",
        choices=("auto", "log_request", "ftp"),
    ),
    ParameterSpec(
        "replay_speed",
        1.0,
        "Replay speed with tlog:PATH, as a factor of real time; 0 is as fast as possible.",
        0.0,
        1000.0,
    ),
    ParameterSpec(
        "target_system",
        0,
        "MAVLink system id of the vehicle; 0 selects the first autopilot heard.",
        0,
        255,
    ),
    ParameterSpec(
        "source_component",
        191,
        "MAVLink component id of this server; 191 is an onboard computer.",
        1,
        255,
    ),
    ParameterSpec(
        "heartbeat_type",
        "auto",
        "Type in the HEARTBEAT of this server: auto (as the firmware requires), gcs (ground "
        "station) or onboard (onboard computer).",
        choices=("auto", "gcs", "onboard"),
    ),
    ParameterSpec(
        "arming",
        "never",
        "Permission of goals to arm and take off: auto (both), pilot (take off only after the "
        "vehicle has been armed by someone else) or never (neither; an armed rover or boat may "
        "drive).",
        choices=("auto", "pilot", "never"),
    ),
    ParameterSpec(
        "on_new_goal",
        "replace",
        "Handling of a goal that arrives while another is active: replace the active goal, or "
        "reject the new one.",
        choices=("replace", "reject"),
    ),
    ParameterSpec(
        "separation",
        "enabled",
        "Whether vehicles keep apart from each other: those of this server, of other servers and "
        "other traffic.",
        choices=("enabled", "disabled"),
    ),
    ParameterSpec(
        "separation_horizontal_m",
        5.0,
        "Least horizontal distance between two vehicles that are not separated vertically.",
        1.0,
        1000.0,
    ),
    ParameterSpec(
        "separation_vertical_m",
        3.0,
        "Least difference of altitudes of two vehicles that are not separated horizontally.",
        1.0,
        1000.0,
    ),
    ParameterSpec(
        "traffic_conflict",
        "wait",
        "Handling of a target too near to another vehicle's target, or to where one stands: wait "
        "until it is free, reject the goal, or reroute it to the nearest free position.",
        choices=("wait", "reject", "reroute"),
    ),
    ParameterSpec(
        "traffic_timeout_s",
        120.0,
        "Longest time that a goal waits for other vehicles; it then ends with TRAFFIC.",
        1.0,
        3600.0,
    ),
    ParameterSpec(
        "traffic_peers",
        [],
        "Names of other servers (their namespaces, or their vehicle's) that must have been heard "
        "before a vehicle of this one moves. Empty: those that are heard.",
    ),
    ParameterSpec(
        "traffic_topic",
        "",
        "Topic (custom_interfaces/TrafficReport) of other vehicles in the air or on the ground, "
        "in addition to ADSB_VEHICLE messages. Empty: none.",
    ),
    ParameterSpec(
        "announce_adsb",
        "disabled",
        "Whether the other vehicles are announced to this vehicle's autopilot and to ground "
        "stations as ADSB_VEHICLE.",
        choices=("disabled", "enabled"),
    ),
    ParameterSpec(
        "adsb_address",
        "",
        "ICAO address of the vehicle's own transponder, 6 hexadecimal digits: ADSB_VEHICLE "
        "messages with it are about the vehicle itself. Empty: they are recognised by their "
        "motion.",
    ),
    ParameterSpec(
        "on_station_pause",
        "cancel",
        "Effect of a pause by a ground station on the active goal: cancel it, or pause it until"
        " the ground station resumes it.",
        choices=("cancel", "pause"),
    ),
    ParameterSpec(
        "on_missed_waypoint",
        "continue",
        "Handling of a waypoint that the vehicle passes outside its radius: continue (fly the "
        "rest, then end with WAYPOINT_MISSED) or turn_back (fly to it again, at most twice). In"
        " a mission the autopilot always continues.",
        choices=("continue", "turn_back"),
    ),
    ParameterSpec(
        "cmd_vel_start",
        "goal",
        "What lets velocity commands move the vehicle: goal (only a follow_velocity goal) or "
        "command (also a first command while no goal is active).",
        choices=("goal", "command"),
    ),
    ParameterSpec(
        "cmd_vel_type",
        "stamped",
        "Type of the topic of velocity commands: stamped (geometry_msgs/TwistStamped, whose frame "
        "is base_link or map) or plain (geometry_msgs/Twist, in base_link).",
        choices=("stamped", "plain"),
    ),
    ParameterSpec(
        "cmd_vel_timeout_s",
        0.5,
        "Silence of the velocity commands after which the vehicle stops and holds.",
        0.1,
        5.0,
    ),
    ParameterSpec(
        "setpoint_rate_hz", 20.0, "Rate of SET_POSITION_TARGET_LOCAL_NED while flying.", 2.0, 100.0
    ),
    ParameterSpec(
        "feedback_rate_hz",
        10.0,
        "Maximum rate of action feedback; a new status is told at once.",
        0.5,
        100.0,
    ),
    ParameterSpec(
        "position_rate_hz",
        20.0,
        "Requested rate of GLOBAL_POSITION_INT and LOCAL_POSITION_NED.",
        2.0,
        100.0,
    ),
    ParameterSpec(
        "heartbeat_timeout_s",
        3.0,
        "Silence of the vehicle after which the link counts as lost. While other messages "
        "arrive, HEARTBEAT may be missing for three times as long.",
        1.5,
        60.0,
    ),
    ParameterSpec(
        "link_lost_abort_s",
        10.0,
        "Time without HEARTBEAT after which the active goal ends with LINK_LOST.",
        2.0,
        600.0,
    ),
    ParameterSpec(
        "position_timeout_s",
        5.0,
        "Age of the last position at which a goal ends; the vehicle holds from an age of 1 s.",
        1.5,
        60.0,
    ),
    ParameterSpec(
        "speed_default_m_s", 3.0, "Ground speed of a goal whose max_speed is 0.", 0.1, 50.0
    ),
    ParameterSpec(
        "speed_max_m_s",
        10.0,
        "Maximum ground speed, regardless of the goal.",
        0.1,
        50.0,
    ),
    ParameterSpec("speed_up_m_s", 1.5, "Maximum climb speed.", 0.1, 20.0),
    ParameterSpec("speed_down_m_s", 1.0, "Maximum descent speed.", 0.1, 20.0),
    ParameterSpec(
        "acceleration_horizontal_m_s2", 2.0, "Maximum horizontal acceleration.", 0.1, 20.0
    ),
    ParameterSpec("acceleration_vertical_m_s2", 1.0, "Maximum vertical acceleration.", 0.1, 20.0),
    ParameterSpec("jerk_m_s3", 5.0, "Maximum jerk.", 0.1, 100.0),
    ParameterSpec("yaw_rate_deg_s", 60.0, "Maximum yaw rate.", 1.0, 360.0),
    ParameterSpec(
        "arrival_radius_m",
        0.5,
        "Distance from the target within which the vehicle has arrived.",
        0.05,
        50.0,
    ),
    ParameterSpec(
        "arrival_speed_m_s",
        0.3,
        "Speed below which the vehicle has stopped at the target.",
        0.05,
        5.0,
    ),
    ParameterSpec(
        "arrival_dwell_s",
        1.0,
        "Time within arrival_radius_m and below arrival_speed_m_s before a goal succeeds.",
        0.0,
        60.0,
    ),
    ParameterSpec(
        "settle_timeout_s",
        20.0,
        "Timeout for the arrival, from the end of the planned flight.",
        1.0,
        600.0,
    ),
    ParameterSpec(
        "cancel_timeout_s",
        10.0,
        "Timeout for the vehicle to stop after a cancel; then CANCELED is reported anyway.",
        1.0,
        60.0,
    ),
    ParameterSpec(
        "takeoff_height_m",
        2.5,
        "Maximum height above ground of an automatic take-off; lower goals take off to their "
        "own height.",
        0.5,
        100.0,
    ),
    ParameterSpec(
        "takeoff_height_min_m",
        1.5,
        "Minimum height above ground of an automatic take-off.",
        0.5,
        100.0,
    ),
    ParameterSpec(
        "volume_radius_m",
        500.0,
        "Horizontal distance from the map origin within which targets are accepted.",
        1.0,
        100000.0,
    ),
    ParameterSpec(
        "volume_altitude_min_m", 0.5, "Minimum height above ground of a target.", 0.0, 10000.0
    ),
    ParameterSpec(
        "volume_altitude_max_m", 120.0, "Maximum height above ground of a target.", 0.5, 10000.0
    ),
    ParameterSpec(
        "fence_margin_m",
        1.0,
        "Minimum distance of targets from the vehicle's own fence, on the inside.",
        0.0,
        1000.0,
    ),
    ParameterSpec(
        "battery_policy",
        "reject",
        "Action on insufficient battery for the goal and the return: reject (or end) the goal, "
        "warn, or ignore.",
        choices=("reject", "warn", "ignore"),
    ),
    ParameterSpec(
        "battery_reserve",
        0.2,
        "Fraction of the battery that must remain after the goal and the return.",
        0.0,
        0.9,
    ),
    ParameterSpec(
        "battery_endurance_s",
        900.0,
        "Endurance of a full battery, used until the consumption has been measured.",
        60.0,
        86400.0,
    ),
    ParameterSpec(
        "position_doubt_timeout_s",
        40.0,
        "Time for which a goal is held while the reported position is in doubt (GPS glitch, "
        "jump); then the goal ends.",
        1.0,
        600.0,
    ),
    ParameterSpec(
        "vehicle_radius_m",
        0.5,
        "Half of the vehicle's largest width; within this distance it touches an obstacle.",
        0.05,
        20.0,
    ),
    ParameterSpec(
        "obstacle_margin_m",
        1.0,
        "Clearance between the hull of the vehicle and obstacles in planned paths.",
        0.1,
        20.0,
    ),
    ParameterSpec(
        "blocked_timeout_s",
        30.0,
        "Time without a free path after which a goal ends with NO_PATH, or without obstacle "
        "data with NO_OBSTACLE_DATA.",
        1.0,
        3600.0,
    ),
    ParameterSpec(
        "obstacle_timeout_s",
        2.0,
        "Silence of the obstacle sensors after which a vehicle that avoids obstacles is stopped.",
        0.2,
        60.0,
    ),
    ParameterSpec("obstacles_file", "", "Path of a YAML file of known obstacles. Empty: none."),
    ParameterSpec(
        "scan_topic", "", "Topic of a sensor_msgs/LaserScan for obstacle detection. Empty: none."
    ),
    ParameterSpec(
        "points_topic",
        "",
        "Topic of a sensor_msgs/PointCloud2 for obstacle detection. Empty: none.",
    ),
    ParameterSpec(
        "sensor_pose",
        "",
        "Pose of the obstacle sensor in base_link: 'x y z roll pitch yaw', metres (forward, "
        "left, up) and degrees. Empty: at base_link.",
    ),
    ParameterSpec(
        "publish_tf",
        "all",
        "Transforms published: all, vehicle (without the sensors of sensor_pose, where a robot "
        "model has them) or none.",
        choices=("all", "vehicle", "none"),
    ),
    ParameterSpec(
        "external_odometry_topic",
        "",
        "Topic (nav_msgs/Odometry) of a position for the autopilot's estimator, from a camera or "
        "motion capture. Empty: none.",
    ),
    ParameterSpec(
        "external_origin",
        "",
        "Origin of external_odometry_topic's positions: 'latitude longitude altitude', degrees and "
        "metres above sea level; set on an autopilot that has none. Empty: it is not set.",
    ),
    ParameterSpec(
        "obstacle_map_size_m",
        200.0,
        "Side length of the map of sensed obstacles, a square centred on the vehicle.",
        10.0,
        400.0,
    ),
    ParameterSpec("obstacle_cell_m", 0.25, "Cell size of the map of sensed obstacles.", 0.1, 2.0),
)

# Read once, at the start. All others may change at run time; an active goal keeps its values.
FIXED = frozenset(
    {
        "link_url",
        "vehicles",
        "gcs_links",
        "signing_key_file",
        "record_tlog",
        "log_directory",
        "log_transfer",
        "target_system",
        "source_component",
        "heartbeat_type",
        "setpoint_rate_hz",
        "position_rate_hz",
        "heartbeat_timeout_s",
        "cmd_vel_type",
        "scan_topic",
        "points_topic",
        "publish_tf",
        "external_odometry_topic",
        "external_origin",
        "obstacle_map_size_m",
        "obstacle_cell_m",
    }
)

# Parameters of the server as a whole; all others belong to each vehicle.
SERVER_WIDE = frozenset(
    {
        *("vehicles", "gcs_links", "signing_key_file", "record_tlog", "replay_speed"),
        *("separation", "separation_horizontal_m", "separation_vertical_m", "traffic_peers"),
    }
)

SPECS: dict[str, ParameterSpec] = {spec.name: spec for spec in PARAMETERS}
