"""ArduCopter's own simulator was flown with the same script; this is what it did.

ArduPilot 4.7.0-dev, its standard parameters, calm. Numbers are its LOCAL_POSITION_NED. Legs of
AUTO are of February 2026 (46ae7859).
"""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig, Wind, World
from sitl_support.ground_station import (
    ACCELERATION,
    ACCEPTED,
    AUTO,
    BRAKE,
    GUIDED,
    LAND,
    POSITION,
    VELOCITY,
    YAW,
    GroundStation,
    copter,
    flying,
)
from sitl_support.missions import home, item, upload, waypoint

PAUSE, SPEED = mav.MAV_CMD_DO_PAUSE_CONTINUE, mav.MAV_CMD_DO_CHANGE_SPEED

Row = tuple[float, float, float]
"""Seconds, distance from where it began (m), and speed (m/s)"""


def moved(station: GroundStation, rows: list[Row], north_m: float) -> list[Row]:
    """The same rows of the simulated one, along North or against it."""
    begin_s, begin_m = station.now_s, station.position[0]
    seen = []
    for after_s, _, _ in rows:
        station.run(begin_s + after_s - station.now_s)
        way_m, speed = station.position[0] - begin_m, station.velocity[0]
        sign = math.copysign(1.0, north_m)
        seen.append((after_s, sign * way_m, sign * speed))
    return seen


def assert_alike(seen: list[Row], real: list[Row]) -> None:
    for (_, way_m, speed), (after_s, real_m, real_m_s) in zip(seen, real, strict=True):
        assert way_m == pytest.approx(real_m, abs=0.08 * abs(real[-1][1])), after_s
        assert speed == pytest.approx(real_m_s, abs=0.8), after_s


# A pause.

PAUSED_IN_GUIDED = [(1.0, 9.2, 8.19), (2.0, 16.25, 6.4), (3.0, 21.83, 3.9), (4.0, 24.33, 1.22)]
PAUSED_IN_AUTO = [(1.0, 8.68, 7.88), (2.0, 15.62, 5.84), (3.0, 20.36, 3.45), (4.0, 22.5, 0.8)]
WENT_ON_IN_AUTO = [(1.0, 0.36, 1.39), (2.0, 3.18, 4.01), (3.0, 8.17, 5.98), (4.0, 15.26, 8.08)]


def test_a_pause_in_guided_slows_down_as_much_as_the_real_one() -> None:
    """The desired motion is what is slowed down, and that is ahead of the vehicle."""
    station = flying(10.0)
    station.setpoint(POSITION, (60.0, 0.0, -10.0))
    station.run(4.0)
    assert station.command(PAUSE, 0) == ACCEPTED
    assert_alike(moved(station, PAUSED_IN_GUIDED, 1.0), PAUSED_IN_GUIDED)


def test_a_pause_in_auto_slows_down_along_the_leg_and_continues_from_there() -> None:
    station = flying(10.0)
    station.interval(42, 4.0)
    assert upload(station, [home(), waypoint(-120, 0), waypoint(-120, -40)]) == 0
    assert station.command(mav.MAV_CMD_MISSION_START) == ACCEPTED
    station.run(6.0)
    assert station.command(PAUSE, 0) == ACCEPTED
    assert_alike(moved(station, PAUSED_IN_AUTO, -1.0), PAUSED_IN_AUTO)
    station.run(6.0)
    assert math.hypot(*station.velocity) < 0.2
    assert station.last("MISSION_CURRENT").mission_state == mav.MISSION_STATE_PAUSED
    assert station.command(PAUSE, 1) == ACCEPTED
    assert_alike(moved(station, WENT_ON_IN_AUTO, -1.0), WENT_ON_IN_AUTO)


def test_a_speed_that_was_changed_in_a_pause_counts_after_it() -> None:
    station = flying(10.0)
    assert upload(station, [home(), waypoint(120, 0), waypoint(120, 40)]) == 0
    assert station.command(mav.MAV_CMD_MISSION_START) == ACCEPTED
    station.run(5.0)
    station.command(PAUSE, 0)
    station.run(6.0)
    assert station.command(SPEED, 1, 3.0, -1) == ACCEPTED
    station.run(2.0)
    assert math.hypot(*station.velocity) < 0.3, "it is still a pause"
    station.command(PAUSE, 1)
    station.run(6.0)
    assert station.velocity[0] == pytest.approx(3.0, abs=0.2)


# A position alone is flown to in a straight line.

