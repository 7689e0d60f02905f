"""PX4's own simulator (SIH) was flown and asked with the same script; this is what it did."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.autopilot.personality import px4
from sitl_support.ground_station import (
    ACCEPTED,
    DENIED,
    FAILED,
    TEMPORARILY_REJECTED,
)
from sitl_support.missions import upload
from sitl_support.px4_station import HOME, Px4Station, at, flying_px4, plan_item, ready_px4

pytestmark = pytest.mark.wide

HEARTBEAT, MISSION_CURRENT = 0, 42
STATION_COMPONENT, COMPANION_COMPONENT = 190, 191


def hovering() -> Px4Station:
    """In AUTO.LOITER, with a ground station's own component beside the companion."""
    air = flying_px4()
    assert air.mode(px4.LOITER) == ACCEPTED
    air.run(3.0)
    air.gcs_heartbeat()
    return air


# Modes that are refused.

REFUSED = [
    ((6, 0), "Offboard"),
    ((3, 0), "Position"),
    ((3, 1), "Position"),
    ((3, 2), "Position Slow"),
    ((2, 0), "Altitude"),
    ((1, 0), "Manual"),
    ((5, 0), "Acro"),
    ((7, 0), "Stabilized"),
    ((11, 0), "Altitude Cruise"),
    ((4, 4), "Mission"),
    ((4, 0), "Mission"),
    ((4, 11), "External 1"),
]


def said(station: Px4Station, since_s: float) -> str:
    return "".join(station.texts(since_s)).replace("\t", "|")


@pytest.fixture(scope="module")
def air() -> Px4Station:
    return hovering()


@pytest.mark.parametrize(("mode", "name"), REFUSED)
def test_a_rejected_mode_is_reported_to_a_ground_station_and_to_nobody_else(
    air: Px4Station, mode: tuple[int, int], name: str
) -> None:
    for component in (COMPANION_COMPONENT, STATION_COMPONENT):
        air.run(1.1)
        air.gcs_heartbeat()
        begin_s = air.now_s
        speaker = Px4Station(air.simulation, system=255, component=component)
        results = speaker.command_results(mav.MAV_CMD_DO_SET_MODE, 1, *mode)
        assert results == [ACCEPTED, TEMPORARILY_REJECTED]
        heard = "".join(speaker.texts(begin_s)).replace("\t", "|")
        expected = f"Switching to {name} is currently not available|"
        assert heard == (expected if component == STATION_COMPONENT else "")
    assert air.custom_mode == px4.LOITER


@pytest.mark.parametrize("mode", [(99, 0), (8, 0), (10, 0)])
def test_a_main_mode_that_nobody_handles_is_accepted_and_nothing_happens(
    air: Px4Station, mode: tuple[int, int]
) -> None:
    begin_s = air.now_s
    assert air.command_results(mav.MAV_CMD_DO_SET_MODE, 1, *mode) == [ACCEPTED, ACCEPTED]
    air.run(1.1)
    assert (air.custom_mode, said(air, begin_s)) == (px4.LOITER, "")


@pytest.mark.parametrize("sub_mode", [99, 10])
def test_an_auto_mode_that_does_not_exist_has_a_text_of_its_own(
    air: Px4Station, sub_mode: int
) -> None:
    air.run(0.1)
    air.gcs_heartbeat()
    begin_s = air.now_s
    results = air.command_results(mav.MAV_CMD_DO_SET_MODE, 1, 4, sub_mode)
    assert results == [ACCEPTED, TEMPORARILY_REJECTED]
    assert said(air, begin_s) == "Unsupported auto mode|"


def test_rejections_are_reported_once_a_second() -> None:
    air = hovering()
    station = Px4Station(air.simulation, system=255, component=STATION_COMPONENT)
    for _ in range(5):
        station.command_results(mav.MAV_CMD_DO_SET_MODE, 1, 6)
        station.run(0.1)
    assert station.texts() == ["Switching to Offboard is currently not available\t"]


