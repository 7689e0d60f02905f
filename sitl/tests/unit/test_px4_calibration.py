"""PREFLIGHT_CALIBRATION of PX4: the texts that QGroundControl and MAVSDK follow."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    DENIED,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
)
from sitl_support.px4_station import Px4Station, ready_px4

CALIBRATE = mav.MAV_CMD_PREFLIGHT_CALIBRATION
GYRO, MAG, BARO, RADIO, ACCEL, AIRSPEED, ESC = range(7)
CALIBRATING, STANDBY = mav.MAV_STATE_CALIBRATING, mav.MAV_STATE_STANDBY


def calibrate(ground: Px4Station, what: int, kind: float = 1.0) -> int:
    params = [0.0] * 7
    params[what] = kind
    return ground.command(CALIBRATE, *params)


def listening() -> Px4Station:
    """The vehicle hears a ground station: only such a link gets texts."""
    ground = ready_px4()
    ground.gcs_heartbeat()
    return ground


def heard(ground: Px4Station, seconds: float) -> list[str]:
    """The texts of the calibration, while a ground station is heard."""
    for _ in range(int(seconds)):
        ground.gcs_heartbeat()
        ground.run(1.0)
    return [text for text in ground.texts() if text.startswith("[cal] ")]


@pytest.mark.parametrize(
    ("what", "kind", "name"),
    [(GYRO, 1.0, "gyro"), (ACCEL, 2.0, "level"), (BARO, 1.0, "baro")],
)
def test_what_needs_no_turning_is_done(what: int, kind: float, name: str) -> None:
    ground = listening()
    assert calibrate(ground, what, kind) == ACCEPTED
    said = heard(ground, 8)
    assert said[0] == f"[cal] calibration started: 2 {name}"
    assert said[-1] == f"[cal] calibration done: {name}"
    shown = [int(text.split("<")[1].rstrip(">")) for text in said[1:-1]]
    assert shown == sorted(shown)
    assert shown[-1] == 100


@pytest.mark.wide
@pytest.mark.parametrize(
    ("what", "name", "within_s", "last"),
    [
        (ACCEL, "accel", 45, ["timeout: no motion", "accel"]),
        (MAG, "mag", 15, ["mag"]),
        (AIRSPEED, "airspeed", 38, ["airspeed"]),
    ],
)
def test_what_needs_hands_or_air_fails_and_says_so(
    what: int, name: str, within_s: float, last: list[str]
) -> None:
    ground = listening()
    assert calibrate(ground, what) == ACCEPTED
    said = heard(ground, within_s)
    assert said[0] == f"[cal] calibration started: 2 {name}"
    assert said[-len(last) :] == [f"[cal] calibration failed: {why}" for why in last]
    if what != AIRSPEED:
        assert "[cal] pending: back front left right up down" in said
        assert "[cal] down orientation detected" in said


def test_while_it_calibrates_it_says_so_and_does_neither_arm_nor_begin_another() -> None:
    ground = listening()
    assert calibrate(ground, ACCEL) == ACCEPTED
    heard(ground, 2)
    assert ground.last("HEARTBEAT").system_status == CALIBRATING
    assert calibrate(ground, GYRO) == TEMPORARILY_REJECTED
    assert ground.arm() == TEMPORARILY_REJECTED
    assert ground.command(CALIBRATE) == ACCEPTED
    assert heard(ground, 3)[-1] == "[cal] calibration cancelled"
    assert ground.last("HEARTBEAT").system_status == STANDBY
    assert ground.arm() == ACCEPTED
    assert calibrate(ground, GYRO) == TEMPORARILY_REJECTED


def test_the_radio_and_the_motors() -> None:
    ground = listening()
    assert calibrate(ground, RADIO) == ACCEPTED
    assert ground.command(CALIBRATE) == ACCEPTED
    radio = [text for text in ground.texts() if "RC input" in text]
    assert radio == ["Calibration: Disabling RC input\t", "Calibration: Restoring RC input\t"]
    assert calibrate(ground, ESC) == DENIED
    assert "".join(ground.texts()[-2:]) == (
        "[cal] calibration failed: Disconnect battery and try again"
    )
    assert calibrate(ground, GYRO, 7.0) == UNSUPPORTED
