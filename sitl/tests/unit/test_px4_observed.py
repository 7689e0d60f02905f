"""Observed rules of PX4's services that ground stations rely on; each is a test that names it."""

from __future__ import annotations

import math
import struct

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from sitl_support.ground_station import ACCEPTED, FAILED, TEMPORARILY_REJECTED
from sitl_support.missions import Message, download, item, take_off, upload, waypoint
from sitl_support.px4_station import HOME, NAN, Px4Station, near_home, ready_px4

READY = 0x10000000
MISSION = [take_off(10.0), waypoint(15.0, 0.0), item(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=2)]


@pytest.fixture
def ground() -> Px4Station:
    """On the ground, ready, disarmed, in AUTO.LOITER."""
    return ready_px4()


def flying() -> Px4Station:
    return ready_px4().quiet().take_off()


def extension(message: Message, place: int, size: int) -> bytes:
    """Bytes of a payload that the generated classes do not know; zeros at the end are cut off."""
    frame = bytes(message.get_msgbuf())
    return frame[10 : 10 + frame[1]].ljust(place + size, b"\0")[place : place + size]


# Commands and modes.


@pytest.mark.parametrize("command", [21, 22, 192, 400, 511, 512])
def test_other_commands_than_do_set_mode_get_one_acknowledgement(
    ground: Px4Station, command: int
) -> None:
    params = {192: (-1, 1, 0, NAN), 511: (30, 100000), 512: (148,)}.get(command, (0,))
    assert ground.command_results(command, *params) == [ACCEPTED]


def test_no_ground_station_is_needed_to_arm(ground: Px4Station) -> None:
    assert ground.arm() == ACCEPTED


def test_ready_is_one_bit_of_the_health(ground: Px4Station) -> None:
    assert ground.last("SYS_STATUS").onboard_control_sensors_health & READY
    assert ground.mode(px4.OFFBOARD) == ACCEPTED
    ground.run(1.0)
    assert not ground.last("SYS_STATUS").onboard_control_sensors_health & READY


def test_current_mode_comes_every_two_seconds_and_has_the_intention(ground: Px4Station) -> None:
    begin_s = ground.now_s
    ground.mode(px4.POSCTL)
    ground.run(6.0)
    modes = ground.messages("CURRENT_MODE", begin_s + 0.001)
    assert len(modes) == 3
    assert {(m.custom_mode, m.intended_custom_mode) for m in modes} == {(px4.POSCTL, px4.POSCTL)}


def test_current_mode_comes_no_more_often_than_the_status_is_published(ground: Px4Station) -> None:
    """Read in CURRENT_MODE.hpp and Commander.cpp: twice a second, and whenever it changes."""
    assert ground.command(511, 436, 200_000) == ACCEPTED
    ground.run(1.0)
    begin_s = ground.now_s
    ground.run(10.0)
    assert len(ground.messages("CURRENT_MODE", begin_s + 0.001)) == pytest.approx(20, abs=1)
    begin_s = ground.now_s
    ground.mode(px4.POSCTL)
    ground.run(0.25)
    assert ground.last("CURRENT_MODE").custom_mode == px4.POSCTL
    assert ground.messages("CURRENT_MODE", begin_s)


@pytest.mark.parametrize("message_id", [0, 42, 9999])
def test_what_no_stream_sends_has_no_interval(ground: Px4Station, message_id: int) -> None:
    """Read in mavlink_receiver.cpp: the mission manager sends MISSION_CURRENT by itself."""
    assert ground.command(511, message_id, 500_000) == FAILED
    begin_s = ground.now_s
    ground.run(4.0)
    assert len(ground.messages("MISSION_CURRENT", begin_s + 0.001)) == pytest.approx(4, abs=1)


def test_one_available_mode_can_be_asked_for(ground: Px4Station) -> None:
    answers = ground.send(mav.MAVLink_command_long_message(1, 1, 512, 0, 435, 7, 0, 0, 0, 0, 0))
    (mode,) = (m for m in answers if m.get_type() == "AVAILABLE_MODES")
    assert (mode.mode_index, mode.number_modes, mode.mode_name) == (7, 26, "Position Slow")


def test_manual_control_is_heard_and_a_channel_override_is_not() -> None:
    air = flying()
    air.send(mav.MAVLink_rc_channels_override_message(1, 1, *[1500] * 8))
    assert air.mode(px4.POSCTL) == TEMPORARILY_REJECTED
    air.send(mav.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0))
    assert air.mode(px4.POSCTL) == ACCEPTED


# Missions.