def test_offboard_is_accepted_when_its_first_setpoint_follows_the_command_at_once() -> None:
    """The setpoint came 0.3 ms after the command, the acceptance after 10.8 ms."""
    air = hovering()
    command = mav.MAVLink_command_long_message(
        1, 1, mav.MAV_CMD_DO_SET_MODE, 0, 1, 6, 0, 0, 0, 0, 0
    )
    answers = air.send(command)
    assert [m.result for m in answers if m.get_type() == "COMMAND_ACK"] == [ACCEPTED]
    begin = len(air.log)
    air.stream_to(3.0, 60.0, 0.0, -10.0)
    acks = [m.result for _, m in air.log[begin:] if m.get_type() == "COMMAND_ACK"]
    assert (acks, air.custom_mode) == ([ACCEPTED], px4.OFFBOARD)
    assert air.position[0] > 15.0


def test_offboard_is_rejected_when_its_first_setpoint_comes_20_ms_later() -> None:
    air = hovering()
    assert air.mode(px4.OFFBOARD) == TEMPORARILY_REJECTED
    air.stream_to(1.0, 60.0, 0.0, -10.0)
    assert air.custom_mode == px4.LOITER


# Streams.


def test_an_interval_of_mission_current_fails_and_it_keeps_coming_once_a_second() -> None:
    ground = ready_px4()
    for message_id in (MISSION_CURRENT, HEARTBEAT, 46, 247, 9999):
        assert ground.interval(message_id, 5.0) == FAILED, message_id
    assert ground.command(mav.MAV_CMD_REQUEST_MESSAGE, MISSION_CURRENT) == DENIED
    begin_s = ground.now_s
    ground.run(5.0)
    assert len(ground.messages("MISSION_CURRENT", begin_s)) == 5


@pytest.mark.parametrize("message_id", [26, 65, 116, 225, 254, 380, 12918])
def test_a_stream_that_has_nothing_to_say_is_accepted_anyway(message_id: int) -> None:
    ground = ready_px4().quiet()
    assert ground.interval(message_id, 5.0) == ACCEPTED
    ground.run(1.0)
    assert message_id not in {m.get_msgId() for _, m in ground.log}


@pytest.mark.parametrize("link", ["gcs", "onboard"])
def test_each_link_has_the_streams_that_the_real_one_has(link: str) -> None:
    station = ready_px4((link,))
    begin_s = station.now_s
    station.run(20.0)
    counts: dict[str, float] = {}
    for time_s, message in station.log:
        if time_s > begin_s + 0.001:
            counts[message.get_type()] = counts.get(message.get_type(), 0) + 1 / 20.0
    slow = {
        "HEARTBEAT": 1, "MISSION_CURRENT": 1, "HOME_POSITION": 0.5, "BATTERY_STATUS": 0.5,
        "CURRENT_MODE": 0.5, "OPEN_DRONE_ID_LOCATION": 1, "OPEN_DRONE_ID_SYSTEM": 1,
        "SCALED_PRESSURE": 1,
    }  # fmt: skip
    own = {
        "gcs": {
            "ALTITUDE": 1, "ATTITUDE": 50, "ATTITUDE_QUATERNION": 50, "ATTITUDE_TARGET": 50,
            "DISTANCE_SENSOR": 0.5, "ESTIMATOR_STATUS": 0.5, "EXTENDED_SYS_STATE": 1,
            "GLOBAL_POSITION_INT": 50, "GPS_RAW_INT": 5, "LOCAL_POSITION_NED": 50, "PING": 0.1,
            "POSITION_TARGET_LOCAL_NED": 50, "SERVO_OUTPUT_RAW": 50, "SYS_STATUS": 1,
            "VFR_HUD": 4, "VIBRATION": 0.1,
        },
        "onboard": {
            "ALTITUDE": 10, "ATTITUDE": 100, "ATTITUDE_QUATERNION": 50, "ATTITUDE_TARGET": 10,
            "DISTANCE_SENSOR": 10, "ESTIMATOR_STATUS": 1, "EXTENDED_SYS_STATE": 5,
            "GLOBAL_POSITION_INT": 50, "GPS_RAW_INT": 8, "HIGHRES_IMU": 50,
            "LOCAL_POSITION_NED": 30, "ODOMETRY": 30, "PING": 1, "POSITION_TARGET_LOCAL_NED": 10,
            "SERVO_OUTPUT_RAW": 10, "SYS_STATUS": 5, "SYSTEM_TIME": 1, "TIMESYNC": 10,
            "VFR_HUD": 10, "VIBRATION": 0.5,
        },
    }[link]  # fmt: skip
    assert set(counts) == {*slow, *own}
    for kind, rate_hz in {**slow, **own}.items():
        assert counts[kind] == pytest.approx(rate_hz, rel=0.03, abs=0.06), kind