Leg = tuple[tuple[float, float], list[tuple[float, float, float]]]
LEGS: list[Leg] = [
    # Target from the start, north and down, m; then time, s, and movement north and down, m.
    ((30.0, 30.0), [(3.0, 3.29, 3.23), (6.0, 7.83, 7.68), (12.0, 16.8, 16.68)]),
    ((-30.0, -20.0), [(3.0, -6.87, -4.09), (5.0, -14.06, -9.1), (8.0, -25.0, -16.36)]),
    ((-100.0, 25.0), [(3.0, -8.93, 3.3), (6.0, -27.82, 7.78), (12.0, -65.68, 16.77)]),
    ((60.0, -25.0), [(3.0, 8.89, -4.09), (6.0, 27.04, -11.58), (9.0, 45.56, -19.08)]),
    ((20.0, 30.0), [(3.0, 2.24, 3.23), (6.0, 5.24, 7.7), (12.0, 11.2, 16.69)]),
]


@pytest.mark.parametrize(("leg", "rows"), LEGS)
def test_down_and_up_a_slope_the_slower_direction_limits_the_other(
    leg: tuple[float, float], rows: list[tuple[float, float, float]]
) -> None:
    """WPNAV_SPEED 10, _DN 1.5, _UP 2.5: 45 degrees down are flown with 1.5 m/s over ground."""
    north_m, down_m = leg
    station = flying(40.0 if down_m > 0.0 else 10.0)
    station.run(4.0)
    begin_s, (north_0, _, down_0) = station.now_s, station.position
    station.setpoint(POSITION, (north_0 + north_m, 0.0, down_0 + down_m))
    for after_s, north, down in rows:
        station.run(begin_s + after_s - station.now_s)
        assert station.position[0] - north_0 == pytest.approx(north, abs=0.4), after_s
        assert station.position[2] - down_0 == pytest.approx(down, abs=0.3), after_s


# Speeds that were changed.


def fastest(station: GroundStation, north_m: float, seconds: float = 9.0) -> float:
    """The greatest speed on the way to a place so far north of here."""
    north, east, down = station.position
    station.setpoint(POSITION, (north + north_m, east, down))
    top = 0.0
    for _ in range(round(seconds / 0.1)):
        station.run(0.1)
        top = max(top, math.hypot(*station.velocity[:2]))
    return top


def test_a_changed_speed_is_lost_with_the_first_position_after_a_take_off() -> None:
    """Each kind of target in GUIDED begins with the parameters' speeds: 6.69 m/s were seen."""
    station = flying(15.0)
    assert station.command(SPEED, 1, 3.0, -1) == ACCEPTED
    assert fastest(station, 30.0) == pytest.approx(6.69, abs=0.3)
    assert station.command(SPEED, 1, 3.0, -1) == ACCEPTED
    assert fastest(station, -30.0, 14.0) == pytest.approx(3.08, abs=0.15), "now it is kept"


def test_a_changed_speed_is_lost_with_another_kind_of_target() -> None:
    """Seen: 3 m/s, a velocity of 6, and then a position with 9.73 m/s."""
    station = flying(15.0)
    fastest(station, 10.0)
    station.command(SPEED, 1, 3.0, -1)
    station.stream(6.0, 10.0, lambda: station.setpoint(VELOCITY, velocity=(6.0, 0.0, 0.0)))
    assert fastest(station, -80.0) > 8.5


def test_3_then_10_a_mission_and_a_brake_leave_nothing_of_the_3() -> None:
    station = flying(15.0)
    fastest(station, 5.0)
    for speed in (3.0, 10.0):
        assert station.command(SPEED, 1, speed, -1) == ACCEPTED
    assert fastest(station, 60.0) == pytest.approx(9.15, abs=0.5)
    slow = item(mav.MAV_CMD_DO_CHANGE_SPEED, params=(1.0, 3.0, -1.0), frame=3)
    assert upload(station, [home(), slow, waypoint(0, 0), waypoint(0, 60)]) == 0
    assert station.command(mav.MAV_CMD_MISSION_START) == ACCEPTED
    station.run(9.0)
    assert station.velocity[0] == pytest.approx(-3.0, abs=0.2)
    assert station.mode(BRAKE) == ACCEPTED
    assert station.command(SPEED, 1, 5.0, -1) == mav.MAV_RESULT_FAILED
    station.run(5.0)
    assert station.mode(GUIDED) == ACCEPTED
    assert fastest(station, 60.0) == pytest.approx(9.11, abs=0.5)