def test_an_upload_is_asked_for_with_int_requests_and_acknowledged_with_its_identity(
    ground: Px4Station,
) -> None:
    assert upload(ground, near_home(MISSION)) == 0
    asked = ground.messages("MISSION_REQUEST_INT")
    assert [m.seq for m in asked] == [0, 1, 2]
    identity = extension(ground.last("MISSION_ACK"), 4, 4)
    assert identity != bytes(4)
    ground.run(1.1)
    assert extension(ground.last("MISSION_CURRENT"), 6, 4) == identity


def test_a_count_of_zero_clears(ground: Px4Station) -> None:
    assert upload(ground, near_home(MISSION)) == 0
    assert upload(ground, []) == 0
    ground.run(1.1)
    current = ground.last("MISSION_CURRENT")
    assert (current.total, current.mission_state) == (65535, 1)


@pytest.mark.parametrize(
    ("bad", "result"),
    [(item(31999, 5.0), 3), (item(16, 5.0, frame=1), 2)],
    ids=["unknown command", "bad frame"],
)
def test_a_rejected_upload_leaves_the_previous_mission(
    ground: Px4Station, bad: Message, result: int
) -> None:
    assert upload(ground, near_home(MISSION)) == 0
    assert upload(ground, [bad]) == result
    assert len(download(ground)) == 3


def test_a_withheld_item_is_asked_for_every_quarter_second_and_given_up_without_an_ack(
    ground: Px4Station,
) -> None:
    begin_s = ground.now_s
    ground.heartbeats(True)
    ground.send(mav.MAVLink_mission_count_message(1, 1, 2, 0))
    ground.run(6.5)
    assert len(ground.messages("MISSION_REQUEST_INT", begin_s)) == pytest.approx(20, abs=1)
    assert "Operation timeout\t" in ground.texts()
    assert ground.messages("MISSION_ACK", begin_s) == []


def test_relative_frames_come_back_as_6_and_that_of_rtl_as_2(ground: Px4Station) -> None:
    assert upload(ground, near_home(MISSION)) == 0
    assert [m.frame for m in download(ground)] == [6, 6, 2]


def test_clearing_all_types_is_acknowledged_with_type_255(ground: Px4Station) -> None:
    ground.send(mav.MAVLink_mission_clear_all_message(1, 1, 255))
    ack = ground.last("MISSION_ACK")
    assert (ack.type, ack.mission_type) == (0, 255)


def test_mission_mode_says_mission_also_in_land_and_takeoff_and_else_suspended(
    ground: Px4Station,
) -> None:
    for number, mission_mode in (
        (px4.LOITER, 2), (px4.MISSION, 1), (px4.RTL, 2), (px4.TAKEOFF, 1), (px4.LAND, 1)
    ):  # fmt: skip
        assert ground.mode(number) == ACCEPTED
        ground.run(1.1)
        assert ground.last("MISSION_CURRENT").mission_mode == mission_mode


def test_a_reached_item_is_reported_ten_times() -> None:
    air = ready_px4().quiet()
    assert upload(air, near_home([take_off(5.0), waypoint(100.0, 0.0)])) == 0
    assert air.mode(px4.MISSION) == ACCEPTED
    assert air.arm() == ACCEPTED
    air.run_until(lambda: air.position[0] > 80.0)
    assert [m.seq for m in air.messages("MISSION_ITEM_REACHED")] == [0] * 10


def test_a_mission_cleared_in_flight_ends_where_it_was() -> None:
    air = ready_px4().quiet()
    assert upload(air, near_home([take_off(5.0), waypoint(60.0, 0.0)])) == 0
    assert air.mode(px4.MISSION) == ACCEPTED
    assert air.arm() == ACCEPTED
    air.run_until(lambda: air.position[0] > 20.0)
    air.gcs_heartbeat()
    where = air.position
    begin_s = air.now_s
    air.send(mav.MAVLink_mission_clear_all_message(1, 1, 0))
    assert air.last("MISSION_ACK").type == 0
    assert extension(air.last("MISSION_ACK"), 4, 4) == bytes(4)
    assert air.custom_mode == px4.LOITER
    assert air.texts(begin_s)[-1] == "No valid mission available, loitering\t"
    furthest = 0.0
    for _ in range(60):
        air.run(0.2)
        furthest = max(furthest, air.position[0])
    assert 3.0 < furthest - where[0] < 9.0, "it overshoots"
    assert math.dist(air.position, where) < 2.5, "and comes back"
    assert air.messages("MISSION_ITEM_REACHED", begin_s) == [], "what is cleared is told no more"
    assert air.mode(px4.MISSION) == TEMPORARILY_REJECTED
    assert air.custom_mode == px4.LOITER


