"""The failsafe parameters of each firmware, as data.

The meaning of the numbers is that of the firmwares' own parameter descriptions: ArduPilot's
Parameters.cpp of each vehicle, AP_BattMonitor_Params.cpp and AC_Fence.cpp; PX4's
commander_params.c and geofence_params.c (v1.17.0), and the release notes of v1.18.0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType


@dataclass(frozen=True)
class FailsafeSetting:
    """One parameter.

    Attributes:
        name: as the firmware calls it.
        about: what it is about, in a few words.
        values: what its numbers mean; empty for a quantity.
        unit: of a quantity.
        off: the numbers with which the vehicle does nothing.
        formerly: what older firmwares call it; a firmware answers for the one that it has.
        in_some_releases: a release without it has nothing to report.
    """

    name: str
    about: str
    values: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    unit: str = ""
    off: frozenset[int] = frozenset()
    formerly: str = ""
    in_some_releases: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The names that it may have."""
        return (self.name, self.formerly) if self.formerly else (self.name,)

    def describe(self, value: float) -> str:
        """Return a value as text, with what it means."""
        number = f"{value:g}{' ' if self.unit else ''}{self.unit}"
        meaning = self.values.get(int(value)) if value == int(value) else None
        return number if meaning is None else f"{number} ({meaning})"


def _choice(name: str, about: str, *meanings: str, off: tuple[int, ...] = (0,)) -> FailsafeSetting:
    """Make a setting whose numbers count from 0; an empty meaning is a number without one."""
    values = {number: meaning for number, meaning in enumerate(meanings) if meaning}
    return FailsafeSetting(name, about, MappingProxyType(values), off=frozenset(off))


_STATION, _RC, _BATTERY = "ground station lost", "remote control lost", "battery low"
_CRITICAL, _FENCE_ON, _FENCE = "battery critical", "fence", "fence breached"
_COPTER_ACTIONS = (
    "nothing", "RTL", "RTL", "SmartRTL or RTL", "SmartRTL or land", "land",
    "to the mission's landing, or RTL", "brake or land",
)  # fmt: skip
_COPTER_BATTERY = (
    "nothing", "land", "RTL", "SmartRTL or RTL", "SmartRTL or land", "terminate",
    "to the mission's landing, or RTL", "brake or land",
)  # fmt: skip
_ROVER_ENABLE = ("off", "on", "on, but a mission continues")
_ROVER_BATTERY = ("nothing", "RTL", "hold", "SmartRTL", "SmartRTL or hold", "terminate")
_PLANE_BATTERY = ("nothing", "RTL", "land", "terminate", "QLAND", "parachute", "loiter to QLAND")
# Renamed in ArduPilot 4.7.
_STATION_ID = FailsafeSetting(
    "MAV_GCS_SYSID", "system id of the monitored ground station", formerly="SYSID_MYGCS"
)
_FENCE_ENABLE = _choice("FENCE_ENABLE", _FENCE_ON, "off", "on")
# Nothing is amiss where no law asks for it.
_REMOTE_ID = _choice("DID_ENABLE", "Remote ID", "off", "on", off=())

ARDUCOPTER = (
    _choice("FS_GCS_ENABLE", _STATION, *_COPTER_ACTIONS),
    _STATION_ID,
    _choice(
        "FS_THR_ENABLE", _RC, "nothing", "RTL", "RTL, but a mission continues", "land",
        "SmartRTL or RTL", "SmartRTL or land", "to the mission's landing, or RTL",
        "brake or land",
    ),
    _choice("BATT_FS_LOW_ACT", _BATTERY, *_COPTER_BATTERY),
    _choice("BATT_FS_CRT_ACT", _CRITICAL, *_COPTER_BATTERY),
    _choice("FS_EKF_ACTION", "estimator failed", "report only", "land", "ALT_HOLD",
            "land, even from STABILIZE"),
    _REMOTE_ID,
    _FENCE_ENABLE,
    _choice(
        "FENCE_ACTION", _FENCE, "report only", "RTL or land", "land",
        "SmartRTL, RTL or land", "brake or land", "SmartRTL or land",
    ),
    FailsafeSetting("GUID_TIMEOUT", "setpoints ended", unit="s"),
)  # fmt: skip

