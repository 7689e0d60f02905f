"""ArduPlane: each rule was observed on the real firmware (`plane_guided`)."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    FAILED,
    POSITION,
    UNSUPPORTED,
    VELOCITY,
    GroundStation,
)
from sitl_support.kinds import kind, starting

MANUAL, CIRCLE, FBWA, FBWB, CRUISE, AUTO, RTL = 0, 1, 5, 6, 7, 10, 11
LOITER, TAKEOFF, GUIDED = 12, 13, 15
STANDBY, ACTIVE = 3, 4
ON_GROUND, IN_AIR, TAKING_OFF = 1, 2, 3


def plane(
    parameters: dict[str, float] | None = None, wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> GroundStation:
    """A plane on the ground that knows its position, nose to the North."""
    return kind("plane", parameters, wind)


def flying(wind: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> GroundStation:
    """A plane that circles 50 m up, in TAKEOFF."""
    station = plane(wind=wind)
    assert station.mode(TAKEOFF) == ACCEPTED
    assert station.arm() == ACCEPTED
    station.run(20.0)
    assert station.last("EXTENDED_SYS_STATE").landed_state == IN_AIR
    return station


def in_guided() -> tuple[GroundStation, tuple[float, float]]:
    """A plane in GUIDED, and where that began."""
    station = flying()
    assert station.mode(GUIDED) == ACCEPTED
    return station, station.position[:2]


def distances(station: GroundStation, place: tuple[float, float], seconds: float) -> list[float]:
    """Distances from a place over time."""
    found = []
    for _ in range(round(seconds / 0.5)):
        station.run(0.5)
        found.append(math.dist(station.position[:2], place))
    return found


def airspeed(station: GroundStation) -> float:
    return station.vehicle.snapshot().airspeed_m_s or 0.0


# Identity and state.


def test_it_is_a_fixed_wing_with_its_own_capabilities() -> None:
    station = plane()
    beat = station.last("HEARTBEAT")
    assert (beat.type, beat.base_mode, beat.custom_mode) == (mav.MAV_TYPE_FIXED_WING, 0x51, MANUAL)
    station.command(mav.MAV_CMD_REQUEST_MESSAGE, 148)
    assert station.last("AUTOPILOT_VERSION").capabilities == 0xF36F


def test_while_starting_it_is_calibrating_in_mode_16() -> None:
    assert starting("plane", 20.0, 1.5) == (16, 0x11, 2)


def test_takeoff_mode_and_arming_take_off() -> None:
    station = flying()
    assert station.changes("EXTENDED_SYS_STATE", "landed_state") == [
        ON_GROUND, TAKING_OFF, IN_AIR,
    ]  # fmt: skip
    assert station.changes("HEARTBEAT", "system_status")[-2:] == [STANDBY, ACTIVE]
    assert "Takeoff to 50m for 200.0m heading 0.0 deg" in station.texts()
    assert -station.position[2] == pytest.approx(50.0, abs=8.0)


def test_disarmed_takeoff_mode_waits() -> None:
    station = plane()
    station.mode(TAKEOFF)
    station.run(10.0)
    assert math.hypot(*station.position[:2]) < 0.1
    assert station.last("HEARTBEAT").base_mode == 0x59


# Commands.


def test_nav_takeoff_fails_and_nav_land_is_unsupported() -> None:
    station, _ = in_guided()
    assert station.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 50) == FAILED
    assert station.command(mav.MAV_CMD_NAV_LAND) == UNSUPPORTED


def test_disarming_in_flight_fails_unless_forced() -> None:
    station = flying()
    assert station.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0) == FAILED
    assert station.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196) == ACCEPTED


def test_auto_without_a_mission_is_over_at_once_and_returns() -> None:
    station = flying()
    assert station.mode(AUTO) == ACCEPTED
    assert station.last("HEARTBEAT").custom_mode == RTL
    assert "Mission complete, changing mode to RTL" in station.texts()


def test_change_speed_is_about_airspeed() -> None:
    station, _ = in_guided()
    assert station.command(mav.MAV_CMD_DO_CHANGE_SPEED, 0, 12.0, -1) == FAILED, "below the least"
    assert station.command(mav.MAV_CMD_DO_CHANGE_SPEED, 2, 3.0, -1) == FAILED
    assert station.command(mav.MAV_CMD_DO_CHANGE_SPEED, 0, 26.0, -1) == ACCEPTED
    assert "Set airspeed 26 m/s" in station.texts()
    station.run(15.0)
    assert airspeed(station) == pytest.approx(26.0, abs=1.5)


@pytest.mark.night
def test_reposition_as_command_int_sends_it_there() -> None:
    station, _ = in_guided()
    x = round(-35.363261e7 + 400.0 / 0.0111318845)
    y = round(149.165230e7)
    assert (
        station.command(mav.MAV_CMD_DO_REPOSITION, -1, 1, 0, 0, -35.36, 149.17, 60) == UNSUPPORTED
    )
    assert station.command_int(mav.MAV_CMD_DO_REPOSITION, 6, -1, 1, 0, 0, x=x, y=y, z=80.0) == 0
    station.run(60.0)
    circle = distances(station, (400.0, 0.0), 30.0)
    assert min(circle) > 60.0
    assert max(circle) < 110.0
    assert -station.position[2] == pytest.approx(80.0, abs=2.0)


# GUIDED.


@pytest.mark.night
def test_in_guided_it_sinks_on_its_way_and_climbs_at_once() -> None:
    """Plane::setup_alt_slope of the real one: a slope down for more than ALT_SLOPE_MIN (15 m)."""
    station, _ = in_guided()
    x, y = round(-35.363261e7 + 1500.0 / 0.0111318845), round(149.165230e7)

    def height_after_m(height_m: float, seconds: float) -> float:
        sent = station.command_int(mav.MAV_CMD_DO_REPOSITION, 6, -1, 1, x=x, y=y, z=height_m)
        assert sent == ACCEPTED
        station.run(seconds)
        return -station.position[2]

    assert height_after_m(110.0, 20.0) > 105.0
    assert 95.0 < height_after_m(98.0, 8.0) < 101.0
    # Some 900 m are left: 50 m down take it about 40 s, not 10.
    assert 70.0 < height_after_m(48.0, 15.0) < 92.0
    station.run(60.0)
    assert -station.position[2] == pytest.approx(48.0, abs=4.0)


@pytest.mark.night
def test_guided_circles_where_it_began_and_reports_it_as_item_0() -> None:
    station, place = in_guided()
    station.run(40.0)
    circle = distances(station, place, 30.0)
    assert min(circle) > 60.0, "it cannot hover"
    assert max(circle) < 110.0
    assert [m.seq for m in station.messages("MISSION_ITEM_REACHED")] == [0]


@pytest.mark.wide
@pytest.mark.parametrize("mask", [POSITION, VELOCITY])
def test_local_setpoints_have_no_effect_and_get_no_word(mask: int) -> None:
    station, place = in_guided()
    words = len(station.texts())
    height = -station.position[2]
    station.setpoint(mask, (2000.0, 0.0, -200.0), (15.0, 0.0, -3.0))
    station.run(30.0)
    assert math.dist(station.position[:2], place) < 130.0
    assert -station.position[2] == pytest.approx(height, abs=8.0)
    assert len(station.texts()) == words


def test_of_a_global_setpoint_only_the_height_counts() -> None:
    station, place = in_guided()
    station.send(
        mav.MAVLink_set_position_target_global_int_message(
            0, 1, 1, 6, POSITION, round(-35.35e7), round(149.165230e7), 90.0, *[0.0] * 8
        )
    )
    station.run(40.0)
    assert -station.position[2] == pytest.approx(90.0, abs=2.0)
    assert math.dist(station.position[:2], place) < 130.0


def test_of_an_offset_only_the_height_counts() -> None:
    station, _ = in_guided()
    station.run(20.0)
    height = -station.position[2]
    station.setpoint(POSITION, (500.0, 0.0, -20.0), frame=mav.MAV_FRAME_LOCAL_OFFSET_NED)
    station.run(25.0)
    assert -station.position[2] == pytest.approx(height + 20.0, abs=2.0)


@pytest.mark.night
def test_rtl_circles_above_home_and_does_not_land() -> None:
    station = flying()
    assert station.mode(RTL) == ACCEPTED
    station.run(60.0)
    circle = distances(station, (0.0, 0.0), 30.0)
    assert min(circle) > 60.0
    assert max(circle) < 110.0
    assert -station.position[2] == pytest.approx(100.0, abs=2.0)
    assert station.last("HEARTBEAT").base_mode == 0xD9


# The aircraft.


def test_it_never_flies_slower_than_it_can() -> None:
    station, _ = in_guided()
    for _ in range(100):
        station.run(0.3)
        assert airspeed(station) > 17.0


def test_without_throttle_it_comes_down() -> None:
    """FBWA, the throttle stick at its lowest, stick pulled: it stalls instead of hovering."""
    station = flying()
    station.mode(FBWA)
    pull = mav.MAVLink_rc_channels_override_message(
        1, 1, 1500, 1000, 1000, 1500, 65535, 65535, 65535, 65535
    )
    station.stream(30.0, 5.0, lambda: station.send(pull))
    assert station.position[2] > -1.0
    assert station.last("EXTENDED_SYS_STATE").landed_state == ON_GROUND


def test_bank_and_climb_keep_their_limits() -> None:
    station = flying()
    station.mode(RTL)
    for _ in range(300):
        station.run(0.1)
        attitude = station.last("ATTITUDE")
        assert abs(math.degrees(attitude.roll)) <= 65.5
        assert -station.velocity[2] < 6.5


@pytest.mark.night
def test_wind_moves_the_circle_speed_over_ground_but_not_the_circle() -> None:
    station = flying(wind=(0.0, 8.0, 0.0))
    station.mode(RTL)
    station.run(60.0)
    speeds, far = [], []
    for _ in range(100):
        station.run(0.4)
        speeds.append(math.hypot(*station.velocity[:2]))
        far.append(math.hypot(*station.position[:2]))
    assert max(speeds) - min(speeds) > 10.0
    assert max(far) < 140.0
    assert min(far) > 45.0


def test_cruise_holds_the_height_and_the_course() -> None:
    station = flying()
    station.mode(CRUISE)
    height = -station.position[2]
    station.run(20.0)
    assert -station.position[2] == pytest.approx(height, abs=5.0)
    assert abs(math.degrees(station.last("ATTITUDE").roll)) < 2.0


# The other modes.


@pytest.mark.parametrize("mode", [CIRCLE, FBWB, CRUISE, LOITER, GUIDED])
def test_armed_on_the_ground_it_stays_there_in_modes_that_fly_by_themselves(mode: int) -> None:
    station = plane()
    assert station.mode(mode) == ACCEPTED
    assert station.arm() == ACCEPTED
    station.run(8.0)
    assert math.hypot(*station.position[:2]) < 0.5
    station.command(mav.MAV_CMD_REQUEST_MESSAGE, 36)
    assert station.last("SERVO_OUTPUT_RAW").servo3_raw == 1000, "the throttle is closed"


def sticks(
    station: GroundStation, roll: int = 1500, pitch: int = 1500, throttle: int = 1500
) -> None:
    """One override of the first three channels."""
    station.send(
        mav.MAVLink_rc_channels_override_message(
            1, 1, roll, pitch, throttle, 1500, 65535, 65535, 65535, 65535
        )
    )


def test_a_pilot_takes_off_in_manual_by_throttle_and_stick() -> None:
    station = plane()
    assert station.arm() == ACCEPTED
    station.stream(8.0, 5.0, lambda: sticks(station, pitch=1800, throttle=2000))
    assert -station.position[2] > 10.0
    assert station.last("EXTENDED_SYS_STATE").landed_state == IN_AIR


@pytest.mark.parametrize(("throttle", "speed"), [(1000, 17.0), (1500, 23.5), (2000, 30.0)])
def test_in_fly_by_wire_b_the_throttle_stick_asks_for_an_airspeed(
    throttle: int, speed: float
) -> None:
    station = flying()
    station.mode(FBWB)
    station.stream(15.0, 5.0, lambda: sticks(station, throttle=throttle))
    assert airspeed(station) == pytest.approx(speed, abs=1.5)


def test_in_fly_by_wire_b_the_pitch_stick_climbs_by_its_parameter() -> None:
    station = flying()
    station.mode(FBWB)
    station.stream(15.0, 5.0, lambda: sticks(station, pitch=2000))
    assert -station.velocity[2] == pytest.approx(2.0, abs=0.3)


def test_cruise_keeps_its_course_over_ground_in_a_side_wind_and_turns_with_the_stick() -> None:
    station = flying(wind=(0.0, 6.0, 0.0))
    station.mode(CRUISE)
    station.run(10.0)
    begin = station.position
    course = math.atan2(station.velocity[1], station.velocity[0])
    station.run(20.0)
    north, east = (a - b for a, b in zip(station.position[:2], begin[:2], strict=True))
    beside = math.hypot(north, east) * math.sin(math.atan2(east, north) - course)
    assert abs(beside) < 6.0
    station.stream(6.0, 5.0, lambda: sticks(station, roll=1800))
    assert abs(math.remainder(math.atan2(*station.velocity[1::-1]) - course, math.tau)) > 0.7


def test_circle_turns_gently_at_a_third_of_the_largest_bank() -> None:
    station = flying()
    station.mode(CIRCLE)
    height = -station.position[2]
    station.run(20.0)
    assert math.degrees(station.last("ATTITUDE").roll) == pytest.approx(65.0 / 3.0, abs=1.0)
    assert -station.position[2] == pytest.approx(height, abs=6.0)


def test_takeoff_chosen_in_the_air_only_circles() -> None:
    station = flying()
    station.mode(RTL)
    station.run(2.0)
    here = station.position
    station.mode(TAKEOFF)
    assert "Takeoff skipped - circling" in station.texts()
    circle = distances(station, here[:2], 40.0)
    assert 60.0 < min(circle[40:]) < max(circle[40:]) < 110.0


@pytest.mark.night
def test_a_negative_rtl_radius_turns_the_other_way() -> None:
    station = flying()
    station.vehicle.parameters.set("RTL_RADIUS", -150.0)
    station.mode(RTL)
    station.run(60.0)
    circle = distances(station, (0.0, 0.0), 20.0)
    assert min(circle) > 130.0
    assert math.degrees(station.last("ATTITUDE").roll) < -5.0


@pytest.mark.night
def test_a_reposition_may_give_a_radius_and_a_sense_and_without_them_the_radius_stays() -> None:
    """Seen on the firmware: 120 m of 136 m in this air, both ways; -120, 0 and NaN keep it."""
    station, _ = in_guided()
    x, y = round(-35.363261e7 + 400.0 / 0.0111318845), round(149.165230e7)
    for radius_m, against, side in ((150.0, 1.0, -1.0), (0.0, 0.0, 1.0), (math.nan, 1.0, -1.0)):
        reposition = mav.MAV_CMD_DO_REPOSITION
        arguments = (-1, 1, radius_m, against)
        assert station.command_int(reposition, 6, *arguments, x=x, y=y, z=80.0) == ACCEPTED
        station.run(70.0)
        circle = distances(station, (400.0, 0.0), 20.0)
        assert 150.0 < min(circle) < max(circle) < 180.0
        assert side * math.degrees(station.last("ATTITUDE").roll) > 5.0


@pytest.mark.night
def test_the_sign_of_the_usual_radius_counts_where_a_reposition_gives_none() -> None:
    station, _ = in_guided()
    station.vehicle.parameters.set("WP_LOITER_RAD", -90.0)
    x, y = round(-35.363261e7 + 400.0 / 0.0111318845), round(149.165230e7)
    for radius_m, side in ((0.0, -1.0), (90.0, 1.0)):
        reposition = mav.MAV_CMD_DO_REPOSITION
        assert station.command_int(reposition, 6, -1, 1, radius_m, 0, x=x, y=y, z=80.0) == ACCEPTED
        station.run(60.0)
        assert side * math.degrees(station.last("ATTITUDE").roll) > 5.0


def test_outside_guided_a_reposition_needs_leave_to_change_the_mode() -> None:
    station = flying()
    x, y = round(-35.36e7), round(149.165230e7)
    assert station.command_int(mav.MAV_CMD_DO_REPOSITION, 6, -1, 0, 0, 0, x=x, y=y, z=80) == FAILED


@pytest.mark.night
def test_the_wind_may_not_make_it_slower_over_ground_than_asked() -> None:
    station = flying(wind=(0.0, 12.0, 0.0))
    station.mode(GUIDED)
    assert station.command(mav.MAV_CMD_DO_CHANGE_SPEED, 1, 14.0, -1) == ACCEPTED
    assert "Set groundspeed 14" in station.texts()
    station.run(20.0)
    slowest = math.inf
    for _ in range(100):
        station.run(0.4)
        slowest = min(slowest, math.hypot(*station.velocity[:2]))
    assert slowest > 12.5


def test_guided_change_speed_is_an_airspeed_within_the_limits() -> None:
    """Seen in `plane_guided_repo`: 25 is accepted, 50 fails, as COMMAND_LONG too."""
    station, _ = in_guided()
    station.interval(74, 2.0)
    change = mav.MAV_CMD_GUIDED_CHANGE_SPEED
    assert station.command_int(change, 0, 0, 25.0) == ACCEPTED
    assert station.command(change, 0, 50.0) == FAILED
    station.run(12.0)
    assert station.last("VFR_HUD").airspeed == pytest.approx(25.0, abs=1.5)


def test_a_throttle_without_a_speed_is_taken() -> None:
    """Seen in `plane_guided_repo`."""
    station, _ = in_guided()
    assert station.command(mav.MAV_CMD_DO_CHANGE_SPEED, 0, -1.0, 60.0) == ACCEPTED
    assert "Set throttle 60" in station.texts()
