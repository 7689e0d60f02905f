"""Rules observed on the real ArduPilot before it has a position and after it loses it."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    ALT_HOLD,
    FAILED,
    GUIDED,
    LAND,
    STABILIZE,
    GroundStation,
    copter,
    flying,
)
from sitl_support.px4_station import flying_px4

READY_AFTER_S = 41.64


def starting() -> GroundStation:
    """A copter that starts as slowly as the real one, with streams on from the beginning."""
    station = copter(ready_after_s=READY_AFTER_S)
    for message_id in (1, 2, 24, 32, 33, 147, 193, 242):
        assert station.interval(message_id, 4.0) == ACCEPTED
    return station


def test_global_position_is_zero_before_the_gps() -> None:
    station = starting()
    station.run(5.0)
    message = station.last("GLOBAL_POSITION_INT")
    assert (message.lat, message.lon, message.alt, message.relative_alt) == (0, 0, 0, 0)
    station.run(7.0)
    assert station.last("GLOBAL_POSITION_INT").lat == pytest.approx(-353632610, abs=10)


def test_gps_raw_before_the_gps() -> None:
    station = starting()
    station.run(5.0)
    message = station.last("GPS_RAW_INT")
    assert (message.fix_type, message.eph, message.epv) == (0, 65535, 65535)
    station.run(7.0)
    message = station.last("GPS_RAW_INT")
    assert (message.fix_type, message.satellites_visible) == (6, 10)


def test_no_date_before_the_gps() -> None:
    station = starting()
    station.run(5.0)
    assert station.last("SYSTEM_TIME").time_unix_usec == 0
    station.run(7.0)
    assert station.last("SYSTEM_TIME").time_unix_usec > 1.7e15


def test_local_position_starts_only_when_the_ekf_uses_gps() -> None:
    station = starting()
    station.run(41.0)
    assert station.messages("LOCAL_POSITION_NED") == []
    station.run(1.5)
    assert station.messages("LOCAL_POSITION_NED")
    assert "EKF3 IMU0 is using GPS" in station.texts()


def test_a_start_longer_than_the_firmware_s_says_that_it_uses_gps_when_it_does() -> None:
    station = copter(ready_after_s=60.0)
    station.interval(32, 10.0)
    station.run(59.0)
    assert "EKF3 IMU0 origin set" in station.texts()
    assert "EKF3 IMU0 is using GPS" not in station.texts()
    assert station.messages("LOCAL_POSITION_NED") == []
    station.run(1.5)
    assert station.texts()[-2:] == ["EKF3 IMU0 is using GPS", "EKF3 IMU1 is using GPS"]
    assert station.messages("LOCAL_POSITION_NED")


def test_battery_status_until_ready() -> None:
    station = starting()
    station.run(1.0)
    battery = station.last("BATTERY_STATUS")
    assert list(battery.voltages) == [65535] * 10
    assert battery.battery_remaining == -1
    assert battery.charge_state == mav.MAV_BATTERY_CHARGE_STATE_UNHEALTHY == 6
    status = station.last("SYS_STATUS")
    assert (status.voltage_battery, status.current_battery, status.battery_remaining) == (0, -1, -1)
    station.run(3.0)
    battery = station.last("BATTERY_STATUS")
    assert list(battery.voltages) == [12600] + [65535] * 9
    assert (battery.battery_remaining, battery.charge_state) == (100, 1)
    assert station.last("SYS_STATUS").voltage_battery == 12600


def test_home_position_comes_with_the_origin_and_its_q_is_nan() -> None:
    station = starting()
    station.run(19.0)
    assert station.messages("HOME_POSITION") == []
    station.run(2.0)
    home = station.last("HOME_POSITION")
    assert (home.latitude, home.longitude) == pytest.approx((-353632610, 1491652300), abs=10)
    assert home.altitude == pytest.approx(584000, abs=100)
    assert all(math.isnan(q) for q in home.q)
    assert station.messages("GPS_GLOBAL_ORIGIN")


def test_ekf_flags_while_starting() -> None:
    station = starting()
    station.run(43.0)
    assert station.changes("EKF_STATUS_REPORT", "flags") == [0x400, 0, 0xA7, 0x33F]


def test_system_status_is_boot_then_standby() -> None:
    station = starting()
    station.run(5.0)
    assert station.changes("HEARTBEAT", "system_status") == [
        mav.MAV_STATE_BOOT,
        mav.MAV_STATE_STANDBY,
    ]


def test_first_heartbeat_a_second_after_power_up() -> None:
    station = starting()
    station.run(0.9)
    assert station.messages("HEARTBEAT") == []
    station.run(0.2)
    assert len(station.messages("HEARTBEAT")) == 1


def test_sys_status_bits_as_recorded() -> None:
    station = starting()
    station.run(45.0)
    seen = []
    for message in station.messages("SYS_STATUS"):
        bits = (
            message.onboard_control_sensors_present,
            message.onboard_control_sensors_enabled,
            message.onboard_control_sensors_health,
        )
        if bits not in seen:
            seen.append(bits)
    assert seen[0] == (0x5331FC0F, 0x52019C0F, 0x45119C0B)
    # The prearm bit (0x10000000) is set as soon as STABILIZE may be armed.
    assert seen[-1] == (0x5371FC2F, 0x52619C2F, 0x57719C2F)
    station.mode(GUIDED)
    station.arm()
    station.run(0.5)
    status = station.last("SYS_STATUS")
    assert status.onboard_control_sensors_enabled == 0x5361FC2F
    assert status.onboard_control_sensors_health == 0x5771FC2F


def test_guided_is_accepted_before_the_ekf_is_ready_when_disarmed() -> None:
    station = starting()
    station.run(10.0)
    assert station.mode(GUIDED) == ACCEPTED


def test_a_mode_chosen_before_the_start_is_over_is_forgotten() -> None:
    station = starting()
    station.run(1.1)
    assert station.mode(GUIDED) == ACCEPTED
    station.run(2.0)
    assert station.changes("HEARTBEAT", "custom_mode") == [STABILIZE, GUIDED, STABILIZE]


def test_arming_in_guided_without_a_position_fails_with_one_text_per_reason() -> None:
    station = starting()
    station.run(15.0)
    station.mode(GUIDED)
    assert station.arm() == FAILED
    assert station.texts()[-2:] == ["Arm: Gyros inconsistent", "Arm: AHRS: waiting for home"]
    assert {m.severity for m in station.messages("STATUSTEXT")[-2:]} == {2}


def test_arming_right_after_power_up_fails_with_the_recorded_texts() -> None:
    station = starting()
    station.run(1.1)
    station.mode(GUIDED)
    assert station.arm() == FAILED
    assert station.texts() == [
        "Arm: Need Alt Estimate",
        "Arm: Hardware safety switch",
        "Arm: Gyros not healthy",
        "Arm: EKF attitude is bad",
        "Arm: Compass not healthy",
        "Arm: AHRS: waiting for home",
        "Arm: Battery 1 unhealthy",
    ]


def test_failing_checks_are_said_every_30_s() -> None:
    station = starting()
    station.run(5.0)
    station.mode(GUIDED)
    station.run(34.0)
    assert station.texts().count("PreArm: Need Position Estimate") == 1


# Losing the GPS in flight.


def test_gps_loss_leads_to_land_after_8_s_and_ends_the_local_position_after_15_s() -> None:
    station = flying()
    station.interval(24, 4.0)
    station.interval(193, 4.0)
    lost_s = station.now_s
    station.vehicle.lose_gps()
    station.run(4.0)
    raw = station.messages("GPS_RAW_INT", lost_s + 1.0)
    assert {m.fix_type for m in raw} == {1}
    assert len({m.time_usec for m in raw}) == 1
    assert len({(m.lat, m.lon) for m in raw}) > 1, "the position keeps moving"
    took = station.run_until(lambda: station.vehicle.firmware.mode.spec.number == LAND, 10.0)
    assert took + 4.0 == pytest.approx(8.0, abs=0.3)
    assert station.texts(lost_s)[-2:] == ["EKF variance", "EKF Failsafe: changed to LAND Mode"]
    station.run(1.5)
    assert station.last("HEARTBEAT").system_status == mav.MAV_STATE_CRITICAL
    assert station.last("EKF_STATUS_REPORT").flags == 0x25
    # GPS and AHRS stay healthy in SYS_STATUS, as observed.
    assert station.last("SYS_STATUS").onboard_control_sensors_health & 0x00200020 == 0x00200020
    station.run(6.0)
    assert station.last("EKF_STATUS_REPORT").flags == 0xA7
    count = len(station.messages("LOCAL_POSITION_NED"))
    frozen = station.messages("GLOBAL_POSITION_INT", station.now_s - 0.2)[-1]
    station.run(3.0)
    assert len(station.messages("LOCAL_POSITION_NED")) == count
    latest = station.last("GLOBAL_POSITION_INT")
    assert (latest.lat, latest.lon) == (frozen.lat, frozen.lon)
    assert latest.relative_alt != frozen.relative_alt
    assert station.texts()[-2:] == ["EKF3 IMU0 stopped aiding", "EKF3 IMU1 stopped aiding"]
    station.vehicle.restore_gps()
    station.run(2.0)
    assert len(station.messages("LOCAL_POSITION_NED")) > count
    using = [f"EKF3 IMU{number} is using GPS" for number in (0, 1)]
    assert station.texts()[-3:] == [*using, "EKF Failsafe Cleared"]


@pytest.mark.parametrize(
    ("action", "mode", "text"),
    [
        (0, GUIDED, "EKF Failsafe"),
        (1, LAND, "EKF Failsafe: changed to LAND Mode"),
        (2, ALT_HOLD, "EKF Failsafe: changed to ALT_HOLD Mode"),
        (3, LAND, "EKF Failsafe: changed to LAND Mode"),
    ],
)
def test_fs_ekf_action_says_what_a_lost_position_does(action: int, mode: int, text: str) -> None:
    station = flying(parameters={"FS_EKF_ACTION": float(action)})
    station.vehicle.lose_gps()
    station.run(8.5)
    assert station.vehicle.firmware.mode.spec.number == mode
    assert station.texts()[-2:] == ["EKF variance", text]
    assert station.last("HEARTBEAT").system_status == mav.MAV_STATE_CRITICAL


def test_only_3_lands_from_a_mode_that_needs_no_position() -> None:
    for action, mode in ((1, ALT_HOLD), (3, LAND)):
        station = flying(30.0, parameters={"FS_EKF_ACTION": float(action)})
        station.mode(ALT_HOLD)
        station.vehicle.lose_gps()
        station.run(8.5)
        assert station.vehicle.firmware.mode.spec.number == mode


def test_guided_without_a_position_is_rejected_in_the_air_and_land_continues() -> None:
    station = flying()
    station.vehicle.lose_gps()
    station.run_until(lambda: station.vehicle.firmware.mode.spec.number == LAND, 10.0)
    assert station.mode(GUIDED) == FAILED
    assert station.texts()[-1] == "Mode change to GUIDED failed: requires position"
    assert station.vehicle.firmware.mode.spec.number == LAND


def test_a_short_gps_outage_changes_nothing() -> None:
    station = flying()
    station.vehicle.lose_gps()
    station.run(5.0)
    station.vehicle.restore_gps()
    station.run(10.0)
    assert station.vehicle.firmware.mode.spec.number == GUIDED
    north, east, _ = station.position
    assert math.hypot(north, east) < 1.0


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_after_a_long_outage_the_position_is_the_receivers_at_once(seed: int) -> None:
    """As "is using GPS" says: the estimate that had gone astray is reset."""
    station = copter(seed=seed).ready()
    station.interval(32, 4.0)
    station.vehicle.lose_gps()
    station.run(60.0)
    station.vehicle.restore_gps()
    station.run(3.0)
    told, true = station.last("LOCAL_POSITION_NED"), station.position
    assert math.hypot(told.x - true[0], told.y - true[1]) < 1.5


@pytest.mark.parametrize(
    ("fly", "outage_s", "after_s"),
    [(flying, 9.0, 0.3), (flying, 12.0, 0.3), (flying_px4, 12.0, 1.2)],
)
def test_as_flown_by_the_real_ones_an_estimate_gone_astray_comes_back_in_one_step(
    fly: Callable[[], GroundStation], outage_s: float, after_s: float
) -> None:
    """ArduCopter with a biased accelerometer: 6.5 m after 6 s, 11.6 m after 12 s; PX4: 35 m."""
    station = fly()
    station.interval(32, 50.0)
    station.vehicle.lose_gps()
    station.run(outage_s)
    told, true = station.last("LOCAL_POSITION_NED"), station.position
    astray_m = math.dist((told.x, told.y), true[:2])
    assert astray_m > 1.2
    since_s = station.now_s
    station.vehicle.restore_gps()
    station.run(after_s - 0.1)
    assert len(station.messages("LOCAL_POSITION_NED", since_s)) > 3
    assert steps_m(station, since_s) < 0.5, "it has not come back yet"
    station.run(0.3)
    assert steps_m(station, since_s) == pytest.approx(astray_m, rel=0.2)
    places = station.messages("LOCAL_POSITION_NED", since_s)
    assert max(math.hypot(m.vx, m.vy) for m in places) < 2.0


def steps_m(station: GroundStation, since_s: float) -> float:
    """The farthest step of the reported position from one message to the next."""
    places = station.messages("LOCAL_POSITION_NED", since_s)
    return max(math.dist((a.x, a.y), (b.x, b.y)) for a, b in pairwise(places))
