"""Typed, validated settings made from parameters. No ROS."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from mavlink_vehicle.events import LogMeans
from mavlink_vehicle.vehicle import VehicleConfig
from navigation_bridge.configuration.known_obstacles import (
    KnownObstacles,
    ObstaclesError,
    read_obstacles,
)
from navigation_bridge.configuration.parameter_table import PARAMETERS, ParameterValue
from navigation_bridge.configuration.parameter_values import (
    ConfigurationError,
    check_links_apart,
    check_value,
    texts,
)
from navigation_bridge.configuration.sensor_poses import SensorPose, SensorPoseError
from navigation_bridge.configuration.settings import (
    BatteryPolicy,
    BridgeConfig,
    CommandConfig,
    MissedWaypoint,
    ObstacleConfig,
    PublishTf,
    SafetyConfig,
    StationPause,
    TrafficConfig,
    TrafficConflict,
)
from navigation_core.safety.target_checks import FlightVolume
from navigation_core.tasks.flying.goto import GotoConfig
from navigation_core.traffic.volumes import Separation
from navigation_core.trajectories.trajectory import Limits

__all__ = [
    "ConfigurationError",
    "ServerConfig",
    "check_value",
    "make_config",
]

_Number = Callable[[str], float]
_Text = Callable[[str], str]


# MAV_TYPE_GCS and MAV_TYPE_ONBOARD_CONTROLLER (common.xml); None leaves it to the profile.
_HEARTBEAT_TYPES: dict[str, int | None] = {"auto": None, "gcs": 6, "onboard": 18}

# Requested rate of the vehicle's range sensors.
_RANGES_HZ = 10.0
# An ArduPilot sends one aircraft at a time, of up to 25 (ADSB_LIST_MAX).
_TRAFFIC_HZ = 10.0


@dataclass(frozen=True)
class ServerConfig:
    """The settings of one server, checked.

    Attributes:
        link_url: link to the autopilot.
        record_tlog: path of the recording, or None.
        vehicle: settings of the vehicle's MAVLink connection.
        bridge: settings for goals.
        vehicles: names of the vehicles; none: one vehicle without a namespace.
        gcs_links: links to ground stations.
        signing_key_file: path of the MAVLink 2 signing key, or None.
        external_odometry_topic: topic of a position for the autopilot's estimator; empty: none.
        log_directory: folder for logs downloaded from the autopilot.
        publish_tf: which transforms are published.
        replay_speed: replay speed as a factor of real time; 0: as fast as possible.
    """

    link_url: str
    record_tlog: str | None
    vehicle: VehicleConfig
    bridge: BridgeConfig
    vehicles: tuple[str, ...] = ()
    gcs_links: tuple[str, ...] = ()
    signing_key_file: str | None = None
    replay_speed: float = 1.0
    log_directory: str = "autopilot_logs"
    external_odometry_topic: str = ""
    publish_tf: PublishTf = PublishTf.ALL


def make_config(values: Mapping[str, ParameterValue]) -> ServerConfig:
    """Build the settings from parameter values; missing ones have their defaults.

    Raises:
        ConfigurationError: an unknown name, an invalid value, or contradicting values.
    """
    for name, value in values.items():
        check_value(name, value)
    merged: dict[str, ParameterValue] = {spec.name: spec.default for spec in PARAMETERS}
    merged.update(values)

    def number(name: str) -> float:
        value = merged[name]
        assert isinstance(value, (int, float)), name
        return float(value)

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
        # Otherwise silence would be attributed to something other than a lost link.
        if number(name) <= number("heartbeat_timeout_s"):
            raise ConfigurationError(f"Parameter {name} must be above heartbeat_timeout_s.")
    _check_texts(text)
    gcs_links = texts(merged["gcs_links"])
    check_links_apart(text("link_url"), gcs_links)
    return ServerConfig(
        link_url=text("link_url"),
        record_tlog=text("record_tlog") or None,
        vehicle=_vehicle_config(number, text),
        bridge=_bridge_config(number, text, texts(merged["traffic_peers"])),
        vehicles=texts(merged["vehicles"]),
        gcs_links=gcs_links,
        signing_key_file=text("signing_key_file") or None,
        replay_speed=number("replay_speed"),
        log_directory=text("log_directory"),
        external_odometry_topic=text("external_odometry_topic"),
        publish_tf=PublishTf(text("publish_tf")),
    )


def _check_texts(text: _Text) -> None:
    if not text("log_directory"):
        raise ConfigurationError("Parameter log_directory must name a folder.")
    if text("external_origin") and not text("external_odometry_topic"):
        raise ConfigurationError("Parameter external_origin needs external_odometry_topic.")


def _vehicle_config(number: _Number, text: _Text) -> VehicleConfig:
    defaults = VehicleConfig()
    rate_hz = number("position_rate_hz")
    rates_hz = dict(defaults.message_rates_hz)
    rates_hz.update({"GLOBAL_POSITION_INT": rate_hz, "LOCAL_POSITION_NED": rate_hz})
    optional_hz = {"OBSTACLE_DISTANCE": _RANGES_HZ, "DISTANCE_SENSOR": _RANGES_HZ}
    if text("separation") == "enabled":
        optional_hz["ADSB_VEHICLE"] = _TRAFFIC_HZ
    return VehicleConfig(
        target_system=int(number("target_system")),
        source_component=int(number("source_component")),
        heartbeat_type=_HEARTBEAT_TYPES[text("heartbeat_type")],
        heartbeat_timeout_s=number("heartbeat_timeout_s"),
        message_rates_hz=rates_hz,
        optional_rates_hz=optional_hz,
        external_origin=_origin(text("external_origin")),
        log_means=LogMeans(text("log_transfer")),
    )


def _origin(words: str) -> tuple[float, float, float] | None:
    """Return latitude and longitude in degrees and altitude in m; None for an empty text."""
    if not words.strip():
        return None
    try:
        latitude_deg, longitude_deg, altitude_m = map(float, words.split())
    except ValueError:
        latitude_deg = longitude_deg = altitude_m = math.nan
    # The bounds exclude NaN as well.
    if not (abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0 and abs(altitude_m) < 20e3):
        raise ConfigurationError(
            f"Parameter external_origin is '{words}'; give latitude, longitude (degrees) and "
            "altitude (metres above sea level), such as '47.3977 8.5456 488'."
        )
    return latitude_deg, longitude_deg, altitude_m


def _bridge_config(number: _Number, text: _Text, peers: tuple[str, ...]) -> BridgeConfig:
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
        may_take_off=text("arming") in ("auto", "pilot"),
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
            position_doubt_timeout_s=number("position_doubt_timeout_s"),
        ),
        obstacles=_obstacle_config(number, text),
        on_station_pause=StationPause(text("on_station_pause")),
        on_missed_waypoint=MissedWaypoint(text("on_missed_waypoint")),
        commands=CommandConfig(
            timeout_s=number("cmd_vel_timeout_s"),
            start_goal=text("cmd_vel_start") == "command",
            stamped=text("cmd_vel_type") == "stamped",
        ),
        traffic=_traffic_config(number, text, peers),
    )


def _traffic_config(number: _Number, text: _Text, peers: tuple[str, ...]) -> TrafficConfig:
    return TrafficConfig(
        on=text("separation") == "enabled",
        separation=Separation(number("separation_horizontal_m"), number("separation_vertical_m")),
        conflict=TrafficConflict(text("traffic_conflict")),
        timeout_s=number("traffic_timeout_s"),
        peers=peers,
        topic=text("traffic_topic"),
        announces=text("announce_adsb") == "enabled",
        adsb_address=_address(text("adsb_address")),
    )


def _address(digits: str) -> int:
    """Return an ICAO address; 0 for an empty text."""
    if not digits:
        return 0
    if not re.fullmatch(r"[0-9A-Fa-f]{6}", digits) or not int(digits, 16):
        raise ConfigurationError(
            f"Parameter adsb_address is '{digits}'; give the 6 hexadecimal digits of an ICAO "
            "address, such as '4B1A2C'."
        )
    return int(digits, 16)


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