ARDUROVER = (
    _choice("FS_ACTION", "failsafe action", "nothing", "RTL", "hold", "SmartRTL or RTL",
            "SmartRTL or hold", "terminate", "loiter or hold"),
    FailsafeSetting("FS_TIMEOUT", "failsafe delay", unit="s"),
    _choice("FS_GCS_ENABLE", _STATION, *_ROVER_ENABLE),
    _STATION_ID,
    _choice("FS_THR_ENABLE", _RC, *_ROVER_ENABLE),
    _choice("BATT_FS_LOW_ACT", _BATTERY, *_ROVER_BATTERY),
    _choice("BATT_FS_CRT_ACT", _CRITICAL, *_ROVER_BATTERY),
    _choice("FS_EKF_ACTION", "estimator failed", "nothing", "hold", "report only", off=(0, 2)),
    _choice("FS_CRASH_CHECK", "crash", "nothing", "hold", "hold and disarm"),
    _REMOTE_ID,
    _FENCE_ENABLE,
    _choice("FENCE_ACTION", _FENCE, "report only", "RTL or hold", "hold",
            "SmartRTL, RTL or hold", "SmartRTL or hold", "terminate", "loiter or hold"),
)  # fmt: skip

ARDUPLANE = (
    _choice("FS_LONG_ACTN", "long failsafe action in GUIDED", "continue", "RTL", "glides",
            "parachute", "AUTO", "AUTOLAND or RTL"),
    FailsafeSetting("FS_LONG_TIMEOUT", "failsafe delay", unit="s"),
    _choice("FS_GCS_ENABL", _STATION, "off", "on", "on, also by the radio's report",
            "on in AUTO only"),
    _STATION_ID,
    _choice("THR_FAILSAFE", _RC, "off", "on", "no failsafe; drops stale input", off=(0, 2)),
    _choice("BATT_FS_LOW_ACT", _BATTERY, *_PLANE_BATTERY),
    _choice("BATT_FS_CRT_ACT", _CRITICAL, *_PLANE_BATTERY),
    _REMOTE_ID,
    _FENCE_ENABLE,
    _choice("FENCE_ACTION", _FENCE, "report only", "RTL", "", "", "", "", "GUIDED",
            "GUIDED, with the pilot's throttle", "AUTOLAND or RTL"),
)  # fmt: skip

_PX4_LINK = ("nothing", "hold", "return", "land", "", "terminate", "disarm")
_PX4_STICKS = (*_PX4_LINK, "hold, without a failsafe")
_PX4_OFFBOARD = (
    "position mode", "altitude mode", "stabilized", "return", "land", "hold", "terminate",
    "disarm",
)  # fmt: skip

PX4_ANY = (
    FailsafeSetting("COM_DL_LOSS_T", "ground station counts as lost after", unit="s"),
    _choice("NAV_DLL_ACT", _STATION, *_PX4_LINK),
    _choice("NAV_RCL_ACT", _RC, *_PX4_STICKS),
    FailsafeSetting("COM_RCL_EXCEPT", "modes that need no remote control (bits)"),
    _choice("COM_LOW_BAT_ACT", _BATTERY, "warns only", "", "lands when critical",
            "returns when critical, lands in an emergency"),
    _choice("GF_ACTION", _FENCE, "nothing", "warns only", "hold", "return", "terminate", "land",
            off=(0, 1)),
    _choice("COM_ARM_ODID", "Remote ID", "not checked", "warns only", "needed to arm", "return",
            "land", "terminate", off=()),
    _choice("COM_PARACHUTE", "parachute", "not checked", "warns only; before 1.18 needed to arm",
            "return", "land", off=()),
    replace(
        _choice("COM_GNSSLOSS_ACT", "fewer GNSS receivers than SYS_HAS_NUM_GNSS", "warns only",
                "return", "land", "terminate", off=()),
        in_some_releases=True,
    ),
    FailsafeSetting("COM_DISARM_PRFLT", "armed, but no take-off: disarms after", unit="s"),
)  # fmt: skip

PX4_OFFBOARD = (
    FailsafeSetting("COM_OF_LOSS_T", "setpoints count as lost after", unit="s"),
    _choice("COM_OBL_RC_ACT", "setpoints lost", *_PX4_OFFBOARD, off=()),
    *PX4_ANY,
)

# A multicopter's pilot takes over by a stick: by how far it is moved up to 1.17, from 1.18 on by
# how fast, in OFFBOARD, too.
PX4_COPTER = (
    *PX4_OFFBOARD,
    FailsafeSetting(
        "MAN_OVERRIDE_SPD",
        "a stick that moves faster takes over",
        MappingProxyType({-1: "none takes over"}),
        unit="of its way from the middle in a second",
        off=frozenset({-1}),
        in_some_releases=True,
    ),
    replace(
        _choice("COM_RC_OVERRIDE", "a moved stick takes over", "in no mode", "not in OFFBOARD",
                "in OFFBOARD only", "in OFFBOARD, too", off=()),
        in_some_releases=True,
    ),
    FailsafeSetting(
        "FD_ALT_LOSS", "terminates as far below its setpoint (0: never)", unit="m",
        in_some_releases=True,
    ),
)  # fmt: skip
