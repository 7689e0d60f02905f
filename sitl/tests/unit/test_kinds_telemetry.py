"""Telemetry of rovers, boats and planes: recorded in `rover_guided` and `plane_guided`."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig, Wind, World
from sitl_support.ground_station import ACCEPTED, DENIED, GroundStation

RAW = {"RAW_IMU", "SCALED_IMU2", "SCALED_IMU3", "SCALED_PRESSURE", "SCALED_PRESSURE2"}
STATUS = {"SYS_STATUS", "POWER_STATUS", "MEMINFO", "MISSION_CURRENT", "GPS_RAW_INT"}
EXTRA = {"AHRS", "SYSTEM_TIME", "BATTERY_STATUS", "EKF_STATUS_REPORT", "VIBRATION"}
ALL = {
    "ATTITUDE", "SIMSTATE", "AHRS2", "VFR_HUD", "SERVO_OUTPUT_RAW", "RC_CHANNELS",
    "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", *RAW, *STATUS, *EXTRA,
}  # fmt: skip
OWN = {
    "rover": {"RC_CHANNELS_SCALED"},
    "boat": {"RC_CHANNELS_SCALED"},
    "plane": {"AIRSPEED", "AOA_SSA", "TERRAIN_REPORT", "WIND"},
}
GROUPS = {
    mav.MAV_DATA_STREAM_RAW_SENSORS: RAW,
    mav.MAV_DATA_STREAM_EXTENDED_STATUS: STATUS,
    mav.MAV_DATA_STREAM_RC_CHANNELS: {"SERVO_OUTPUT_RAW", "RC_CHANNELS"},
    mav.MAV_DATA_STREAM_POSITION: {"GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"},
    mav.MAV_DATA_STREAM_EXTRA1: {"ATTITUDE", "SIMSTATE", "AHRS2"},
    mav.MAV_DATA_STREAM_EXTRA2: {"VFR_HUD"},
    mav.MAV_DATA_STREAM_EXTRA3: EXTRA,
}
OWN_GROUPS = {
    ("rover", mav.MAV_DATA_STREAM_RAW_CONTROLLER): {"RC_CHANNELS_SCALED"},
    ("boat", mav.MAV_DATA_STREAM_RAW_CONTROLLER): {"RC_CHANNELS_SCALED"},
    ("plane", mav.MAV_DATA_STREAM_RAW_SENSORS): {"AIRSPEED"},
    ("plane", mav.MAV_DATA_STREAM_EXTRA1): {"AOA_SSA"},
    ("plane", mav.MAV_DATA_STREAM_EXTRA3): {"TERRAIN_REPORT", "WIND"},
}
KINDS = sorted(OWN)
UNASKED = {"HEARTBEAT", "TIMESYNC", "STATUSTEXT", "COMMAND_ACK"}
MANUAL = 0


def vehicle(kind: str, wind: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> GroundStation:
    """One that knows its position and has been asked for nothing."""
    config = VehicleConfig(vehicle=kind, ready_after_s=1.0, heading_deg=0.0)
    station = GroundStation(Simulation([config], seed=1, world=World(wind=Wind(wind))))
    station.run(4.0)
    return station


def streamed(station: GroundStation, group: int) -> set[str]:
    """The kinds of message that come when only one group is requested."""
    station.log.clear()
    station.send(mav.MAVLink_request_data_stream_message(1, 1, group, 4, 1))
    station.run(2.0)
    station.send(mav.MAVLink_request_data_stream_message(1, 1, group, 4, 0))
    return {message.get_type() for _, message in station.log} - UNASKED


def sensors(station: GroundStation) -> tuple[str, str, str]:
    """SYS_STATUS as hexadecimal numbers: present, enabled, healthy."""
    station.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_SYS_STATUS)
    status = station.last("SYS_STATUS")
    return (
        f"{status.onboard_control_sensors_present:08x}",
        f"{status.onboard_control_sensors_enabled:08x}",
        f"{status.onboard_control_sensors_health:08x}",
    )


@pytest.mark.parametrize("kind", KINDS)
def test_all_streams_are_those_that_were_recorded_in_manual(kind: str) -> None:
    """There NAV_CONTROLLER_OUTPUT is absent; a rover never sends WIND."""
    assert streamed(vehicle(kind), mav.MAV_DATA_STREAM_ALL) == ALL | OWN[kind]


@pytest.mark.parametrize("kind", KINDS)
def test_each_group_has_the_messages_that_the_firmware_puts_into_it(kind: str) -> None:
    station = vehicle(kind)
    groups = {*GROUPS, mav.MAV_DATA_STREAM_RAW_CONTROLLER}
    for group in sorted(groups):
        wanted = GROUPS.get(group, set()) | OWN_GROUPS.get((kind, group), set())
        assert streamed(station, group) == wanted, group


def test_rover_shows_the_recorded_sensor_bits_in_each_mode() -> None:
    station = vehicle("rover")
    assert sensors(station) == ("1331dc2f", "1221802f", "1331812f")
    assert station.mode(15) == ACCEPTED
    assert station.arm() == ACCEPTED
    assert sensors(station) == ("1331dc2f", "1321dc2f", "1331dd2f"), "GUIDED"
    station.mode(4)
    assert sensors(station) == ("1331dc2f", "1321802f", "1331812f"), "HOLD"


def test_plane_shows_the_recorded_sensor_bits_in_each_mode() -> None:
    station = vehicle("plane")
    assert sensors(station) == ("1361fc3f", "1261803f", "1331803f")
    station.mode(13)
    assert station.arm() == ACCEPTED
    assert sensors(station) == ("1361fc3f", "1361fc3f", "1331fc3f"), "TAKEOFF"


def test_the_sensor_bits_tell_of_a_lost_radio_and_of_an_enabled_fence() -> None:
    station = vehicle("plane")
    station.vehicle.lose_radio(True)
    assert int(sensors(station)[2], 16) & mav.MAV_SYS_STATUS_SENSOR_RC_RECEIVER == 0
    station.vehicle.parameters.set("FENCE_TYPE", 1.0)
    station.vehicle.parameters.set("FENCE_ENABLE", 1.0)
    present, enabled, healthy = (int(bits, 16) for bits in sensors(station))
    fence = mav.MAV_SYS_STATUS_GEOFENCE
    assert (present & fence, enabled & fence, healthy & fence) == (fence, fence, fence)


def test_navigation_is_absent_in_manual_and_there_in_fly_by_wire_of_a_plane() -> None:
    station = vehicle("plane")
    station.interval(mav.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT, 4.0)
    station.run(2.0)
    assert not station.messages("NAV_CONTROLLER_OUTPUT")
    station.mode(5)
    station.run(1.0)
    assert station.messages("NAV_CONTROLLER_OUTPUT")


def test_a_plane_measures_the_air_and_not_the_ground() -> None:
    """Standing in a head wind of 8 m/s, the airspeed is the wind's; speeds are indicated ones."""
    station = vehicle("plane", wind=(-8.0, 0.0, 0.0))
    for message_id in (74, 168, 295, 29):
        station.command(mav.MAV_CMD_REQUEST_MESSAGE, message_id)
    indicated = 8.0 / 1.06
    hud, air = station.last("VFR_HUD"), station.last("AIRSPEED")
    assert hud.airspeed == pytest.approx(indicated, abs=0.2)
    assert hud.groundspeed == pytest.approx(0.0, abs=0.1)
    assert air.airspeed == pytest.approx(hud.airspeed, abs=0.2)
    assert air.raw_press == pytest.approx(air.airspeed**2 / 1.9936, rel=0.01)
    assert station.last("SCALED_PRESSURE").press_diff == pytest.approx(air.raw_press / 100.0)
    wind = station.last("WIND")
    assert wind.speed == pytest.approx(8.0, abs=0.1)
    assert math.remainder(wind.direction, 360.0) == pytest.approx(0.0, abs=1.0), "from the North"


