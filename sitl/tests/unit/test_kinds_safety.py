"""Failsafes and fences of rovers, boats and planes, with the firmware's own parameters.

After the documentation of the parameters and the source; no recording shows them.
"""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    DENIED,
    FAILED,
    POSITION,
    VELOCITY,
    YAW_RATE,
    GroundStation,
)
from sitl_support.kinds import (
    FBWA,
    HOLD,
    LOITER,
    PLANE_AUTO,
    PLANE_GUIDED,
    PLANE_RTL,
    ROVER_AUTO,
    ROVER_GUIDED,
    ROVER_RTL,
    SMART_RTL,
    kind,
    mode_of,
    plane,
    rover,
)
from sitl_support.missions import HOME, METRE, item, upload, waypoint

pytestmark = pytest.mark.wide

LOW = {"BATT_LOW_VOLT": 10.5, "BATT_CRT_VOLT": 9.8, "BATT_LOW_TIMER": 1.0}
CIRCLE = 1
STANDBY, ACTIVE, CRITICAL = 3, 4, 5
WP_RADIUS_M = 2.0
INCLUSION = 5001


def said(station: GroundStation, text: str) -> bool:
    return any(text in words for words in station.texts())


def empty(station: GroundStation, voltage_v: float) -> None:
    station.vehicle.set_battery_voltage(voltage_v)
    station.run(3.0)


def going_north_m(station: GroundStation) -> float:
    """How far North of home the place is that a vehicle goes to."""
    station.command(mav.MAV_CMD_REQUEST_MESSAGE, 87)
    return float(station.last("POSITION_TARGET_GLOBAL_INT").lat_int - HOME[0]) / METRE


# Battery.


@pytest.mark.parametrize("vehicle", ["rover", "boat"])
@pytest.mark.parametrize(("action", "mode"), [(0, ROVER_GUIDED), (1, ROVER_RTL), (2, HOLD)])
def test_a_low_battery_does_what_is_set_for_it(vehicle: str, action: int, mode: int) -> None:
    station = rover({**LOW, "BATT_FS_LOW_ACT": action}, vehicle)
    empty(station, 10.2)
    assert mode_of(station) == mode
    assert said(station, "Battery Failsafe")
    status = STANDBY if mode == HOLD else ACTIVE
    assert station.last("HEARTBEAT").system_status == status, "links and estimator alone count"


@pytest.mark.parametrize(("action", "mode"), [(3, SMART_RTL), (4, SMART_RTL)])
def test_a_critical_battery_of_a_rover_may_drive_back_the_way_it_came(
    action: int, mode: int
) -> None:
    station = rover({**LOW, "BATT_FS_CRT_ACT": action})
    empty(station, 10.2)
    assert mode_of(station) == ROVER_GUIDED, "low is only said"
    empty(station, 9.5)
    assert mode_of(station) == mode


def test_a_battery_may_end_the_drive() -> None:
    station = rover({**LOW, "BATT_FS_CRT_ACT": 5.0})
    empty(station, 9.5)
    station.run(1.0)
    assert not station.last("HEARTBEAT").base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED


@pytest.mark.parametrize(("action", "mode"), [(0, PLANE_GUIDED), (1, PLANE_RTL), (2, PLANE_RTL)])
def test_a_low_battery_of_a_plane_returns_or_lands_by_the_mission_if_there_is_one(
    action: int, mode: int
) -> None:
    station = plane({**LOW, "BATT_FS_LOW_ACT": action})
    empty(station, 10.2)
    assert mode_of(station) == mode
    assert said(station, "Unable to start landing sequence") == (action == 2)


def test_a_low_battery_of_a_plane_goes_to_the_missions_landing() -> None:
    station = plane({**LOW, "BATT_FS_LOW_ACT": 2.0})
    landing = [
        item(mav.MAV_CMD_DO_LAND_START, anywhere=True),
        waypoint(-500, 0, 40),
        item(mav.MAV_CMD_NAV_LAND),
    ]
    assert upload(station, [waypoint(0, 0), *landing]) == 0
    empty(station, 10.2)
    assert mode_of(station) == PLANE_AUTO
    assert said(station, "Landing sequence start")