# A mission that is begun by command.


def told(station: GroundStation, since_s: float) -> list[str]:
    return [text for text in station.texts(since_s) if text.startswith("Mission:")]


def test_mission_start_begins_the_mission_twice_and_says_so() -> None:
    station = flying(10.0)
    assert upload(station, [home(), waypoint(60, 0), waypoint(60, 40)]) == 0
    begin_s = station.now_s
    assert station.command(mav.MAV_CMD_MISSION_START) == ACCEPTED
    station.run(1.0)
    assert told(station, begin_s) == ["Mission: 1 WP", "Mission: 1 WP"]


def test_a_mode_change_begins_it_once_and_mission_start_in_auto_not_again() -> None:
    station = flying(10.0)
    assert upload(station, [home(), waypoint(60, 0), waypoint(60, 40)]) == 0
    begin_s = station.now_s
    assert station.mode(3) == ACCEPTED
    assert station.command(mav.MAV_CMD_MISSION_START) == ACCEPTED
    station.run(1.0)
    assert told(station, begin_s) == ["Mission: 1 WP"]


# Arming in the first half minute.

AGREE = [(12.4, "Accels inconsistent"), (13.4, "Gyros inconsistent"), (22.6, "Gyros inconsistent")]


def refusals(station: GroundStation) -> list[str]:
    station.log.clear()
    assert station.arm() == mav.MAV_RESULT_FAILED
    return [text.removeprefix("Arm: ") for text in station.texts()]


def test_a_copter_is_not_armed_before_its_sensors_have_agreed_for_20_seconds() -> None:
    station = copter(ready_after_s=41.64)
    for at_s, reasons in [
        (3.2, ["EKF attitude is bad", "AHRS: not using configured AHRS type"]),
        (5.2, ["EKF attitude is bad", "AHRS: EKF3 still initialising"]),
        (6.3, []),
    ]:
        station.run(at_s - station.now_s)
        assert refusals(station) == ["Accels inconsistent", *reasons], at_s
    for at_s, reason in AGREE:
        station.run(at_s - station.now_s)
        assert refusals(station) == [reason], at_s
    station.run(23.7 - station.now_s)
    assert station.arm() == ACCEPTED


def test_in_guided_it_also_waits_for_home_and_for_a_position() -> None:
    station = copter(ready_after_s=41.64)
    station.run(3.6)
    assert station.mode(GUIDED) == ACCEPTED
    for at_s, reasons in [
        (4.7, ["Need Alt Estimate", "Accels inconsistent", "EKF attitude is bad"]),
        (10.8, ["Accels inconsistent"]),
        (19.0, ["Gyros inconsistent"]),
    ]:
        station.run(at_s - station.now_s)
        assert refusals(station) == [*reasons, "AHRS: waiting for home"], at_s
    station.run(21.1 - station.now_s)
    assert refusals(station) == ["Gyros inconsistent", "Need Position Estimate"]
    station.run(40.0 - station.now_s)
    assert refusals(station) == ["Need Position Estimate"]
    station.run(42.5 - station.now_s)
    assert station.arm() == ACCEPTED


# One kind of setpoint after another.

VELOCITY_ACCELERATION = 0xC07
Vector = tuple[float, float, float]
KINDS: list[tuple[int, Vector, Vector, list[Row]]] = [
    # Mask, velocity and acceleration, streamed for 3.05 s; then time, s, with north and east, m.
    (VELOCITY, (3.0, 0.0, 0.0), (0.0, 0.0, 0.0), [(1.0, 0.41, 0.0), (2.0, 3.16, 0.0)]),
    (VELOCITY_ACCELERATION, (3.0, 2.0, 0.0), (0.5, 0.0, 0.0), [(1.0, 9.09, 0.37)]),
    (ACCELERATION, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), [(1.0, 19.2, 6.57), (2.0, 22.48, 9.83)]),
    (VELOCITY, (0.0, -4.0, -1.0), (0.0, 0.0, 0.0), [(1.0, 28.85, 18.82), (2.0, 30.01, 21.39)]),
]


def test_velocities_and_accelerations_in_turn_are_flown_as_by_the_real_one() -> None:
    """It corrects across its new course with up to 0.7 of its acceleration."""
    station = flying(15.0)
    station.run(4.0)
    for mask, velocity, acceleration, rows in KINDS:
        begin_s = station.now_s
        for _ in range(30):
            station.setpoint(mask, velocity=velocity, acceleration=acceleration)
            station.run(0.1017)
            for after_s, north, east in rows:
                if abs(station.now_s - begin_s - after_s) < 0.05:
                    assert station.position[:2] == pytest.approx((north, east), abs=0.9), after_s


