"""Failure injection by command and by parameter, and the resulting failsafes."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import LinkFaults, Simulation, VehicleConfig
from mavlink_sitl.links.faults import FaultyPipe
from sitl_support.ground_station import (
    ACCEPTED,
    FAILED,
    GUIDED,
    LAND,
    POSITION,
    RTL,
    UNSUPPORTED,
    GroundStation,
    copter,
    flying,
)

GPS, BATTERY, MOTOR, RADIO, LINK = 4, 100, 101, 104, 105
OK, OFF, STUCK, GARBAGE, WRONG, SLOW, DELAYED, INTERMITTENT = range(8)


def inject(station: GroundStation, unit: int, kind: int, instance: int = 0) -> int:
    return station.command(mav.MAV_CMD_INJECT_FAILURE, unit, kind, instance)


def put(station: GroundStation, name: str, value: float) -> None:
    station.send(mav.MAVLink_param_set_message(1, 1, name.encode(), value, 9))


def fail(
    station: GroundStation, way: str, unit: int, kind: int, parameter: tuple[str, float]
) -> None:
    """Let a unit fail, by the command or by a parameter that does the same."""
    if way == "command":
        assert inject(station, unit, kind) == ACCEPTED
    else:
        put(station, *parameter)


def error_m(station: GroundStation) -> float:
    """How far the estimate is from the truth, horizontally."""
    told = station.last("LOCAL_POSITION_NED")
    return math.hypot(told.x - station.position[0], told.y - station.position[1])


@pytest.mark.parametrize("way", ["command", "parameter"])
def test_gps_loss_in_flight_as_observed(way: str) -> None:
    """copter_gpsloss: fix 1; 'EKF variance' and LAND after 8 s, no local position after 15 s."""
    station = flying()
    station.interval(24, 5.0)
    station.interval(193, 5.0)
    begin_s = station.now_s
    if way == "command":
        assert inject(station, GPS, OFF) == ACCEPTED
    else:
        put(station, "SIM_GPS1_ENABLE", 0)
    station.run(2.0)
    assert station.last("GPS_RAW_INT").fix_type == 1
    assert station.last("EKF_STATUS_REPORT").flags == 0x33F
    station.run(8.0)
    assert station.last("EKF_STATUS_REPORT").flags == 0x25
    assert "EKF Failsafe: changed to LAND Mode" in station.texts(begin_s)
    heartbeat = station.last("HEARTBEAT")
    assert (heartbeat.custom_mode, heartbeat.system_status) == (LAND, 5)
    assert station.mode(GUIDED) == FAILED
    assert "Mode change to GUIDED failed: requires position" in station.texts(begin_s)
    station.run(6.5)
    assert station.last("EKF_STATUS_REPORT").flags == 0xA7
    silent_s = station.now_s
    station.run(1.0)
    assert not station.messages("LOCAL_POSITION_NED", silent_s)
    assert station.messages("GLOBAL_POSITION_INT", silent_s)
    assert station.last("SYS_STATUS").onboard_control_sensors_health & 0x20, "as observed"
    if way == "command":
        assert inject(station, GPS, OK) == ACCEPTED
    else:
        put(station, "SIM_GPS1_ENABLE", 1)
    station.run(3.0)
    assert station.last("GPS_RAW_INT").fix_type == 6
    assert station.messages("LOCAL_POSITION_NED", silent_s + 2.0)
    assert station.mode(GUIDED) == ACCEPTED


METRE_DEG = 1.0 / 111318.845
GLITCHING = 0x8000


def test_a_small_glitch_pulls_the_vehicle_away() -> None:
    station = flying()
    put(station, "SIM_GPS1_GLTCH_X", 3.0 * METRE_DEG)
    station.run(10.0)
    assert error_m(station) == pytest.approx(3.0, abs=0.5)
    assert station.position[0] == pytest.approx(-3.0, abs=1.0), "it holds the wrong place"
    put(station, "SIM_GPS1_GLTCH_X", 0.0)
    station.run(10.0)
    assert error_m(station) < 0.5
    assert "GPS Glitch or Compass error" not in station.texts()


@pytest.mark.parametrize("way", ["command", "parameter"])
def test_a_receiver_that_jumps_is_not_believed_for_ten_seconds(way: str) -> None:
    """EKF3: flagged after a second; after posRetryTimeUseVel_ms the estimate is reset to it."""
    station = flying()
    for message_id in (24, 193):
        station.interval(message_id, 5.0)
    begin_s = station.now_s
    if way == "command":
        assert inject(station, GPS, WRONG) == ACCEPTED
    else:
        put(station, "SIM_GPS1_GLTCH_X", 60.0 * METRE_DEG)
        put(station, "SIM_GPS1_GLTCH_Y", 60.0 * METRE_DEG)
    station.run(0.9)
    report = station.last("EKF_STATUS_REPORT")
    assert (report.flags, report.pos_horiz_variance > 1.0) == (0x33F, True)
    station.run(8.0)
    told = station.last("GPS_RAW_INT")
    assert told.fix_type == 6
    away_m = (told.lat / 1e7 - station.vehicle.origin.latitude_deg) / METRE_DEG
    assert away_m - station.position[0] > 50.0
    assert error_m(station) < 1.0
    report = station.last("EKF_STATUS_REPORT")
    assert report.flags == 0x33F | GLITCHING
    assert "GPS Glitch or Compass error" in station.texts(begin_s)
    station.run(2.0)
    assert error_m(station) > 50.0, "in one step"
    report = station.last("EKF_STATUS_REPORT")
    assert (report.flags, report.pos_horiz_variance < 1.0) == (0x33F | GLITCHING, True)
    station.run(10.0)
    assert station.last("EKF_STATUS_REPORT").flags == 0x33F
    assert station.texts(begin_s) == ["GPS Glitch or Compass error", "Glitch cleared"]
    assert station.last("HEARTBEAT").custom_mode == GUIDED, "the position alone is no failsafe"
    assert math.hypot(*station.position[:2]) < 1.0, "what it holds goes along with the reset"


def test_a_receiver_that_is_right_again_in_time_leaves_the_estimate_alone() -> None:
    station = flying()
    station.interval(193, 5.0)
    put(station, "SIM_GPS1_GLTCH_X", 20.0 * METRE_DEG)
    station.run(6.0)
    put(station, "SIM_GPS1_GLTCH_X", 0.0)
    station.run(9.0)
    assert station.last("EKF_STATUS_REPORT").flags & GLITCHING, "for ten seconds more"
    station.run(2.0)
    assert station.last("EKF_STATUS_REPORT").flags == 0x33F
    assert error_m(station) < 0.5


def test_a_px4_says_at_once_that_it_does_not_believe_and_gives_in_after_seven_seconds() -> None:
    """Seen on its own simulator, with a receiver that was fed 20 m beside the truth."""
    config = VehicleConfig(autopilot="px4", ready_after_s=1.0, parameters={"SYS_FAILURE_EN": 1.0})
    station = GroundStation(Simulation([config], seed=1))
    station.run(4.0)
    station.interval(230, 10.0)
    assert inject(station, GPS, WRONG) == ACCEPTED
    station.run(0.3)
    report = station.last("ESTIMATOR_STATUS")
    assert (report.flags & 0x400, round(report.pos_horiz_ratio, 2)) == (0x400, 2.0)
    station.run(6.4)
    assert error_m(station) < 1.0
    station.run(0.6)
    report = station.last("ESTIMATOR_STATUS")
    assert (report.flags & 0x400, report.pos_horiz_ratio < 0.1) == (0, True)
    assert error_m(station) > 80.0


@pytest.mark.parametrize("way", ["command", "parameter"])
def test_weak_motors_are_made_up_for_and_dead_ones_are_not(way: str) -> None:
    station = flying()
    fail(station, way, MOTOR, SLOW, ("SIM_ENGINE_MUL", 0.8))
    station.run(5.0)
    assert station.position[2] == pytest.approx(-10.0, abs=1.0)
    fail(station, way, MOTOR, OFF, ("SIM_ENGINE_FAIL", 15))
    station.run(3.0)
    assert station.simulation.truth.on_ground[0]
    assert any(text.startswith("SIM Hit ground at") for text in station.texts())


def test_one_motor_of_four_leaves_half() -> None:
    station = flying(4.0)
    assert inject(station, MOTOR, OFF, 2) == ACCEPTED
    station.run(5.0)
    assert not station.simulation.truth.on_ground[0]
    assert inject(station, MOTOR, OFF, 1) == ACCEPTED
    station.run(4.0)
    assert station.simulation.truth.on_ground[0]
    assert inject(station, MOTOR, OFF, 5) == UNSUPPORTED


def test_an_empty_battery_and_a_good_one_again() -> None:
    station = flying(parameters={"BATT_FS_LOW_ACT": 2.0, "BATT_LOW_TIMER": 3.0})
    before = station.last("SYS_STATUS").battery_remaining
    assert inject(station, BATTERY, OFF) == ACCEPTED
    station.run(5.0)
    assert station.last("HEARTBEAT").custom_mode == RTL
    assert station.last("SYS_STATUS").battery_remaining == 0
    assert inject(station, BATTERY, OK) == ACCEPTED
    station.run(1.0)
    assert station.last("SYS_STATUS").battery_remaining == pytest.approx(before, abs=1)


@pytest.mark.parametrize("way", ["command", "parameter"])
def test_radio_loss_returns_within_a_second_even_from_guided(way: str) -> None:
    """Observed: RTL in 1 s even from GUIDED ('Radio Failsafe'); GUIDED may be chosen again."""
    station = flying()
    fail(station, way, RADIO, OFF, ("SIM_RC_FAIL", 1))
    station.run(1.0)
    assert "Radio Failsafe" in station.texts()
    assert station.last("HEARTBEAT").custom_mode == RTL
    assert station.mode(GUIDED) == ACCEPTED
    station.run(3.0)
    assert station.last("HEARTBEAT").custom_mode == GUIDED
    if way == "command":
        assert inject(station, RADIO, OK) == ACCEPTED
    else:
        put(station, "SIM_RC_FAIL", 0)
    station.run(1.0)
    assert "Radio Failsafe Cleared" in station.texts()


def test_radio_loss_by_its_parameter() -> None:
    for action, mode in ((0, GUIDED), (3, LAND)):
        station = flying(parameters={"FS_THR_ENABLE": float(action)})
        inject(station, RADIO, OFF)
        station.run(1.5)
        assert station.last("HEARTBEAT").custom_mode == mode


def test_overrides_stand_in_for_the_radio() -> None:
    station = flying()
    centre = mav.MAVLink_rc_channels_override_message(1, 1, *[1500] * 8)
    station.send(centre)
    inject(station, RADIO, OFF)
    station.stream(2.0, 5.0, lambda: station.send(centre))
    assert "Radio Failsafe" not in station.texts()
    station.run(4.0)
    assert "Radio Failsafe" in station.texts(), "3 s after the last override"


def test_wind_by_parameter() -> None:
    station = flying()
    station.interval(168, 5.0)
    put(station, "SIM_WIND_DIR", 90)
    put(station, "SIM_WIND_SPD", 6)
    station.run(0.5)
    assert station.last("WIND").speed == pytest.approx(6.0)
    assert station.last("WIND").direction == pytest.approx(90.0, abs=0.1)


# The link.


def test_a_silent_vehicle_still_hears() -> None:
    station = flying()
    assert inject(station, LINK, OFF) == -1, "no answer any more"
    quiet_s = station.now_s
    station.setpoint(POSITION, (5.0, 0.0, -10.0))
    station.run(6.0)
    assert not [m for t, m in station.log if t > quiet_s]
    assert station.position[0] == pytest.approx(5.0, abs=0.5)
    assert inject(station, LINK, OK) == ACCEPTED
    station.run(2.0)
    assert station.messages("HEARTBEAT", quiet_s)


@pytest.mark.parametrize("kind", [GARBAGE, WRONG, SLOW, DELAYED, INTERMITTENT])
def test_each_fault_of_the_link(kind: int) -> None:
    station = copter(seed=4).ready()
    station.run(3.0)
    begin_s = station.now_s
    usual = len(station.messages("ATTITUDE", begin_s - 2.0))
    inject(station, LINK, kind)
    first_s = station.now_s
    raw = []
    for _ in range(40):
        station.simulation.run_for(0.05)
        raw += station.vehicle.link.read_datagrams()
    parser = mav.MAVLink(None)
    parser.robust_parsing = True
    seen = [m for data in raw for m in parser.parse_buffer(data) or []]
    whole = [m for m in seen if m.get_type() == "ATTITUDE"]
    assert station.now_s - first_s == pytest.approx(2.0)
    if kind in (GARBAGE, INTERMITTENT):
        assert 0.3 * usual < len(whole) < 0.95 * usual
    elif kind == WRONG:
        assert len(whole) > 1.2 * usual
    else:
        assert len(whole) < usual
        assert whole[0].time_boot_ms / 1e3 < station.now_s - 0.2
    if kind == GARBAGE:
        assert any(m.get_type() == "BAD_DATA" for m in seen)


def test_a_corrupting_pipe_changes_one_byte_and_is_seeded() -> None:
    def through(seed: str) -> list[bytes]:
        pipe = FaultyPipe(LinkFaults(corrupt=0.5), seed)
        for _ in range(200):
            pipe.push(bytes(20), 0)
        return pipe.pop(0)

    arrived = through("a")
    bent = [data for data in arrived if any(data)]
    assert 70 < len(bent) < 130
    assert all(sum(byte != 0 for byte in data) == 1 for data in bent)
    assert arrived == through("a")
    assert arrived != through("b")


# Limits of failures: unsupported ones, how long they last, which vehicle they hit.


@pytest.mark.parametrize(("unit", "kind"), [(0, OFF), (GPS, STUCK), (99, OFF), (LINK, STUCK)])
def test_what_cannot_be_broken_is_unsupported(unit: int, kind: int) -> None:
    assert inject(copter().ready(), unit, kind) == UNSUPPORTED


def test_another_parameter_does_not_mend_what_a_command_broke() -> None:
    station = flying()
    inject(station, GPS, OFF)
    inject(station, RADIO, OFF)
    put(station, "WPNAV_SPEED", 500)
    station.run(2.0)
    assert not station.vehicle.firmware.estimator.gps_fix
    assert station.vehicle.firmware.pilot.lost


def test_failures_hit_one_vehicle_of_many() -> None:
    simulation = Simulation([VehicleConfig(ready_after_s=1.0)] * 3, seed=1)
    simulation.run_for(3.0)
    simulation.vehicles[1].lose_gps()
    simulation.vehicles[2].weaken_motors(0.5)
    simulation.run_for(1.0)
    fixes = [vehicle.firmware.estimator.gps_fix for vehicle in simulation.vehicles]
    assert fixes == [True, False, True]


@pytest.mark.parametrize(
    ("vehicle", "autopilot"),
    [
        ("copter", "ardupilot"),
        ("copter", "px4"),
        ("rover", "ardupilot"),
        ("boat", "ardupilot"),
        ("plane", "ardupilot"),
        ("rover", "px4"),
        ("boat", "px4"),
        ("plane", "px4"),
    ],
)
def test_every_kind_of_vehicle_can_be_broken_and_mended(vehicle: str, autopilot: str) -> None:
    parameters = {"SYS_FAILURE_EN": 1.0} if autopilot == "px4" else {}
    config = VehicleConfig(
        vehicle=vehicle, autopilot=autopilot, ready_after_s=1.0, parameters=parameters
    )
    station = GroundStation(Simulation([config], seed=1))
    station.run(4.0)
    body = station.vehicle.firmware
    for unit in (GPS, BATTERY, MOTOR, RADIO):
        assert inject(station, unit, OFF) == ACCEPTED
    station.run(2.0)
    assert not body.estimator.gps_fix
    assert body.pilot.lost
    assert body.observation.battery.remaining_percent < 5.0 or autopilot == "px4"
    for unit in (GPS, BATTERY, MOTOR, RADIO):
        assert inject(station, unit, OK) == ACCEPTED
    station.run(4.0)
    assert body.estimator.gps_fix
    assert not body.pilot.lost
    assert body.observation.battery.remaining_percent > 90.0


def test_px4_wants_failures_to_be_enabled() -> None:
    config = VehicleConfig(autopilot="px4", ready_after_s=1.0)
    station = GroundStation(Simulation([config], seed=1))
    station.run(3.0)
    assert inject(station, GPS, OFF) == 2
    assert station.vehicle.firmware.estimator.gps_fix