# Ground station.


@pytest.mark.parametrize(("action", "mode"), [(0, ROVER_GUIDED), (1, ROVER_RTL), (2, HOLD)])
def test_a_silent_ground_station_does_fs_action_after_both_timeouts(action: int, mode: int) -> None:
    station = rover({"FS_GCS_ENABLE": 1.0, "FS_ACTION": action, "FS_TIMEOUT": 2.0})
    station.heartbeats(True)
    station.run(2.0)
    station.heartbeats(False)
    station.run(6.0)
    assert not said(station, "GCS Failsafe")
    station.run(2.0)
    assert said(station, "GCS Failsafe")
    assert mode_of(station) == mode
    station.heartbeats(True)
    station.run(2.0)
    assert station.texts()[-1] == "GCS Failsafe Cleared"
    assert mode_of(station) == mode, "it stays in it"


def test_a_rover_may_continue_with_its_mission_without_a_ground_station() -> None:
    station = rover({"FS_GCS_ENABLE": 2.0})
    assert upload(station, [waypoint(0, 0), waypoint(300, 0)]) == 0
    station.mode(ROVER_AUTO)
    station.heartbeats(True)
    station.run(2.0)
    station.heartbeats(False)
    station.run(9.0)
    assert said(station, "Failsafe - Continuing Auto Mode")
    assert mode_of(station) == ROVER_AUTO


@pytest.mark.parametrize(
    ("before", "action", "mode"),
    [
        (PLANE_GUIDED, 0, PLANE_GUIDED),
        (PLANE_GUIDED, 1, PLANE_RTL),
        (PLANE_GUIDED, 2, FBWA),
        (LOITER, 0, PLANE_RTL),
    ],
)
def test_a_silent_ground_station_does_fs_long_actn(before: int, action: int, mode: int) -> None:
    station = plane({"FS_GCS_ENABL": 1.0, "FS_LONG_ACTN": action})
    station.mode(before)
    station.heartbeats(True)
    station.run(2.0)
    station.heartbeats(False)
    station.run(7.0)
    assert mode_of(station) == mode
    name = station.vehicle.firmware.mode.spec.name
    assert f"GCS Failsafe On: {name}" in station.texts()
    station.heartbeats(True)
    station.run(1.5)
    assert "GCS Failsafe Off" in station.texts()
    assert mode_of(station) == mode


def test_a_plane_may_mind_the_ground_station_in_auto_only() -> None:
    station = plane({"FS_GCS_ENABL": 3.0, "FS_LONG_ACTN": 1.0})
    station.heartbeats(True)
    station.run(2.0)
    station.heartbeats(False)
    station.run(8.0)
    assert mode_of(station) == PLANE_GUIDED


# Radio.


@pytest.mark.parametrize("vehicle", ["rover", "boat"])
def test_a_lost_radio_does_fs_action_after_fs_timeout(vehicle: str) -> None:
    station = rover({"FS_ACTION": 1.0}, vehicle)
    station.vehicle.parameters.set("SIM_RC_FAIL", 1.0)
    station.run(1.3)
    assert mode_of(station) == ROVER_GUIDED
    station.run(1.0)
    assert mode_of(station) == ROVER_RTL
    assert said(station, "Radio Failsafe")
    station.vehicle.parameters.set("SIM_RC_FAIL", 0.0)
    station.run(0.5)
    assert station.texts()[-1] == "Radio Failsafe Cleared"


def test_a_lost_radio_means_nothing_when_its_failsafe_is_off() -> None:
    for station, name in (
        (rover({"FS_THR_ENABLE": 0.0}), ROVER_GUIDED),
        (plane({"THR_FAILSAFE": 0.0, "FS_SHORT_ACTN": 1.0}), PLANE_GUIDED),
    ):
        station.vehicle.lose_radio(True)
        station.run(9.0)
        assert mode_of(station) == name


