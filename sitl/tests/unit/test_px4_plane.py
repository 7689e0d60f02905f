"""PX4's planes, after the source of v1.17 and its simulated plane."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.plane import path_guidance
from sitl_support.ground_station import (
    ACCEPTED,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
    VELOCITY,
    Message,
)
from sitl_support.missions import upload
from sitl_support.px4_station import HOME, NAN, Px4Station, at, plan_item, ready_px4

pytestmark = pytest.mark.wide

ARM = mav.MAV_CMD_COMPONENT_ARM_DISARM
WAYPOINT, TAKEOFF, LAND = 16, 22, 21
ALTITUDE_M = HOME.altitude_amsl_m


def on_runway(
    parameters: dict[str, float] | None = None,
    wind_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Px4Station:
    """Disarmed; texts are heard."""
    station = ready_px4(parameters=parameters, vehicle="plane", wind_ned_m_s=wind_ned_m_s).quiet()
    station.heartbeats(True)
    station.run(0.1)
    return station


def flying(
    height_m: float = 50.0,
    parameters: dict[str, float] | None = None,
    wind_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Px4Station:
    """Circling in AUTO.LOITER after a take-off."""
    station = on_runway(parameters, wind_ned_m_s)
    assert station.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, ALTITUDE_M + height_m) == ACCEPTED
    assert station.arm() == ACCEPTED
    station.run_until(lambda: station.custom_mode == px4.LOITER)
    station.run(10.0)
    return station


@pytest.fixture
def plane() -> Px4Station:
    """A plane in flight."""
    return flying()


def reposition(station: Px4Station, north_m: float, east_m: float, up_m: float) -> int:
    x, y = at(north_m, east_m)
    return station.command_int(192, 0, -1, 1, 0, NAN, x=x, y=y, z=ALTITUDE_M + up_m)


def distances(station: Px4Station, centre: tuple[float, float], seconds: float) -> list[float]:
    """How far it is from a place, twice a second."""
    found = []
    for _ in range(round(2 * seconds)):
        station.run(0.5)
        found.append(math.dist(station.position[:2], centre))
    return found


# Identity, arming and modes.


def test_it_says_what_it_is_and_is_ready_in_auto_loiter() -> None:
    station = ready_px4(vehicle="plane")
    beat = station.last("HEARTBEAT")
    assert (beat.autopilot, beat.type) == (12, 1)
    assert (beat.custom_mode, beat.base_mode, beat.system_status) == (px4.LOITER, 29, 3)


def test_posctl_is_the_standard_mode_cruise() -> None:
    station = ready_px4(vehicle="plane")
    answers = station.send(mav.MAVLink_command_long_message(1, 1, 512, 0, 435, 0, 0, 0, 0, 0, 0))
    modes = {m.custom_mode: m for m in answers if m.get_type() == "AVAILABLE_MODES"}
    assert len(modes) == 26
    assert modes[px4.POSCTL].standard_mode == 3
    assert modes[px4.ALTCTL].standard_mode == 4


def test_armed_in_auto_loiter_it_stands_and_stays_armed() -> None:
    station = on_runway()
    assert station.arm() == ACCEPTED
    station.run(20.0)
    assert station.armed, "COM_DISARM_PRFLT is off"
    assert math.hypot(*station.position) < 0.1
    assert station.vehicle.firmware.landed_state == 1


@pytest.mark.parametrize("number", [px4.RTL, px4.LAND])
def test_it_is_not_armed_in_rtl_and_land(number: int) -> None:
    station = on_runway()
    assert station.mode(number) == ACCEPTED
    assert station.arm() == TEMPORARILY_REJECTED


# Take-off.


def test_a_take_off_rolls_rotates_climbs_and_ends_in_a_circle() -> None:
    station = on_runway()
    assert station.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    assert station.arm() == ACCEPTED
    station.run(0.2)
    assert station.texts()[-2:] == [
        "Armed by external command\t",
        "Using default takeoff altitude: 25.0 m\t",
    ]
    station.run_until(lambda: station.velocity[0] > 8.0)
    assert station.position[2] == pytest.approx(0.0, abs=0.01), "it has not rotated yet"
    assert "Takeoff detected\t" in station.texts(), "the land detector looks at the speed"
    station.run_until(lambda: station.custom_mode == px4.LOITER)
    assert -station.position[2] == pytest.approx(25.0, abs=2.0)
    assert abs(station.position[1]) < 1.0, "straight on"
    centre = station.position[:2]
    station.run(25.0)
    assert distances(station, (centre[0], centre[1]), 30.0) == pytest.approx([80.0] * 60, abs=4.0)
    assert -station.position[2] == pytest.approx(25.0, abs=1.0)
    station.run(1.1)
    assert station.changes("EXTENDED_SYS_STATE", "landed_state") == [1, 3, 2]


def test_rwto_ramp_time_opens_the_throttle_slowly() -> None:
    speeds = []
    for ramp_s in (1.0, 6.0):
        station = on_runway({"RWTO_RAMP_TIME": ramp_s})
        station.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, NAN)
        station.arm()
        station.run(3.5)
        speeds.append(station.velocity[0])
    assert speeds[0] > 2.0 * speeds[1]


def test_a_take_off_height_below_the_plane_is_not_flown_to() -> None:
    station = on_runway()
    assert station.arm() == ACCEPTED
    assert station.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 10.0) == ACCEPTED
    assert "Already higher than takeoff altitude\t" in station.texts()
    station.run(5.0)
    assert math.hypot(*station.position) < 0.1


def test_disarming_in_the_air_is_denied_unless_forced(plane: Px4Station) -> None:
    assert plane.command(ARM, 0) == TEMPORARILY_REJECTED
    assert plane.command(ARM, 0, 21196) == ACCEPTED
    assert not plane.armed


# Holding.


def test_hold_circles_the_place_where_it_was_chosen_and_cannot_hover(plane: Px4Station) -> None:
    plane.stream_to(0.3, 2000.0, 0.0, -50.0)
    assert plane.mode(px4.OFFBOARD) == ACCEPTED
    plane.stream_to(8.0, 2000.0, 0.0, -50.0)
    assert plane.mode(px4.LOITER) == ACCEPTED
    centre = plane.position[:2]
    far = distances(plane, (centre[0], centre[1]), 60.0)
    assert far[-40:] == pytest.approx([80.0] * 40, abs=5.0)
    assert math.hypot(*plane.velocity) > 12.0


def test_nav_loiter_rad_is_the_radius_and_its_sign_the_direction() -> None:
    station = flying(parameters={"NAV_LOITER_RAD": -120.0})
    assert reposition(station, 100.0, 100.0, 50.0) == ACCEPTED
    station.run(60.0)
    assert distances(station, (100.0, 100.0), 15.0) == pytest.approx([120.0] * 30, abs=6.0)
    north, east, _ = station.position
    v_n, v_e, _ = station.velocity
    assert (north - 100.0) * v_e - (east - 100.0) * v_n < 0.0, "counter-clockwise"


def test_do_reposition_circles_another_place_at_an_altitude_above_sea_level(
    plane: Px4Station,
) -> None:
    assert reposition(plane, 300.0, 200.0, 80.0) == ACCEPTED
    plane.run(60.0)
    assert distances(plane, (300.0, 200.0), 10.0) == pytest.approx([80.0] * 20, abs=4.0)
    assert -plane.position[2] == pytest.approx(80.0, abs=1.5)


def test_a_wind_moves_the_circle_little() -> None:
    station = flying(wind_ned_m_s=(0.0, 6.0, 0.0))
    reposition(station, 0.0, 0.0, 60.0)
    station.run(60.0)
    assert distances(station, (0.0, 0.0), 30.0) == pytest.approx([80.0] * 60, abs=20.0)


def test_do_change_speed_changes_the_airspeed_within_its_limits(plane: Px4Station) -> None:
    assert plane.interval(74, 2.0) == ACCEPTED
    for asked, flown in ((12.0, 12.0), (40.0, 20.0)):
        assert plane.command(178, 0, asked, -1) == ACCEPTED
        plane.run(15.0)
        assert plane.last("VFR_HUD").airspeed == pytest.approx(flown, abs=1.0)


# Coming back, coming down.


def test_return_climbs_circles_home_and_does_not_land(plane: Px4Station) -> None:
    reposition(plane, 400.0, 0.0, 50.0)
    plane.run(40.0)
    assert plane.mode(px4.RTL) == ACCEPTED
    assert any(text.startswith("RTL: start return at 58") for text in plane.texts())
    plane.run_until(lambda: "RTL: completed, loitering\t" in plane.texts(), 120.0)
    plane.run(40.0)
    north, east, _ = plane.vehicle.firmware.navigator.home_ned_m()
    assert north == pytest.approx(5.0, abs=3.0), "home is where the take-off was detected"
    assert distances(plane, (north, east), 20.0) == pytest.approx([80.0] * 40, abs=5.0)
    assert -plane.position[2] == pytest.approx(100.0, abs=2.0)
    assert plane.custom_mode == px4.RTL


def test_rtl_land_delay_lets_it_land_at_home() -> None:
    parameters = {"RTL_LAND_DELAY": 2.0, "RTL_RETURN_ALT": 30.0, "RTL_DESCEND_ALT": 20.0}
    station = flying(30.0, parameters)
    assert station.mode(px4.RTL) == ACCEPTED
    station.run_until(lambda: not station.armed, 200.0)
    said = station.texts()
    assert "RTL: land at destination\t" in said
    assert said[-2:] == ["Landing detected\t", "Disarmed by landing\t"]
    assert math.hypot(*station.position[:2]) < 180.0


def test_auto_land_circles_down_flares_and_disarms() -> None:
    station = flying(20.0)
    assert station.command(LAND, 0, 0, 0, NAN, NAN, NAN, NAN) == ACCEPTED
    assert station.texts()[-1] == "Landing at current position\t"
    station.run(3.0)
    assert station.velocity[2] == pytest.approx(10.0 * 1.06 * math.sin(math.radians(5)), abs=0.3)
    station.run_until(lambda: station.position[2] > -0.05, 60.0)
    assert station.velocity[2] < 0.6, "it flares"
    station.run_until(lambda: not station.armed, 30.0)
    assert station.texts()[-2:] == ["Landing detected\t", "Disarmed by landing\t"]
    assert station.changes("EXTENDED_SYS_STATE", "landed_state") == [1, 3, 2, 4, 1]
    assert station.custom_mode == px4.LOITER


# OFFBOARD.


def offboard(station: Px4Station) -> Px4Station:
    station.stream_to(0.3, 0.0, 0.0, -50.0)
    assert station.mode(px4.OFFBOARD) == ACCEPTED
    return station


def test_an_offboard_position_is_flown_over_again_and_again(plane: Px4Station) -> None:
    offboard(plane)
    far = []
    for _ in range(160):
        plane.stream(0.5, 4.0, lambda: plane.go_to(300.0, 300.0, -50.0))
        far.append(math.dist(plane.position[:2], (300.0, 300.0)))
    assert plane.custom_mode == px4.OFFBOARD
    assert min(far) < 30.0
    assert max(far[-60:]) < 120.0
    assert -plane.position[2] == pytest.approx(50.0, abs=4.0)


def test_an_offboard_position_with_a_velocity_is_a_path(plane: Px4Station) -> None:
    offboard(plane)

    def send() -> None:
        plane.setpoint(0xDC0, (0.0, -100.0, -60.0), (10.0, 0.0, 0.0))

    plane.stream(40.0, 4.0, send)
    assert plane.position[1] == pytest.approx(-100.0, abs=3.0)
    assert plane.velocity[0] > 13.0, "the speed is the airspeed, whatever the velocity's size"
    assert -plane.position[2] == pytest.approx(60.0, abs=1.5)


def test_a_velocity_alone_keeps_offboard_and_controls_nothing(plane: Px4Station) -> None:
    offboard(plane)
    course = math.atan2(plane.velocity[1], plane.velocity[0])
    plane.stream(15.0, 4.0, lambda: plane.setpoint(VELOCITY, velocity=(-10.0, 0.0, -2.0)))
    assert plane.custom_mode == px4.OFFBOARD
    now = math.atan2(plane.velocity[1], plane.velocity[0])
    assert abs(math.remainder(now - course, math.tau)) < 0.6, "it flies straight on"
    assert -plane.position[2] == pytest.approx(50.0, abs=5.0)


def test_a_position_that_lacks_something_controls_nothing(plane: Px4Station) -> None:
    offboard(plane)
    plane.stream(10.0, 4.0, lambda: plane.setpoint(0xDFB, (0.0, 0.0, -90.0)))
    assert plane.custom_mode == px4.OFFBOARD
    assert -plane.position[2] == pytest.approx(50.0, abs=5.0)


def test_a_lost_stream_returns_home_and_a_resumed_one_takes_control_again(
    plane: Px4Station,
) -> None:
    offboard(plane)
    plane.stream_to(1.0, 500.0, 0.0, -50.0)
    plane.returns_without_setpoints()
    plane.stream_to(0.3, 500.0, 0.0, -50.0)
    assert plane.custom_mode == px4.OFFBOARD


# Missions.

PATTERN = [
    plan_item(TAKEOFF, 200.0, 0.0, 30.0),
    plan_item(WAYPOINT, 400.0, 0.0, 50.0),
    plan_item(WAYPOINT, 400.0, 400.0, 50.0),
    plan_item(WAYPOINT, 0.0, 400.0, 30.0),
    plan_item(LAND, 0.0, 50.0, 0.0),
]


def test_a_mission_from_take_off_to_a_straight_landing() -> None:
    station = on_runway()
    assert upload(station, PATTERN) == 0
    station.run(0.2)
    assert station.command(300) == ACCEPTED
    assert station.armed
    nearest = [math.inf] * 3
    while station.armed:
        station.run(0.5)
        places = ((400.0, 0.0), (400.0, 400.0), (0.0, 400.0))
        far = [math.dist(station.position[:2], place) for place in places]
        nearest = [min(pair) for pair in zip(nearest, far, strict=True)]
        assert station.now_s < 250.0
    assert max(nearest) < 40.0, "waypoints are turned at within the switch distance"
    assert station.changes("MISSION_ITEM_REACHED", "seq") == [0, 1, 2, 3, 4]
    assert math.dist(station.position[:2], (0.0, 50.0)) < 100.0
    assert abs(station.position[0]) < 5.0, "on the line of the approach"
    assert station.texts()[-1] == "Disarmed by landing\t"


def test_a_mission_without_a_landing_is_infeasible() -> None:
    station = on_runway()
    assert upload(station, PATTERN[:3]) == 0
    station.mode(px4.MISSION)
    assert station.arm() == TEMPORARILY_REJECTED


@pytest.mark.parametrize(
    "before",
    [
        plan_item(WAYPOINT, 0.0, 150.0, 40.0),
        plan_item(WAYPOINT, 0.0, 450.0, 0.0),
        plan_item(17, 0.0, 450.0, 30.0),
    ],
    ids=["too steep", "from below", "from a circle without an end"],
)
def test_a_landing_whose_approach_does_not_fit_is_infeasible(before: Message) -> None:
    station = on_runway()
    assert upload(station, [*PATTERN[:3], before, PATTERN[4]]) == 0
    station.mode(px4.MISSION)
    assert station.arm() == TEMPORARILY_REJECTED


def test_loiters_of_a_mission_last_as_they_say() -> None:
    station = flying(parameters={"MIS_TKO_LAND_REQ": 0})
    items = [
        plan_item(19, 200.0, 0.0, 50.0, 10.0, 0.0, 60.0),
        plan_item(19, 200.0, 200.0, 50.0, 30.0, 0.0, 60.0),
        plan_item(WAYPOINT, 0.0, 0.0, 50.0),
    ]
    assert upload(station, items) == 0
    station.run(0.2)
    assert station.command(300) == ACCEPTED
    reached_s: list[float] = []
    for _ in range(400):
        station.run(0.5)
        if len({m.seq for m in station.messages("MISSION_ITEM_REACHED")}) > len(reached_s):
            reached_s.append(station.now_s)
        if len(reached_s) == 3:
            break
    assert len(reached_s) == 3
    assert reached_s[1] - reached_s[0] > 30.0
    station.run(30.0)
    assert "Mission finished, loitering\t" in station.texts()
    assert max(distances(station, (0.0, 0.0), 20.0)) < 110.0, "round the last place"


def test_return_goes_to_the_landing_of_the_mission_and_lands() -> None:
    station = on_runway({"RTL_RETURN_ALT": 40.0})
    assert upload(station, PATTERN) == 0
    station.run(0.2)
    assert station.command(300) == ACCEPTED
    station.run_until(lambda: -station.position[2] > 45.0)
    assert station.mode(px4.RTL) == ACCEPTED
    station.run_until(lambda: not station.armed, 250.0)
    assert abs(station.position[0]) < 10.0
    assert "RTL: land at destination\t" in station.texts()


# Sticks and failsafes.


def sticks(station: Px4Station, roll: float, pitch: float, throttle: float = 0.5) -> None:
    values = (int(pitch * 1000), int(roll * 1000), int(throttle * 1000), 0, 0)
    station.send(mav.MAVLink_manual_control_message(1, *values))


def test_altctl_holds_the_height_and_banks_with_the_stick(plane: Px4Station) -> None:
    sticks(plane, 0.0, 0.0)
    assert plane.mode(px4.ALTCTL) == ACCEPTED
    plane.stream(6.0, 5.0, lambda: sticks(plane, 0.5, 0.0))
    assert plane.vehicle.firmware.motion.roll_rad == pytest.approx(math.radians(25.0), abs=0.05)
    plane.stream(6.0, 5.0, lambda: sticks(plane, 0.0, -1.0))
    assert plane.velocity[2] < -2.0, "pulled back it climbs"


def test_posctl_keeps_the_course(plane: Px4Station) -> None:
    sticks(plane, 0.0, 0.0)
    assert plane.mode(px4.POSCTL) == ACCEPTED
    plane.stream(4.0, 5.0, lambda: sticks(plane, 0.0, 0.0))
    course = math.atan2(plane.velocity[1], plane.velocity[0])
    plane.stream(10.0, 5.0, lambda: sticks(plane, 0.0, 0.0))
    now = math.atan2(plane.velocity[1], plane.velocity[0])
    assert abs(math.remainder(now - course, math.tau)) < 0.35
    assert -plane.position[2] == pytest.approx(50.0, abs=4.0)


def test_a_lost_ground_station_is_nav_dll_act_after_a_hold() -> None:
    station = flying(parameters={"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 5})
    station.heartbeats(False)
    station.run_until(lambda: station.custom_mode == px4.RTL, 15.0)
    assert station.vehicle.firmware.system_status == 5


# Telemetry.


def test_telemetry_of_a_plane(plane: Px4Station) -> None:
    reposition(plane, 300.0, 200.0, 50.0)
    for message_id in (36, 74, 83, 85, 87):
        assert plane.interval(message_id, 5.0) == ACCEPTED
    plane.run(40.0)
    hud = plane.last("VFR_HUD")
    assert hud.airspeed == pytest.approx(15.0, abs=0.5)
    target = plane.last("POSITION_TARGET_GLOBAL_INT")
    assert (target.lat_int, target.lon_int) == pytest.approx(at(300.0, 200.0), abs=2)
    nearest = plane.last("POSITION_TARGET_LOCAL_NED")
    assert math.dist((nearest.x, nearest.y), (300.0, 200.0)) == pytest.approx(80.0, abs=0.1)
    assert math.isnan(nearest.vx)
    assert 1000 < plane.last("SERVO_OUTPUT_RAW").servo4_raw < 2000


# The law.


def test_far_from_a_path_it_is_flown_to_and_near_it_along() -> None:
    law = path_guidance.Law(10.0, 0.7)
    north = path_guidance.line((0.0, 200.0), (0.0, 0.0), (1000.0, 0.0))
    far = path_guidance.sideways_m_s2((0.0, 200.0), (0.0, -15.0), north, law)
    assert far == pytest.approx(0.0, abs=0.01), "flying straight to it is right"
    on = path_guidance.line((50.0, 0.0), (0.0, 0.0), (1000.0, 0.0))
    assert path_guidance.sideways_m_s2((50.0, 0.0), (15.0, 0.0), on, law) == pytest.approx(0.0)
    circle = path_guidance.circle((80.0, 0.0), (0.0, 0.0), 80.0, (1.0, 0.0))
    needed = path_guidance.sideways_m_s2((80.0, 0.0), (0.0, 15.0), circle, law)
    assert needed == pytest.approx(15.0**2 / 80.0)


def test_do_change_altitude_keeps_the_circle_of_auto_loiter(plane: Px4Station) -> None:
    assert plane.command(186, 560.0) == ACCEPTED
    plane.run(1.1)
    assert plane.custom_mode == px4.LOITER
    status = plane.last("ORBIT_EXECUTION_STATUS")
    assert status.radius == pytest.approx(80.0)


def test_figures_of_eight_are_unsupported(plane: Px4Station) -> None:
    x, y = at(300.0, 0.0)
    assert plane.command_int(35, 0, 80, 1, 0, NAN, x=x, y=y, z=560.0) == UNSUPPORTED


def test_do_orbit_loiters_with_a_radius_of_its_own_until_the_next_reposition(
    plane: Px4Station,
) -> None:
    """Seen on the firmware with 120, -120, 40 and 20 m: the mode stays AUTO.LOITER."""
    x, y = at(300.0, 0.0)
    for radius_m in (-120.0, 50.0):
        assert plane.command_int(34, 0, radius_m, NAN, 0, NAN, x=x, y=y, z=ALTITUDE_M + 60.0) == (
            ACCEPTED
        )
        plane.run(60.0)
        assert plane.custom_mode == px4.LOITER
        assert plane.last("ORBIT_EXECUTION_STATUS").radius == radius_m
        assert distances(plane, (300.0, 0.0), 10.0) == pytest.approx([abs(radius_m)] * 20, abs=6.0)
        north, east, _ = plane.position
        v_n, v_e, _ = plane.velocity
        assert math.copysign(1.0, (north - 300.0) * v_e - east * v_n) == (
            math.copysign(1.0, radius_m)
        )
    reposition(plane, 300.0, 0.0, 60.0)
    plane.run(40.0)
    assert distances(plane, (300.0, 0.0), 10.0) == pytest.approx([80.0] * 20, abs=6.0)