def test_a_lean_is_kept_for_a_while_when_another_kind_of_setpoint_comes() -> None:
    """The integrator takes it over, until the velocity at that moment is flown: 0.76 m/s."""
    station = flying(15.0)
    station.run(4.0)
    north_0, east_0, _ = station.position
    station.setpoint(POSITION, (north_0 + 4.23, east_0 + 10.43, -12.0))
    station.run(1.0)
    station.setpoint(ACCELERATION, acceleration=(1.0, 0.0, 0.0))
    station.run(3.0)
    assert station.velocity[1] == pytest.approx(0.76, abs=0.6)
    station.run(1.0)
    assert station.position[1] - east_0 == pytest.approx(6.06, abs=1.0)


# Yaw.

BODY_NED = 8


def yaw_deg(station: GroundStation) -> float:
    return math.degrees(station.last("ATTITUDE").yaw)


def test_a_velocity_of_the_body_turns_it_40_degrees_a_second() -> None:
    """2 m/s forward and 1 to the right: the nose follows the course, and the velocity the nose."""
    station = flying(20.0)
    station.interval(30, 50.0)
    station.run(4.0)
    seen: list[float] = []
    for seconds in (1.6, 1.4):
        station.stream(
            seconds,
            10.0,
            lambda: station.setpoint(VELOCITY, velocity=(2.0, 1.0, 0.0), frame=BODY_NED),
        )
        seen.append(yaw_deg(station))
    assert (seen[1] - seen[0]) % 360.0 / 1.4 == pytest.approx(40.5, abs=6.0)


def test_a_turn_ends_when_the_vehicle_stops() -> None:
    """It had turned half way to its new course, 94 degrees, braked, and looked there for good."""
    station = flying(20.0)
    station.interval(30, 50.0)
    station.run(2.0)
    station.setpoint(POSITION & ~YAW, (0.0, 0.0, -20.0), yaw=math.radians(178.0))
    station.run(7.0)
    station.stream(1.2, 10.0, lambda: station.setpoint(ACCELERATION, acceleration=(1.5, 0.0, 0.0)))
    station.stream(3.0, 10.0, lambda: station.setpoint(VELOCITY, velocity=(0.0, 0.0, 0.0)))
    seen_deg = yaw_deg(station)
    assert seen_deg == pytest.approx(86.0, abs=30.0)
    station.stream(2.0, 10.0, lambda: station.setpoint(VELOCITY, velocity=(0.0, 0.0, 0.0)))
    assert yaw_deg(station) == pytest.approx(seen_deg, abs=2.0)


# Out of AUTO at full speed.

SPED_UP = [(3.0, 2.86, 2.97), (4.5, 9.58, 6.09), (6.0, 20.8, 8.64), (7.5, 34.65, 9.53)]
"""Means of six legs, which differ among themselves by up to 0.4 m/s"""
STOPPED = [(1.0, 9.17), (2.0, 16.0), (3.0, 20.2), (4.0, 21.8)]
"""Seconds after the change to GUIDED, and metres, with nothing to fly to or a velocity sideways"""
STOPPED_FOR_A_PLACE = [(1.0, 9.47), (2.0, 16.55), (3.0, 21.38), (4.0, 23.52)]
"""With a position to the side, which the firmware approaches straight (shaping of May 2025)"""


def at_full_speed() -> GroundStation:
    """On the first leg of a mission, for 7.5 s."""
    station = flying(10.0)
    station.run(6.0)
    assert upload(station, [home(), waypoint(300, 0), waypoint(300, 200)]) == 0
    assert station.mode(AUTO) == ACCEPTED
    return station


def test_the_time_of_a_leg_passes_more_slowly_while_the_copter_is_behind() -> None:
    """With its drag and its attitude's lag it reaches 9.5 m/s, 34.6 m after the start."""
    station = at_full_speed()
    for (_, north, speed), (after_s, real, real_m_s) in zip(
        moved(station, SPED_UP, 1.0), SPED_UP, strict=True
    ):
        assert north == pytest.approx(real, abs=2.2), after_s
        assert speed == pytest.approx(real_m_s, abs=0.5), after_s


