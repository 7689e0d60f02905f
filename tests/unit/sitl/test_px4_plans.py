"""What PX4 does with fences, safe points and missions that cannot be flown.

Not observed on the wire but read in the firmware (navigator, commander's failsafes).
"""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from tests.support.ground_station import ACCEPTED, TEMPORARILY_REJECTED
from tests.support.missions import Message, item, take_off, upload, waypoint
from tests.support.px4_station import HOME, Px4Station, near_home, ready_px4

READY = 0x10000000
RALLY, LAND, RTL = 5100, mav.MAV_CMD_NAV_LAND, mav.MAV_CMD_NAV_RETURN_TO_LAUNCH
NEAR = {"GF_MAX_HOR_DIST": 15.0}
AT_ONCE = {"COM_FAIL_ACT_T": 0.0}


def square(command: int, north_m: float, half_m: float) -> list[Message]:
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return [
        item(command, north_m + n * half_m, e * half_m, params=(4.0,), mission_type=1)
        for n, e in corners
    ]


def circle(command: int, north_m: float, radius_m: float) -> list[Message]:
    return [item(command, north_m, params=(radius_m,), mission_type=1)]


def rally(north_m: float, east_m: float) -> Message:
    return item(RALLY, north_m, east_m, mission_type=2)


def commander(station: Px4Station) -> Px4Vehicle:
    vehicle = station.vehicle.copter
    assert isinstance(vehicle, Px4Vehicle)
    return vehicle


def flying_px4(parameters: dict[str, float] | None = None) -> Px4Station:
    return ready_px4(parameters=parameters).without_streams().take_off()


def leave(station: Px4Station, seconds: float = 12.0, north_m: float = 40.0) -> Px4Station:
    """Fly North, until something happens."""
    station.gcs_heartbeat()
    station.stream_to(2.0, 0.0, 0.0, -10.0)
    for _ in range(round(seconds / 0.5)):
        if station.custom_mode != px4.OFFBOARD or not station.armed:
            return station
        station.gcs_heartbeat()
        station.stream_to(0.5, north_m, 0.0, -10.0)
    return station


# The geofence.


def test_too_far_from_home_holds_by_default_and_says_so() -> None:
    air = leave(flying_px4(parameters=NEAR))
    assert air.custom_mode == px4.LOITER
    assert air.vehicle.copter.system_status == 5
    said = air.texts()
    assert "Geofence: exceeding maximum distance to Home\t" in said
    assert said[-1] == "Failsafe activated\t"
    air.stream_to(8.0, 0.0, 0.0, -10.0)
    assert air.custom_mode == px4.LOITER, "it stays, whatever is streamed"
    assert commander(air).intention == px4.OFFBOARD


def test_too_high_above_home_is_a_breach_too() -> None:
    air = flying_px4(parameters={"GF_MAX_VER_DIST": 20.0})
    air.heartbeats(True)
    air.gcs_heartbeat()
    air.stream_to(3.0, 0.0, 0.0, -30.0)
    air.gcs_heartbeat()
    air.stream_to(2.5, 0.0, 0.0, -30.0)
    assert air.custom_mode == px4.LOITER
    assert "Geofence: exceeding maximum altitude above Home\t" in air.texts()


@pytest.mark.parametrize(("action", "mode"), [(0, px4.OFFBOARD), (1, px4.OFFBOARD), (3, px4.RTL),
                                              (5, px4.LAND)])  # fmt: skip
def test_gf_action_is_what_is_done(action: int, mode: int) -> None:
    air = leave(flying_px4(parameters={**NEAR, **AT_ONCE, "GF_ACTION": action}), 7.0)
    assert air.custom_mode == mode
    warned = [text for text in air.texts() if text == "Failsafe activated\t"]
    assert len(warned) == int(action > 0)


def test_gf_action_4_stops_the_motors() -> None:
    air = leave(flying_px4(parameters={**NEAR, "GF_ACTION": 4}))
    assert not air.armed
    assert air.position[2] < -5.0


def test_a_return_is_preceded_by_a_hold_of_com_fail_act_t() -> None:
    air = leave(flying_px4(parameters={**NEAR, "GF_ACTION": 3}))
    assert air.custom_mode == px4.LOITER
    assert "Failsafe activated, entering Hold for 5 seconds\t" in air.texts()[-1] + "\t"
    took_s = air.run_until(lambda: air.custom_mode == px4.RTL)
    assert took_s == pytest.approx(5.0, abs=0.7)


def test_who_chooses_a_mode_may_fly_on_outside() -> None:
    air = leave(flying_px4(parameters=NEAR))
    assert air.mode(px4.OFFBOARD) == ACCEPTED
    air.stream_to(3.0, 25.0, 0.0, -10.0)
    assert air.custom_mode == px4.OFFBOARD
    air.stream_to(7.0, 0.0, 0.0, -10.0)
    assert leave(air).custom_mode == px4.LOITER, "the next breach counts again"