def test_remote_id_reports_where_it_is_and_that_the_operator_is_at_home() -> None:
    air = hovering()
    air.run(1.2)
    where, who = air.last("OPEN_DRONE_ID_LOCATION"), air.last("OPEN_DRONE_ID_SYSTEM")
    assert where.status == mav.MAV_ODID_STATUS_AIRBORNE
    assert where.latitude == pytest.approx(HOME.latitude_deg * 1e7, abs=300)
    assert where.height == pytest.approx(10.0, abs=2.0)
    assert who.operator_latitude == pytest.approx(HOME.latitude_deg * 1e7, abs=300)
    assert who.operator_location_type == mav.MAV_ODID_OPERATOR_LOCATION_TYPE_TAKEOFF


# Arming.


def test_arming_is_denied_in_the_first_four_seconds() -> None:
    """As long as its start takes; ready_after_s shortens it otherwise."""
    config = VehicleConfig(autopilot="px4", ready_after_s=4.4, links=("gcs",))
    ground = Px4Station(Simulation([config], seed=1), system=255, component=190)
    ground.run(3.0)
    ground.gcs_heartbeat()
    assert ground.arm() == TEMPORARILY_REJECTED
    assert said(ground, 0.0) == "Arming denied: Resolve system health failures first|"
    ground.run(2.0)
    assert ground.arm() == ACCEPTED


def test_mission_start_says_that_it_arms() -> None:
    ground = ready_px4()
    ground.gcs_heartbeat()
    items = [plan_item(22, 0, 0, 5.0), plan_item(16, 20, 0, 5.0)]
    assert upload(ground, items) == 0
    ground.run(0.3)
    ground.gcs_heartbeat()
    assert ground.command(mav.MAV_CMD_MISSION_START) == ACCEPTED
    assert "Armed by mission start\t" in ground.texts()


def test_a_takeoff_without_a_height_climbs_by_mis_takeoff_alt_from_where_it_is() -> None:
    air = hovering()
    begin_s = air.now_s
    assert air.mode(px4.TAKEOFF) == ACCEPTED
    assert said(air, begin_s) == "Using default takeoff altitude: 2.5 m|"
    air.run_until(lambda: air.custom_mode == px4.LOITER)
    air.run(4.0)
    assert -air.position[2] == pytest.approx(12.5, abs=0.7)


def test_the_default_height_is_reported_once_it_is_armed() -> None:
    ground = ready_px4()
    ground.gcs_heartbeat()
    begin_s = ground.now_s
    assert ground.mode(px4.TAKEOFF) == ACCEPTED
    ground.run(0.5)
    assert said(ground, begin_s) == ""
    assert ground.arm() == ACCEPTED
    ground.run(0.5)
    armed_and_told = "Armed by external command|Using default takeoff altitude: 2.5 m|"
    assert said(ground, begin_s) == armed_and_told


# Ground station lost.


