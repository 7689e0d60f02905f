"""Every parameter of the navigation server, as one table, and the typed settings it makes.

The table is what the ROS parameters, ``--help``, ``docs/parameters.md`` and the tests
are made from or held to. No ROS in here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import yaml

from drone_navigation.known_obstacles import KnownObstacles, ObstaclesError, read_obstacles
from drone_navigation.sensor_pose import SensorPose, SensorPoseError
from drone_navigation.settings import BatteryPolicy, BridgeConfig, ObstacleConfig, SafetyConfig
from mavlink_vehicle.vehicle import VehicleConfig
from navigation_core.safety import FlightVolume
from navigation_core.tasks.goto import GotoConfig
from navigation_core.trajectory import Limits

ParameterValue: TypeAlias = bool | int | float | str
_Number = Callable[[str], float]
_Text = Callable[[str], str]


class ConfigurationError(ValueError):
    """A parameter has a value that cannot be used; the sentence says which and what to do."""


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
        "udpout://HOST:PORT, tcp://HOST:PORT, serial:///dev/NAME:BAUD.",
    ),
    ParameterSpec(
        "record_tlog",
        "",
        "Path of a telemetry log that records all MAVLink traffic, both ways; empty records none.",
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
        "Whether a goal may arm the vehicle and take off: auto or never.",
        choices=("auto", "never"),
    ),
    ParameterSpec(
        "on_new_goal",
        "replace",
        "What happens to a goal that is active when a new one comes: replace or reject the new.",
        choices=("replace", "reject"),
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
        80.0,
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

# MAV_TYPE_GCS and MAV_TYPE_ONBOARD_CONTROLLER (common.xml); None leaves it to the profile.
_HEARTBEAT_TYPES: dict[str, int | None] = {"auto": None, "gcs": 6, "onboard": 18}

# Asked of the vehicle's range sensors.
_RANGES_HZ = 10.0

SPECS: dict[str, ParameterSpec] = {spec.name: spec for spec in PARAMETERS}


@dataclass(frozen=True)
class ServerConfig:
    """The settings of one server, checked.

    Attributes:
        link_url: link to the autopilot.
        record_tlog: path of the recording, or None.
        vehicle: settings of the MAVLink side.
        bridge: settings of the goals.
    """

    link_url: str
    record_tlog: str | None
    vehicle: VehicleConfig
    bridge: BridgeConfig


def check_value(name: str, value: ParameterValue) -> None:
    """Check one value against its spec.

    Raises:
        ConfigurationError: unknown name, wrong type or out of range.
    """
    spec = SPECS.get(name)
    if spec is None:
        raise ConfigurationError(
            f"There is no parameter '{name}'; `navigation_server --help` lists them."
        )
    if isinstance(spec.default, str):
        if not isinstance(value, str):
            raise ConfigurationError(f"Parameter {name} must be text, not {value!r}.")
        if spec.choices is not None and value not in spec.choices:
            raise ConfigurationError(
                f"Parameter {name} is '{value}'; it must be one of {', '.join(spec.choices)}."
            )
        return
    if isinstance(value, (bool, str)):
        raise ConfigurationError(f"Parameter {name} must be a number, not {value!r}.")
    if isinstance(spec.default, int) and not isinstance(value, int):
        raise ConfigurationError(f"Parameter {name} must be a whole number, not {value!r}.")
    low, high = spec.minimum, spec.maximum
    if not (low is None or value >= low) or not (high is None or value <= high):
        raise ConfigurationError(
            f"Parameter {name} is {value}; it must be between {low:g} and {high:g}."
        )


def read_parameter_file(path: Path, node_name: str) -> dict[str, ParameterValue]:
    """Return the parameters that a ROS parameter file sets for ``node_name``, unchecked.

    ROS ignores what is meant for another node, so that a slip in the name would leave a
    vehicle with the defaults, without a word.

    Raises:
        ConfigurationError: it cannot be read, is no parameter file, or is for other nodes.
    """
    try:
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError(f"Cannot read {path}: {error.strerror or error}.") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        where = " ".join(str(error).split())
        raise ConfigurationError(f"{path} is not YAML: {where}.") from error
    nodes = document if isinstance(document, dict) else {}
    values: dict[str, ParameterValue] = {}
    for name in ("/**", node_name, f"/{node_name}"):
        node = nodes.get(name)
        found = node.get("ros__parameters") if isinstance(node, dict) else None
        if isinstance(found, dict):
            values.update(found)
    if not values:
        raise ConfigurationError(
            f"{path} sets no parameter of {node_name}; write them below '{node_name}:' and "
            "'ros__parameters:', as in bridge_config/sitl.yaml."
        )
    return values


def make_config(values: Mapping[str, ParameterValue]) -> ServerConfig:
    """Build the settings from parameter values; what is missing takes its default.

    Raises:
        ConfigurationError: an unknown name, a bad value, or values that contradict.
    """
    for name, value in values.items():
        check_value(name, value)
    merged: dict[str, ParameterValue] = {spec.name: spec.default for spec in PARAMETERS}
    merged.update(values)

    def number(name: str) -> float:
        return float(merged[name])

    def text(name: str) -> str:
        return str(merged[name])

    if number("volume_altitude_min_m") >= number("volume_altitude_max_m"):
        raise ConfigurationError(
            "Parameter volume_altitude_min_m must be below volume_altitude_max_m."
        )
    if number("takeoff_height_min_m") > number("takeoff_height_m"):
        raise ConfigurationError(
            "Parameter takeoff_height_min_m must not be above takeoff_height_m."
        )
    if number("speed_default_m_s") > number("speed_max_m_s"):
        raise ConfigurationError("Parameter speed_default_m_s must not be above speed_max_m_s.")
    for name in ("link_lost_abort_s", "position_timeout_s"):
        # The other way round, silence would be taken for something else than a lost link.
        if number(name) <= number("heartbeat_timeout_s"):
            raise ConfigurationError(f"Parameter {name} must be above heartbeat_timeout_s.")
    return ServerConfig(
        link_url=text("link_url"),
        record_tlog=text("record_tlog") or None,
        vehicle=_vehicle_config(number, text),
        bridge=_bridge_config(number, text),
    )


def _vehicle_config(number: _Number, text: _Text) -> VehicleConfig:
    defaults = VehicleConfig()
    rate_hz = number("position_rate_hz")
    rates_hz = dict(defaults.message_rates_hz)
    rates_hz.update({"GLOBAL_POSITION_INT": rate_hz, "LOCAL_POSITION_NED": rate_hz})
    return VehicleConfig(
        target_system=int(number("target_system")),
        source_component=int(number("source_component")),
        heartbeat_type=_HEARTBEAT_TYPES[text("heartbeat_type")],
        heartbeat_timeout_s=number("heartbeat_timeout_s"),
        message_rates_hz=rates_hz,
        optional_rates_hz={"OBSTACLE_DISTANCE": _RANGES_HZ, "DISTANCE_SENSOR": _RANGES_HZ},
    )


def _bridge_config(number: _Number, text: _Text) -> BridgeConfig:
    limits = Limits(
        speed_horizontal_m_s=number("speed_default_m_s"),
        speed_up_m_s=number("speed_up_m_s"),
        speed_down_m_s=number("speed_down_m_s"),
        acceleration_horizontal_m_s2=number("acceleration_horizontal_m_s2"),
        acceleration_vertical_m_s2=number("acceleration_vertical_m_s2"),
        jerk_m_s3=number("jerk_m_s3"),
        yaw_rate_rad_s=math.radians(number("yaw_rate_deg_s")),
    )
    goto = GotoConfig(
        limits=limits,
        arrival_radius_m=number("arrival_radius_m"),
        arrival_speed_m_s=number("arrival_speed_m_s"),
        arrival_dwell_s=number("arrival_dwell_s"),
        settle_timeout_s=number("settle_timeout_s"),
        cancel_timeout_s=number("cancel_timeout_s"),
        may_arm=text("arming") == "auto",
        takeoff_height_m=number("takeoff_height_m"),
        takeoff_height_min_m=number("takeoff_height_min_m"),
        position_timeout_s=number("position_timeout_s"),
    )
    volume = FlightVolume(
        radius_max_m=number("volume_radius_m"),
        altitude_min_m=number("volume_altitude_min_m"),
        altitude_max_m=number("volume_altitude_max_m"),
    )
    return BridgeConfig(
        goto=goto,
        volume=volume,
        replace_active_goal=text("on_new_goal") == "replace",
        setpoint_period_s=1.0 / number("setpoint_rate_hz"),
        feedback_period_s=1.0 / number("feedback_rate_hz"),
        link_lost_abort_s=number("link_lost_abort_s"),
        speed_max_m_s=number("speed_max_m_s"),
        safety=SafetyConfig(
            fence_margin_m=number("fence_margin_m"),
            battery_policy=BatteryPolicy(text("battery_policy")),
            battery_reserve=number("battery_reserve"),
            battery_endurance_s=number("battery_endurance_s"),
        ),
        obstacles=_obstacle_config(number, text),
    )


def _obstacle_config(number: _Number, text: _Text) -> ObstacleConfig:
    known = KnownObstacles()
    try:
        if text("obstacles_file"):
            known = read_obstacles(Path(text("obstacles_file")).expanduser())
    except ObstaclesError as error:
        raise ConfigurationError(f"Parameter obstacles_file: {error}") from error
    try:
        pose = SensorPose.parse(text("sensor_pose"))
    except SensorPoseError as error:
        raise ConfigurationError(f"Parameter sensor_pose {error}") from error
    return ObstacleConfig(
        vehicle_radius_m=number("vehicle_radius_m"),
        margin_m=number("obstacle_margin_m"),
        blocked_timeout_s=number("blocked_timeout_s"),
        sensor_timeout_s=number("obstacle_timeout_s"),
        known=known,
        scan_topic=text("scan_topic"),
        points_topic=text("points_topic"),
        sensor_pose=pose,
        map_size_m=number("obstacle_map_size_m"),
        cell_m=number("obstacle_cell_m"),
    )
