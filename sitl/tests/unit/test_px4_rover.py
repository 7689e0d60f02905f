"""PX4's rovers and boats, after the source of v1.17 and its simulated rover."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.rover.pursuit import bearing_rad, speed_in_time
from sitl_support.ground_station import (
    ACCEPTED,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
    VELOCITY,
)
from sitl_support.missions import upload
from sitl_support.px4_station import HOME, NAN, Px4Station, at, plan_item, ready_px4

pytestmark = pytest.mark.wide

KINDS = ["rover", "boat"]
ARM = mav.MAV_CMD_COMPONENT_ARM_DISARM
WAYPOINT = mav.MAV_CMD_NAV_WAYPOINT


def driving(
    vehicle: str = "rover",
    parameters: dict[str, float] | None = None,
    wind_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Px4Station:
    """Armed in AUTO.LOITER; texts are heard."""
    station = ready_px4(parameters=parameters, vehicle=vehicle, wind_ned_m_s=wind_ned_m_s)
    station.quiet().heartbeats(True)
    station.run(0.1)
    assert station.arm() == ACCEPTED
    station.run(1.0)
    return station


@pytest.fixture
def rover() -> Px4Station:
    """A rover that is armed."""
    return driving()


def reposition(station: Px4Station, north_m: float, east_m: float) -> int:
    x, y = at(north_m, east_m)
    return station.command_int(192, 6, -1, 1, 0, NAN, x=x, y=y, z=HOME.altitude_amsl_m)


def heading(station: Px4Station) -> float:
    return float(station.simulation.truth.yaw_rad[0])


# Identity, arming and modes.


@pytest.mark.parametrize(("vehicle", "kind"), [("rover", 10), ("boat", 11)])
def test_each_says_what_it_is_and_is_ready_in_auto_loiter(vehicle: str, kind: int) -> None:
    station = ready_px4(vehicle=vehicle)
    beat = station.last("HEARTBEAT")
    assert (beat.autopilot, beat.type) == (12, kind)
    assert (beat.custom_mode, beat.base_mode, beat.system_status) == (px4.LOITER, 29, 3)
    assert station.last("SYS_STATUS").onboard_control_sensors_health & 0x10000000


def test_modes_that_are_a_copters_have_names_instead_of_standard_modes() -> None:
    station = ready_px4(vehicle="rover")
    answers = station.send(mav.MAVLink_command_long_message(1, 1, 512, 0, 435, 0, 0, 0, 0, 0, 0))
    modes = {m.custom_mode: m for m in answers if m.get_type() == "AVAILABLE_MODES"}
    assert len(modes) == 26
    named = {m.mode_name: m.standard_mode for m in modes.values()}
    assert [named[name] for name in ("Altitude", "Position", "Orbit")] == [0, 0, 0]
    assert modes[px4.RTL].standard_mode == 5


def test_armed_is_not_landed(rover: Px4Station) -> None:
    assert rover.texts()[-2:] == ["Armed by external command\t", "Takeoff detected\t"]
    assert rover.changes("EXTENDED_SYS_STATE", "landed_state") == [1, 2]


def test_it_stays_armed_and_may_be_disarmed_while_it_rolls(rover: Px4Station) -> None:
    rover.run(15.0)
    assert rover.armed
    reposition(rover, 40.0, 0.0)
    rover.run(4.0)
    assert rover.velocity[0] > 2.0
    assert rover.command(ARM, 0) == ACCEPTED
    rover.run(0.1)
    assert rover.velocity[0] > 1.0


def test_altctl_is_accepted_while_disarmed_and_never_runs() -> None:
    station = ready_px4(vehicle="rover")
    assert station.mode(px4.ALTCTL) == ACCEPTED
    assert station.arm() == TEMPORARILY_REJECTED
    station.mode(px4.LOITER)
    station.arm()
    assert station.mode(px4.ALTCTL) == TEMPORARILY_REJECTED


@pytest.mark.parametrize("number", [px4.RTL, px4.LAND])
def test_it_is_not_armed_in_rtl_and_land(number: int) -> None:
    station = ready_px4(vehicle="rover")
    assert station.mode(number) == ACCEPTED
    assert station.arm() == TEMPORARILY_REJECTED


# Going somewhere.


@pytest.mark.parametrize("vehicle", KINDS)
def test_do_reposition_drives_to_a_place_and_stays(vehicle: str) -> None:
    station = driving(vehicle)
    assert reposition(station, 30.0, 10.0) == ACCEPTED
    accept_m = station.parameter("NAV_ACC_RAD")
    station.run_until(lambda: math.dist(station.position[:2], (30.0, 10.0)) < accept_m)
    station.run(10.0)
    assert math.dist(station.position[:2], (30.0, 10.0)) < accept_m + 1.0
    assert station.custom_mode == px4.LOITER


def test_do_reposition_disarmed_only_changes_the_mode() -> None:
    station = ready_px4(vehicle="rover")
    station.mode(px4.MANUAL)
    assert reposition(station, 30.0, 0.0) == ACCEPTED
    assert station.custom_mode == px4.LOITER
    station.arm()
    station.run(5.0)
    assert math.hypot(*station.position[:2]) < 0.1


def test_do_reposition_needs_change_mode(rover: Px4Station) -> None:
    x, y = at(10.0, 0.0)
    assert rover.command_int(192, 6, -1, 0, 0, NAN, x=x, y=y, z=0.0) == UNSUPPORTED


def test_ro_speed_lim_and_do_change_speed_limit_the_speed(rover: Px4Station) -> None:
    """Told 1.5 m/s it drives 1.9: the throttle is a feed-forward."""
    reposition(rover, 60.0, 0.0)
    rover.run(5.0)
    assert rover.velocity[0] == pytest.approx(3.0, abs=0.1)
    assert rover.command(178, 1, 1.5, -1) == ACCEPTED
    rover.run(3.0)
    assert rover.velocity[0] == pytest.approx(1.9, abs=0.1)
    assert rover.command(178, 1, 9.0, -1) == ACCEPTED
    rover.run(3.0)
    assert rover.velocity[0] == pytest.approx(3.0, abs=0.1)


def test_hold_at_speed_comes_back_to_where_it_was_chosen(rover: Px4Station) -> None:
    offboard(rover)
    rover.stream(4.0, 5.0, lambda: rover.setpoint(VELOCITY, velocity=(3.0, 0.0, 0.0)))
    place = rover.position
    assert rover.mode(px4.LOITER) == ACCEPTED
    rover.run(1.5)
    assert math.dist(rover.position[:2], place[:2]) > 0.5, "it cannot stop at once"
    rover.run(15.0)
    assert math.dist(rover.position[:2], place[:2]) < 0.7
    assert math.hypot(*rover.velocity) < 0.1


def test_a_boat_that_drifts_away_comes_back() -> None:
    station = driving("boat", wind_ned_m_s=(0.0, 6.0, 0.0))
    far = []
    for _ in range(60):
        station.run(1.0)
        far.append(math.hypot(*station.position[:2]))
    assert max(far) > 0.3, "it drifts"
    assert max(far) < 8.0


# Take-off, landing, returning.


def test_auto_takeoff_is_over_as_soon_as_it_is_armed() -> None:
    station = ready_px4(vehicle="rover")
    assert station.command(22, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    assert station.custom_mode == px4.TAKEOFF
    assert station.arm() == ACCEPTED
    station.run(1.0)
    assert station.custom_mode == px4.LOITER
    assert station.position == pytest.approx((0.0, 0.0, 0.0), abs=0.05)


def test_auto_land_has_landed_at_once_and_disarms(rover: Px4Station) -> None:
    assert rover.command(21, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    took_s = rover.run_until(lambda: not rover.armed)
    assert took_s == pytest.approx(2.0, abs=0.3)
    assert rover.texts()[-2:] == ["Landing detected\t", "Disarmed by landing\t"]


@pytest.mark.parametrize("vehicle", KINDS)
def test_return_is_a_straight_path_home_that_ends_in_disarming(vehicle: str) -> None:
    station = driving(vehicle)
    reposition(station, 25.0, 15.0)
    station.run(20.0)
    assert station.mode(px4.RTL) == ACCEPTED
    station.run(2.1)
    assert station.last("EXTENDED_SYS_STATE").landed_state == 4, "LANDING all the way"
    assert "RTL: land at destination\t" in station.texts()
    station.run_until(lambda: not station.armed, 90.0)
    assert math.hypot(*station.position[:2]) < station.parameter("NAV_ACC_RAD") + 1.5
    assert station.texts()[-2:] == ["Landing detected\t", "Disarmed by landing\t"]
    assert station.custom_mode == px4.LOITER


# OFFBOARD.


def offboard(station: Px4Station) -> Px4Station:
    station.stream_to(0.5, 0.0, 0.0, 0.0)
    assert station.mode(px4.OFFBOARD) == ACCEPTED
    return station


@pytest.mark.parametrize("vehicle", KINDS)
def test_offboard_drives_to_a_position_whatever_its_height(vehicle: str) -> None:
    station = offboard(driving(vehicle))
    station.stream_to(25.0, 20.0, 20.0, -50.0)
    accept_m = station.parameter("NAV_ACC_RAD")
    assert math.dist(station.position[:2], (20.0, 20.0)) < accept_m + 0.5


def test_an_offboard_velocity_is_a_course_and_a_speed_never_backwards(rover: Px4Station) -> None:
    offboard(rover)
    rover.stream(6.0, 10.0, lambda: rover.setpoint(VELOCITY, velocity=(-2.0, 0.0, 0.0)))
    assert rover.velocity[0] == pytest.approx(-2.3, abs=0.15)
    assert abs(heading(rover)) == pytest.approx(math.pi, abs=0.1)


@pytest.mark.parametrize(
    ("told_m_s", "driven_m_s"),
    [(0.5, 0.0), (0.7, 0.0), (0.8, 1.07), (1.0, 1.3), (1.5, 1.85), (2.0, 2.35), (3.0, 3.0)],
)
def test_an_offboard_speed_is_a_throttle_that_moves_nothing_below_0_8(
    rover: Px4Station, told_m_s: float, driven_m_s: float
) -> None:
    """The real one's speed for a setpoint depends a little on the course.

    It did not move up to 0.7 m/s. A setpoint of 1.0 m/s gave 1.2 to 1.3 m/s, 1.5 gave 1.8, 2.0
    gave 2.3 to 2.4 and 3.0 gave 2.5 to 3.1.
    """
    offboard(rover)
    rover.stream(4.0, 10.0, lambda: rover.setpoint(VELOCITY, velocity=(told_m_s, 0.0, 0.0)))
    assert rover.velocity[0] == pytest.approx(driven_m_s, abs=0.1)


def test_a_velocity_of_zero_steers_north_while_it_brakes(rover: Px4Station) -> None:
    """Seen on the real one: 100 degrees from 2.6 m/s, 54 from 2 m/s."""
    offboard(rover)
    rover.stream(4.0, 10.0, lambda: rover.setpoint(VELOCITY, velocity=(0.0, 3.0, 0.0)))
    assert heading(rover) == pytest.approx(math.pi / 2, abs=0.05)
    rover.stream(2.0, 10.0, lambda: rover.setpoint(VELOCITY, velocity=(0.0, 0.0, 0.0)))
    assert math.hypot(*rover.velocity) < 0.1
    assert heading(rover) < math.radians(45.0)


def test_an_offboard_body_velocity_is_turned_by_the_heading(rover: Px4Station) -> None:
    offboard(rover)
    message = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    rover.stream(1.0, 10.0, lambda: rover.setpoint(VELOCITY, *message, frame=8))
    assert heading(rover) > 0.2, "to the right means turning right"


def test_yaw_yaw_rate_and_acceleration_in_offboard_move_nothing(rover: Px4Station) -> None:
    offboard(rover)
    rover.stream(
        3.0,
        10.0,
        lambda: rover.setpoint(0x03F, acceleration=(1.0, 0.0, 0.0), yaw=1.0, yaw_rate=1.0),
    )
    assert rover.custom_mode == px4.OFFBOARD
    assert math.hypot(*rover.position[:2]) < 0.1
    assert heading(rover) == pytest.approx(0.0, abs=0.05)


def test_a_height_alone_in_offboard_moves_nothing(rover: Px4Station) -> None:
    offboard(rover)
    rover.stream(3.0, 10.0, lambda: rover.setpoint(0xDFB, (0.0, 0.0, -5.0)))
    assert rover.custom_mode == px4.OFFBOARD
    assert math.hypot(*rover.position[:2]) < 0.1


def test_a_lost_stream_returns_home_and_a_resumed_one_takes_control_again(
    rover: Px4Station,
) -> None:
    offboard(rover)
    rover.stream_to(4.0, 60.0, 0.0, 0.0)
    rover.returns_without_setpoints()
    rover.stream_to(0.3, 60.0, 0.0, 0.0)
    assert rover.custom_mode == px4.OFFBOARD


def test_com_obl_rc_act_3_returns_home_instead() -> None:
    station = offboard(driving(parameters={"COM_OBL_RC_ACT": 3}))
    station.stream_to(2.0, 40.0, 0.0, 0.0)
    station.run_until(lambda: station.custom_mode == px4.RTL, 3.0)


def test_a_lost_ground_station_is_nav_dll_act() -> None:
    station = driving(parameters={"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 5, "COM_FAIL_ACT_T": 0})
    reposition(station, 30.0, 0.0)
    station.run(3.0)
    station.heartbeats(False)
    took_s = station.run_until(lambda: station.custom_mode == px4.RTL)
    assert took_s == pytest.approx(5.0, abs=1.1)


# Sticks.


def sticks(station: Px4Station, forward: float, turn: float) -> None:
    station.send(
        mav.MAVLink_manual_control_message(1, 0, int(turn * 1000), 500 + int(forward * 500), 0, 0)
    )


def test_manual_passes_the_sticks_on(rover: Px4Station) -> None:
    sticks(rover, 0.0, 0.0)
    assert rover.mode(px4.MANUAL) == ACCEPTED
    rover.stream(2.0, 10.0, lambda: sticks(rover, 0.4, 0.3))
    assert math.hypot(*rover.velocity) > 1.0
    assert heading(rover) > 0.3


def test_posctl_asks_for_a_speed_and_keeps_the_course(rover: Px4Station) -> None:
    sticks(rover, 0.0, 0.0)
    assert rover.mode(px4.POSCTL) == ACCEPTED
    rover.stream(4.0, 10.0, lambda: sticks(rover, -0.5, 0.0))
    assert rover.velocity[0] == pytest.approx(-1.9, abs=0.1)
    assert heading(rover) == pytest.approx(0.0, abs=0.05)


def test_posctl_without_sticks_falls_back_to_nav_rcl_act(rover: Px4Station) -> None:
    assert rover.mode(px4.POSCTL) == TEMPORARILY_REJECTED
    sticks(rover, 0.0, 0.0)
    assert rover.mode(px4.POSCTL) == ACCEPTED
    rover.run(1.0)
    assert rover.custom_mode == px4.LOITER, "for COM_FAIL_ACT_T"
    rover.run(5.0)
    assert rover.custom_mode == px4.RTL


# Missions.


@pytest.mark.parametrize("vehicle", KINDS)
def test_a_mission_is_driven_in_order_and_ends_at_its_last_place(vehicle: str) -> None:
    station = driving(vehicle)
    places = [(30.0, 0.0), (30.0, 30.0), (0.0, 30.0)]
    assert upload(station, [plan_item(WAYPOINT, *place) for place in places]) == 0
    station.run(0.2)
    assert station.command(300) == ACCEPTED
    nearest = [math.inf] * 3
    for _ in range(180):
        station.run(0.5)
        far = [math.dist(station.position[:2], place) for place in places]
        nearest = [min(pair) for pair in zip(nearest, far, strict=True)]
        if "Mission finished, loitering\t" in station.texts():
            break
    assert station.changes("MISSION_ITEM_REACHED", "seq") == [0, 1, 2]
    assert max(nearest) < 10.5 if vehicle == "boat" else max(nearest) < 3.1
    station.run(10.0)
    assert station.custom_mode == px4.LOITER
    assert math.dist(station.position[:2], places[-1]) < (4.0 if vehicle == "boat" else 1.0)


def test_a_delay_stops_at_the_place(rover: Px4Station) -> None:
    items = [plan_item(WAYPOINT, 10.0, 0.0, 0.0, 4.0), plan_item(WAYPOINT, 20.0, 0.0)]
    assert upload(rover, items) == 0
    rover.run(0.2)
    assert rover.command(300) == ACCEPTED
    rover.run_until(lambda: math.dist(rover.position[:2], (10.0, 0.0)) < 0.5)
    rover.run(3.0)
    assert math.hypot(*rover.velocity) < 0.1
    rover.run_until(lambda: rover.position[0] > 19.0)


def test_an_rtl_item_changes_the_mode(rover: Px4Station) -> None:
    home = plan_item(20, 0.0, 0.0)
    home.frame = 2
    assert upload(rover, [plan_item(WAYPOINT, 10.0, 0.0), home]) == 0
    rover.run(0.2)
    assert rover.command(300) == ACCEPTED
    rover.run_until(lambda: rover.custom_mode == px4.RTL)
    rover.run_until(lambda: not rover.armed)
    assert math.hypot(*rover.position[:2]) < 0.6


def test_a_mission_that_is_cleared_ends_in_auto_loiter(rover: Px4Station) -> None:
    assert upload(rover, [plan_item(WAYPOINT, 50.0, 0.0)]) == 0
    rover.run(0.2)
    assert rover.command(300) == ACCEPTED
    rover.run(4.0)
    rover.send(mav.MAVLink_mission_clear_all_message(1, 1, 0))
    assert rover.custom_mode == px4.LOITER
    assert "No valid mission available, loitering\t" in "".join(rover.texts())


# Telemetry.


def test_no_setpoints_of_attitude_and_local_position_are_published(rover: Px4Station) -> None:
    for message_id in (36, 74, 83, 85, 87, 105):
        assert rover.interval(message_id, 5.0) == ACCEPTED
    reposition(rover, 30.0, 0.0)
    rover.run(3.0)
    assert not rover.messages("ATTITUDE_TARGET")
    assert not rover.messages("POSITION_TARGET_LOCAL_NED")
    target = rover.last("POSITION_TARGET_GLOBAL_INT")
    assert (target.lat_int, target.lon_int) == pytest.approx(at(30.0, 0.0), abs=2)
    steering, throttle = (
        rover.last("SERVO_OUTPUT_RAW").servo1_raw,
        rover.last("SERVO_OUTPUT_RAW").servo2_raw,
    )
    assert steering == pytest.approx(1500, abs=30)
    assert throttle > 1520
    assert rover.last("HIGHRES_IMU").zacc == pytest.approx(-9.81, abs=0.01)


# The laws.


def test_the_look_ahead_point_lies_on_the_line_and_not_beyond_its_end() -> None:
    line = ((0.0, 0.0), (100.0, 0.0))
    assert bearing_rad((10.0, 0.0), *line, 5.0) == pytest.approx(0.0)
    assert bearing_rad((10.0, 3.0), *line, 5.0) == pytest.approx(-math.atan2(3.0, 4.0))
    assert bearing_rad((10.0, 50.0), *line, 5.0) == pytest.approx(-math.pi / 2)
    assert abs(bearing_rad((120.0, 0.0), *line, 5.0)) == pytest.approx(math.pi)
    assert bearing_rad((98.0, 2.0), *line, 5.0) == pytest.approx(-math.pi / 4)


def test_the_speed_in_time_can_be_stopped_from() -> None:
    for distance in (0.1, 1.0, 10.0):
        speed = speed_in_time(10.0, 3.0, distance, 0.0)
        stopping_m = speed * (speed / 3.0 + 3.0 / 10.0) / 2.0
        assert stopping_m < distance * 1.2
    assert speed_in_time(10.0, 3.0, 0.0, 2.0) == 2.0
