"""AUTO as observed with ArduPilot: each test names what was seen."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import AUTO, GUIDED, LOITER, RTL, GroundStation, copter
from sitl_support.missions import answer, home, item, take_off, upload, waypoint

READY = {"AUTO_OPTIONS": 3.0}
START, PAUSE = mav.MAV_CMD_MISSION_START, mav.MAV_CMD_DO_PAUSE_CONTINUE


def begun(*items: mav.MAVLink_message, parameters: dict[str, float] | None = None) -> GroundStation:
    """A copter that has armed in AUTO and flies the items after a take-off to 10 m."""
    station = copter(parameters={**READY, **(parameters or {})}).ready()
    assert upload(station, [home(), take_off(10), *items]) == 0
    assert station.mode(AUTO) == 0
    assert station.arm() == 0
    assert station.command(START) == 0
    station.interval(42, 4.0)
    return station


def reached(station: GroundStation) -> list[int]:
    return [m.seq for m in station.messages("MISSION_ITEM_REACHED")]


def until_reached(station: GroundStation, seq: int, timeout_s: float = 90.0) -> float:
    return station.run_until(lambda: seq in reached(station), timeout_s)


def test_auto_is_not_armable_without_auto_options() -> None:
    station = copter().ready()
    upload(station, [home(), take_off(10)])
    station.mode(AUTO)
    assert station.arm() == 4
    assert "Arm: AUTO mode not armable" in station.texts()


def test_the_take_off_waits_for_mission_start_without_the_option() -> None:
    station = copter(parameters={"AUTO_OPTIONS": 1}).ready()
    upload(station, [home(), take_off(10)])
    station.mode(AUTO)
    assert station.arm() == 0
    station.run(5.0)
    assert station.position[2] > -0.2
    assert station.command(START) == 0
    until_reached(station, 1)
    assert -station.position[2] == pytest.approx(10.0, abs=0.5)


def test_mission_start_changes_into_auto_and_takes_off() -> None:
    station = copter().ready()
    upload(station, [home(), take_off(10), waypoint(10, 0)])
    station.mode(GUIDED)
    station.arm()
    assert station.command(START) == 0
    assert station.last("HEARTBEAT").custom_mode == AUTO
    until_reached(station, 2)


def test_a_mission_that_does_not_begin_with_a_take_off_is_rejected_when_armed() -> None:
    station = copter().ready()
    upload(station, [home(), waypoint(10, 0)])
    station.mode(GUIDED)
    station.arm()
    assert station.mode(AUTO) == 4
    assert "Auto: Missing Takeoff Cmd" in station.texts()


def test_after_the_last_item_it_hovers_in_auto() -> None:
    station = begun(waypoint(15, 0))
    until_reached(station, 2)
    station.run(10.0)
    assert math.dist(station.position, (15, 0, -10)) < 0.6
    assert station.last("HEARTBEAT").custom_mode == AUTO
    assert station.last("MISSION_CURRENT").mission_state == 5


def test_a_waypoint_with_a_delay_is_a_stop() -> None:
    station = begun(waypoint(15, 0, stay_s=4.0), waypoint(15, 15))
    station.run_until(lambda: math.dist(station.position, (15, 0, -10)) < 0.5)
    begin_s = station.now_s
    until_reached(station, 2)
    assert station.now_s - begin_s > 3.5
    assert math.hypot(*station.velocity) < 0.4


def test_a_corner_is_cut_within_the_radius() -> None:
    station = begun(waypoint(20, 0), waypoint(20, 20))
    until_reached(station, 2)
    assert 0.3 < math.dist(station.position[:2], (20, 0)) < 2.5
    assert math.hypot(*station.velocity[:2]) > 1.5


def test_loiter_time_loiter_turns_delay_and_unlimited() -> None:
    station = begun(
        item(mav.MAV_CMD_NAV_LOITER_TIME, 10, 0, 10, params=(3.0,)),
        item(mav.MAV_CMD_NAV_LOITER_TURNS, 10, 0, 10, params=(1.0, 0.0, 5.0)),
        item(mav.MAV_CMD_NAV_DELAY, params=(5.0,), anywhere=True),
        item(mav.MAV_CMD_NAV_LOITER_UNLIM, 0, 0, 12),
    )
    until_reached(station, 2)
    angles = set()
    while 3 not in reached(station):
        station.run(0.2)
        north, east, _ = station.position
        if abs(math.hypot(north - 10, east) - 5.0) < 1.0:
            angles.add(round(math.atan2(east, north - 10)))
        assert station.now_s < 120.0
    assert len(angles) == 7, "all round"
    began_s = station.now_s
    until_reached(station, 4)
    assert station.now_s - began_s == pytest.approx(5.0, abs=0.2)
    station.run(30.0)
    assert math.dist(station.position, (0, 0, -12)) < 0.6
    assert reached(station)[-1] == 4
    assert station.last("MISSION_CURRENT").mission_state == 3


def test_change_speed_limits_the_legs_after_it() -> None:
    slow = item(mav.MAV_CMD_DO_CHANGE_SPEED, params=(1.0, 2.0), anywhere=True)
    station = begun(slow, waypoint(20, 0))
    until_reached(station, 2)
    fastest = 0.0
    while 3 not in reached(station):
        station.run(0.1)
        fastest = max(fastest, math.hypot(*station.velocity[:2]))
        assert station.now_s < 60.0
    assert 1.7 < fastest < 2.2


def test_a_jump_repeats_as_often_as_it_says() -> None:
    back = item(mav.MAV_CMD_DO_JUMP, params=(2.0, 2.0), anywhere=True)
    station = begun(waypoint(6, 0), waypoint(0, 0), back, waypoint(0, 6))
    until_reached(station, 5, 120.0)
    assert [seq for seq in reached(station) if seq in (2, 3, 5)] == [2, 3, 2, 3, 2, 3, 5]


def test_a_jump_to_itself_does_not_hang() -> None:
    forever = item(mav.MAV_CMD_DO_JUMP, params=(2.0, -1.0), anywhere=True)
    station = begun(forever)
    until_reached(station, 1)
    station.run(1.0)
    assert station.last("MISSION_CURRENT").mission_state == 5


def test_rtl_as_an_item_lands_and_disarms_in_auto() -> None:
    station = begun(waypoint(10, 0), item(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, anywhere=True))
    station.run_until(lambda: not station.vehicle.firmware.armed, 120.0)
    assert station.last("HEARTBEAT").custom_mode == AUTO
    assert math.dist(station.position, (0, 0, 0)) < 0.5
    assert "Mission: 3 RTL" in station.texts()


def test_land_as_an_item_lands_there_and_disarms() -> None:
    station = begun(item(mav.MAV_CMD_NAV_LAND, 8, 4))
    station.run_until(lambda: not station.vehicle.firmware.armed, 120.0)
    station.run(0.5)
    assert math.dist(station.position, (8, 4, 0)) < 0.6
    assert station.changes("EXTENDED_SYS_STATE", "landed_state") == [1, 3, 2, 4, 1]


def test_clear_all_in_auto_is_an_error_and_it_flies_on() -> None:
    station = begun(waypoint(20, 0))
    until_reached(station, 1)
    assert answer(station, mav.MAVLink_mission_clear_all_message(1, 1, 0)).type == 1
    until_reached(station, 2)
    assert station.last("MISSION_CURRENT").total == 2


def test_after_loiter_the_same_item_is_resumed() -> None:
    station = begun(waypoint(20, 0), waypoint(20, 20))
    until_reached(station, 2)
    station.run(1.0)
    station.vehicle.pilot_throttle(1500)
    station.mode(LOITER)
    station.run(3.0)
    left = station.last("MISSION_CURRENT")
    assert (left.seq, left.mission_state, left.mission_mode) == (3, 2, 0)
    assert station.mode(AUTO) == 0
    station.run(1.0)
    again = station.last("MISSION_CURRENT")
    assert (again.seq, again.mission_state, again.mission_mode) == (3, 3, 1)
    until_reached(station, 3)


def test_pause_holds_and_continue_resumes() -> None:
    station = begun(waypoint(40, 0))
    until_reached(station, 1)
    station.run(3.0)
    assert station.command(PAUSE, 0) == 0
    station.run(6.0)
    held = station.position
    assert held[0] < 30.0
    station.run(5.0)
    assert math.dist(station.position, held) < 0.5
    assert station.command(PAUSE, 1) == 0
    until_reached(station, 2)
    station.run(3.0)
    assert station.command(PAUSE, 0) == 4, "the mission is complete"
    assert "Failed to pause" in station.texts()
    station.mode(GUIDED)
    assert station.command(PAUSE, 0) == 0


def test_an_upload_in_auto_is_taken_item_by_item() -> None:
    station = begun(waypoint(30, 0), waypoint(30, 30))
    until_reached(station, 1)
    begin_s = station.now_s
    station.run(1.0)
    mission = [home(), take_off(10), waypoint(30, 0), waypoint(30, -10)]
    assert upload(station, mission) == 0
    assert "Auto mission changed, restarted command" in station.texts(begin_s)
    until_reached(station, 3)
    assert station.position[1] < -5.0


def test_an_upload_begun_in_auto_and_left_ends_the_mission_early() -> None:
    """The copter finishes the leg and hovers, mission_state 5, still AUTO."""
    station = begun(waypoint(20, 0), waypoint(20, 10), waypoint(0, 10))
    until_reached(station, 2)
    station.send(mav.MAVLink_mission_count_message(1, 1, 3, 0))
    assert "Auto mission changed but failed to restart command" in station.texts()
    station.run(15.0)
    assert station.last("MISSION_CURRENT").mission_state == 5
    assert station.last("MISSION_CURRENT").total == 2
    assert station.last("HEARTBEAT").custom_mode == AUTO
    assert math.dist(station.position, (20, 10, -10)) < 0.6


def test_set_current_in_flight_goes_there() -> None:
    station = begun(waypoint(20, 0), waypoint(0, 10))
    until_reached(station, 1)
    station.run(2.0)
    assert station.command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 3) == 0
    until_reached(station, 3)
    station.run(3.0)
    assert math.dist(station.position, (0, 10, -10)) < 0.6
    assert 2 not in reached(station)


def test_disarming_rewinds_the_mission() -> None:
    station = begun(waypoint(10, 0), waypoint(10, 10))
    until_reached(station, 2)
    station.mode(RTL)
    station.run_until(lambda: not station.vehicle.firmware.armed, 120.0)
    station.run(1.0)
    current = station.last("MISSION_CURRENT")
    assert (current.seq, current.mission_state, current.mission_mode) == (0, 2, 0)


def test_setpoints_are_ignored_in_auto() -> None:
    station = begun(waypoint(20, 0))
    until_reached(station, 1)
    station.setpoint(0xDF8, (-50.0, 0.0, -10.0))
    until_reached(station, 2)


def test_a_mission_item_with_current_2_is_a_target_for_guided() -> None:
    station = copter().ready().take_off(10)
    target = waypoint(12, 0)
    target.current = 2
    assert answer(station, target).type == 0
    station.run(12.0)
    assert math.dist(station.position, (12, 0, -10)) < 0.6
    station.mode(RTL)
    assert answer(station, target).type == 1
