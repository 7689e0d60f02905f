"""ArduPlane 4.7-dev of May 2025, as it was recorded."""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.personality import (
    ModeSpec,
    SavedStep,
    Sensors,
    shared,
)
from mavlink_sitl.autopilot.personality.arducopter import TRAVELLER
from mavlink_sitl.autopilot.personality.parameters import table

_PILOT, _ITSELF = 0x50, 0x58


def _by_itself(number: int, name: str, behaviour: str, armable: bool = True) -> ModeSpec:
    return ModeSpec(number, name, behaviour, True, armable, base_flags=_ITSELF)


_MODES = (
    ModeSpec(0, "MANUAL", "stick", armable=True, base_flags=_PILOT),
    ModeSpec(1, "CIRCLE", "circle", armable=True, base_flags=_PILOT),
    ModeSpec(2, "STABILIZE", "stick", armable=True, base_flags=_PILOT),
    ModeSpec(4, "ACRO", "stick", armable=True, base_flags=_PILOT),
    ModeSpec(5, "FLY_BY_WIRE_A", "stick", armable=True, base_flags=_PILOT),
    ModeSpec(6, "FLY_BY_WIRE_B", "hold_height", armable=True, base_flags=_PILOT),
    ModeSpec(7, "CRUISE", "cruise", armable=True, base_flags=_PILOT),
    _by_itself(10, "AUTO", "auto"),
    _by_itself(11, "RTL", "rtl", armable=False),
    _by_itself(12, "LOITER", "loiter"),
    _by_itself(13, "TAKEOFF", "takeoff"),
    _by_itself(15, "GUIDED", "guided"),
)

# Those of the recordings where they show, else the firmware's defaults.
_PARAMETERS = (*shared.COMMON, *shared.HEIGHT_FENCE, *shared.SIM_WIND, *table("arduplane"))

ARDUPLANE = replace(
    TRAVELLER,
    name="ArduPlane",
    kind="plane",
    mav_type=1,
    capabilities=0xF36F,
    modes={mode.number: mode for mode in _MODES},
    parameters=_PARAMETERS,
    whole="ardupilot_plane",
    banner=("ArduPlane V4.7.0-dev (cef8bcef)",),
    boot=shared.boot("arduplane"),
    saved=(*shared.saved(1.75, 2.76), SavedStep(3.42, "ARSPD_OFFSET", 2013.95)),
    ready_s=20.51,
    gps_fix_s=9.1,
    battery_ready_s=2.6,
    origin_s=19.49,
    standby_s=1.747,
    boot_flags=0x10,
    streams=shared.streams(raw_sensors=(295,), extra1=(11020,)),
    sensors=Sensors(
        present=0x1361FC1F,
        enabled=0x1241801F,
        healthy=0x0301801F,
        by_mode={
            "MANUAL": 0,
            "ACRO": shared.RATES,
            "STABILIZE": shared.LEVEL,
            "FLY_BY_WIRE_A": shared.LEVEL,
            "FLY_BY_WIRE_B": shared.LEVEL,
            "CRUISE": shared.LEVEL,
        },
        otherwise=shared.FLOWN,
    ),
)