def plane_without_radio_for(seconds: float) -> GroundStation:
    station = plane()
    station.mode(FBWA)
    station.vehicle.lose_radio(True)
    station.run(seconds)
    return station


def test_a_plane_circles_for_a_short_loss_and_goes_back_to_its_mode() -> None:
    station = plane_without_radio_for(2.0)
    assert mode_of(station) == CIRCLE
    assert "RC Short Failsafe: switched to CIRCLE" in station.texts()
    station.vehicle.lose_radio(False)
    station.run(0.5)
    assert mode_of(station) == FBWA
    assert station.texts()[-2:] == ["Short Failsafe Cleared", "Flight mode FLY_BY_WIRE_A restored"]


def test_a_plane_returns_from_a_long_loss() -> None:
    station = plane_without_radio_for(8.0)
    assert mode_of(station) == PLANE_RTL
    assert "RC Long Failsafe On: RTL" in station.texts()
    station.vehicle.lose_radio(False)
    station.run(0.5)
    assert station.texts()[-1] == "RC Long Failsafe Cleared"
    assert mode_of(station) == PLANE_RTL


@pytest.mark.parametrize(("action", "mode"), [(0, PLANE_GUIDED), (1, CIRCLE), (2, FBWA), (4, 6)])
def test_in_guided_a_short_loss_does_fs_short_actn(action: int, mode: int) -> None:
    station = plane({"FS_SHORT_ACTN": action})
    station.vehicle.lose_radio(True)
    station.run(2.0)
    assert mode_of(station) == mode


# GPS.


@pytest.mark.parametrize(("action", "mode"), [(0, ROVER_GUIDED), (1, HOLD), (2, ROVER_GUIDED)])
def test_a_rover_without_gps_does_fs_ekf_action(action: int, mode: int) -> None:
    station = rover({"FS_EKF_ACTION": action})
    station.vehicle.lose_gps()
    station.run(20.0)
    assert mode_of(station) == mode
    assert "EKF variance" in station.texts()
    assert ("EKF failsafe" in station.texts()) == (action != 0)
    assert station.last("HEARTBEAT").system_status == CRITICAL


@pytest.mark.night
def test_a_rover_reports_that_it_has_a_position_again() -> None:
    station = rover()
    station.vehicle.lose_gps()
    station.run(20.0)
    station.vehicle.restore_gps()
    station.run(20.0)
    assert "EKF failsafe cleared" in station.texts()
    assert mode_of(station) == HOLD
    assert station.last("HEARTBEAT").system_status == STANDBY


def test_a_plane_without_gps_flies_on() -> None:
    station = plane()
    station.vehicle.lose_gps()
    station.run(20.0)
    assert mode_of(station) == PLANE_GUIDED
    assert -station.position[2] > 30.0


# Fences.


@pytest.mark.parametrize("vehicle", ["rover", "boat"])
@pytest.mark.parametrize(
    ("action", "mode"), [(0, ROVER_GUIDED), (1, ROVER_RTL), (2, HOLD), (3, SMART_RTL)]
)
def test_a_rover_beyond_its_circle_does_fence_action(vehicle: str, action: int, mode: int) -> None:
    station = rover({"FENCE_ENABLE": 1.0, "FENCE_RADIUS": 20.0, "FENCE_ACTION": action}, vehicle)
    station.setpoint(POSITION, (40.0, 0.0, 0.0))
    station.run_until(lambda: said(station, "Circle fence breached"), 40.0)
    station.run(0.5)
    assert mode_of(station) == mode


