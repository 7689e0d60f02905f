"""A copter that a pilot flies: sticks, mode switch, arming by the stick, loss of the radio."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    ALT_HOLD,
    AUTO,
    FAILED,
    GUIDED,
    LAND,
    LOITER,
    RTL,
    STABILIZE,
    GroundStation,
    copter,
    flying,
)
from sitl_support.transmitter import PITCH, ROLL, THROTTLE, YAW, Transmitter

POSHOLD = 16
SWITCH = 5


def mode(station: GroundStation) -> int:
    return station.vehicle.firmware.mode.spec.number


def speed(station: GroundStation) -> float:
    return math.hypot(*station.velocity[:2])


def up(number: int, height_m: float = 20.0) -> tuple[GroundStation, Transmitter]:
    """In the air in a mode, throttle in the middle."""
    station = flying(height_m)
    pilot = Transmitter(station)
    pilot.put({THROTTLE: 1500})
    assert station.mode(number) == ACCEPTED
    return station, pilot


def override(station: GroundStation, channels: dict[int, int], rest: int = 65535) -> None:
    values = [channels.get(n, rest if n <= 8 else 0) for n in range(1, 19)]
    station.send(mav.MAVLink_rc_channels_override_message(1, 1, *values))


# Channels.


def test_an_override_reaches_sixteen_channels_and_those_above_8_are_released_by_65534() -> None:
    station = copter()
    station.run(3.0)
    station.interval(65, 10.0)
    override(station, {5: 1200, 9: 1300, 16: 1400})
    station.run(0.2)
    seen = station.last("RC_CHANNELS")
    assert (seen.chan5_raw, seen.chan9_raw, seen.chan16_raw) == (1200, 1300, 1400)
    assert seen.chancount == 8
    override(station, {5: 0, 9: 0, 16: 65534})
    station.run(0.2)
    seen = station.last("RC_CHANNELS")
    assert (seen.chan5_raw, seen.chan9_raw, seen.chan16_raw) == (1800, 1300, 0)


def test_the_receiver_gives_up_to_sixteen_channels() -> None:
    station = copter()
    station.run(3.0)
    station.interval(65, 10.0)
    station.vehicle.firmware.pilot.receive((1501, 0, 1100, *[1600] * 13))
    station.run(0.2)
    seen = station.last("RC_CHANNELS")
    assert seen.chancount == 16
    assert (seen.chan1_raw, seen.chan2_raw, seen.chan3_raw) == (1501, 1500, 1100)
    assert seen.chan16_raw == 1600


def test_overrides_last_as_long_as_rc_override_time_says() -> None:
    station = copter()
    station.run(3.0)
    station.interval(65, 10.0)
    station.vehicle.parameters.set("RC_OVERRIDE_TIME", -1.0)
    override(station, {1: 1700})
    station.run(20.0)
    assert station.last("RC_CHANNELS").chan1_raw == 1700
    station.vehicle.parameters.set("RC_OVERRIDE_TIME", 0.0)
    station.run(0.2)
    assert station.last("RC_CHANNELS").chan1_raw == 1500


def test_manual_control_has_the_pitch_the_other_way_round() -> None:
    station = copter()
    station.run(3.0)
    station.interval(65, 10.0)
    station.send(mav.MAVLink_manual_control_message(1, 500, -200, 600, 1000, 0))
    station.run(0.2)
    seen = station.last("RC_CHANNELS")
    raw = (seen.chan1_raw, seen.chan2_raw, seen.chan3_raw, seen.chan4_raw)
    assert raw == (1400, 1250, 1600, 2000)
    station.send(mav.MAVLink_manual_control_message(1, 32767, 32767, 500, 32767, 0))
    station.run(0.2)
    seen = station.last("RC_CHANNELS")
    raw = (seen.chan1_raw, seen.chan2_raw, seen.chan3_raw, seen.chan4_raw)
    assert raw == (1500, 1500, 1500, 1500)


def test_overrides_count_as_a_sign_of_life_of_the_ground_station() -> None:
    station = copter().ready()
    station.vehicle.parameters.set("FS_GCS_ENABLE", 1.0)
    station.take_off(5.0)
    station.heartbeats(True)
    station.run(2.0)
    station.heartbeats(False)
    station.stream(8.0, 2.0, lambda: override(station, {3: 1500}))
    assert mode(station) == GUIDED
    station.run(7.0)
    assert mode(station) == RTL


# Flying.


@pytest.mark.parametrize("number", [STABILIZE, ALT_HOLD, LOITER, POSHOLD])
def test_a_raised_throttle_takes_off_and_a_closed_one_lands_and_the_stick_disarms(
    number: int,
) -> None:
    station = copter().ready()
    pilot = Transmitter(station)
    station.mode(number)
    assert station.arm() == ACCEPTED
    station.run(3.0)
    assert station.position[2] == pytest.approx(0.0, abs=0.05)
    pilot.put({THROTTLE: 1800})
    station.run_until(lambda: station.position[2] < -8.0, 12.0)
    pilot.move({THROTTLE: 1500}, 2.0)
    pilot.put({THROTTLE: 1400 if number == STABILIZE else 1200})
    station.run_until(lambda: station.position[2] > -0.1, 40.0)
    pilot.put({THROTTLE: 1000})
    station.run_until(lambda: station.vehicle.firmware.landed, 10.0)
    pilot.hold_yaw(1000)
    assert not station.vehicle.firmware.armed


def test_stabilize_hovers_with_the_throttle_in_the_middle() -> None:
    station, _ = up(STABILIZE)
    station.run(4.0)
    assert station.velocity[2] == pytest.approx(0.0, abs=0.3)


@pytest.mark.parametrize("number", [STABILIZE, ALT_HOLD])
def test_the_sticks_lean_as_far_as_angle_max(number: int) -> None:
    station, pilot = up(number)
    pilot.move({ROLL: 2000}, 1.5)
    motion = station.vehicle.firmware.motion
    assert math.degrees(motion.roll_rad) == pytest.approx(30.0, abs=1.5)
    pilot.move({ROLL: 1500, PITCH: 1000}, 1.5)
    motion = station.vehicle.firmware.motion
    assert math.degrees(motion.pitch_rad) == pytest.approx(-30.0, abs=1.5)
    assert math.degrees(motion.roll_rad) == pytest.approx(0.0, abs=1.5)


def test_alt_hold_keeps_its_height_and_drifts_with_the_sticks_centred() -> None:
    station, pilot = up(ALT_HOLD)
    pilot.move({PITCH: 1300}, 4.0)
    pilot.move({PITCH: 1500}, 3.0)
    assert speed(station) > 1.0
    assert station.position[2] == pytest.approx(-20.0, abs=1.5)


def test_the_yaw_stick_turns_at_pilot_y_rate() -> None:
    station, pilot = up(ALT_HOLD)
    pilot.move({YAW: 1760}, 2.0)
    rate = math.degrees(station.vehicle.firmware.motion.yaw_rate_rad_s)
    assert rate == pytest.approx(101.25, abs=5.0)
    pilot.move({YAW: 1500}, 2.0)
    assert station.vehicle.firmware.motion.yaw_rate_rad_s == pytest.approx(0.0, abs=0.05)


@pytest.mark.night
def test_a_stick_in_loiter_leads_to_its_share_of_loit_speed_and_let_go_of_it_stops() -> None:
    station, pilot = up(LOITER)
    station.vehicle.parameters.set("LOIT_SPEED", 800.0)
    pilot.move({PITCH: 1000}, 15.0)
    assert station.velocity[0] == pytest.approx(8.0, abs=0.4)
    assert station.position[2] == pytest.approx(-20.0, abs=0.5)
    pilot.move({PITCH: 1240}, 15.0)
    assert station.velocity[0] == pytest.approx(4.0, abs=0.4)
    pilot.put({PITCH: 1500})
    station.run_until(lambda: speed(station) < 0.2, 15.0)
    station.run(4.0)
    there = station.position
    station.run(5.0)
    assert math.dist(station.position, there) < 0.3


def test_the_sticks_lean_with_the_nose() -> None:
    station, pilot = up(LOITER)
    pilot.move({YAW: 1760}, 0.9)
    pilot.move({YAW: 1500}, 2.0)
    yaw = station.vehicle.firmware.motion.yaw_rad
    pilot.move({PITCH: 1000}, 4.0)
    course = math.atan2(station.velocity[1], station.velocity[0])
    assert math.remainder(course - yaw, math.tau) == pytest.approx(0.0, abs=0.05)


def test_channels_may_be_mapped_reversed_and_calibrated() -> None:
    station, pilot = up(ALT_HOLD)
    for name, value in (("RCMAP_ROLL", 6.0), ("RC6_REVERSED", 1.0), ("RC6_MIN", 1200.0)):
        station.vehicle.parameters.set(name, value)
    station.vehicle.parameters.set("RC6_TRIM", 1500.0)
    pilot.move({6: 1200}, 1.5)
    assert math.degrees(station.vehicle.firmware.motion.roll_rad) == pytest.approx(30.0, abs=1.5)


# Arming.


def test_the_yaw_stick_arms_after_2_s_with_the_throttle_closed() -> None:
    station = copter().ready()
    station.mode(STABILIZE)
    pilot = Transmitter(station)
    pilot.move({YAW: 2000}, 1.8)
    assert not station.vehicle.firmware.armed
    station.run(0.5)
    assert station.vehicle.firmware.armed
    pilot.move({YAW: 1500}, 0.2)
    pilot.hold_yaw(1000)
    assert not station.vehicle.firmware.armed


@pytest.mark.parametrize(("rudder", "armed", "disarmed"), [(0, False, True), (1, True, False)])
def test_arming_rudder_says_what_the_stick_may(rudder: int, armed: bool, disarmed: bool) -> None:
    station = copter().ready()
    station.mode(STABILIZE)
    station.vehicle.parameters.set("ARMING_RUDDER", rudder)
    pilot = Transmitter(station)
    pilot.hold_yaw(2000)
    assert station.vehicle.firmware.armed is armed
    pilot.hold_yaw(1000)
    assert station.vehicle.firmware.armed is not disarmed


def test_the_stick_does_not_arm_in_guided_nor_with_the_throttle_open() -> None:
    station = copter().ready()
    pilot = Transmitter(station)
    station.mode(GUIDED)
    pilot.hold_yaw(2000)
    assert not station.vehicle.firmware.armed
    assert "Arm: GUIDED mode not armable" in station.texts()
    station.mode(STABILIZE)
    pilot.put({THROTTLE: 1300})
    pilot.hold_yaw(2000)
    assert not station.vehicle.firmware.armed


def test_the_stick_does_not_disarm_in_the_air_where_height_is_held() -> None:
    station, pilot = up(ALT_HOLD)
    pilot.put({THROTTLE: 1000})
    pilot.hold_yaw(1000)
    assert station.vehicle.firmware.armed


@pytest.mark.parametrize(
    ("channel", "text"),
    [
        (THROTTLE, "Throttle (RC3) is not neutral"),
        (ROLL, "Roll (RC1) is not neutral"),
        (YAW, "Yaw (RC4) is not neutral"),
    ],
)
def test_sticks_out_of_their_middle_prevent_arming(channel: int, text: str) -> None:
    station = copter().ready()
    station.mode(STABILIZE)
    Transmitter(station).put({channel: 1700})
    assert station.arm() == FAILED
    assert f"Arm: {text}" in station.texts()


# The mode switch.


def test_the_switch_changes_the_mode_when_it_moves_and_not_again() -> None:
    station, pilot = up(LOITER)
    pilot.move({SWITCH: 1300}, 0.1)
    assert mode(station) == LOITER
    station.run(0.3)
    assert mode(station) == LAND
    assert station.mode(GUIDED) == ACCEPTED
    station.run(2.0)
    assert mode(station) == GUIDED
    pilot.move({SWITCH: 1700}, 0.4)
    assert mode(station) == LOITER


@pytest.mark.parametrize(
    ("raw_us", "number"),
    [(1230, 7), (1231, LAND), (1360, LAND), (1490, RTL), (1491, AUTO), (1621, LOITER), (1750, 0)],
)
def test_the_bands_of_the_switch(raw_us: int, number: int) -> None:
    station = copter()
    station.run(3.0)
    station.mode(4)
    Transmitter(station).move({SWITCH: raw_us}, 0.5)
    assert mode(station) == (4 if number == 0 else number)


def test_a_mode_that_does_not_exist_is_rejected_from_the_switch_too() -> None:
    station = copter()
    station.run(3.0)
    station.vehicle.parameters.set("FLTMODE1", 77.0)
    Transmitter(station).move({SWITCH: 1000}, 0.5)
    assert "No such mode 77" in station.texts()
    assert mode(station) == STABILIZE


def test_it_starts_in_the_mode_of_its_switch_or_without_one_in_initial_mode() -> None:
    station = copter()
    station.run(3.0)
    station.vehicle.parameters.set("INITIAL_MODE", 5.0)
    station.vehicle.power_cycle()
    station.run(5.0)
    assert mode(station) == STABILIZE
    station.vehicle.parameters.set("FLTMODE_CH", 0.0)
    station.vehicle.power_cycle()
    station.run(5.0)
    assert mode(station) == LOITER


# The radio.


def test_a_receiver_without_its_transmitter_lowers_the_throttle() -> None:
    station, _ = up(LOITER)
    station.vehicle.parameters.set("SIM_RC_FAIL", 2.0)
    station.run(1.0)
    assert "Radio Failsafe" in station.texts()
    assert mode(station) == RTL
    station.vehicle.parameters.set("SIM_RC_FAIL", 0.0)
    station.run(1.0)
    assert "Radio Failsafe Cleared" in station.texts()


def test_a_low_throttle_is_none_without_its_failsafe() -> None:
    station, _ = up(LOITER)
    station.vehicle.parameters.set("FS_THR_ENABLE", 0.0)
    station.vehicle.parameters.set("SIM_RC_FAIL", 2.0)
    station.run(3.0)
    assert mode(station) == LOITER
    assert station.velocity[2] > 2.0


def test_without_a_radio_the_switch_does_not_count() -> None:
    station, pilot = up(LOITER)
    station.vehicle.lose_radio(True)
    station.run(1.0)
    pilot.move({SWITCH: 1300}, 1.0)
    assert mode(station) == RTL