def test_raw_sensors_show_gravity_the_field_and_the_pressure_at_home() -> None:
    """As recorded with a rover that stands at 584 m, nose to the North."""
    station = vehicle("rover")
    for message_id in (27, 129, 29, 137):
        station.command(mav.MAV_CMD_REQUEST_MESSAGE, message_id)
    imu, third = station.last("RAW_IMU"), station.last("SCALED_IMU3")
    assert (imu.xacc, imu.yacc, imu.zacc) == pytest.approx((0, 0, -1000), abs=5)
    assert (imu.xmag, imu.ymag, imu.zmag) == pytest.approx((231, 53, -528), abs=5)
    assert (third.xacc, third.zacc, third.zmag) == (0, 0, imu.zmag)
    assert station.last("SCALED_PRESSURE").press_abs == pytest.approx(945.03, abs=0.2)
    assert station.last("SCALED_PRESSURE2").press_diff == 0.0


def test_a_banked_plane_feels_its_turn_along_its_own_axis() -> None:
    """Recorded in a circle: hardly any sideways force, more than 1 g downwards."""
    station = vehicle("plane")
    station.mode(13)
    station.arm()
    station.run(40.0)
    station.command(mav.MAV_CMD_REQUEST_MESSAGE, 27)
    imu = station.last("RAW_IMU")
    assert abs(imu.yacc) < 150
    assert imu.zacc < -1050


@pytest.mark.parametrize("kind", KINDS)
def test_no_more_than_four_fifths_of_the_loops_50_hz_are_sent(kind: str) -> None:
    """Seen with ATTITUDE at 50 Hz; a copter's loop runs at 400 Hz."""
    station = vehicle(kind)
    attitude = mav.MAVLINK_MSG_ID_ATTITUDE
    assert station.interval(attitude, 50.0) == DENIED
    assert station.interval(attitude, 40.0) == ACCEPTED
