"""Learns from a DataFlash log which vehicle wrote it."""

from __future__ import annotations

import re
from typing import Any

from mavlink_vehicle.codec import mavlink

_TYPES = {
    1: mavlink.MAV_TYPE_GROUND_ROVER,
    2: mavlink.MAV_TYPE_QUADROTOR,
    3: mavlink.MAV_TYPE_FIXED_WING,
    4: mavlink.MAV_TYPE_ANTENNA_TRACKER,
    7: mavlink.MAV_TYPE_SUBMARINE,
    12: mavlink.MAV_TYPE_AIRSHIP,
    13: mavlink.MAV_TYPE_HELICOPTER,
}
"""MAV_TYPE by VER.BU, APM_BUILD_TYPE in AP_Vehicle_Type.h"""
_FIRMWARE = re.compile(
    r"(?:Ardu|APM:|APM)?(?P<name>Copter|Plane|Rover2?|Sub|AntennaTracker|Blimp)\s*"
    r"[vV](?P<major>\d+)\.(?P<minor>\d+)(?:\.(?P<patch>\d+))?"
    r"(?:[-. ]?(?P<kind>dev|alpha|beta|rc)\.?(?P<number>\d*))?",
    re.IGNORECASE,
)
"""The first MSG, in all spellings: "ArduCopter V3.1.3", "APM:Copter V3.4.4-rc1", "ArduRover
v2.46beta2" (THISFIRMWARE in each vehicle's version.h)"""
_BUILDS = {"copter": 2, "plane": 3, "rover": 1, "rover2": 1, "sub": 7, "antennatracker": 4,
           "blimp": 12}  # fmt: skip
_KINDS = {"dev": 0, "alpha": 64, "beta": 128, "rc": 192, None: 255}
"""FIRMWARE_VERSION_TYPE; a number of an alpha, a beta or a candidate is added"""
_BUILD_PARAMETERS = {"JS_GAIN_DEFAULT": 7, "WPNAV_SPEED": 2, "WP_SPD": 2, "ARSPD_FBW_MIN": 3,
                     "AIRSPEED_MIN": 3, "CRUISE_SPEED": 1}  # fmt: skip
"""Parameters that only one vehicle has, in this order, for firmwares of another name; WP_SPD is a
copter's since 4.7"""
_BOAT = 2
"""FRAME_CLASS of a Rover"""
_ARMING_EVENTS = {10: True, 11: False}
"""EV.Id, LogEvent in AP_Logger.h; ARM is newer"""


class VehicleFacts:
    """The vehicle of a log, by its records.

    Attributes:
        kinds: the types of records that describe the vehicle.
        version: AUTOPILOT_VERSION.flight_sw_version of the first MSG; None if it names no firmware.
    """

    kinds = ("VER", "MSG", "PARM", "ARM", "EV")

    def __init__(self) -> None:
        """Begin without records."""
        self.version: int | None = None
        self._build = 0
        self._parameters: dict[str, float] = {}
        self._armed_first: bool | None = None

    def take(self, record: Any) -> None:
        """Take a record of any kind."""
        kind = record.get_type()
        if kind == "VER":
            self._build = getattr(record, "BU", 0) or self._build
        elif kind == "MSG" and self.version is None:
            found = _FIRMWARE.match(str(record.Message))
            if found is not None:
                self._build = self._build or _BUILDS[found["name"].lower()]
                self.version = _version(found)
        elif kind == "PARM":
            self._parameters[record.Name] = record.Value
        elif kind in ("ARM", "EV") and self._armed_first is None:
            self._armed_first = arming_of(record)

    @property
    def vehicle_type(self) -> int:
        """MAV_TYPE; GENERIC if no record shows it."""
        parameters = self._parameters
        known = (_BUILD_PARAMETERS[name] for name in _BUILD_PARAMETERS if name in parameters)
        kind = _TYPES.get(self._build or next(known, 0), mavlink.MAV_TYPE_GENERIC)
        if kind == mavlink.MAV_TYPE_GROUND_ROVER and parameters.get("FRAME_CLASS") == _BOAT:
            return int(mavlink.MAV_TYPE_SURFACE_BOAT)
        return int(kind)

    @property
    def armed_at_first(self) -> bool:
        """Whether it was armed when the log began.

        A log usually begins with arming, of which it has no record, and ends with disarming.
        """
        if self._armed_first is not None:
            return not self._armed_first
        return not self._parameters.get("LOG_DISARMED", 0.0)


def arming_of(record: Any) -> bool | None:
    """Return whether the motors are armed after an ARM or EV; None for other events."""
    if record.get_type() == "EV":
        return _ARMING_EVENTS.get(record.Id)
    return bool(record.ArmState)


def _version(found: re.Match[str]) -> int:
    """Return AUTOPILOT_VERSION.flight_sw_version of a firmware's name."""
    major, minor, patch = (int(found[part] or 0) for part in ("major", "minor", "patch"))
    kind = None if found["kind"] is None else found["kind"].lower()
    low = _KINDS[kind] + (min(int(found["number"] or 0), 62) if kind != "dev" and kind else 0)
    return min(major, 255) << 24 | min(minor, 255) << 16 | min(patch, 255) << 8 | low