@pytest.mark.parametrize(
    "fence",
    [
        square(mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, 0.0, 15.0),
        square(mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION, 25.0, 10.0),
        circle(mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 0.0, 15.0),
        circle(mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, 25.0, 10.0),
    ],
)
def test_every_kind_of_uploaded_area_is_kept(fence: list[Message]) -> None:
    air = flying_px4()
    assert upload(air, near_home(fence), mission_type=1) == 0
    leave(air)
    assert air.custom_mode == px4.LOITER
    assert air.position[0] < 30.0
    assert "Geofence: approaching or outside geofence\t" in air.texts()


def test_an_area_without_home_or_without_the_flying_vehicle_is_left_out() -> None:
    air = flying_px4()
    air.gcs_heartbeat()
    far = circle(mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 100.0, 20.0)
    assert upload(air, near_home(far), mission_type=1) == 0
    air.stream_to(0.5, 0.0, 0.0, -10.0)
    said = "".join(air.texts())
    assert "Geofence invalid, doesn't contain Home position\t" in said
    air.stream_to(6.0, 12.0, 0.0, -10.0)
    here = circle(mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 0.0, 5.0)
    assert upload(air, near_home(here), mission_type=1) == 0
    air.gcs_heartbeat()
    air.stream_to(1.0, 12.0, 0.0, -10.0)
    assert "doesn't contain current vehicle position\t" in "".join(air.texts())
    assert air.custom_mode == px4.OFFBOARD


def test_outside_a_fence_it_cannot_be_armed() -> None:
    ground = ready_px4(parameters={"GF_MAX_VER_DIST": 3.0})
    assert ground.last("SYS_STATUS").onboard_control_sensors_health & READY
    below = HOME.altitude_amsl_m - 5.0
    assert ground.command_int(
        179, 0, 0, x=round(HOME.latitude_deg * 1e7), y=round(HOME.longitude_deg * 1e7), z=below
    ) == ACCEPTED  # fmt: skip
    ground.run(1.0)
    assert not ground.last("SYS_STATUS").onboard_control_sensors_health & READY
    assert ground.arm() == TEMPORARILY_REJECTED


# Failsafes that let somebody take over.


