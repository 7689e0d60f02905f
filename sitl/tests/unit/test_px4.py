"""Observed behaviour of the real PX4 v1.17; each rule is a test that names it."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.command_line.options import parse
from mavlink_sitl.config import ConfigurationError
from sitl_support.ground_station import (
    ACCEPTED,
    DENIED,
    FAILED,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
    Message,
)
from sitl_support.missions import take_off, upload, waypoint
from sitl_support.px4_station import (
    HOME,
    NAN,
    Px4Station,
    bytewise,
    flying_px4,
    near_home,
    px4_copter,
    ready_px4,
)

ARM = mav.MAV_CMD_COMPONENT_ARM_DISARM
SET_MODE = mav.MAV_CMD_DO_SET_MODE


@pytest.fixture
def ground() -> Px4Station:
    """On the ground, ready, disarmed, in AUTO.LOITER."""
    return ready_px4()


@pytest.fixture
def air() -> Px4Station:
    """In OFFBOARD, 10 m above home; the stream has just been sent."""
    return flying_px4()


# Modes.


def test_it_starts_in_auto_loiter_without_a_receiver(ground: Px4Station) -> None:
    beat = ground.last("HEARTBEAT")
    assert (beat.autopilot, beat.type) == (12, 2)
    assert (beat.custom_mode, beat.base_mode, beat.system_status) == (0x03040000, 29, 3)


def test_do_set_mode_gets_two_acknowledgements_and_the_second_is_the_verdict(
    air: Px4Station,
) -> None:
    assert air.command_results(SET_MODE, 1, 4, 3) == [0, 0]
    assert air.command_results(SET_MODE, 1, 4, 99) == [0, 1]
    air.run(1.5)
    assert air.command_results(SET_MODE, 1, 6) == [0, 1]  # no stream
    assert air.command_results(SET_MODE, 1, 4, 4) == [0, 1]  # no mission
    assert air.custom_mode == px4.LOITER


def test_a_main_mode_that_does_not_exist_is_accepted_and_changes_nothing(
    ground: Px4Station,
) -> None:
    assert ground.command_results(SET_MODE, 1, 99) == [0, 0]
    assert ground.custom_mode == px4.LOITER


@pytest.mark.parametrize("number", [px4.OFFBOARD, px4.MISSION, px4.POSCTL, px4.ALTCTL, px4.MANUAL])
def test_disarmed_any_mode_is_accepted_and_cannot_be_armed_in_if_it_cannot_run(
    ground: Px4Station, number: int
) -> None:
    assert ground.mode(number) == ACCEPTED
    ground.run(1.1)
    beat = ground.last("HEARTBEAT")
    assert (beat.custom_mode, beat.system_status) == (number, 0)
    assert ground.arm() == TEMPORARILY_REJECTED


def test_the_base_mode_of_each_mode_is_the_recorded_one(ground: Px4Station) -> None:
    for number, base_mode in ((px4.LOITER, 29), (px4.POSCTL, 81), (px4.MISSION, 29)):
        assert ground.mode(number) == ACCEPTED
        ground.run(1.1)
        assert ground.last("HEARTBEAT").base_mode == base_mode


def test_offboard_controls_nothing_before_the_first_setpoint(ground: Px4Station) -> None:
    """HEARTBEAT.base_mode 1; once there was a setpoint it stays 17 (`offboard_loss_stop`)."""
    assert ground.mode(px4.OFFBOARD) == ACCEPTED
    ground.run(1.1)
    assert ground.last("HEARTBEAT").base_mode == 1
    ground.stream_to(1.5, 0.0, 0.0, -1.0)
    assert ground.last("HEARTBEAT").base_mode == 17
    ground.run(3.0)
    assert ground.last("HEARTBEAT").base_mode == 17


def test_the_old_set_mode_message_gets_one_acknowledgement(ground: Px4Station) -> None:
    answers = ground.send(mav.MAVLink_set_mode_message(1, 1, px4.POSCTL))
    acks = [m for m in answers if m.get_type() == "COMMAND_ACK"]
    assert [(m.command, m.result) for m in acks] == [(SET_MODE, 0)]
    assert ground.custom_mode == px4.POSCTL


def test_the_heartbeat_comes_strictly_once_a_second(ground: Px4Station) -> None:
    begin_s = ground.now_s
    for number in (px4.POSCTL, px4.LOITER, px4.OFFBOARD, px4.LOITER):
        ground.mode(number)
        ground.run(0.25)
    assert len(ground.messages("HEARTBEAT", begin_s + 0.001)) == 1


def test_there_are_26_available_modes_eight_of_them_not_available(ground: Px4Station) -> None:
    answers = ground.send(mav.MAVLink_command_long_message(1, 1, 512, 0, 435, 0, 0, 0, 0, 0, 0))
    modes = [m for m in answers if m.get_type() == "AVAILABLE_MODES"]
    assert [m.mode_index for m in modes] == list(range(1, 27))
    assert {m.number_modes for m in modes} == {26}
    assert sum(m.mode_name == "(Mode not available)" and m.properties == 2 for m in modes) == 8
    assert modes[6].custom_mode == 0x02030000
    assert modes[6].mode_name == "Position Slow"


# Commands.


def test_acknowledgements_name_the_asker(ground: Px4Station) -> None:
    ground.command(mav.MAV_CMD_GET_HOME_POSITION)
    ack = ground.last("COMMAND_ACK")
    assert (ack.target_system, ack.target_component) == (1, 191)


def test_component_0_is_answered_and_another_one_is_met_with_silence(ground: Px4Station) -> None:
    assert ground.command(512, 242, component=0) == ACCEPTED
    assert ground.command(512, 242, component=42) == -1


def test_unknown_things_are_rejected_as_the_real_one_rejects_them(ground: Px4Station) -> None:
    assert ground.command(31999) == UNSUPPORTED
    assert ground.command(512, 9999) == DENIED
    assert ground.command(511, 9999, 100000) == FAILED


def test_a_strange_arming_parameter_gets_a_text_and_no_acknowledgement(ground: Px4Station) -> None:
    ground.gcs_heartbeat()
    assert ground.command(ARM, 5) == -1
    assert ground.texts()[-1] == "Unsupported ARM_DISARM param: 5.000\t"


def test_disarming_in_the_air_is_denied_unless_forced(air: Px4Station) -> None:
    assert air.command(ARM, 0) == TEMPORARILY_REJECTED
    assert air.armed
    assert air.command(ARM, 0, 21196) == ACCEPTED
    assert not air.armed


def test_it_disarms_by_itself_eleven_seconds_after_idle_arming(ground: Px4Station) -> None:
    assert ground.arm() == ACCEPTED
    took_s = ground.run_until(lambda: not ground.armed)
    assert took_s == pytest.approx(11.0, abs=0.3)
    assert ground.custom_mode == px4.LOITER


def test_nav_takeoff_while_disarmed_is_accepted_and_changes_the_mode(ground: Px4Station) -> None:
    assert ground.command(22, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    assert ground.custom_mode == px4.TAKEOFF
    assert not ground.armed


def test_nav_takeoff_climbs_to_mis_takeoff_alt_and_holds(ground: Px4Station) -> None:
    assert ground.command(22, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    assert ground.arm() == ACCEPTED
    ground.run_until(lambda: ground.custom_mode == px4.LOITER)
    ground.run(5.0)
    assert -ground.position[2] == pytest.approx(2.5, abs=0.6)
    assert ground.changes("EXTENDED_SYS_STATE", "landed_state") == [1, 3, 2]


def test_the_frame_of_a_command_int_is_ignored_so_a_relative_takeoff_never_lifts(
    ground: Px4Station,
) -> None:
    ground.gcs_heartbeat()
    assert ground.arm() == ACCEPTED
    assert ground.command_int(22, 6, 0, 0, 0, NAN, z=10.0) == ACCEPTED
    assert "Already higher than takeoff altitude\t" in ground.texts()
    ground.run_until(lambda: not ground.armed, 15.0)
    assert ground.position[2] == pytest.approx(0.0, abs=0.05)


def test_takeoff_altitude_is_above_sea_level(ground: Px4Station) -> None:
    assert ground.command(22, 0, 0, 0, NAN, NAN, NAN, HOME.altitude_amsl_m + 8.0) == ACCEPTED
    assert ground.arm() == ACCEPTED
    ground.run(16.0)
    assert -ground.position[2] == pytest.approx(8.0, abs=0.7)


def test_do_reposition_needs_change_mode(air: Px4Station) -> None:
    x, y = round(HOME.latitude_deg * 1e7), round(HOME.longitude_deg * 1e7)
    assert air.command_int(192, 6, -1, 0, 0, NAN, x=x, y=y, z=500.0) == UNSUPPORTED
    assert air.custom_mode == px4.OFFBOARD
    assert air.command_int(192, 6, -1, 1, 0, NAN, x=x, y=y, z=500.0) == ACCEPTED
    assert air.custom_mode == px4.LOITER


def test_do_reposition_with_a_relative_altitude_descends_to_the_ground(air: Px4Station) -> None:
    x, y = round(HOME.latitude_deg * 1e7), round(HOME.longitude_deg * 1e7)
    assert air.command_int(192, 6, -1, 1, 0, NAN, x=x, y=y, z=15.0) == ACCEPTED
    air.run_until(lambda: not air.armed)
    assert air.position[2] == pytest.approx(0.0, abs=0.05)


def test_do_reposition_flies_to_a_place_above_sea_level(air: Px4Station) -> None:
    x = round((HOME.latitude_deg + 10.0 / 111_195.0) * 1e7)
    y = round(HOME.longitude_deg * 1e7)
    altitude = HOME.altitude_amsl_m + 12.0
    assert air.command_int(192, 0, NAN, 1, NAN, NAN, x=x, y=y, z=altitude) == ACCEPTED
    air.run(14.0)
    assert math.dist(air.position, (10.0, 0.0, -12.0)) < 1.0


def test_do_reposition_disarmed_is_accepted_and_just_changes_the_mode(ground: Px4Station) -> None:
    ground.mode(px4.POSCTL)
    assert ground.command_int(192, 6, -1, 1, 0, NAN, x=0, y=0, z=500.0) == ACCEPTED
    assert ground.custom_mode == px4.LOITER


@pytest.mark.parametrize("command", [16, 176, 178, 192, 400, 511, 512])
def test_nan_in_a_command_is_never_accepted_for_a_number(air: Px4Station, command: int) -> None:
    before = air.position
    results = air.command_results(command, *[NAN] * 7)
    assert ACCEPTED not in results
    air.stream_to(1.0, 0.0, 0.0, -10.0)
    assert math.dist(air.position, before) < 0.5


# OFFBOARD.


def test_offboard_needs_a_stream_before_entry_in_the_air(air: Px4Station) -> None:
    assert air.mode(px4.LOITER) == ACCEPTED
    air.run(1.5)
    assert air.mode(px4.OFFBOARD) == TEMPORARILY_REJECTED
    air.stream_to(0.5, 0.0, 0.0, -10.0)
    assert air.mode(px4.OFFBOARD) == ACCEPTED


def test_two_setpoints_a_second_keep_offboard(air: Px4Station) -> None:
    air.stream(6.0, 2.0, lambda: air.go_to(0.0, 0.0, -10.0))
    assert air.custom_mode == px4.OFFBOARD


def test_a_lost_stream_returns_after_com_of_loss_t_and_a_resumed_one_takes_control_again(
    air: Px4Station,
) -> None:
    air.gcs_heartbeat()
    took_s = air.run_until(lambda: air.custom_mode == px4.RTL)
    assert took_s == pytest.approx(1.0, abs=0.15)
    assert "Failsafe activated\t" in air.texts()
    air.run(2.1)
    beat, mode = air.last("HEARTBEAT"), air.last("CURRENT_MODE")
    assert (beat.custom_mode, beat.system_status) == (px4.RTL, 5)
    assert (mode.custom_mode, mode.intended_custom_mode) == (px4.RTL, px4.OFFBOARD)
    air.stream_to(0.3, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.OFFBOARD
    assert air.vehicle.firmware.system_status == 4


def test_com_obl_rc_act_5_holds_instead() -> None:
    air = flying_px4(parameters={"COM_OBL_RC_ACT": 5})
    air.run(3.0)
    beat = air.last("HEARTBEAT")
    assert (beat.custom_mode, beat.system_status) == (px4.LOITER, 5)
    air.run(6.0)
    air.stream_to(0.3, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.OFFBOARD


def test_com_of_loss_t_is_the_time() -> None:
    air = flying_px4(parameters={"COM_OF_LOSS_T": 3.0})
    air.run(2.5)
    assert air.custom_mode == px4.OFFBOARD
    air.run(1.0)
    assert air.custom_mode == px4.RTL


def test_a_mode_that_somebody_chooses_ends_the_failsafe(air: Px4Station) -> None:
    air.run(2.0)
    assert air.mode(px4.LOITER) == ACCEPTED
    air.stream_to(1.0, 5.0, 0.0, -10.0)
    assert air.custom_mode == px4.LOITER


@pytest.mark.parametrize("frame", [0, 7, 9, 12])
def test_illegal_frames_are_rejected_at_every_message_and_count_as_loss(
    air: Px4Station, frame: int
) -> None:
    air.gcs_heartbeat()
    air.stream(1.5, 10.0, lambda: air.go_to(3.0, 0.0, -10.0, frame=frame))
    text = f"SET_POSITION_TARGET_LOCAL_NED coordinate frame {frame} unsupported\t"
    said = "".join(air.texts())
    assert said.count(text) >= 10
    assert air.custom_mode == px4.RTL


def test_a_mask_that_leaves_nothing_is_invalid_and_counts_as_loss(air: Px4Station) -> None:
    air.gcs_heartbeat()
    air.stream(1.5, 10.0, lambda: air.go_to(3.0, 0.0, -10.0, mask=0xDFF))
    assert "SET_POSITION_TARGET_LOCAL_NED invalid\t" in air.texts()
    assert air.custom_mode == px4.RTL


def whole_setpoint(field: str, value: float) -> Message:
    """10 m up, standing, everything given, but for one field."""
    values = dict.fromkeys(("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz"), 0.0)
    values.update(z=-10.0, yaw=0.0, yaw_rate=0.0)
    values[field] = value
    return mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0, *values.values())


def test_a_rate_beside_a_yaw_is_added_to_the_turn_towards_it(air: Px4Station) -> None:
    """So the nose comes to stand where the turn back is as fast as the rate."""
    steady = whole_setpoint("yaw_rate", 0.0)
    air.stream(4.0, 10.0, lambda: air.send(steady))
    assert air.last("ATTITUDE").yaw == pytest.approx(0.0, abs=0.02)
    turning = whole_setpoint("yaw_rate", 0.3)
    air.stream(4.0, 10.0, lambda: air.send(turning))
    assert air.last("ATTITUDE").yaw == pytest.approx(0.3 / 2.8, abs=0.02)  # MC_YAW_P
    assert air.last("ATTITUDE").yawspeed == pytest.approx(0.0, abs=0.03)


FIELDS = ["x", "vx", "afx", "yaw", "yaw_rate"]


@pytest.mark.parametrize("field", FIELDS)
def test_nan_counts_as_not_given_whatever_the_mask_says(air: Px4Station, field: str) -> None:
    message = whole_setpoint(field, NAN)
    air.stream(1.5, 10.0, lambda: air.send(message))
    assert air.custom_mode == px4.OFFBOARD
    assert math.dist(air.position, (0.0, 0.0, -10.0)) < 0.7


@pytest.mark.parametrize("field", FIELDS)
def test_infinity_in_a_field_that_counts_is_rejected(air: Px4Station, field: str) -> None:
    message = whole_setpoint(field, math.inf)
    air.stream(1.5, 10.0, lambda: air.send(message))
    assert air.custom_mode == px4.RTL


def test_nan_as_yaw_holds_the_heading_on_the_way(air: Px4Station) -> None:
    air.stream(2.0, 10.0, lambda: air.setpoint(0x9F8, (0.0, 0.0, -10.0), yaw=1.0))
    place = (0.0, 6.0, -10.0)
    air.stream(6.0, 10.0, lambda: air.setpoint(0x9F8, place, yaw=NAN))
    assert math.dist(air.position, place) < 0.7
    assert air.last("ATTITUDE").yaw == pytest.approx(1.0, abs=0.05)


def test_nothing_but_nan_is_invalid_and_counts_as_loss(air: Px4Station) -> None:
    air.gcs_heartbeat()
    nothing = (NAN, NAN, NAN)
    air.stream(1.5, 10.0, lambda: air.setpoint(0, nothing, nothing, nothing))
    assert "SET_POSITION_TARGET_LOCAL_NED invalid\t" in air.texts()
    assert air.custom_mode == px4.RTL


def test_body_velocity_is_turned_by_the_heading(air: Px4Station) -> None:
    air.stream(3.0, 20.0, lambda: air.setpoint(0x9F8, (0.0, 0.0, -10.0), yaw=math.pi / 2))
    air.stream(9.0, 10.0, lambda: air.setpoint(0xDC7, velocity=(2.0, 0.0, 0.0), frame=8))
    assert air.velocity[1] == pytest.approx(2.0, abs=0.2)
    assert air.velocity[0] == pytest.approx(0.0, abs=0.2)


def test_velocity_with_a_held_height(air: Px4Station) -> None:
    """Position and velocity may share the axes: height held, speed over ground."""
    mask = 0xDFF & ~0x004 & ~0x018
    air.stream(2.0, 10.0, lambda: air.setpoint(mask, (0.0, 0.0, -10.0), velocity=(3.0, 0.0, 0.0)))
    assert 1.8 < air.velocity[0] < 2.6  # drag; the integrator takes its time
    air.stream(9.0, 10.0, lambda: air.setpoint(mask, (0.0, 0.0, -10.0), velocity=(3.0, 0.0, 0.0)))
    assert air.velocity[0] == pytest.approx(3.0, abs=0.3)
    assert air.position[2] == pytest.approx(-10.0, abs=0.4)


def test_acceleration_is_followed(air: Px4Station) -> None:
    air.stream(1.5, 20.0, lambda: air.setpoint(0xC3F, acceleration=(1.0, 0.0, 0.0)))
    assert 0.5 < air.velocity[0] < 1.2  # against the drag


@pytest.mark.parametrize(("frame", "altitude"), [(6, 14.0), (5, HOME.altitude_amsl_m + 14.0)])
def test_global_setpoints_honour_their_frame(air: Px4Station, frame: int, altitude: float) -> None:
    x = round((HOME.latitude_deg + 10.0 / 111_195.0) * 1e7)
    y = round(HOME.longitude_deg * 1e7)
    message = mav.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, 0xDF8, x, y, altitude, 0, 0, 0, 0, 0, 0, 0, 0
    )
    air.stream(8.0, 10.0, lambda: air.send(message))
    drift_m = 1.3 if frame == 6 else 0.0  # home's altitude wanders, see below
    assert math.hypot(air.position[0] - 10.0, air.position[1]) < 0.7
    assert -air.position[2] == pytest.approx(14.0, abs=0.5 + drift_m)


@pytest.mark.parametrize("frame", [0, 3, 10])
def test_the_global_frames_without_int_are_rejected(air: Px4Station, frame: int) -> None:
    message = mav.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, 0xDF8, 473977430, 85455940, 500, 0, 0, 0, 0, 0, 0, 0, 0
    )
    air.stream(1.5, 10.0, lambda: air.send(message))
    assert air.custom_mode == px4.RTL


def test_the_target_is_echoed(air: Px4Station) -> None:
    air.stream_to(1.0, 5.0, 1.0, -10.0)
    target = air.last("POSITION_TARGET_LOCAL_NED")
    assert (target.x, target.y, target.z) == (5.0, 1.0, -10.0)
    assert target.type_mask == 0


# Landing, returning.


@pytest.mark.night
def test_land_disarms_two_seconds_after_landing_and_the_earlier_mode_comes_back(
    air: Px4Station,
) -> None:
    air.gcs_heartbeat()
    assert air.command(21, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    assert air.texts()[-1] == "Landing at current position\t"
    air.heartbeats(True)
    air.run_until(lambda: not air.armed)
    assert air.texts()[-2:] == ["Landing detected\t", "Disarmed by landing\t"]
    assert air.changes("EXTENDED_SYS_STATE", "landed_state") == [1, 2, 4, 1]
    assert air.custom_mode == px4.OFFBOARD
    air.run(1.1)
    beat = air.last("HEARTBEAT")
    assert (beat.base_mode, beat.system_status) == (17, 0)


def test_return_climbs_to_30_m_flies_home_lands_and_disarms(air: Px4Station) -> None:
    air.stream_to(5.0, 25.0, 0.0, -10.0)
    assert air.mode(px4.LOITER) == ACCEPTED
    assert air.mode(px4.RTL) == ACCEPTED
    highest = 0.0
    while air.armed:
        air.run(0.5)
        highest = max(highest, -air.position[2])
        assert air.now_s < 120.0
    assert highest == pytest.approx(30.0, abs=0.8)
    assert math.hypot(*air.position[:2]) < 1.0
    assert air.custom_mode == px4.LOITER


# Streams and links.


def test_the_companions_link_has_the_recorded_default_rates(ground: Px4Station) -> None:
    begin_s = ground.now_s
    ground.run(4.0)
    seconds = ground.now_s - begin_s
    expected = {
        "ATTITUDE": 100, "HIGHRES_IMU": 50, "ATTITUDE_QUATERNION": 50, "GLOBAL_POSITION_INT": 50,
        "LOCAL_POSITION_NED": 30, "ODOMETRY": 30, "TIMESYNC": 10, "ALTITUDE": 10,
        "ATTITUDE_TARGET": 10, "POSITION_TARGET_LOCAL_NED": 10, "VFR_HUD": 10, "GPS_RAW_INT": 8,
        "EXTENDED_SYS_STATE": 5, "SYS_STATUS": 5, "HEARTBEAT": 1, "ESTIMATOR_STATUS": 1,
        "SYSTEM_TIME": 1, "MISSION_CURRENT": 1, "BATTERY_STATUS": 0.5, "CURRENT_MODE": 0.5,
        "HOME_POSITION": 0.5,
    }  # fmt: skip
    for kind, rate_hz in expected.items():
        count = len(ground.messages(kind, begin_s + 0.001))
        assert count == pytest.approx(rate_hz * seconds, abs=1.0), kind


def test_the_ground_stations_link_has_others() -> None:
    station = ready_px4(("gcs",))
    begin_s = station.now_s
    station.run(4.0)
    for kind, rate_hz in {"ATTITUDE": 50, "LOCAL_POSITION_NED": 50, "VFR_HUD": 4, "ALTITUDE": 1,
                          "SYS_STATUS": 1, "GPS_RAW_INT": 5, "TIMESYNC": 0}.items():  # fmt: skip
        count = len(station.messages(kind, begin_s + 0.001))
        assert count == pytest.approx(rate_hz * 4.0, abs=1.0), kind


def test_intervals_can_be_set_put_back_and_stopped(ground: Px4Station) -> None:
    def rate_hz() -> float:
        begin_s = ground.now_s
        ground.run(2.0)
        return len(ground.messages("ATTITUDE", begin_s + 0.001)) / 2.0

    assert ground.command(511, 30, 100000) == ACCEPTED
    assert rate_hz() == pytest.approx(10.0, abs=0.5)
    assert ground.command(510, 30) == ACCEPTED
    assert ground.last("MESSAGE_INTERVAL").interval_us == 100000
    assert ground.command(511, 30, 0) == ACCEPTED
    assert rate_hz() == pytest.approx(100.0, abs=1.0)
    assert ground.command(511, 30, -1) == ACCEPTED
    assert rate_hz() == 0.0


def test_texts_come_only_where_a_ground_station_is_heard_and_end_in_a_tab(
    ground: Px4Station,
) -> None:
    ground.send(mav.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))  # an onboard controller
    ground.mode(px4.POSCTL)
    assert ground.arm() == TEMPORARILY_REJECTED
    assert ground.texts() == []
    ground.gcs_heartbeat()
    assert ground.arm() == TEMPORARILY_REJECTED
    first, second = ground.messages("STATUSTEXT")
    assert first.text + second.text == "Arming denied: Resolve system health failures first\t"
    assert (first.chunk_seq, second.chunk_seq) == (0, 1)
    assert first.id == second.id == 0, "the first text of a link, read in its STATUSTEXT stream"
    assert len(first.text) == 50
    assert ground.arm() == TEMPORARILY_REJECTED
    assert [message.id for message in ground.messages("STATUSTEXT")] == [0, 0, 1, 1]


def test_each_link_has_its_own_acknowledgements_and_hears_the_others_heartbeats() -> None:
    station = ready_px4(("onboard", "gcs"))
    other = station.vehicle.links[1]
    other.read()
    assert station.command(512, 148) == ACCEPTED
    station.gcs_heartbeat()
    heard = mav.MAVLink(None).parse_buffer(other.read()) or []
    assert not [m for m in heard if m.get_type() == "COMMAND_ACK"]
    assert [m.get_srcComponent() for m in heard if m.get_type() == "HEARTBEAT"][-1] == 191


def test_timesync_and_ping_are_answered(ground: Px4Station) -> None:
    (answer,) = (
        m for m in ground.send(mav.MAVLink_timesync_message(0, 4711)) if m.get_type() == "TIMESYNC"
    )
    assert answer.ts1 == 4711
    assert answer.tc1 == pytest.approx(ground.now_s * 1e9, rel=1e-3)
    answers = ground.send(mav.MAVLink_ping_message(1, 77, 0, 0))
    (ping,) = (m for m in answers if m.get_type() == "PING")
    assert (ping.seq, ping.target_system, ping.target_component) == (77, 1, 191)


def test_the_version_has_the_recorded_capabilities(ground: Px4Station) -> None:
    assert ground.command(512, 148) == ACCEPTED
    version = ground.last("AUTOPILOT_VERSION")
    assert version.flight_sw_version == 17891583
    assert version.capabilities == 0xE8FF


# Parameters.


def test_integers_travel_bytewise(ground: Px4Station) -> None:
    assert ground.parameter("NAV_RCL_ACT") == 2
    (echo,) = ground.set_parameter("COM_OBL_RC_ACT", 5, kind=6)
    assert (echo.param_type, bytewise(echo.param_value)) == (6, 5)
    assert ground.vehicle.parameters["COM_OBL_RC_ACT"] == 5.0
    assert ground.parameter("COM_OF_LOSS_T") == pytest.approx(1.0)


def test_a_missing_name_and_a_wrong_type_get_no_answer(ground: Px4Station) -> None:
    answers = ground.send(mav.MAVLink_param_request_read_message(1, 1, b"NOPE_X", -1))
    assert not [m for m in answers if m.get_type() == "PARAM_VALUE"]
    assert ground.set_parameter("COM_OBL_RC_ACT", 0.0, kind=9) == []
    assert ground.vehicle.parameters["COM_OBL_RC_ACT"] == 0.0


def test_the_list_begins_with_a_hash_that_changes_with_any_value(ground: Px4Station) -> None:
    def listed() -> list[mav.MAVLink_param_value_message]:
        begin_s = ground.now_s
        ground.send(mav.MAVLink_param_request_list_message(1, 1))
        ground.run(1.0)
        return ground.messages("PARAM_VALUE", begin_s)

    values = listed()
    count = len(ground.vehicle.parameters)
    assert values[0].param_id == "_HASH_CHECK"
    assert (values[0].param_type, values[0].param_index) == (5, 65535)
    assert [m.param_index for m in values[1:]] == list(range(count))
    assert {m.param_count for m in values} == {count}
    assert listed()[0].param_value == values[0].param_value
    ground.set_parameter("MPC_XY_CRUISE", 7.0)
    assert listed()[0].param_value != values[0].param_value


def test_who_knows_the_hash_sends_it_back_and_gets_no_list(ground: Px4Station) -> None:
    ground.send(mav.MAVLink_param_request_list_message(1, 1))
    ground.run(0.02)
    ground.send(mav.MAVLink_param_set_message(1, 1, b"_HASH_CHECK", 0.0, 5))
    ground.run(1.0)
    assert len(ground.messages("PARAM_VALUE")) < len(ground.vehicle.parameters)


# Battery, home, estimator.


@pytest.mark.night
def test_the_battery_drains_to_half_while_armed_and_refills_in_3_s() -> None:
    air = flying_px4()
    air.stream_to(20.0, 0.0, 0.0, -10.0)
    battery = air.last("BATTERY_STATUS")
    assert battery.battery_remaining == 50
    assert battery.voltages[0] == pytest.approx(15300, abs=5)
    assert battery.voltages[1:] == [65535] * 9
    assert battery.current_battery == -100
    assert battery.current_consumed < 0
    air.command(ARM, 0, 21196)
    air.run(4.0)
    assert air.last("BATTERY_STATUS").battery_remaining == 100


def test_a_critical_battery_returns_when_told_to() -> None:
    air = flying_px4(parameters={"COM_LOW_BAT_ACT": 3})
    air.vehicle.set_battery_voltage(14.5)
    air.stream_to(4.5, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.LOITER  # COM_FAIL_ACT_T to take over
    air.stream_to(1.0, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.RTL
    assert air.vehicle.firmware.system_status == 5


@pytest.mark.night
def test_a_px4_holds_for_less_time_where_it_has_held_before() -> None:
    """By what it has held, less a quarter of the time since."""
    air = flying_px4(parameters={"COM_LOW_BAT_ACT": 3})
    air.stream_to(25.0, 0.0, 0.0, -10.0)
    air.vehicle.set_battery_remaining(0.05)
    air.stream_to(3.0, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.LOITER
    air.vehicle.set_battery_remaining(1.0)
    air.stream_to(4.0, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.OFFBOARD
    air.vehicle.set_battery_remaining(0.05)
    air.stream_to(2.0, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.LOITER
    air.stream_to(2.0, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.RTL


@pytest.mark.night
def test_the_altitude_of_home_is_rewritten_in_flight(air: Px4Station) -> None:
    air.stream_to(20.0, 0.0, 0.0, -10.0)
    homes = [m.altitude / 1e3 for m in air.messages("HOME_POSITION")]
    assert max(homes) - min(homes) > 1.0
    relative = [m.relative_alt / 1e3 for m in air.messages("GLOBAL_POSITION_INT")[-500:]]
    assert max(relative) - min(relative) > 1.0
    amsl = [m.alt / 1e3 for m in air.messages("GLOBAL_POSITION_INT")[-500:]]
    assert max(amsl) - min(amsl) < 0.3


def test_the_estimator_reports_what_it_has(air: Px4Station) -> None:
    assert air.messages("ESTIMATOR_STATUS")[-1].flags & 0x1 == 1
    odometry = air.last("ODOMETRY")
    assert (odometry.frame_id, odometry.child_frame_id) == (1, 1)
    assert air.last("ALTITUDE").altitude_local == pytest.approx(10.0, abs=0.4)
    assert math.isnan(air.last("VFR_HUD").airspeed)


@pytest.mark.night
def test_without_a_position_it_lands(air: Px4Station) -> None:
    air.vehicle.lose_gps()
    air.stream_to(12.0, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.LAND
    assert air.vehicle.firmware.system_status == 5


def test_a_landing_on_a_target_without_a_position_lands_where_it_is(air: Px4Station) -> None:
    assert air.mode(px4.PRECLAND) == ACCEPTED
    air.vehicle.lose_gps()
    air.run_until(lambda: air.custom_mode == px4.LAND, 15.0)


# Sticks.


def test_posctl_flies_by_manual_control_and_is_lost_without(air: Px4Station) -> None:
    def stick(x: int) -> None:
        air.send(mav.MAVLink_manual_control_message(1, x, 0, 500, 0, 0))

    stick(0)
    assert air.mode(px4.POSCTL) == ACCEPTED
    air.stream(3.0, 10.0, lambda: stick(500))
    assert air.velocity[0] == pytest.approx(4.6, abs=0.6)
    air.run(1.5)
    assert air.custom_mode == px4.LOITER  # COM_FAIL_ACT_T to take over
    air.run(5.0)
    assert air.custom_mode == px4.RTL


# The whole.


def test_the_same_seed_and_input_give_the_same_bytes() -> None:
    def flight() -> bytes:
        station = px4_copter(("onboard", "gcs"))
        station.simulation.run_for(3.0)
        said = [link.read() for link in station.vehicle.links]
        return b"".join(said)

    assert flight() == flight()


def test_px4_and_ardupilot_fly_in_one_simulation() -> None:
    simulation = Simulation(
        [VehicleConfig(ready_after_s=1.0), VehicleConfig(autopilot="px4", ready_after_s=1.0)]
    )
    simulation.run_for(3.0)
    autopilots = []
    for vehicle in simulation.vehicles:
        messages = mav.MAVLink(None).parse_buffer(vehicle.link.read()) or []
        autopilots += [m.autopilot for m in messages if m.get_type() == "HEARTBEAT"][:1]
    assert autopilots == [3, 12]


def test_a_reboot_is_denied_armed_and_starts_again_on_the_ground(ground: Px4Station) -> None:
    assert ground.arm() == ACCEPTED
    assert ground.command(246, 1) == DENIED
    assert ground.command(ARM, 0) == ACCEPTED
    assert ground.command(246, 1) == ACCEPTED
    ground.run(4.0)
    assert ground.last("ATTITUDE").time_boot_ms < 4000


def test_on_the_command_line_the_port_says_what_a_link_is_for() -> None:
    options, config = parse(["--autopilot", "px4"])
    assert [link.port for link in options.link] == [14550, 14540]
    assert config.links == ("gcs", "onboard")
    link = "udpin://127.0.0.1:14545"
    assert parse(["--autopilot", "px4", "--link", link])[1].links == ("onboard",)
    assert parse(["--link", link])[1].links == ("gcs",)


def test_wrong_links_get_a_sentence() -> None:
    with pytest.raises(ConfigurationError, match="links must be gcs or onboard"):
        VehicleConfig(autopilot="px4", links=())
    with pytest.raises(ConfigurationError, match="not radio"):
        VehicleConfig(autopilot="px4", links=("radio",))


def test_it_asks_everybody_for_a_gimbal_when_it_lands(air: Px4Station) -> None:
    begin_s = air.now_s
    assert air.command(21, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    air.run(4.0)
    asked = air.messages("COMMAND_LONG", begin_s)
    first, repeated = asked[:3], asked[3:]
    assert [(m.command, m.confirmation) for m in first] == [(1001, 0), (1000, 0), (1001, 0)]
    assert [(m.command, m.confirmation) for m in repeated] == [(1001, n) for n in (1, 2, 3)]
    assert {(m.target_system, m.target_component) for m in asked} == {(1, 0)}


@pytest.mark.night
def test_do_change_speed_counts_in_the_auto_modes(air: Px4Station) -> None:
    x = round((HOME.latitude_deg + 60.0 / 111_195.0) * 1e7)
    y = round(HOME.longitude_deg * 1e7)
    air.command_int(192, 0, NAN, 1, NAN, NAN, x=x, y=y, z=HOME.altitude_amsl_m + 10.0)
    assert air.command(178, 1, 2.0) == ACCEPTED
    air.run(8.0)
    assert air.velocity[0] == pytest.approx(1.8, abs=0.3)
    for speed_m_s in (0.0, -1.0):
        assert air.command(178, 1, speed_m_s) == ACCEPTED, "the usual speed again"
    air.run(3.0)
    assert air.velocity[0] > 3.0


def test_mission_start_without_a_mission_is_denied(air: Px4Station) -> None:
    assert air.command(300) == DENIED
    assert air.custom_mode == px4.OFFBOARD


def test_pausing_and_choosing_an_item_are_no_commands(air: Px4Station) -> None:
    for command in (193, 224):
        assert air.command(command, 0) == UNSUPPORTED


@pytest.mark.parametrize("command", [203, 205, 206, 211, 521, 3000])
def test_commands_for_parts_that_it_does_not_have_are_not_answered(
    ground: Px4Station, command: int
) -> None:
    assert ground.command(command) == -1


def test_what_was_seen_of_other_commands_on_the_ground(ground: Px4Station) -> None:
    accepted = (191, 195, 197, 241, 246)
    assert [ground.command(command) for command in accepted] == [ACCEPTED] * len(accepted)
    assert ground.command(185, 0) == DENIED
    assert ground.command(512, 436) == DENIED
    assert ground.command(17) == UNSUPPORTED
    assert ground.command(262, 6) == ACCEPTED, "the standard mode of missions"
    assert ground.command(186, HOME.altitude_amsl_m + 20.0) == ACCEPTED
    ground.run(1.1)
    assert ground.custom_mode == px4.LOITER


def test_do_change_altitude_goes_to_the_height_in_auto_loiter(air: Px4Station) -> None:
    assert air.command(186, HOME.altitude_amsl_m + 20.0) == ACCEPTED
    air.run(12.0)
    assert air.custom_mode == px4.LOITER
    assert -air.position[2] == pytest.approx(20.0, abs=2.0)


def test_a_place_that_is_none_is_accepted_and_not_flown_to(air: Px4Station) -> None:
    before = air.position
    altitude_m = HOME.altitude_amsl_m + 10.0
    assert air.command_int(192, 0, -1, 1, 0, NAN, x=2_000_000_000, y=0, z=altitude_m) == ACCEPTED
    air.run(3.0)
    assert math.dist(before, air.position) < 2.0


def attitude(station: Px4Station, pitch_rad: float, thrust: float = 0.5, mask: int = 7) -> None:
    q = (math.cos(pitch_rad / 2.0), 0.0, math.sin(pitch_rad / 2.0), 0.0)
    station.send(mav.MAVLink_set_attitude_target_message(0, 1, 1, mask, q, 0, 0, 0, thrust))


def test_an_attitude_in_offboard_pushes_where_it_leans(air: Px4Station) -> None:
    air.stream(3.0, 20.0, lambda: attitude(air, -0.1, 0.5 / math.cos(0.1)))
    assert air.custom_mode == px4.OFFBOARD
    assert air.velocity[0] > 0.7
    assert -air.position[2] == pytest.approx(10.0, abs=1.5)


def test_rates_in_offboard_keep_the_stream_alive(air: Px4Station) -> None:
    air.stream(3.0, 20.0, lambda: attitude(air, 0.0, mask=0x80))
    assert air.custom_mode == px4.OFFBOARD


@pytest.mark.parametrize("then", [px4.LOITER, px4.LAND])
def test_a_take_off_that_is_broken_off_is_not_landed_at_once_but_ends(
    ground: Px4Station, then: int
) -> None:
    assert ground.command(22, 0, 0, 0, NAN, NAN, NAN, HOME.altitude_amsl_m + 10.0) == ACCEPTED
    assert ground.arm() == ACCEPTED
    ground.run(1.9)
    assert ground.mode(px4.LOITER) == ACCEPTED
    assert ground.command(400, 0) == TEMPORARILY_REJECTED
    ground.mode(then)
    ground.run(2.0)
    ground.mode(px4.LAND)
    ground.run_until(lambda: not ground.armed, 15.0)


@pytest.mark.parametrize("mode", ["OFFBOARD", "AUTO.LOITER"])
def test_a_mission_that_is_uploaded_or_cleared_in_another_mode_moves_nothing(mode: str) -> None:
    station = flying_px4()
    if mode == "AUTO.LOITER":
        assert station.command_results(SET_MODE, 1, 4, 3) == [0, 0]
        station.run(4.0)
    number, place = station.last("HEARTBEAT").custom_mode, station.position
    for mission in ([take_off(10.0), waypoint(40.0, 0.0)], []):
        assert upload(station, near_home(mission)) == 0
        if mode == "OFFBOARD":
            station.stream_to(3.0, *place)
        else:
            station.run(3.0)
        assert station.last("MISSION_CURRENT").mission_state in (1, 2), "not started"
        assert station.last("HEARTBEAT").custom_mode == number
        assert math.dist(station.position, place) < 1.0
    assert not [text for text in station.texts() if "mission" in text.lower()]
