"""ArduRover 4.7-dev of May 2025, as it was recorded; for cars and for boats."""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.personality import (
    ModeSpec,
    Sensors,
    shared,
)
from mavlink_sitl.autopilot.personality.arducopter import TRAVELLER
from mavlink_sitl.autopilot.personality.parameters import table

MANUAL_INPUT, AUTONOMOUS = 0x40, 0x08
"""Of HEARTBEAT.base_mode: in modes that a pilot drives, in modes that the firmware drives"""


def _driven(number: int, name: str, behaviour: str) -> ModeSpec:
    return ModeSpec(number, name, behaviour, armable=True, base_flags=MANUAL_INPUT)


def _controlled(number: int, name: str, behaviour: str) -> ModeSpec:
    """Driven by the pilot, with a speed or a rate of turn that is controlled."""
    return replace(_driven(number, name, behaviour), requires_velocity=True)


def _by_itself(number: int, name: str, behaviour: str, armable: bool = True) -> ModeSpec:
    return ModeSpec(number, name, behaviour, True, armable, base_flags=AUTONOMOUS)


_MODES = (
    _driven(0, "MANUAL", "manual"),
    _controlled(1, "ACRO", "acro"),
    _controlled(3, "STEERING", "steering"),
    ModeSpec(4, "HOLD", "hold", armable=True, base_flags=0),
    _by_itself(5, "LOITER", "loiter"),
    _by_itself(9, "CIRCLE", "circle"),
    _by_itself(10, "AUTO", "auto"),
    _by_itself(11, "RTL", "rtl", armable=False),
    _by_itself(12, "SMART_RTL", "smart_rtl", armable=False),
    _by_itself(15, "GUIDED", "guided"),
)

# Defaults are the firmware's where it has one and the recordings do not say otherwise.
_PARAMETERS = (*shared.COMMON, *table("ardurover"))

ARDUROVER = replace(
    TRAVELLER,
    name="ArduRover",
    kind="rover",
    mav_type=10,
    capabilities=0xF1EF,
    modes={mode.number: mode for mode in _MODES},
    parameters=_PARAMETERS,
    whole="ardupilot_rover",
    banner=("ArduRover V4.7.0-dev (cef8bcef)",),
    boot=shared.boot("ardurover"),
    saved=shared.saved(1.73, 3.40, calibrations_s=(1.85, 2.37)),
    ready_s=42.10,
    gps_fix_s=9.75,
    battery_ready_s=2.4,
    origin_s=19.88,
    standby_s=2.365,
    boot_flags=MANUAL_INPUT,
    streams=shared.streams(raw_controller=(34,)),
    sensors=Sensors(
        present=0x1321DC0F,
        enabled=0x1201800F,
        healthy=0x0301810F,
        by_mode={
            "MANUAL": 0,
            "HOLD": 0,
            "ACRO": shared.LEVEL,
            "STEERING": shared.LEVEL,
        },
        otherwise=shared.DRIVEN,
        estimator_needs_gps=True,
    ),
)

ARDUBOAT = replace(ARDUROVER, name="ArduRover (boat)", kind="boat", mav_type=11)
