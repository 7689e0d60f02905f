"""Outcomes and rejections of goals: stable codes with a sentence each."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class OutcomeCode(str, Enum):
    """The reason why a goal ended or was rejected. The value is its stable name for clients."""

    SUCCESS = "SUCCESS"
    CANCELED = "CANCELED"
    PREEMPTED = "PREEMPTED"
    PILOT_OVERRIDE = "PILOT_OVERRIDE"
    SHUTTING_DOWN = "SHUTTING_DOWN"
    DUPLICATE_SERVER = "DUPLICATE_SERVER"
    NO_VEHICLE = "NO_VEHICLE"
    UNSUPPORTED_VEHICLE = "UNSUPPORTED_VEHICLE"
    NO_POSITION = "NO_POSITION"
    INVALID_NUMBER = "INVALID_NUMBER"
    INVALID_ORIENTATION = "INVALID_ORIENTATION"
    NEGATIVE_SPEED = "NEGATIVE_SPEED"
    UNKNOWN_FRAME = "UNKNOWN_FRAME"
    BELOW_GROUND = "BELOW_GROUND"
    OUTSIDE_VOLUME = "OUTSIDE_VOLUME"
    OUTSIDE_FENCE = "OUTSIDE_FENCE"
    BUSY = "BUSY"
    ARMING_NOT_ALLOWED = "ARMING_NOT_ALLOWED"
    TAKEOFF_NOT_ALLOWED = "TAKEOFF_NOT_ALLOWED"
    INVALID_WAYPOINTS = "INVALID_WAYPOINTS"
    NOT_FLYING = "NOT_FLYING"
    ALREADY_FLYING = "ALREADY_FLYING"
    LOW_BATTERY = "LOW_BATTERY"
    UNHEALTHY = "UNHEALTHY"
    MODE_REFUSED = "MODE_REFUSED"
    ARMING_REFUSED = "ARMING_REFUSED"
    TAKEOFF_REFUSED = "TAKEOFF_REFUSED"
    TIMEOUT = "TIMEOUT"
    MISSION_REFUSED = "MISSION_REFUSED"
    MISSION_CHANGED = "MISSION_CHANGED"
    WAYPOINT_MISSED = "WAYPOINT_MISSED"
    NO_PATH = "NO_PATH"
    NO_OBSTACLE_DATA = "NO_OBSTACLE_DATA"
    TRAFFIC = "TRAFFIC"
    LINK_LOST = "LINK_LOST"
    DISARMED = "DISARMED"
    LANDED = "LANDED"
    VEHICLE_REBOOTED = "VEHICLE_REBOOTED"
    VEHICLE_FAILSAFE = "VEHICLE_FAILSAFE"
    FAILSAFE_BATTERY = "FAILSAFE_BATTERY"
    FAILSAFE_FENCE = "FAILSAFE_FENCE"
    FAILSAFE_RC = "FAILSAFE_RC"
    FAILSAFE_GCS = "FAILSAFE_GCS"
    FAILSAFE_GPS = "FAILSAFE_GPS"
    FAILSAFE_OFFBOARD = "FAILSAFE_OFFBOARD"
    INTERNAL_ERROR = "INTERNAL_ERROR"


@dataclass(frozen=True)
class Rejection:
    """The reason for which a goal is not accepted.

    Attributes:
        code: stable reason.
        message: a sentence with all numbers and units, saying what to do where it can.
    """

    code: OutcomeCode
    message: str