def test_a_mission_that_begins_before_the_vehicle_stands_is_no_slower() -> None:
    """Still on its way at 0.2 m/s: 17.9 m after 5.5 s, and 17.5 m from a stand."""
    station = flying(10.0)
    station.run(6.0)
    assert upload(station, [home(), waypoint(0, 0), waypoint(120, 0), waypoint(120, 60)]) == 0
    station.setpoint(POSITION, (30.0, 0.0, -10.0))
    station.run(14.0)
    station.setpoint(POSITION, (0.0, 0.0, -10.0))
    station.run_until(lambda: station.position[0] < 1.0)
    station.run(2.0)
    assert station.mode(AUTO) == ACCEPTED
    begin_s, north_m = station.now_s, station.position[0]
    station.run(0.2)
    station.send(mav.MAVLink_mission_set_current_message(1, 1, 2))
    station.run(begin_s + 5.5 - station.now_s)
    assert station.position[0] - north_m == pytest.approx(17.9, abs=3.5)


@pytest.mark.parametrize("setpoint", ["none", "ahead of it", "position", "velocity"])
def test_out_of_auto_it_brakes_the_same_whatever_setpoint_comes_around_the_change(
    setpoint: str,
) -> None:
    """A setpoint that came ahead of the mode change is not flown, one right behind it is."""
    station = at_full_speed()
    station.run(7.5)
    begin_s, (north, east, down) = station.now_s, station.position
    if setpoint == "ahead of it":
        station.setpoint(POSITION, (north + 5.0, east + 30.0, down - 5.0))
    station.mode(GUIDED)
    if setpoint == "position":
        station.setpoint(POSITION, (north, east + 30.0, down))
    for after_s, real in STOPPED_FOR_A_PLACE if setpoint == "position" else STOPPED:
        while station.now_s < begin_s + after_s:
            if setpoint == "velocity":
                station.setpoint(VELOCITY, velocity=(0.0, 3.0, 0.0))
            station.run(min(0.1, begin_s + after_s - station.now_s))
        assert station.position[0] - north == pytest.approx(real, abs=1.5), after_s
    sideways_m = station.position[1] - east
    assert (sideways_m > 2.0) == (setpoint in ("position", "velocity"))
    assert station.position[2] == pytest.approx(-10.0, abs=0.3)


# HEARTBEAT and LAND.


def heartbeats(station: GroundStation, since_s: float) -> list[tuple[int, int]]:
    """The values of base_mode and system_status, each as often as they change."""
    seen = [(0, 0)]
    for beat in station.messages("HEARTBEAT", since_s):
        if (beat.base_mode, beat.system_status) != seen[-1]:
            seen.append((beat.base_mode, beat.system_status))
    return seen[1:]


def test_land_stays_armed_for_half_a_second_on_the_ground() -> None:
    station = flying(3.0)
    station.interval(0, 10.0)
    station.run(1.0)
    begin_s = station.now_s
    station.mode(LAND)
    station.run_until(lambda: not station.vehicle.firmware.armed)
    station.run(1.0)
    armed, disarmed = mav.MAV_MODE_FLAG_SAFETY_ARMED | 89, 89
    assert heartbeats(station, begin_s) == [(armed, 4), (armed, 3), (disarmed, 3)]


def test_land_without_a_position_sinks_level_and_controls_none_until_it_stands() -> None:
    """GUIDED_ENABLED of base_mode is gone, though the GPS comes back on the way down."""
    config = VehicleConfig(ready_after_s=1.0)
    station = GroundStation(Simulation([config], seed=1, world=World(wind=Wind((0.0, 3.0, 0.0)))))
    station.ready().take_off(15.0)
    station.interval(0, 10.0)
    station.run(1.0)
    begin_s = station.now_s
    station.vehicle.lose_gps()
    station.run(16.0)
    east_m = station.simulation.truth.position_ned_m[0, 1]
    motion = station.vehicle.firmware.motion
    assert math.hypot(motion.roll_rad, motion.pitch_rad) < 0.01
    station.run(9.0)
    station.vehicle.restore_gps()
    station.run_until(lambda: not station.vehicle.firmware.armed)
    station.run(1.0)
    assert station.simulation.truth.position_ned_m[0, 1] - east_m > 20.0, "the wind carries it away"
    assert heartbeats(station, begin_s) == [
        (217, 4), (217, 5), (209, 5), (209, 4), (217, 3), (89, 3),
    ]  # fmt: skip