# Time, battery, home, estimator.


def test_timesync_is_asked_ten_times_a_second_and_answered_to_nobody_in_particular(
    ground: Px4Station,
) -> None:
    begin_s = ground.now_s
    ground.run(2.0)
    asked = [m for m in ground.messages("TIMESYNC", begin_s + 0.001) if m.tc1 == 0]
    assert len(asked) == pytest.approx(20, abs=1)
    answers = ground.send(mav.MAVLink_timesync_message(0, 4711))
    (answer,) = (m for m in answers if m.get_type() == "TIMESYNC")
    assert extension(answer, 16, 2) == b"\xff\xff"


def test_the_battery_has_odd_values(ground: Px4Station) -> None:
    assert ground.arm() == ACCEPTED
    ground.run(6.2)
    battery, status = ground.last("BATTERY_STATUS"), ground.last("SYS_STATUS")
    assert battery.temperature == 32767
    assert battery.time_remaining == 0
    assert battery.current_consumed < 0
    assert status.current_battery == battery.current_battery == -100
    charge = ground.vehicle.firmware.battery.remaining * 100.0  # type: ignore[attr-defined]
    assert battery.battery_remaining == pytest.approx(charge, abs=3.0)
    assert status.battery_remaining == math.ceil(charge)


def test_sys_status_rounds_the_charge_up_and_battery_status_rounds_it() -> None:
    ground = ready_px4(parameters={"SIM_BAT_MIN_PCT": 50.4, "SIM_BAT_DRAIN": 2.0})
    assert ground.arm() == ACCEPTED
    ground.run(5.0)
    assert ground.last("SYS_STATUS").battery_remaining == 51
    assert ground.last("BATTERY_STATUS").battery_remaining == 50


def test_home_is_set_at_arming_at_take_off_and_at_landing() -> None:
    station = ready_px4().quiet()
    station.stream_to(1.0, 0.0, 0.0, -6.0)
    assert station.mode(px4.OFFBOARD) == ACCEPTED

    def homes_until(condition: object) -> int:
        begin_s = station.now_s
        for _ in range(300):
            if condition():  # type: ignore[operator]
                break
            station.stream_to(0.1, 0.0, 0.0, -6.0)
        return len(station.messages("HOME_POSITION", begin_s + 0.001))

    assert station.command(511, 242, -1) == ACCEPTED  # only what is sent by itself
    begin_s = station.now_s
    assert station.arm() == ACCEPTED
    assert len(station.messages("HOME_POSITION", begin_s)) == 1
    assert homes_until(lambda: station.position[2] < -4.0) == 1
    assert station.command(21, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    begin_s = station.now_s
    station.run_until(lambda: not station.armed)
    assert len(station.messages("HOME_POSITION", begin_s)) == 1


def test_the_gps_has_a_three_dimensional_fix_with_ten_satellites(ground: Px4Station) -> None:
    gps = ground.last("GPS_RAW_INT")
    assert (gps.fix_type, gps.satellites_visible) == (3, 10)
    assert gps.lat == pytest.approx(HOME.latitude_deg * 1e7, abs=300)


def test_vibration_and_the_estimator_s_status_are_there_for_the_ground_station() -> None:
    """A copter's estimator makes no wind, and SYSTEM_TIME is a companion computer's."""
    station = ready_px4(("gcs",))
    station.run(11.0)
    for kind in ("VIBRATION", "ESTIMATOR_STATUS"):
        assert station.messages(kind), kind
    assert station.last("ESTIMATOR_STATUS").flags & 0x1
    assert not station.messages("WIND_COV") + station.messages("SYSTEM_TIME")
    companion = ready_px4(("onboard",))
    assert companion.last("SYSTEM_TIME").time_boot_ms > 0


@pytest.mark.night
def test_servos_are_at_900_disarmed_and_near_1480_in_hover() -> None:
    air = ready_px4().take_off(6.0)
    first = air.messages("SERVO_OUTPUT_RAW")[0]
    assert (first.servo1_raw, first.servo4_raw, first.servo5_raw) == (900, 900, 900)
    assert air.last("SERVO_OUTPUT_RAW").servo1_raw == pytest.approx(1480, abs=40)


def test_the_parameter_hash_is_a_number_of_four_bytes(ground: Px4Station) -> None:
    answers = ground.send(mav.MAVLink_param_request_read_message(1, 1, b"_HASH_CHECK", -1))
    (value,) = (m for m in answers if m.get_type() == "PARAM_VALUE")
    assert value.param_type == mav.MAV_PARAM_TYPE_UINT32
    assert struct.pack("<f", value.param_value) != bytes(4)
