"""AUTO of ArduPlane, after the firmware's documentation of its mission commands."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from sitl_support.ground_station import (
    ACCEPTED,
    DENIED,
    FAILED,
    UNSUPPORTED,
    GroundStation,
)
from sitl_support.missions import Message, home, item, take_off, upload

pytestmark = pytest.mark.wide

MANUAL, AUTO, RTL, GUIDED = 0, 10, 11, 15
ON_GROUND, IN_AIR, TAKING_OFF, LANDING = 1, 2, 3, 4
ACTIVE, NOT_STARTED, COMPLETE = 3, 2, 5


def waypoint(north_m: float, east_m: float = 0.0, up_m: float = 60.0) -> Message:
    return item(north_m=north_m, east_m=east_m, up_m=up_m)


def plane(*items: Message, parameters: dict[str, float] | None = None) -> GroundStation:
    """A plane on the ground, nose to the North, with a mission in it."""
    config = VehicleConfig(
        vehicle="plane", ready_after_s=1.0, heading_deg=0.0, parameters=parameters or {}
    )
    station = GroundStation(Simulation([config], seed=1)).ready()
    station.run(1.0)
    assert upload(station, [home(), *items]) == 0
    station.interval(42, 4.0)
    return station


def begun(*items: Message, parameters: dict[str, float] | None = None) -> GroundStation:
    """One that is taking off to 40 m in AUTO, and then flies the items."""
    station = plane(take_off(40.0), *items, parameters=parameters)
    assert station.mode(AUTO) == ACCEPTED
    assert station.arm() == ACCEPTED
    return station


def reached(station: GroundStation) -> list[int]:
    return [m.seq for m in station.messages("MISSION_ITEM_REACHED")]


def until_reached(station: GroundStation, seq: int, timeout_s: float = 120.0) -> float:
    return station.run_until(lambda: seq in reached(station), timeout_s)


def until_said(station: GroundStation, text: str, timeout_s: float = 120.0) -> float:
    return station.run_until(lambda: any(text in said for said in station.texts()), timeout_s)


def airspeed(station: GroundStation) -> float:
    return station.vehicle.snapshot().airspeed_m_s or 0.0


def radius(station: GroundStation, north_m: float, east_m: float) -> float:
    return math.dist(station.position[:2], (north_m, east_m))


# Take-off and waypoints.


def test_it_takes_off_along_the_runway_and_cuts_the_corners_of_waypoints() -> None:
    station = begun(waypoint(500), waypoint(500, 500), waypoint(0, 500))
    until_reached(station, 1)
    assert abs(station.position[1]) < 5.0, "wings level until it is high enough"
    assert any(text.startswith("Takeoff complete at 40.") for text in station.texts())
    until_reached(station, 2)
    assert 10.0 < radius(station, 500, 0) < 95.0
    until_reached(station, 3)
    assert any(text.startswith("Reached waypoint #3 dist") for text in station.texts())
    assert -station.position[2] == pytest.approx(60.0, abs=3.0)
    assert "Mission: 4 WP" in station.texts()


def test_after_a_take_off_it_levels_off_as_quickly_as_the_real_one() -> None:
    """60 m passed with 9.9 m/s: 69.4 m was the highest, 61.9 m it was 4 s later."""
    station = plane(take_off(60.0), waypoint(500), waypoint(500, 800))
    assert station.mode(AUTO) == ACCEPTED
    assert station.arm() == ACCEPTED
    until_reached(station, 1)
    heights_m: list[float] = []
    for _ in range(12):
        station.run(0.4)
        heights_m.append(-station.position[2])
    assert max(heights_m) == pytest.approx(69.4, abs=3.0)
    assert heights_m[-1] == pytest.approx(61.9, abs=5.0)


def test_it_climbs_from_waypoint_to_waypoint_bit_by_bit() -> None:
    station = begun(waypoint(500, up_m=60), waypoint(1500, up_m=100))
    until_reached(station, 2)
    station.run_until(lambda: station.position[0] > 1000.0)
    assert -station.position[2] == pytest.approx(80.0, abs=8.0)


def test_on_the_ground_without_a_take_off_it_stays() -> None:
    station = plane(waypoint(500))
    station.mode(AUTO)
    assert station.arm() == ACCEPTED
    station.run(5.0)
    assert math.hypot(*station.position[:2]) < 0.5


def test_disarmed_in_auto_it_waits_and_a_delay_runs_out() -> None:
    station = plane(item(mav.MAV_CMD_NAV_DELAY, params=(3,), anywhere=True), take_off(40))
    station.mode(AUTO)
    assert 2.5 < until_reached(station, 1) < 3.5
    assert "Delaying 3 sec" in station.texts()
    station.run(5.0)
    assert math.hypot(*station.position[:2]) < 0.5


def test_a_delay_in_the_air_is_passed_at_once() -> None:
    station = begun(item(mav.MAV_CMD_NAV_DELAY, params=(60,), anywhere=True), waypoint(500))
    until_reached(station, 1)
    assert until_reached(station, 2) < 1.0


def test_the_last_item_is_followed_by_rtl() -> None:
    station = begun(waypoint(400))
    until_reached(station, 2)
    assert station.last("HEARTBEAT").custom_mode == RTL
    assert "Mission complete, changing mode to RTL" in station.texts()
    station.run(0.5)
    assert station.last("MISSION_CURRENT").mission_state == COMPLETE


def test_an_rtl_item_changes_the_mode() -> None:
    station = begun(item(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, anywhere=True))
    until_reached(station, 1)
    assert station.last("HEARTBEAT").custom_mode == RTL


def test_a_jump_is_taken_as_often_as_it_says() -> None:
    jump = item(mav.MAV_CMD_DO_JUMP, params=(2, 1), anywhere=True)
    station = begun(waypoint(400), waypoint(400, 300), jump, waypoint(0, 300))
    until_reached(station, 5, 200.0)
    assert reached(station) == [1, 2, 3, 2, 3, 5]


def test_change_speed_in_a_mission_changes_the_airspeed() -> None:
    fast = item(mav.MAV_CMD_DO_CHANGE_SPEED, params=(0, 27))
    station = begun(fast, waypoint(900))
    until_said(station, "Set airspeed 27 m/s")
    station.run(10.0)
    assert airspeed(station) == pytest.approx(27.0, abs=1.5)


# Loiters.


def test_loiter_unlimited_continues_with_the_items_radius_and_sense() -> None:
    station = begun(item(mav.MAV_CMD_NAV_LOITER_UNLIM, 500, 0, 60, (0, 0, -120)))
    until_reached(station, 1)
    station.run(60.0)
    for _ in range(20):
        station.run(1.5)
        assert radius(station, 500, 0) == pytest.approx(127.0, abs=20.0)
        assert math.degrees(station.last("ATTITUDE").roll) < 0.0, "against the clock"
    assert reached(station) == [1]


def test_loiter_time_begins_on_the_circle_and_leaves_towards_the_next_place() -> None:
    station = begun(item(mav.MAV_CMD_NAV_LOITER_TIME, 600, 0, 60, (20,)), waypoint(600, 800))
    until_reached(station, 1)
    station.run_until(lambda: radius(station, 600, 0) < 95.0)
    took = until_said(station, "Loiter time complete")
    assert 19.0 < took < 55.0, "and up to one turn until it points on"
    north, east, _ = station.velocity
    assert abs(math.degrees(math.atan2(east, north)) - 90.0) < 25.0


def test_loiter_turns_goes_round_so_often() -> None:
    station = begun(item(mav.MAV_CMD_NAV_LOITER_TURNS, 600, 0, 60, (2, 0, 60)), waypoint(600, 800))
    until_reached(station, 1)
    station.run_until(lambda: radius(station, 600, 0) < 75.0)
    took = until_said(station, "Loiter orbits complete")
    turn_s = 2.0 * math.pi * 63.6 / 23.0
    assert 2.0 * turn_s - 3.0 < took < 3.2 * turn_s


def test_loiter_to_alt_changes_the_height_before_it_continues() -> None:
    station = begun(item(mav.MAV_CMD_NAV_LOITER_TO_ALT, 600, 0, 120, (1, 80)), waypoint(600, 800))
    until_said(station, "Loiter to alt complete", 200.0)
    assert -station.position[2] == pytest.approx(120.0, abs=6.0)
    assert 2 in reached(station)


# Requests by people.


def test_left_half_way_it_is_taken_up_at_the_same_item() -> None:
    station = begun(waypoint(400), waypoint(400, 600))
    until_reached(station, 2)
    station.mode(GUIDED)
    station.run(1.0)
    assert station.last("MISSION_CURRENT").mission_state == NOT_STARTED
    station.run(10.0)
    station.mode(AUTO)
    station.run(1.0)
    current = station.last("MISSION_CURRENT")
    assert (current.seq, current.mission_state, current.mission_mode) == (3, ACTIVE, 1)


def test_set_current_goes_there_from_here() -> None:
    station = begun(waypoint(800), waypoint(800, 800), waypoint(0, -600))
    until_reached(station, 1)
    station.run(5.0)
    station.send(mav.MAVLink_mission_set_current_message(1, 1, 4))
    assert station.last("MISSION_CURRENT").seq == 4
    until_reached(station, 4)
    assert reached(station) == [1, 4]
    assert station.command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 9) == DENIED


def test_pause_and_continue_are_for_copters_only() -> None:
    station = begun(waypoint(800))
    assert station.command(mav.MAV_CMD_DO_PAUSE_CONTINUE, 0) == UNSUPPORTED
    assert station.command(mav.MAV_CMD_DO_PAUSE_CONTINUE, 1) == UNSUPPORTED


def test_mission_start_is_auto_and_has_no_first_and_last_item() -> None:
    station = plane(take_off(40), waypoint(500))
    assert station.command(mav.MAV_CMD_MISSION_START, 1, 2) == DENIED
    assert station.command(mav.MAV_CMD_MISSION_START) == ACCEPTED
    assert station.last("HEARTBEAT").custom_mode == AUTO


def test_a_guided_item_is_circled() -> None:
    station = begun(waypoint(800))
    until_reached(station, 1)
    station.mode(GUIDED)
    target = item(north_m=0, east_m=400, up_m=70)
    target.current = 2
    assert [m.type for m in station.send(target) if m.get_type() == "MISSION_ACK"] == [0]
    station.run(60.0)
    assert 60.0 < radius(station, 0, 400) < 110.0


# Landing.

APPROACH = (waypoint(-600, 0, 40), item(mav.MAV_CMD_NAV_LAND, 0, 0, 0))
LAND_START = item(mav.MAV_CMD_DO_LAND_START, anywhere=True)


def test_it_lands_on_the_place_flares_rolls_out_and_disarms() -> None:
    station = begun(waypoint(100, 300), *APPROACH, parameters={"LAND_DISARMDELAY": 5})
    until_said(station, "Landing approach start at", 200.0)
    station.run_until(lambda: -station.position[2] < 15.0)
    assert airspeed(station) == pytest.approx(19.5, abs=1.5)
    assert abs(station.position[1]) < 5.0, "on the line of the approach"
    until_said(station, "Auto disarmed")
    assert station.changes("EXTENDED_SYS_STATE", "landed_state")[-4:] == [
        TAKING_OFF, IN_AIR, LANDING, ON_GROUND,
    ]  # fmt: skip
    assert math.hypot(*station.position[:2]) < 60.0
    impact = next(text for text in station.texts() if "SIM Hit ground at" in text)
    assert float(impact.split()[-2]) < 3.0, "it sinks gently"
    station.run(1.5)
    assert not station.last("HEARTBEAT").base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    assert 4 not in reached(station), "a landing never counts as reached"
    assert any(text.startswith("Flare ") for text in station.texts())
    assert any(text.startswith("Distance from LAND point=") for text in station.texts())


def test_do_land_start_is_where_the_landing_begins() -> None:
    station = begun(waypoint(1500), LAND_START, *APPROACH)
    until_reached(station, 1)
    assert station.command(mav.MAV_CMD_DO_LAND_START) == ACCEPTED
    assert "Landing sequence start" in station.texts()
    until_reached(station, 4)
    assert 2 not in reached(station)


def test_without_do_land_start_there_is_no_landing_to_go_to() -> None:
    station = begun(waypoint(1500), *APPROACH)
    until_reached(station, 1)
    assert station.command(mav.MAV_CMD_DO_LAND_START) == FAILED
    assert "Unable to start landing sequence" in station.texts()
    assert station.last("HEARTBEAT").custom_mode == AUTO


@pytest.mark.parametrize("autoland", [1.0, 2.0])
def test_rtl_continues_to_the_landing_if_wanted(autoland: float) -> None:
    station = begun(waypoint(1500), LAND_START, *APPROACH, parameters={"RTL_AUTOLAND": autoland})
    until_reached(station, 1)
    station.mode(RTL)
    took = until_said(station, "Landing sequence start")
    assert (took < 1.0) == (autoland == 2.0)
    station.run(1.0)
    assert station.last("HEARTBEAT").custom_mode == AUTO
    assert station.last("MISSION_CURRENT").seq == 4


def test_a_landing_that_is_left_begins_again() -> None:
    station = begun(LAND_START, *APPROACH)
    until_said(station, "Landing approach start", 200.0)
    station.run(5.0)
    station.mode(GUIDED)
    assert "Restarted landing via DO_LAND_START: 2" in station.texts()
    station.mode(AUTO)
    station.run(1.0)
    assert station.last("MISSION_CURRENT").seq == 3


def test_a_go_around_climbs_and_comes_again() -> None:
    station = begun(*APPROACH)
    assert station.command(mav.MAV_CMD_DO_GO_AROUND) == FAILED, "it does not land yet"
    until_said(station, "Landing approach start", 200.0)
    station.run_until(lambda: -station.position[2] < 15.0)
    assert station.command(mav.MAV_CMD_DO_GO_AROUND, 50.0) == ACCEPTED
    until_said(station, "Restarted landing sequence at waypoint 2")
    assert -station.position[2] == pytest.approx(50.0, abs=3.0)
    station.run(1.0)
    assert station.last("MISSION_CURRENT").seq == 2
