"""A rover that is driven by sticks, headings and speeds."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    FAILED,
    POSITION,
    VELOCITY,
    GroundStation,
)
from sitl_support.kinds import kind as standing
from sitl_support.transmitter import ROLL, THROTTLE, Transmitter

MANUAL, ACRO, STEERING, HOLD, AUTO, RTL, GUIDED = 0, 1, 3, 4, 10, 11, 15
SWITCH = 8


def speed(station: GroundStation) -> float:
    """Along the nose, m/s."""
    yaw = station.vehicle.firmware.motion.yaw_rad
    return station.velocity[0] * math.cos(yaw) + station.velocity[1] * math.sin(yaw)


def rate(station: GroundStation) -> float:
    return station.vehicle.firmware.motion.yaw_rate_rad_s


def driving(number: int, vehicle: str = "rover") -> tuple[GroundStation, Transmitter]:
    """Armed in a mode."""
    station = standing(vehicle)
    assert station.mode(number) == ACCEPTED
    assert station.arm() == ACCEPTED
    return station, Transmitter(station)


@pytest.mark.parametrize("vehicle", ["rover", "boat"])
@pytest.mark.parametrize("number", [MANUAL, ACRO, STEERING])
def test_the_throttle_drives_forwards_and_backwards_and_the_stick_turns(
    number: int, vehicle: str
) -> None:
    station, pilot = driving(number, vehicle)
    pilot.move({THROTTLE: 1560}, 6.0)
    assert speed(station) > 0.3
    pilot.move({ROLL: 1700}, 3.0)
    assert rate(station) > 0.05
    pilot.move({ROLL: 1500, THROTTLE: 1440}, 10.0)
    assert speed(station) < -0.3


def test_acro_turns_at_its_rate_and_goes_as_fast_as_the_stick_says() -> None:
    station, pilot = driving(ACRO)
    station.vehicle.parameters.set("SPEED_MAX", 8.0)
    station.vehicle.parameters.set("ACRO_TURN_RATE", 60.0)
    pilot.move({THROTTLE: 1624, ROLL: 1640}, 8.0)
    assert speed(station) == pytest.approx(1.6, abs=0.2)
    assert math.degrees(rate(station)) == pytest.approx(14.0, abs=2.0)


def test_steering_drives_circles_limited_by_atc_turn_max_g() -> None:
    station, pilot = driving(STEERING)
    station.vehicle.parameters.set("ATC_TURN_MAX_G", 0.1)
    pilot.move({THROTTLE: 1620, ROLL: 2000}, 12.0)
    sideways = speed(station) * rate(station)
    assert sideways == pytest.approx(0.981, rel=0.15)


def test_without_a_radio_the_sticks_count_as_centred() -> None:
    station, pilot = driving(ACRO)
    station.vehicle.parameters.set("FS_ACTION", 0.0)
    pilot.move({THROTTLE: 1600}, 4.0)
    station.vehicle.lose_radio(True)
    station.run(8.0)
    assert abs(speed(station)) < 0.2


def test_steering_held_to_the_right_arms_and_to_the_left_disarms() -> None:
    station = standing("rover")
    pilot = Transmitter(station)
    assert station.mode(GUIDED) == ACCEPTED
    pilot.move({ROLL: 2000}, 2.5)
    assert not station.vehicle.firmware.armed
    assert station.mode(MANUAL) == ACCEPTED
    station.run(2.2)
    assert station.vehicle.firmware.armed
    pilot.move({ROLL: 1500}, 0.2)
    pilot.move({ROLL: 1000}, 2.2)
    assert not station.vehicle.firmware.armed


def test_the_mode_switch_is_on_channel_8() -> None:
    station = standing("rover")
    pilot = Transmitter(station)
    assert station.mode(HOLD) == ACCEPTED
    pilot.move({SWITCH: 1400}, 0.5)
    assert station.vehicle.firmware.mode.spec.number == RTL
    pilot.move({SWITCH: 1700}, 0.5)
    assert "No such mode 2" in station.texts()


@pytest.mark.parametrize("fail", [1.0, 2.0])
def test_a_lost_radio_holds(fail: float) -> None:
    station, _ = driving(MANUAL)
    station.vehicle.parameters.set("SIM_RC_FAIL", fail)
    if fail == 2.0:
        station.vehicle.parameters.set("FS_THR_VALUE", 960.0)
    station.run(3.0)
    assert station.vehicle.firmware.mode.spec.number == HOLD


# GUIDED.


def attitude(station: GroundStation, mask: int, thrust: float, **fields: object) -> None:
    q = fields.get("q", (1.0, 0.0, 0.0, 0.0))
    station.send(
        mav.MAVLink_set_attitude_target_message(
            0, 1, 1, mask, q, 0.0, 0.0, fields.get("rate", 0.0), thrust
        )
    )


def test_set_attitude_target_drives_by_thrust_and_rate_or_heading() -> None:
    station, _ = driving(GUIDED)
    by_rate = {"rate": math.radians(20.0), "q": (0.0, 0.0, 0.0, 0.0)}
    station.stream(8.0, 5.0, lambda: attitude(station, 0x03, 0.4, **by_rate))
    assert speed(station) == pytest.approx(2.0, abs=0.4)
    assert math.degrees(rate(station)) == pytest.approx(20.0, abs=4.0)
    east = (math.cos(math.pi / 4), 0.0, 0.0, math.sin(math.pi / 4))
    station.stream(8.0, 5.0, lambda: attitude(station, 0x07, 0.4, q=east))
    yaw = math.remainder(station.vehicle.firmware.motion.yaw_rad, math.tau)
    assert math.degrees(yaw) == pytest.approx(90.0, abs=5.0)


def test_a_position_repeated_at_10_hz_is_reached_as_soon_as_one_sent_once() -> None:
    took = []
    for repeats in (False, True):
        station, _ = driving(GUIDED)
        place = (20.0, 12.0, 0.0)

        def there(station: GroundStation = station, place: tuple[float, ...] = place) -> bool:
            return math.dist(station.position[:2], place[:2]) < 2.0

        station.setpoint(POSITION, (20.0, 12.0, 0.0))
        begin_s = station.now_s
        while not there() and station.now_s - begin_s < 60.0:
            if repeats:
                station.setpoint(POSITION, (20.0, 12.0, 0.0))
            station.run(0.1)
        took.append(station.now_s - begin_s)
    assert took[1] == pytest.approx(took[0], abs=0.5)


def test_a_position_that_moves_is_followed() -> None:
    station, _ = driving(GUIDED)
    for step in range(200):
        station.setpoint(POSITION, (8.0 + 0.1 * step, 0.0, 0.0))
        station.run(0.1)
    assert station.position[0] > 12.0


def test_do_change_speed_acts_on_the_way_and_fails_with_a_velocity() -> None:
    station, _ = driving(GUIDED)
    station.setpoint(VELOCITY, velocity=(1.0, 0.0, 0.0))
    assert station.command(mav.MAV_CMD_DO_CHANGE_SPEED, 1, 3.0) == FAILED
    station.setpoint(POSITION, (200.0, 0.0, 0.0))
    station.run(10.0)
    assert station.command(mav.MAV_CMD_DO_CHANGE_SPEED, 1, 1.0) == ACCEPTED
    station.run(8.0)
    assert speed(station) == pytest.approx(1.0, abs=0.25)


def test_do_set_reverse_drives_the_way_tail_first() -> None:
    station, _ = driving(GUIDED)
    assert station.command(mav.MAV_CMD_DO_SET_REVERSE, 1) == ACCEPTED
    station.setpoint(POSITION, (-20.0, 0.0, 0.0))
    station.run(6.0)
    assert speed(station) < -0.5


@pytest.mark.parametrize(("number", "armed"), [(0, True), (4, True), (1, False), (3, False)])
def test_without_gps_only_modes_that_control_no_speed_can_be_armed(
    number: int, armed: bool
) -> None:
    station = standing("rover")
    station.vehicle.parameters.set("SIM_GPS1_ENABLE", 0.0)
    station.run(15.0)
    assert station.mode(number) == ACCEPTED
    assert (station.arm() == ACCEPTED) is armed