@pytest.mark.night
def test_a_rover_far_beyond_its_circle_only_stops() -> None:
    station = rover({"FENCE_RADIUS": 20.0, "FENCE_ACTION": 1.0})
    station.setpoint(POSITION, (150.0, 0.0, 0.0))
    station.run_until(lambda: station.position[0] > 125.0, 90.0)
    assert station.command(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == ACCEPTED
    station.run(0.5)
    assert mode_of(station) == HOLD


@pytest.mark.night
def test_a_rover_leaves_its_polygon_and_returns() -> None:
    station = rover({"FENCE_ENABLE": 1.0})
    corners = [(-10, -10), (10, -10), (10, 10), (-10, 10)]
    items = [item(INCLUSION, n, e, params=(4.0,), mission_type=1) for n, e in corners]
    assert upload(station, items, 1) == 0
    station.setpoint(POSITION, (40.0, 0.0, 0.0))
    station.run_until(lambda: said(station, "Polygon fence breached"), 40.0)
    station.run_until(lambda: math.hypot(*station.position[:2]) < WP_RADIUS_M, 40.0)
    assert mode_of(station) == ROVER_RTL


HIGH = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 1.0, "FENCE_ALT_MAX": 70.0}


def climbing(parameters: dict[str, float]) -> GroundStation:
    """A plane that breaks its ceiling of 70 m in GUIDED."""
    station = plane({**HIGH, **parameters})
    station.interval(162, 4.0)
    station.setpoint(POSITION, (0.0, 0.0, -60.0), frame=mav.MAV_FRAME_LOCAL_OFFSET_NED)
    station.run_until(lambda: said(station, "Max Alt fence breached"), 60.0)
    station.run(0.5)
    return station


def test_a_plane_above_its_ceiling_returns_and_its_mode_is_locked_until_it_is_below() -> None:
    station = climbing({"RTL_ALTITUDE": 50.0})
    assert mode_of(station) == PLANE_RTL
    assert station.last("FENCE_STATUS").breach_type == mav.FENCE_BREACH_MAXALT
    assert station.mode(PLANE_GUIDED) == FAILED
    assert "Mode change to GUIDED denied, in fence recovery" in station.texts()
    station.run_until(lambda: said(station, "Fence breach cleared"), 60.0)
    assert station.mode(PLANE_GUIDED) == ACCEPTED


def test_fence_options_unlock_the_mode_and_0_only_says_it() -> None:
    assert climbing({"FENCE_OPTIONS": 0.0}).mode(LOITER) == ACCEPTED
    station = climbing({"FENCE_ACTION": 0.0})
    assert mode_of(station) == PLANE_GUIDED


def test_a_plane_is_not_sent_beyond_its_fence() -> None:
    station = plane({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 2.0, "FENCE_RADIUS": 2000.0})
    reposition = mav.MAV_CMD_DO_REPOSITION
    for north_m, answer in ((3000.0, DENIED), (1000.0, ACCEPTED)):
        x = HOME[0] + round(north_m * METRE)
        assert station.command_int(reposition, 6, -1, 1, x=x, y=HOME[1], z=60.0) == answer


def test_the_floor_counts_once_it_was_above_it() -> None:
    station = plane({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 8.0, "FENCE_ALT_MIN": 30.0})
    station.interval(162, 4.0)
    assert "Min Alt fence enabled (auto enable)" in station.texts()
    assert not said(station, "breached")
    station.setpoint(POSITION, (0.0, 0.0, 40.0), frame=mav.MAV_FRAME_LOCAL_OFFSET_NED)
    station.run_until(lambda: said(station, "Min Alt fence breached"), 60.0)
    station.run(0.5)
    assert mode_of(station) == PLANE_RTL
    assert station.last("FENCE_STATUS").breach_type == mav.FENCE_BREACH_MINALT


def test_the_floor_does_not_count_for_a_landing() -> None:
    station = plane({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 8.0, "FENCE_ALT_MIN": 20.0})
    land = [waypoint(0, 0), waypoint(-500, 0, 40), item(mav.MAV_CMD_NAV_LAND)]
    assert upload(station, land) == 0
    station.mode(PLANE_AUTO)
    station.run_until(lambda: station.position[2] > -1.0, 150.0)
    assert not said(station, "breached")


