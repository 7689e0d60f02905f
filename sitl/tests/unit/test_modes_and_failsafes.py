"""Modes and failsafes as the real ArduCopter was observed to fly them."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    ALT_HOLD,
    BRAKE,
    FAILED,
    GUIDED,
    LAND,
    LOITER,
    POSITION,
    RTL,
    STABILIZE,
    VELOCITY,
    GroundStation,
    copter,
    flying,
)


def mode(station: GroundStation) -> int:
    return station.vehicle.firmware.mode.spec.number


def north_at(station: GroundStation, speed: float) -> None:
    """Fly north at a speed."""
    station.stream(6.0, 10.0, lambda: station.setpoint(VELOCITY, velocity=(speed, 0.0, 0.0)))


def throttle(station: GroundStation, raw: int) -> None:
    station.send(mav.MAVLink_rc_channels_override_message(1, 1, 0, 0, raw, 0, 0, 0, 0, 0))


# LOITER, ALT_HOLD, POSHOLD, STABILIZE.


def test_loiter_without_rc_sinks_at_2_5_m_s() -> None:
    station = flying(20.0)
    station.mode(LOITER)
    station.run(3.0)
    assert station.velocity[2] == pytest.approx(2.5, abs=0.1)


def test_loiter_hovers_with_the_throttle_in_the_middle() -> None:
    station = flying(10.0)
    station.mode(LOITER)
    station.stream(10.0, 2.0, lambda: throttle(station, 1500))
    assert station.position == pytest.approx((0.0, 0.0, -10.0), abs=0.3)


def test_an_override_runs_out_after_3_s() -> None:
    station = flying(20.0)
    station.mode(LOITER)
    throttle(station, 1500)
    station.run(2.8)
    assert station.velocity[2] == pytest.approx(0.0, abs=0.1)
    station.run(2.0)
    assert station.velocity[2] > 2.0


def test_rc_channels_shows_the_override_and_its_release() -> None:
    station = flying(5.0)
    station.interval(65, 10.0)
    throttle(station, 1500)
    station.run(0.2)
    assert station.last("RC_CHANNELS").chan3_raw == 1500
    throttle(station, 0)
    station.run(0.2)
    assert station.last("RC_CHANNELS").chan3_raw == 1000


def test_an_override_from_another_system_than_the_ground_station_does_not_count() -> None:
    station = flying(20.0)
    other = GroundStation(station.simulation, system=42)
    station.mode(LOITER)
    throttle(other, 1500)
    station.run(3.0)
    assert station.velocity[2] > 2.0


@pytest.mark.parametrize("number", [LOITER, ALT_HOLD, 16])
def test_the_throttle_climbs_and_sinks_where_height_is_held(number: int) -> None:
    station = flying(10.0)
    station.vehicle.pilot_throttle(2000)
    assert station.mode(number) == ACCEPTED
    station.run(3.0)
    assert station.velocity[2] == pytest.approx(-2.5, abs=0.1)


def test_stabilize_with_the_throttle_low_falls() -> None:
    station = flying(20.0)
    station.mode(STABILIZE)
    station.run(1.0)
    assert station.velocity[2] > 5.0


def test_loiter_on_the_ground_stays_armed_for_disarm_delay_then_disarms() -> None:
    station = flying(5.0)
    station.mode(LOITER)
    station.run_until(lambda: station.vehicle.firmware.landed, 15.0)
    took = station.run_until(lambda: not station.vehicle.firmware.armed, 20.0)
    assert took == pytest.approx(10.0, abs=0.3)


# BRAKE, LAND.


def test_brake_from_3_7_m_s_stops_within_5_s_and_6_6_m_then_holds() -> None:
    station = flying(10.0)
    north_at(station, 3.7)
    begin = station.position[0]
    assert station.mode(BRAKE) == ACCEPTED
    took = station.run_until(lambda: math.hypot(*station.velocity) < 0.1, 10.0)
    assert took < 6.0
    assert station.position[0] - begin == pytest.approx(6.6, abs=1.0)
    stopped = station.position
    station.run(10.0)
    assert station.position == pytest.approx(stopped, abs=0.5)


def test_land_is_slow_below_10_m_and_takes_the_recorded_time() -> None:
    """10 m take about 23 s from the command to disarming, at 0.5 m/s."""
    station = flying(10.0)
    station.mode(LAND)
    station.run(4.0)
    assert station.velocity[2] == pytest.approx(0.5, abs=0.05)
    took = station.run_until(lambda: not station.vehicle.firmware.armed, 40.0) + 4.0
    assert took == pytest.approx(23.0, abs=2.0)


def test_land_is_fast_above_10_m() -> None:
    station = flying(25.0)
    station.mode(LAND)
    station.run(4.0)
    assert station.velocity[2] == pytest.approx(1.5, abs=0.1)


def test_land_on_the_ground_while_armed_disarms() -> None:
    station = copter().ready()
    station.mode(GUIDED)
    station.arm()
    station.mode(LAND)
    station.run(1.0)
    assert not station.vehicle.firmware.armed


# RTL.


def test_rtl_climbs_to_15_m_returns_waits_and_lands() -> None:
    station = flying(10.0)
    station.setpoint(POSITION, (30.0, 10.0, -10.0))
    station.run(15.0)
    assert station.mode(RTL) == ACCEPTED
    highest = fastest = 0.0
    while station.vehicle.firmware.armed:
        station.run(0.1)
        highest = max(highest, -station.position[2])
        fastest = max(fastest, math.hypot(*station.velocity[:2]))
        assert station.now_s < 150.0
    assert highest == pytest.approx(15.0, abs=0.3)
    assert 5.0 < fastest < 6.5, "5.2 m/s recorded on a way of 27 m"
    assert station.position == pytest.approx((0.0, 0.0, 0.0), abs=1.0)


def test_rtl_from_higher_up_stays_there() -> None:
    station = flying(20.0)
    station.setpoint(POSITION, (30.0, 0.0, -20.0))
    station.run(15.0)
    station.mode(RTL)
    station.run(8.0)
    assert station.position[2] == pytest.approx(-20.0, abs=0.3)


def test_rtl_close_to_home_climbs_less() -> None:
    """RTL_CONE_SLOPE: three times the distance."""
    station = flying(3.0)
    station.setpoint(POSITION, (2.0, 0.0, -3.0))
    station.run(8.0)
    station.mode(RTL)
    highest = 0.0
    for _ in range(80):
        station.run(0.1)
        highest = max(highest, -station.position[2])
    assert highest == pytest.approx(6.0, abs=0.4)


def test_guided_may_be_chosen_out_of_rtl() -> None:
    station = flying(10.0)
    station.mode(RTL)
    station.run(2.0)
    assert station.mode(GUIDED) == ACCEPTED
    station.run(3.0)
    assert math.hypot(*station.velocity) < 0.3


# The pilot.


def test_a_mode_change_by_the_pilot_is_reported_at_once_and_without_an_ack() -> None:
    station = flying(10.0)
    station.log.clear()
    assert station.vehicle.pilot_mode_change("LOITER")
    station.read()
    assert [(m.get_type(), m.custom_mode) for _, m in station.log] == [("HEARTBEAT", LOITER)]


def test_a_mode_that_does_not_exist_is_an_error_of_the_test() -> None:
    with pytest.raises(ValueError, match="no mode 'HOVER'; there are: STABILIZE"):
        copter().vehicle.pilot_mode_change("HOVER")


# Battery.

BATTERY = {
    "BATT_LOW_VOLT": 10.8,
    "BATT_CRT_VOLT": 10.2,
    "BATT_LOW_TIMER": 3.0,
    "BATT_FS_LOW_ACT": 2.0,
    "BATT_FS_CRT_ACT": 1.0,
}


def test_a_low_battery_returns_and_a_critical_one_lands() -> None:
    station = flying(10.0, BATTERY)
    station.setpoint(POSITION, (25.0, 0.0, -10.0))
    station.run(12.0)
    station.vehicle.set_battery_voltage(10.6)
    station.run(2.8)
    assert mode(station) == GUIDED, "BATT_LOW_TIMER is 3 s"
    station.run(1.0)
    assert mode(station) == RTL
    low, failsafe = station.texts()[-2:]
    assert low.startswith("Battery 1 is low 10.60V used ")
    assert low.endswith(" mAh")
    assert failsafe == "Battery Failsafe"
    station.run(1.0)
    assert station.last("HEARTBEAT").system_status == mav.MAV_STATE_CRITICAL
    assert station.last("BATTERY_STATUS").charge_state == 2
    health = station.last("SYS_STATUS").onboard_control_sensors_health
    assert not health & mav.MAV_SYS_STATUS_SENSOR_BATTERY
    # It does not follow the voltage.
    assert station.last("BATTERY_STATUS").battery_remaining > 85
    assert station.mode(GUIDED) == ACCEPTED
    station.run(2.0)
    assert mode(station) == GUIDED
    station.vehicle.set_battery_voltage(10.0)
    station.run(3.5)
    assert mode(station) == LAND
    assert station.texts()[-2].startswith("Battery 1 is critical 10.00V used ")
    height = station.position[2]
    station.run(3.5)
    assert station.position[2] == pytest.approx(height, abs=0.5), "it waits 4 s before it sinks"
    station.run_until(lambda: not station.vehicle.firmware.armed, 60.0)
    station.run(1.5)
    assert station.last("BATTERY_STATUS").charge_state == 3
    assert station.last("HEARTBEAT").system_status == mav.MAV_STATE_CRITICAL
    station.mode(GUIDED)
    assert station.arm() == FAILED
    assert station.texts()[-2:] == [
        "Arm: Battery 1 low voltage failsafe",
        "Arm: Battery failsafe",
    ]


def test_a_short_dip_of_the_voltage_is_nothing() -> None:
    station = flying(10.0, BATTERY)
    station.vehicle.set_battery_voltage(10.0)
    station.run(2.0)
    station.vehicle.set_battery_voltage(0.0)
    station.run(10.0)
    assert mode(station) == GUIDED


def test_the_voltage_can_be_set_by_parameter_as_in_the_real_simulator() -> None:
    station = flying(5.0, BATTERY)
    station.send(mav.MAVLink_param_set_message(1, 1, b"SIM_BATT_VOLTAGE", 10.6, 9))
    station.run(4.0)
    assert mode(station) == RTL


def test_battery_by_charge() -> None:
    station = flying(5.0, {"BATT_LOW_MAH": 500.0, "BATT_FS_LOW_ACT": 1.0, "BATT_LOW_TIMER": 1.0})
    station.vehicle.set_battery_remaining(0.04)
    station.run(2.0)
    assert mode(station) == LAND
    assert station.last("BATTERY_STATUS").battery_remaining == pytest.approx(4, abs=1)


@pytest.mark.night
def test_hover_draws_what_was_recorded() -> None:
    station = flying(10.0)
    station.run(5.0)
    start = station.last("BATTERY_STATUS")
    assert start.current_battery == pytest.approx(2770, abs=60), "27.7 A"
    station.run(60.0)
    end = station.last("BATTERY_STATUS")
    assert end.current_consumed - start.current_consumed == pytest.approx(462, abs=15)
    assert end.voltages[0] < start.voltages[0] < 12600
    assert end.energy_consumed > start.energy_consumed


# The ground station.


def test_gcs_failsafe_returns_5_s_after_the_last_heartbeat_and_clears() -> None:
    station = flying(10.0, {"FS_GCS_ENABLE": 1.0})
    station.setpoint(POSITION, (20.0, 0.0, -10.0))
    station.heartbeats(True)
    station.run(10.0)
    station.heartbeats(False)
    # Setpoints are no sign of a ground station.
    stream = 0.0
    while mode(station) == GUIDED and stream < 7.0:
        station.setpoint(POSITION, (20.0, 0.0, -10.0))
        station.run(0.1)
        stream += 0.1
    assert 4.0 < stream <= 5.2
    assert mode(station) == RTL
    assert station.texts()[-1] == "GCS Failsafe"
    station.run(1.0)
    assert station.last("HEARTBEAT").system_status == mav.MAV_STATE_CRITICAL
    station.heartbeats(True)
    station.run(2.0)
    assert station.texts()[-1] == "GCS Failsafe Cleared"
    assert mode(station) == RTL
    assert station.last("HEARTBEAT").system_status == mav.MAV_STATE_ACTIVE


def test_without_fs_gcs_enable_silence_means_nothing() -> None:
    station = flying(10.0)
    station.heartbeats(True)
    station.run(5.0)
    station.heartbeats(False)
    station.run(20.0)
    assert mode(station) == GUIDED


def test_circle_goes_round_a_place_ahead_with_the_nose_to_it() -> None:
    station = flying(5.0)
    nose = float(station.simulation.truth.yaw_rad[0])
    centre = (10.0 * math.cos(nose), 10.0 * math.sin(nose))
    assert station.mode(7) == ACCEPTED
    station.run(9.0)
    turned, before = 0.0, None
    for _ in range(11):
        north, east, down = station.position
        assert math.dist((north, east), centre) == pytest.approx(10.0, abs=1.2)
        assert down == pytest.approx(-5.0, abs=0.4)
        angle = math.atan2(east - centre[1], north - centre[0])
        yaw = float(station.simulation.truth.yaw_rad[0])
        assert abs(math.remainder(angle + math.pi - yaw, math.tau)) < 0.4
        turned += 0.0 if before is None else math.remainder(angle - before, math.tau)
        before = angle
        station.run(1.0)
    assert math.degrees(turned) == pytest.approx(200.0, abs=25.0), "CIRCLE_RATE is 20 degrees/s"


def test_throw_is_entered_disarmed_only() -> None:
    station = copter().ready()
    assert station.mode(18) == ACCEPTED
    assert station.last("HEARTBEAT").base_mode == 0x51
    station.mode(GUIDED)
    station.arm()
    assert station.mode(18) == FAILED
    assert "Mode change to THROW failed: init failed" in station.texts()
