"""Settings of a server, each declared with the parameter that sets it. No ROS."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from mavlink_vehicle.events import LogMeans
from mavlink_vehicle.io.tlog_series import FILES_MIN
from mavlink_vehicle.protocols.streams.remote_id import RemoteId
from mavlink_vehicle.vehicle_config import DEFAULT_RATES_HZ, VehicleConfig
from navigation_bridge.configuration.declarations import (
    also,
    group,
    of_core,
    parameter,
    words_of,
)
from navigation_bridge.configuration.parameter_values import (
    TOKEN,
    read_operator,
    read_origin,
    read_text,
    read_vehicle_names,
)
from navigation_bridge.configuration.settings import SWITCH, BridgeConfig
from navigation_bridge.configuration.station_links import read_station_links

# MAV_TYPE_GCS and MAV_TYPE_ONBOARD_CONTROLLER (common.xml); None leaves it to the profile.
_HEARTBEAT_TYPES: dict[str, int | None] = {"auto": None, "gcs": 6, "onboard": 18}
_POSITIONS = ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED")
# A server is one Python process, which has one core however many there are. 20 vehicles in flight
# took 0.36 cores of a quiet machine, 50 took 0.66, and 100 starved (docs/scaling.md).
_VEHICLES_MAX = 25
# Requested rate of the vehicle's range sensors.
_RANGES_HZ = 10.0
# An ArduPilot sends one aircraft at a time, of up to 25 (ADSB_LIST_MAX).
_TRAFFIC_HZ = 10.0


class PublishTf(Enum):
    """Which transforms the server publishes."""

    ALL = "all"
    """The tree of the vehicle, and the sensors that have a pose among the parameters."""
    VEHICLE = "vehicle"
    """The same without these sensors, which a model of the robot has."""
    NONE = "none"
    """None: something else publishes the frames."""


def _read_path(text: str) -> str | None:
    return text or None


def _rates_hz(position_hz: float) -> Mapping[str, float]:
    positions_hz = dict.fromkeys(_POSITIONS, position_hz)
    return {**DEFAULT_RATES_HZ, **positions_hz}


def _optional_rates_hz(separation: str) -> Mapping[str, float]:
    rates_hz = dict.fromkeys(("OBSTACLE_DISTANCE", "DISTANCE_SENSOR"), _RANGES_HZ)
    return {**rates_hz, "ADSB_VEHICLE": _TRAFFIC_HZ} if SWITCH[separation] else rates_hz


@dataclass(frozen=True)
class ServerConfig:
    """The settings of one server, checked."""

    link_url: str = parameter(
        "link_url",
        "udpin://127.0.0.1:14550",
        "Link to the autopilot, in MAVSDK or pymavlink [notation](protocols.md#links): "
        "udpin://HOST:PORT, udpout://HOST:PORT, tcp://HOST:PORT, serial:///dev/NAME:BAUD; or "
        "tlog:PATH to replay a recording.",
        fixed=True,
    )
    vehicles: tuple[str, ...] = parameter(
        "vehicles",
        [],
        "Vehicle names; each is a ROS namespace with its own navigation_server node and "
        "[settings](fleet.md#settings). Empty: one vehicle without a namespace.",
        read=read_vehicle_names,
        fixed=True,
        server_wide=True,
        schema={"items": {"type": "string", "pattern": f"^{TOKEN}$"}, "uniqueItems": True},
    )
    vehicles_max: int = parameter(
        "vehicles_max",
        _VEHICLES_MAX,
        "Most vehicles of this server: with more in `vehicles` it does not start. The default is "
        "what was [measured](scaling.md#what-bounds-a-server) to leave room.",
        (1, 254),
        fixed=True,
        server_wide=True,
    )
    autostart: bool = parameter(
        "autostart",
        True,
        "Whether the server configures and activates itself. false: it waits for its "
        "[lifecycle](on_board.md#lifecycle) services.",
        fixed=True,
        server_wide=True,
    )
    gcs_links: tuple[str, ...] = parameter(
        "gcs_links",
        [],
        "Links to [ground stations](ground_stations.md), in the notation of link_url. Traffic "
        "between vehicles and ground stations is forwarded.",
        read=read_station_links,
        fixed=True,
        server_wide=True,
    )
    signing_key_file: str | None = parameter(
        "signing_key_file",
        "",
        "Path of the MAVLink 2 [signing](ground_stations.md#signing) key. Empty: messages are not "
        "signed, and unsigned commands are accepted.",
        read=_read_path,
        fixed=True,
        server_wide=True,
    )
    record_tlog: str | None = parameter(
        "record_tlog",
        "",
        "Path of a telemetry log of all MAVLink traffic in both directions; its folder must exist. "
        "Empty: no recording.",
        read=_read_path,
        fixed=True,
        server_wide=True,
    )
    record_tlog_file_mb: int = parameter(
        "record_tlog_file_mb",
        0,
        "Size in MB at which the recording continues in [another file](logs.md#many-flights). "
        "0: one file, begun again at each start.",
        (0, 100_000),
        fixed=True,
        server_wide=True,
    )
    record_tlog_files: int = parameter(
        "record_tlog_files",
        20,
        "Most files of that recording on the disk; the oldest are deleted, the newest two never.",
        (FILES_MIN, 10_000),
        fixed=True,
        server_wide=True,
    )
    log_directory: str = parameter(
        "log_directory",
        "autopilot_logs",
        "Folder for [logs downloaded from the autopilot](logs.md#the-autopilots-own-logs); it is "
        "made with the first one.",
        fixed=True,
    )
    replay_speed: float = parameter(
        "replay_speed",
        1.0,
        "Replay speed with tlog:PATH, as a factor of real time; 0 is as fast as possible.",
        (0.0, 1000.0),
        server_wide=True,
    )
    external_odometry_topic: str = parameter(
        "external_odometry_topic",
        "",
        "Topic (nav_msgs/Odometry) of a [position](navigate.md#without-gps) for the autopilot's "
        "estimator, from a camera or motion capture. Empty: none.",
        fixed=True,
    )
    sends_computer_status: bool = parameter(
        "onboard_computer_status",
        "disabled",
        "Whether the vehicle gets the "
        "[status of this computer](on_board.md#status-for-the-autopilot) once a second "
        "(ONBOARD_COMPUTER_STATUS): `enabled` or `disabled`.",
        words=SWITCH,
        fixed=True,
    )
    remote_id: RemoteId = group(
        RemoteId,
        serial_number=of_core(
            "remote_id_serial_number",
            "Serial number of the vehicle for its [Remote ID](on_board.md#remote-id) transponder "
            "(ANSI/CTA-2063-A, up to 20 characters). Empty: it is not sent.",
            read=read_text("remote_id_serial_number", 20),
            default="",
            fixed=True,
        ),
        operator_id=of_core(
            "remote_id_operator_id",
            "Identity of the operator for Remote ID, as given by the authority (up to 20 "
            "characters). Empty: it is not sent.",
            read=read_text("remote_id_operator_id", 20),
            default="",
            fixed=True,
        ),
        description=of_core(
            "remote_id_description",
            "Description of the flight for Remote ID (up to 23 characters). Empty: it is not sent.",
            read=read_text("remote_id_description", 23),
            default="",
            fixed=True,
        ),
        operator=of_core(
            "remote_id_operator_position",
            "Where the operator stands, for Remote ID: 'latitude longitude altitude', degrees and "
            "metres above the WGS-84 ellipsoid. Empty: it is not sent.",
            read=read_operator,
            default="",
            fixed=True,
        ),
    )
    vehicle: VehicleConfig = group(
        VehicleConfig,
        target_system=of_core(
            "target_system",
            "MAVLink system id of the vehicle; 0 selects the "
            "[first autopilot heard](protocols.md#identity).",
            (0, 255),
            fixed=True,
        ),
        source_component=of_core(
            "source_component",
            "MAVLink component id of this server; 191 is an onboard computer.",
            (1, 255),
            fixed=True,
        ),
        heartbeat_type=of_core(
            "heartbeat_type",
            "[Type in the HEARTBEAT](autopilots.md#the-heartbeat-type) of this server: `auto` (as "
            "the firmware requires), `gcs` (ground station) or `onboard` (onboard computer).",
            words=_HEARTBEAT_TYPES,
            fixed=True,
        ),
        heartbeat_timeout_s=of_core(
            "heartbeat_timeout_s",
            "Silence of the vehicle after which the link counts as lost. While other messages "
            "arrive, HEARTBEAT may be missing for three times as long.",
            (1.5, 60.0),
            fixed=True,
        ),
        message_rates_hz=of_core(
            "position_rate_hz",
            "Requested rate of GLOBAL_POSITION_INT and LOCAL_POSITION_NED.",
            (2.0, 100.0),
            default=DEFAULT_RATES_HZ[_POSITIONS[0]],
            read=_rates_hz,
            fixed=True,
        ),
        optional_rates_hz=also("separation", _optional_rates_hz),
        external_origin=of_core(
            "external_origin",
            "Origin of external_odometry_topic's positions: 'latitude longitude altitude', degrees "
            "and metres above sea level; set on an autopilot that has none. Empty: it is not set.",
            read=read_origin,
            default="",
            fixed=True,
        ),
        log_means=of_core(
            "log_transfer",
            "Protocol for [logs of the autopilot](logs.md#the-autopilots-own-logs): `log_request` "
            "(LOG_REQUEST_*), `ftp` (MAVFTP), or `auto` (MAVFTP if LOG_REQUEST_LIST is not "
            "answered).",
            words=words_of(LogMeans),
            fixed=True,
        ),
    )
    bridge: BridgeConfig = group(BridgeConfig)
    publish_tf: PublishTf = parameter(
        "publish_tf",
        "all",
        "[Transforms](frames_and_units.md#the-tree) published: `all`, `vehicle` (without the "
        "sensors of sensor_pose, where a robot model has them) or `none`.",
        words=words_of(PublishTf),
        fixed=True,
    )