def test_several_broken_fences_are_said_at_once_and_none_at_all_forbids_arming() -> None:
    station = plane({"FENCE_TYPE": 3.0, "FENCE_ALT_MAX": 20.0, "FENCE_RADIUS": 30.0})
    assert station.command(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == ACCEPTED
    station.run(0.5)
    assert "Max Alt and Circle fences breached" in station.texts()
    nothing = kind("plane", {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0})
    assert nothing.arm() == FAILED
    assert "Arm: Fences enabled, but none selected" in nothing.texts()


# Rally points.


def test_a_rover_returns_to_a_rally_point_that_is_nearer_than_home() -> None:
    station = rover()
    assert upload(station, [item(5100, 30, 10, mission_type=2)], 2) == 0
    station.setpoint(POSITION, (30.0, 0.0, 0.0))
    station.run(20.0)
    station.mode(ROVER_RTL)
    station.run_until(lambda: said(station, "Reached destination"), 60.0)
    assert math.dist(station.position[:2], (30.0, 10.0)) < 1.5


def test_a_plane_prefers_a_rally_point_to_a_nearer_home() -> None:
    station = plane()
    assert upload(station, [item(5100, -1000, 0, 70, mission_type=2)], 2) == 0
    station.mode(PLANE_RTL)
    assert going_north_m(station) == pytest.approx(-1000.0, abs=1.0)
    station.vehicle.parameters.set("RALLY_INCL_HOME", 1.0)
    station.mode(LOITER)
    station.mode(PLANE_RTL)
    assert going_north_m(station) == pytest.approx(0.0, abs=1.0)


# SMART_RTL.


def way(vehicle: str = "rover") -> GroundStation:
    """One that has driven round a corner: 20 m North, then 20 m East."""
    station = rover(vehicle=vehicle)
    for place in ((20.0, 0.0, 0.0), (20.0, 20.0, 0.0)):
        station.setpoint(POSITION, place)
        station.run(15.0)
    assert math.dist(station.position[:2], (20.0, 20.0)) < 3.0
    return station


@pytest.mark.parametrize("vehicle", ["rover", "boat"])
def test_smart_rtl_drives_back_round_the_corner(vehicle: str) -> None:
    station = way(vehicle)
    assert station.mode(SMART_RTL) == ACCEPTED
    least = math.inf
    for _ in range(400):
        station.run(0.2)
        least = min(least, math.dist(station.position[:2], (20.0, 0.0)))
        if said(station, "Reached destination"):
            break
    assert least < 7.0, "straight home it would be 14 m; a boat turns wide"
    assert math.hypot(*station.position[:2]) < 2.5
    assert mode_of(station) == SMART_RTL


def test_smart_rtl_leaves_out_loops() -> None:
    station = way()
    for place in ((0.0, 20.0, 0.0), (0.0, 0.5, 0.0), (-15.0, 0.5, 0.0)):
        station.setpoint(POSITION, place)
        station.run(15.0)
    station.mode(SMART_RTL)
    for _ in range(100):
        station.run(0.2)
        assert station.position[1] < 8.0
    assert math.hypot(*station.position[:2]) < 3.0


def test_smart_rtl_is_rejected_disarmed_and_after_too_long_a_path() -> None:
    station = kind("rover")
    assert station.mode(SMART_RTL) == FAILED
    assert "Flight mode change failed" in station.texts()
    station = rover({"SRTL_POINTS": 5.0})

    def turn() -> None:
        mask = VELOCITY & ~YAW_RATE
        forward = (3.0, 0.0, 0.0)
        station.setpoint(mask, velocity=forward, yaw_rate=0.3, frame=mav.MAV_FRAME_BODY_NED)

    station.stream(30.0, 2.0, turn)
    assert "SmartRTL deactivated: buffer full" in station.texts()
    assert station.mode(SMART_RTL) == FAILED
