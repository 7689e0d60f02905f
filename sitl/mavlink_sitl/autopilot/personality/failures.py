"""The parameters of ArduPilot's simulator that break the sensors of any kind of vehicle."""

from __future__ import annotations

from mavlink_sitl.autopilot.parameters import ParameterSpec, ParameterType

SIM_GPS = (
    ParameterSpec("SIM_GPS1_ENABLE", 1.0, ParameterType.INT8),
    ParameterSpec("SIM_GPS1_GLTCH_X", 0.0),
    ParameterSpec("SIM_GPS1_GLTCH_Y", 0.0),
    ParameterSpec("SIM_GPS1_GLTCH_Z", 0.0),
)
SIM_ENGINE = (
    ParameterSpec("SIM_ENGINE_FAIL", 0.0, ParameterType.INT32),
    ParameterSpec("SIM_ENGINE_MUL", 1.0),
)
SIM_WIND = (
    ParameterSpec("SIM_WIND_DIR", 180.0),
    ParameterSpec("SIM_WIND_SPD", 0.0),
)
