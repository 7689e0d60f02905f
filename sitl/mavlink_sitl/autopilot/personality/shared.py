"""What the personalities of ArduPilot share: parameters, and the groups of streams."""

from __future__ import annotations

from mavlink_sitl.autopilot.parameters import ParameterSpec, ParameterType

_INT8 = ParameterType.INT8
_INT32 = ParameterType.INT32

BATTERY = (
    ParameterSpec("BATT_CAPACITY", 3300.0, _INT32),
    ParameterSpec("BATT_CRT_VOLT", 0.0),
    ParameterSpec("BATT_FS_CRT_ACT", 0.0, _INT8),
    ParameterSpec("BATT_FS_LOW_ACT", 0.0, _INT8),
    ParameterSpec("BATT_LOW_MAH", 0.0),
    ParameterSpec("BATT_LOW_TIMER", 10.0, _INT8),
    ParameterSpec("BATT_LOW_VOLT", 10.5),
)
FENCE = (
    ParameterSpec("FENCE_ACTION", 1.0, _INT8),
    ParameterSpec("FENCE_ENABLE", 0.0, _INT8),
    ParameterSpec("FENCE_MARGIN", 2.0),
    ParameterSpec("FENCE_RADIUS", 300.0),
)
HEIGHT_FENCE = (
    ParameterSpec("FENCE_ALT_MAX", 100.0),
    ParameterSpec("FENCE_ALT_MIN", -10.0),
)
"""Of those that leave the ground"""
LINK = (
    ParameterSpec("RC_OVERRIDE_TIME", 3.0),
    ParameterSpec("SYSID_MYGCS", 255.0, _INT32),
)
SIMULATION = (
    ParameterSpec("SIM_BATT_VOLTAGE", 0.0),
    ParameterSpec("SIM_ENGINE_FAIL", 0.0, _INT32),
    ParameterSpec("SIM_ENGINE_MUL", 1.0),
    ParameterSpec("SIM_GPS1_ENABLE", 1.0, _INT8),
    ParameterSpec("SIM_GPS1_GLTCH_X", 0.0),
    ParameterSpec("SIM_GPS1_GLTCH_Y", 0.0),
    ParameterSpec("SIM_GPS1_GLTCH_Z", 0.0),
    ParameterSpec("SIM_RC_FAIL", 0.0, _INT8),
)
"""Of the firmware's simulator, that break something"""
SIM_WIND = (
    ParameterSpec("SIM_WIND_DIR", 180.0),
    ParameterSpec("SIM_WIND_SPD", 0.0),
)
"""Of those that the wind moves"""
COMMON = (*BATTERY, *FENCE, *LINK, *SIMULATION)
"""Of every kind of vehicle"""


STREAMS: dict[str, tuple[int, ...]] = {
    "raw_sensors": (27, 116, 129, 29, 137),
    "extended_status": (1, 125, 152, 42, 24, 62, 162, 87),
    "rc_channels": (36, 65),
    "raw_controller": (),
    "position": (33, 32),
    "extra1": (30, 164, 178),
    "extra2": (74,),
    "extra3": (163, 168, 132, 2, 147, 193, 241),
}
"""What the firmware puts into each group, of those messages that are modelled"""
STREAM_IDS = {
    "raw_sensors": 1,
    "extended_status": 2,
    "rc_channels": 3,
    "raw_controller": 4,
    "position": 6,
    "extra1": 10,
    "extra2": 11,
    "extra3": 12,
}
"""MAV_DATA_STREAM"""


def streams(**more: tuple[int, ...]) -> dict[int, tuple[int, ...]]:
    """REQUEST_DATA_STREAM: message ids by stream id; 0 is all of them.

    Args:
        more: what a kind of vehicle sends besides, by group.
    """
    by_id = {
        STREAM_IDS[name]: (*messages, *more.get(name, ())) for name, messages in STREAMS.items()
    }
    return {0: tuple(m for messages in by_id.values() for m in messages), **by_id}


RATES, ATTITUDE, YAW, HEIGHT, PLACE = 0x400, 0x800, 0x1000, 0x2000, 0x4000
"""Of SYS_STATUS: what is controlled"""