def test_a_station_that_comes_back_is_reported() -> None:
    air = flying_px4(parameters={"NAV_DLL_ACT": 2.0, "COM_DL_LOSS_T": 5.0})
    assert air.mode(px4.LOITER) == ACCEPTED
    air.gcs_heartbeat()
    air.run(8.0)
    assert air.vehicle.firmware.failsafe.active
    air.gcs_heartbeat()
    air.run(0.2)
    assert air.texts()[-1] == "GCS connection regained\t"


# How it moves.

LEGS = [
    # Length, m; speeds after 0.3, 0.6, 0.9, 1.2 and 1.5 s; the highest; until within 1, 0.5 and
    # 0.3 m, s. Means of two to four legs, which differ among themselves by up to 0.3 m/s.
    (5.2, (0.60, 1.84, 2.69, 2.79, 2.49), 2.81, (2.21, 2.55, 2.75)),
    (15.4, (0.65, 2.39, 4.13, 5.49, 6.46), 6.76, (3.59, 3.91, 4.08)),
    (20.4, (0.74, 2.42, 4.13, 5.52, 6.45), 7.88, (3.98, 4.25, 4.37)),
    (30.6, (0.70, 2.35, 4.24, 5.55, 6.68), 8.83, (4.86, 5.02, 5.08)),
]


@pytest.mark.parametrize(("length_m", "speeds", "top", "within_s"), LEGS)
def test_a_position_in_offboard_is_flown_to_as_fast_as_by_the_real_one(
    length_m: float,
    speeds: tuple[float, ...],
    top: float,
    within_s: tuple[float, float, float],
) -> None:
    air = flying_px4()
    seen: list[float] = []
    left: list[float] = []
    for _ in range(120):
        air.go_to(length_m, 0.0, -10.0)
        air.run(0.05)
        seen.append(math.hypot(*air.velocity[:2]))
        left.append(length_m - air.position[0])
    assert seen[5:30:6] == pytest.approx(speeds, abs=0.4)
    assert max(seen) == pytest.approx(top, abs=0.35)
    there_s = [sum(metres >= radius_m for metres in left) * 0.05 for radius_m in (1.0, 0.5, 0.3)]
    assert there_s == pytest.approx(within_s, abs=0.3)


CLIMB_OF_5_M = [(0.33, 0.31), (0.63, 1.05), (0.93, 1.88), (1.23, 2.68), (1.83, 3.88), (2.43, 4.47)]
"""Seconds after a setpoint 5 m above, and metres climbed"""


def test_a_height_in_offboard_is_flown_to_without_a_trajectory() -> None:
    """P and PI alone: 2 m/s after 0.33 s, and at most MPC_Z_VEL_MAX_UP."""
    air = flying_px4()
    air.stream_to(3.0, 0.0, 0.0, -10.0)
    begin_s, height_m = air.now_s, -air.position[2]
    for after_s, climbed_m in CLIMB_OF_5_M:
        air.stream_to(begin_s + after_s - air.now_s, 0.0, 0.0, -height_m - 5.0)
        assert -air.position[2] - height_m == pytest.approx(climbed_m, abs=0.3), after_s


CLIMB_AT_SPEED = [(0.9, 0.42), (1.3, 0.71), (1.7, 1.08), (2.1, 1.6), (2.5, 1.85)]
"""Seconds after the failsafe of a stream that ended at 9 m/s, and climb rate, m/s"""


def test_a_return_at_speed_climbs_as_slowly_as_it_stops() -> None:
    """The axes of a trajectory take equally long (VelocitySmoothing::timeSynchronization)."""
    air = flying_px4()
    air.stream_to(3.9, 80.0, 0.0, -10.0)
    air.run_until(lambda: air.vehicle.firmware.failsafe.active)
    begin_s = air.now_s
    for after_s, real_m_s in CLIMB_AT_SPEED:
        air.run(begin_s + after_s - air.now_s)
        assert -air.velocity[2] == pytest.approx(real_m_s, abs=0.4), after_s


