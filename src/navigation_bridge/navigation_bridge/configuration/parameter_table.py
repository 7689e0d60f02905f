"""Every parameter of the navigation server, as one table.

The ROS parameters, ``--help``, ``docs/parameters.md``, the JSON Schema and the tests are made from
it or held to it.
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
        description: one sentence for people.
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
        "MAVLink link to the autopilot, as MAVSDK or pymavlink write it: udpin://HOST:PORT, "
        "udpout://HOST:PORT, tcp://HOST:PORT, serial:///dev/NAME:BAUD; or tlog:PATH to replay.",
    ),
    ParameterSpec(
        "vehicles",
        [],
        "Names of the vehicles, each a namespace of ROS with a navigation_server node and settings "
        "of its own; empty: one vehicle, without a namespace.",
    ),
    ParameterSpec(
        "gcs_links",
        [],
        "Links to ground stations, written like link_url; what vehicles and ground stations send "
        "each other is passed on.",
    ),
    ParameterSpec(
        "signing_key_file",
        "",
        "Path of the key of MAVLink 2 signing; empty: nothing is signed, and unsigned commands "
        "are taken.",
    ),
    ParameterSpec(
        "record_tlog",
        "",
        "Path of a telemetry log that records all MAVLink traffic, both ways; empty records none.",
    ),
    ParameterSpec(
        "replay_speed",
        1.0,
        "With tlog:PATH, how many seconds of the recording pass in a second; 0 is as fast as "
        "possible.",
        0.0,
        1000.0,
    ),
    ParameterSpec(
        "target_system",
        0,
        "MAVLink system id of the vehicle; 0 takes the first autopilot that is heard.",
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
        "As what this server sends HEARTBEAT: auto (what the firmware needs), gcs (a ground "
        "station) or onboard (an onboard computer).",
        choices=("auto", "gcs", "onboard"),
    ),
    ParameterSpec(
        "arming",
        "never",
        "Whether goals may arm the vehicle and take off: auto (both), pilot (take off once "
        "somebody has armed it) or never (neither; what drives may go once it is armed).",
        choices=("auto", "pilot", "never"),
    ),
    ParameterSpec(
        "on_new_goal",
        "replace",
        "What happens to a goal that is active when a new one comes: replace or reject the new.",
        choices=("replace", "reject"),
    ),
    ParameterSpec(
        "on_station_pause",
        "cancel",
        "What a pause by a ground station is to the active goal: cancel (its end) or pause (until "
        "the ground station lets it go on).",
        choices=("cancel", "pause"),
    ),
    ParameterSpec(
        "on_missed_waypoint",
        "continue",
        "What becomes of a waypoint that a route passes outside its radius: continue (the rest is "
        "flown, and the goal ends with WAYPOINT_MISSED) or turn_back (it is flown to again, twice "
        "at most). In a mission the autopilot flies on.",
        choices=("continue", "turn_back"),
    ),
    ParameterSpec(
        "setpoint_rate_hz", 20.0, "Rate of SET_POSITION_TARGET_LOCAL_NED while flying.", 2.0, 100.0
    ),
    ParameterSpec("feedback_rate_hz", 10.0, "Highest rate of action feedback.", 0.5, 100.0),
    ParameterSpec(
        "position_rate_hz",
        20.0,
        "Rate asked of the vehicle for GLOBAL_POSITION_INT and LOCAL_POSITION_NED.",
        2.0,
        100.0,
    ),
    ParameterSpec(
        "heartbeat_timeout_s",
        3.0,
        "Silence of the vehicle after which the link counts as lost; while other messages come, "
        "its HEARTBEAT may be missing three times as long.",
        1.5,
        60.0,
    ),
    ParameterSpec(
        "link_lost_abort_s",
        10.0,
        "Time without a HEARTBEAT after which an active goal ends with LINK_LOST.",
        2.0,
        600.0,
    ),
    ParameterSpec(
        "position_timeout_s",
        5.0,
        "Age of the last position after which a goal ends; it holds from 1 s on.",
        1.5,
        60.0,
    ),
    ParameterSpec(
        "speed_default_m_s", 3.0, "Ground speed of a goal whose max_speed is 0.", 0.1, 50.0
    ),
    ParameterSpec(
        "speed_max_m_s",
        10.0,
        "Highest ground speed that is ever flown, whatever the goal asks.",
        0.1,
        50.0,
    ),
    ParameterSpec("speed_up_m_s", 1.5, "Highest climb speed.", 0.1, 20.0),
    ParameterSpec("speed_down_m_s", 1.0, "Highest descent speed.", 0.1, 20.0),
    ParameterSpec(
        "acceleration_horizontal_m_s2", 2.0, "Highest horizontal acceleration.", 0.1, 20.0
    ),
    ParameterSpec("acceleration_vertical_m_s2", 1.0, "Highest vertical acceleration.", 0.1, 20.0),
    ParameterSpec("jerk_m_s3", 5.0, "Highest change of acceleration.", 0.1, 100.0),
    ParameterSpec("yaw_rate_deg_s", 60.0, "Highest rate of turn.", 1.0, 360.0),
    ParameterSpec(
        "arrival_radius_m", 0.5, "Distance from the target that counts as arrived.", 0.05, 50.0
    ),
    ParameterSpec("arrival_speed_m_s", 0.3, "Speed below which the vehicle is slow.", 0.05, 5.0),
    ParameterSpec(
        "arrival_dwell_s", 1.0, "Time to be near and slow before a goal succeeds.", 0.0, 60.0
    ),
    ParameterSpec(
        "settle_timeout_s",
        20.0,
        "Time after the end of the planned flight within which it must have arrived.",
        1.0,
        600.0,
    ),
    ParameterSpec(
        "cancel_timeout_s",
        10.0,
        "Longest wait for the vehicle to stop before CANCELED is reported all the same.",
        1.0,
        60.0,
    ),
    ParameterSpec(
        "takeoff_height_m",
        2.5,
        "Greatest height above ground of an automatic take-off; lower goals take off to theirs.",
        0.5,
        100.0,
    ),
    ParameterSpec(
        "takeoff_height_min_m",
        1.5,
        "Least height above ground of an automatic take-off.",
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
        "volume_altitude_min_m", 0.5, "Least height of a target above ground.", 0.0, 10000.0
    ),
    ParameterSpec(
        "volume_altitude_max_m", 120.0, "Greatest height of a target above ground.", 0.5, 10000.0
    ),
    ParameterSpec(
        "fence_margin_m",
        1.0,
        "How far inside of the vehicle's own fence targets must be.",
        0.0,
        1000.0,
    ),
    ParameterSpec(
        "battery_policy",
        "reject",
        "What happens when the battery will not do for the goal and the way back: reject the goal "
        "(or end it), warn, or ignore.",
        choices=("reject", "warn", "ignore"),
    ),
    ParameterSpec(
        "battery_reserve",
        0.2,
        "Fraction of the battery that must be left after the goal and the way back.",
        0.0,
        0.9,
    ),
    ParameterSpec(
        "battery_endurance_s",
        900.0,
        "How long a full battery lasts under way, used until consumption was measured.",
        60.0,
        86400.0,
    ),
    ParameterSpec(
        "position_doubt_timeout_s",
        40.0,
        "How long a goal is held while the position is given but in doubt (a GPS glitch, a jump); "
        "then it ends.",
        1.0,
        600.0,
    ),
    ParameterSpec(
        "vehicle_radius_m",
        0.5,
        "Half of the vehicle's greatest width; nearer than this it would touch an obstacle.",
        0.05,
        20.0,
    ),
    ParameterSpec(
        "obstacle_margin_m",
        1.0,
        "Distance that ways are planned to keep between vehicle and obstacles.",
        0.1,
        20.0,
    ),
    ParameterSpec(
        "blocked_timeout_s",
        30.0,
        "Time without a way through after which a goal ends with NO_PATH, or without obstacle "
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
    ParameterSpec(
        "obstacles_file", "", "Path of a YAML file of known obstacles; empty: none are known."
    ),
    ParameterSpec(
        "scan_topic", "", "Topic of a sensor_msgs/LaserScan that sees obstacles; empty: none."
    ),
    ParameterSpec(
        "points_topic", "", "Topic of a sensor_msgs/PointCloud2 that sees obstacles; empty: none."
    ),
    ParameterSpec(
        "sensor_pose",
        "",
        "Where the sensor of these topics is on the vehicle: 'x y z roll pitch yaw', metres "
        "forward, left, up and degrees; empty: at base_link.",
    ),
    ParameterSpec(
        "obstacle_map_size_m",
        200.0,
        "Side of the square about the vehicle in which sensed obstacles are remembered.",
        10.0,
        400.0,
    ),
    ParameterSpec(
        "obstacle_cell_m", 0.25, "Side of a cell of the map of sensed obstacles.", 0.1, 2.0
    ),
)

# Taken once, at the start. All others may change while the server runs; a goal that is being
# worked on keeps what it was started with.
FIXED = frozenset(
    {
        "link_url",
        "vehicles",
        "gcs_links",
        "signing_key_file",
        "record_tlog",
        "target_system",
        "source_component",
        "heartbeat_type",
        "setpoint_rate_hz",
        "position_rate_hz",
        "heartbeat_timeout_s",
        "scan_topic",
        "points_topic",
        "obstacle_map_size_m",
        "obstacle_cell_m",
    }
)

# Of the server as a whole; all others are a vehicle's own, where there are several.
SERVER_WIDE = frozenset(
    {"vehicles", "gcs_links", "signing_key_file", "record_tlog", "replay_speed"}
)

SPECS: dict[str, ParameterSpec] = {spec.name: spec for spec in PARAMETERS}
