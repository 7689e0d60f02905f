"""The settings of `Vehicle`, validated when they are created."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from mavlink_vehicle.errors import SettingError
from mavlink_vehicle.events import LogMeans

DEFAULT_RATES_HZ: Mapping[str, float] = MappingProxyType(
    {
        "GLOBAL_POSITION_INT": 20.0,
        "LOCAL_POSITION_NED": 20.0,
        "EXTENDED_SYS_STATE": 5.0,
        "SYS_STATUS": 2.0,
        "BATTERY_STATUS": 2.0,
        "GPS_RAW_INT": 2.0,
        "EKF_STATUS_REPORT": 1.0,
        "ESTIMATOR_STATUS": 1.0,
        "ATTITUDE": 10.0,
        "SYSTEM_TIME": 1.0,
        "HOME_POSITION": 0.5,
        "TERRAIN_REPORT": 0.5,
        "CURRENT_MODE": 5.0,
        "MISSION_CURRENT": 2.0,
    }
)
"""Hz by message name, asked for in this order."""


@dataclass(frozen=True)
class VehicleConfig:
    """Settings for one vehicle.

    Attributes:
        target_system: its MAVLink system id; 0 takes the first vehicle that is heard, and a better
            known one instead while nothing flies.
        target_component: component id of its autopilot.
        source_system: our system id; None takes the vehicle's own, as an onboard computer
            should (1 before it is known).
        source_component: our component id; 191 is MAV_COMP_ID_ONBOARD_COMPUTER.
        heartbeat_interval_s: how often we send HEARTBEAT.
        heartbeat_type: as which MAV_TYPE; None takes what the firmware's profile says.
        heartbeat_timeout_s: silence of its HEARTBEAT after which it counts as lost.
        message_rates_hz: telemetry that is asked for.
        optional_rates_hz: telemetry that is asked for, too, but need not be there.
        command_timeout_s: time to the repetition of a command without an answer.
        command_retries: repetitions after the first sending.
        operation_timeout_s: time for a mode change, arming or disarming to show in its state.
        takeoff_timeout_s: time for a take-off; None takes 15 s and 2 s for each metre.
        timesync_interval_s: how often the round trip is measured; 0: never.
        mission_timeout_s: time to the repetition of a message of a mission transfer.
        mission_retries: repetitions of each such message after the first sending.
        external_origin: latitude and longitude in degrees and altitude above mean sea level in m
            of the local frame of external poses; set where the autopilot has no origin. None: the
            autopilot gets it otherwise.
        log_means: how the autopilot's own logs are listed and downloaded.
        grace_s: a change that we asked for may show up this long after its operation ended.
    """

    target_system: int = 0
    target_component: int = 1
    source_system: int | None = None
    source_component: int = 191
    heartbeat_interval_s: float = 1.0
    heartbeat_type: int | None = None
    heartbeat_timeout_s: float = 3.0
    message_rates_hz: Mapping[str, float] = field(default_factory=lambda: DEFAULT_RATES_HZ)
    optional_rates_hz: Mapping[str, float] = field(default_factory=dict)
    command_timeout_s: float = 0.5
    command_retries: int = 4
    operation_timeout_s: float = 10.0
    takeoff_timeout_s: float | None = None
    grace_s: float = 5.0
    timesync_interval_s: float = 2.0
    mission_timeout_s: float = 0.5
    mission_retries: int = 20
    external_origin: tuple[float, float, float] | None = None
    log_means: LogMeans = LogMeans.AUTO

    def __post_init__(self) -> None:
        """Reject what makes no sense.

        Raises:
            SettingError: says which value and what it may be.
        """
        for name, low in (
            ("target_system", 0),
            ("target_component", 1),
            ("source_component", 1),
            ("source_system", 1),
        ):
            number = getattr(self, name)
            if number is not None and not low <= number <= 255:
                raise SettingError(f"{name} is {number}; it must be {low} to 255.")
        if self.heartbeat_type is not None and not 0 <= self.heartbeat_type <= 255:
            raise SettingError(f"heartbeat_type is {self.heartbeat_type}; it must be 0 to 255.")
        for name in (
            "heartbeat_interval_s",
            "heartbeat_timeout_s",
            "command_timeout_s",
            "operation_timeout_s",
            "mission_timeout_s",
        ):
            if not 0.0 < getattr(self, name) < 1e6:
                raise SettingError(f"{name} must be a positive number of seconds.")
        if self.command_retries < 0 or self.mission_retries < 0:
            raise SettingError("command_retries and mission_retries must be 0 or more.")
        for name in ("message_rates_hz", "optional_rates_hz"):
            if not all(0.0 <= rate_hz <= 1000.0 for rate_hz in getattr(self, name).values()):
                raise SettingError(f"{name} must be between 0 (off) and 1000 Hz.")
