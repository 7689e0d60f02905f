"""Parameters and stream groups that the personalities of ArduPilot share."""

from __future__ import annotations

from importlib import resources

from mavlink_sitl.autopilot.parameters import ParameterSpec, ParameterType
from mavlink_sitl.autopilot.personality import BootStep, SavedStep
from mavlink_sitl.autopilot.personality.parameters import table

_INT8 = ParameterType.INT8
_INT32 = ParameterType.INT32

HEIGHT_FENCE = (
    ParameterSpec("FENCE_ALT_MAX", 100.0),
    ParameterSpec("FENCE_ALT_MIN", -10.0),
)
"""Of those that leave the ground"""
SIM_WIND = (
    ParameterSpec("SIM_WIND_DIR", 180.0),
    ParameterSpec("SIM_WIND_SPD", 0.0),
)
"""Of those that the wind moves"""
COMMON = table("ardupilot")
"""Of every vehicle type"""


STREAMS: dict[str, tuple[int, ...]] = {
    "raw_sensors": (27, 116, 129, 29, 137),
    "extended_status": (1, 125, 152, 42, 24, 62, 162, 87),
    "rc_channels": (36, 65),
    "raw_controller": (),
    "position": (33, 32),
    "extra1": (30, 164, 178),
    "extra2": (74,),
    "extra3": (163, 168, 132, 2, 136, 147, 192, 191, 193, 241),
}
"""The message ids of each stream group, as far as the messages are simulated"""
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
    """REQUEST_DATA_STREAM: message ids by stream id; 0 is all of them."""
    by_id = {
        STREAM_IDS[name]: (*messages, *more.get(name, ())) for name, messages in STREAMS.items()
    }
    return {0: tuple(m for messages in by_id.values() for m in messages), **by_id}


def boot(name: str) -> tuple[BootStep, ...]:
    """The texts of the firmware while it starts, by time; from `boot/NAME.txt`."""
    text = resources.files(__package__).joinpath("boot", f"{name}.txt").read_text("utf-8")
    lines = (line.split(" ", 1) for line in text.splitlines() if not line.startswith("#"))
    return tuple(BootStep(float(at_s), said) for at_s, said in lines)


BAROMETERS = (("BARO1_GND_PRESS", 94502.8), ("BARO2_GND_PRESS", 94502.5))
_SENSOR_IDS = (
    ("INS_GYR_ID", 2752772.0),
    ("INS_ACC_ID", 2753028.0),
    ("INS_GYR2_ID", 2752780.0),
    ("INS_ACC2_ID", 2753036.0),
)
_GYROSCOPES = (("", "1", 2752772.0), ("2", "2", 2752780.0), ("3", "", 0.0))
"""In the names of offsets, in that of the temperature, and the id; the third one is not there"""


def _gyroscopes(at_s: float) -> list[SavedStep]:
    """The calibration of the gyroscopes at a time, seconds after power-up."""
    found: list[SavedStep] = []
    for place, warm, number in _GYROSCOPES:
        found += [
            SavedStep(at_s, f"INS_GYR{place}OFFS_{axis}", 2e-5 if warm else 0.0) for axis in "XYZ"
        ]
        found.append(SavedStep(at_s, f"INS_GYR{place}_ID", number, _INT32))
        if warm:
            found.append(SavedStep(at_s, f"INS_GYR{warm}_CALTEMP", 25.02))
    return found


GYROSCOPES = tuple(_gyroscopes(0.0))
"""The parameters that a calibration of the gyroscopes saves"""


def saved(
    barometers_s: float, source_s: float, calibrations_s: tuple[float, float] | None = None
) -> tuple[SavedStep, ...]:
    """The parameters that are saved while starting; times are seconds after power-up.

    Args:
        barometers_s: when the pressure on the ground is measured.
        source_s: when the source of the estimator's position is chosen.
        calibrations_s: when inertial sensors are found, and when the gyroscopes are calibrated;
            None where no recording shows it.
    """
    found = [SavedStep(barometers_s, name, value) for name, value in BAROMETERS]
    if calibrations_s is not None:
        found += _calibrations(*calibrations_s)
    return (*found, SavedStep(source_s, "EK3_SRC1_POSXY", 3.0, _INT8))


def _calibrations(ids_s: float, gyroscopes_s: float) -> list[SavedStep]:
    """The saved ids of the inertial sensors, and the calibration of the gyroscopes.

    Args:
        ids_s: when they are found, seconds after power-up.
        gyroscopes_s: when they are calibrated.
    """
    found = [SavedStep(ids_s, name, value, _INT32) for name, value in _SENSOR_IDS]
    return found + _gyroscopes(gyroscopes_s)


RATES, ATTITUDE, YAW, HEIGHT, PLACE = 0x400, 0x800, 0x1000, 0x2000, 0x4000
"""Of SYS_STATUS: what is controlled"""
LEVEL = RATES | ATTITUDE
DRIVEN = LEVEL | YAW | PLACE
FLOWN = DRIVEN | HEIGHT