def test_a_lost_ground_station_holds_first_and_then_returns() -> None:
    air = flying_px4(parameters={"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 5})
    air.gcs_heartbeat()
    assert air.mode(px4.LOITER) == ACCEPTED
    air.run_until(lambda: air.vehicle.copter.system_status == 5)
    assert air.custom_mode == px4.LOITER
    took_s = air.run_until(lambda: air.custom_mode == px4.RTL)
    assert took_s == pytest.approx(5.0, abs=0.2)
    air.gcs_heartbeat()
    air.run(1.0)
    assert air.custom_mode == px4.RTL, "until somebody chooses"
    assert air.mode(px4.LOITER) == ACCEPTED
    air.run(1.0)
    assert air.vehicle.copter.system_status == 4


# Safe points.


@pytest.mark.parametrize(
    ("kind", "points", "north_m"),
    [
        (0, [(30.0, 0.0)], 30.0),
        (0, [(-40.0, 0.0)], 0.0),
        (1, [(-40.0, 0.0)], -40.0),
        (1, [], 0.0),
        (3, [(30.0, 0.0), (20.0, 0.0)], 20.0),
        (5, [(-40.0, 0.0)], -40.0),
        (5, [], 22.0),
    ],
)
def test_rtl_type_chooses_where_to(
    kind: int, points: list[tuple[float, float]], north_m: float
) -> None:
    air = flying_px4(parameters={"RTL_TYPE": kind, "RTL_RETURN_ALT": 12.0})
    assert upload(air, near_home([rally(n, e) for n, e in points]), mission_type=2) == 0
    air.stream_to(6.0, 22.0, 0.0, -10.0)
    assert air.mode(px4.RTL) == ACCEPTED
    air.run_until(lambda: not air.armed, 90.0)
    assert math.dist(air.position[:2], (north_m, 0.0)) < 1.5


def test_rtl_type_1_takes_the_landing_of_the_mission() -> None:
    air = flying_px4(parameters={"RTL_TYPE": 1, "RTL_RETURN_ALT": 12.0})
    mission = [take_off(10.0), waypoint(10.0, 0.0), item(LAND, 30.0, 0.0)]
    assert upload(air, near_home(mission)) == 0
    assert air.mode(px4.RTL) == ACCEPTED
    air.run_until(lambda: not air.armed, 90.0)
    assert math.dist(air.position[:2], (30.0, 0.0)) < 1.5


def test_rtl_waits_rtl_land_delay_at_rtl_descend_alt() -> None:
    air = flying_px4(parameters={"RTL_LAND_DELAY": 4.0, "RTL_DESCEND_ALT": 6.0})
    air.gcs_heartbeat()
    assert air.mode(px4.RTL) == ACCEPTED
    air.heartbeats(True)
    air.run_until(lambda: "RTL: loiter 4.0s\t" in air.texts(), 60.0)
    assert -air.position[2] == pytest.approx(6.0, abs=0.9)
    took_s = air.run_until(lambda: "RTL: land at destination\t" in air.texts())
    assert took_s == pytest.approx(4.0, abs=0.3)


def test_a_negative_rtl_land_delay_never_lands() -> None:
    air = flying_px4(parameters={"RTL_LAND_DELAY": -1.0})
    assert air.mode(px4.RTL) == ACCEPTED
    air.run(40.0)
    assert -air.position[2] == pytest.approx(10.0, abs=0.9)


# Missions that cannot be flown.


def judged(mission: list[Message], parameters: dict[str, float] | None = None) -> Px4Station:
    ground = ready_px4(parameters=parameters)
    ground.gcs_heartbeat()
    assert upload(ground, near_home(mission)) == 0, "the upload is accepted in any case"
    ground.run(0.2)
    return ground


AWAY = waypoint(40_000.0, 0.0)
REFUSED = [
    ([take_off(2.0), waypoint(10, 0)], {}, "Mission rejected: Takeoff altitude too low!"),
    ([waypoint(10, 0), take_off(10.0)], {}, "Mission rejected: takeoff not first waypoint item"),
    ([item(LAND, 10.0)], {}, "Mission rejected: starts with landing"),
    ([take_off(10.0), waypoint(90, 0)], {"GF_MAX_HOR_DIST": 50.0},
     "Geofence violation for waypoint 2"),
    ([waypoint(10, 0)], {"MIS_TKO_LAND_REQ": 1}, "Mission rejected: Takeoff waypoint required."),
    ([take_off(10.0)], {"MIS_TKO_LAND_REQ": 2},
     "Mission rejected: Landing waypoint/pattern required."),
    ([take_off(10.0)], {"MIS_TKO_LAND_REQ": 3},
     "Mission rejected: Takeoff or Landing item missing."),
    ([take_off(10.0)], {"MIS_TKO_LAND_REQ": 4},
     "Mission rejected: Add Landing item or remove Takeoff."),
]  # fmt: skip


@pytest.mark.parametrize(("mission", "parameters", "text"), REFUSED)
def test_what_is_wrong_with_a_mission_is_said_and_it_cannot_be_armed_in(
    mission: list[Message], parameters: dict[str, float], text: str
) -> None:
    # The take-off has a place here: zeros are read as a place by the fence.
    here = [item(m.command, up_m=m.z) if m.command == 22 else m for m in mission]
    ground = judged(here, parameters)
    assert text in "".join(ground.texts()).replace("\t", "")
    assert ground.mode(px4.MISSION) == ACCEPTED
    assert ground.arm() == TEMPORARILY_REJECTED


@pytest.mark.parametrize(
    ("mission", "text"),
    [
        ([AWAY], "First waypoint far away from home: 40"),
        ([waypoint(10.0, 0.0, -5.0)], "Warning: Waypoint 1 below home"),
    ],
)
def test_what_is_only_strange_is_said_and_flown(mission: list[Message], text: str) -> None:
    ground = judged(mission)
    assert text in "".join(ground.texts())
    assert ground.mode(px4.MISSION) == ACCEPTED
    assert ground.arm() == ACCEPTED


def test_an_infeasible_mission_is_refused_in_the_air() -> None:
    air = flying_px4()
    mission = [waypoint(10.0, 0.0), take_off(10.0)]
    assert upload(air, near_home(mission)) == 0
    assert air.mode(px4.MISSION) == TEMPORARILY_REJECTED
    assert air.custom_mode == px4.OFFBOARD


def test_an_infeasible_mission_uploaded_over_the_one_that_flies_ends_in_a_hold() -> None:
    air = flying_px4()
    assert upload(air, near_home([waypoint(30.0, 0.0), waypoint(30.0, 30.0)])) == 0
    assert air.mode(px4.MISSION) == ACCEPTED
    air.run(3.0)
    air.gcs_heartbeat()
    assert upload(air, near_home([waypoint(10.0, 0.0), take_off(10.0)])) == 0
    air.run(0.2)
    assert air.custom_mode == px4.LOITER
    assert "No valid mission available, loitering\t" in air.texts()


def test_a_fence_uploaded_later_makes_a_mission_infeasible() -> None:
    ground = judged([item(22, up_m=10.0), waypoint(60.0, 0.0)])
    assert ground.mode(px4.MISSION) == ACCEPTED
    assert commander(ground).can_arm()
    near = circle(mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, 0.0, 30.0)
    assert upload(ground, near_home(near), mission_type=1) == 0
    ground.run(0.2)
    assert "Geofence violation for waypoint 2\t" in ground.texts()
    assert not commander(ground).can_arm()