def test_a_return_from_15_m_takes_as_long_as_the_real_ones() -> None:
    """49.4, 53.4 and 57.5 s were seen, and 56 s; it stands on the ground after 43 s."""
    air = flying_px4()
    air.stream_to(8.0, 15.0, 0.0, -10.0)
    air.gcs_heartbeat()
    begin_s = air.now_s
    assert air.command(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH) == ACCEPTED
    assert said(air, begin_s).startswith("Returning to launch|RTL: start return at ")
    touched_s = air.run_until(lambda: air.position[2] > -0.05)
    assert touched_s == pytest.approx(43.3, abs=1.5)
    air.run_until(lambda: not air.armed)
    assert air.now_s - begin_s == pytest.approx(53.0, abs=3.5)


def test_landing_is_detected_2_s_after_touchdown_in_land() -> None:
    """2.2 s in `offboard_10m_20n_gt`, of which the truth is known."""
    air = flying_px4(5.0)
    assert air.mode(px4.LAND) == ACCEPTED
    air.run_until(lambda: air.position[2] > -0.05)
    touched_s = air.now_s
    air.run_until(lambda: air.last("EXTENDED_SYS_STATE").landed_state == 1)
    assert air.now_s - touched_s == pytest.approx(2.2, abs=0.5)


# The trajectory of a target.

STEP_10_M = [(2.0, 2.52), (2.5, 4.12), (3.0, 5.69), (3.5, 7.02)]
"""Time, s, and way north, m, after a DO_REPOSITION from a hover (PX4 1.18.0-beta1)"""
CLIMB_FOR_A_RETURN = [(0.7, 1.04), (1.0, 1.92), (1.3, 2.45), (1.6, 2.6)]
"""Time, s, and climb rate, m/s, after RTL began at a height of 10 m (PX4 1.18.0-beta1)"""


def test_a_target_is_flown_to_with_the_jerk_of_its_trajectory() -> None:
    """An acceleration ends as late as its jerk allows (VelocitySmoothing), not proportionally."""
    station = hovering()
    begin_s, begin_m = station.now_s, station.position[0]
    x, y = at(begin_m + 10.0, station.position[1])
    amsl_m = HOME.altitude_amsl_m - station.position[2]
    station.command_int(192, 0, -1, 1, 0, math.nan, x=x, y=y, z=amsl_m)
    for after_s, real_m in STEP_10_M:
        station.run(begin_s + after_s - station.now_s)
        assert station.position[0] - begin_m == pytest.approx(real_m, abs=0.4), after_s


def test_a_return_climbs_with_the_jerk_of_its_trajectory() -> None:
    air = flying_px4()
    air.stream_to(7.0, 20.0, 0.0, -10.0)
    air.run_until(lambda: air.custom_mode == px4.RTL)
    begin_s = air.now_s
    for after_s, real_m_s in CLIMB_FOR_A_RETURN:
        air.run(begin_s + after_s - air.now_s)
        assert -air.velocity[2] == pytest.approx(real_m_s, abs=0.5), after_s


# Without GPS.


def test_without_gps_it_descends_level_and_does_not_say_that_it_lands() -> None:
    """After 5.2 s a failsafe descends, under the number of LAND (PX4 1.18.0-beta1)."""
    air = ready_px4(wind_ned_m_s=(0.0, 4.0, 0.0)).quiet().take_off(10.0).talkative()
    assert air.mode(px4.LOITER) == ACCEPTED
    air.run(3.0)
    begin_s = air.now_s
    air.vehicle.lose_gps()
    air.run_until(lambda: air.vehicle.firmware.failsafe.active)
    assert air.now_s - begin_s == pytest.approx(5.2, abs=0.3)
    east_m = air.simulation.truth.position_ned_m[0, 1]
    air.run_until(lambda: not air.armed)
    assert air.simulation.truth.position_ned_m[0, 1] - east_m > 10.0, "the wind carries it away"
    states = {m.landed_state for m in air.messages("EXTENDED_SYS_STATE", begin_s)}
    assert states == {mav.MAV_LANDED_STATE_IN_AIR, mav.MAV_LANDED_STATE_ON_GROUND}
