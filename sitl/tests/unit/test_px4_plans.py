"""PX4 with fences, safe points and missions that cannot be flown.

Uploads and feasible missions as seen of the real one; the rest is read in the firmware (navigator,
commander's failsafes).
"""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from sitl_support.ground_station import ACCEPTED, DENIED, TEMPORARILY_REJECTED
from sitl_support.missions import (
    Message,
    download,
    item,
    take_off,
    upload,
    waypoint,
)
from sitl_support.px4_station import HOME, Px4Station, near_home, ready_px4

pytestmark = pytest.mark.wide

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
    vehicle = station.vehicle.firmware
    assert isinstance(vehicle, Px4Vehicle)
    return vehicle


def flying_px4(parameters: dict[str, float] | None = None) -> Px4Station:
    return ready_px4(parameters=parameters).quiet().take_off()


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
    assert air.vehicle.firmware.system_status == 5
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
    assert "Failsafe activated: entering Hold for 5 seconds\t" in air.texts()[-1] + "\t"
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
    air.run_until(lambda: air.vehicle.firmware.system_status == 5)
    assert air.custom_mode == px4.LOITER
    took_s = air.run_until(lambda: air.custom_mode == px4.RTL)
    assert took_s == pytest.approx(5.0, abs=0.2)
    air.gcs_heartbeat()
    air.run(1.0)
    assert air.custom_mode == px4.RTL, "until somebody chooses"
    assert air.mode(px4.LOITER) == ACCEPTED
    air.run(1.0)
    assert air.vehicle.firmware.system_status == 4


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


REFUSED = [
    ([take_off(0.0), waypoint(10, 0)], {}),
    ([waypoint(10, 0), take_off(10.0)], {}),
    ([take_off(10.0), take_off(10.0)], {}),
    ([item(LAND, 10.0)], {}),
    ([take_off(10.0), waypoint(90, 0)], {"GF_MAX_HOR_DIST": 50.0}),
    ([waypoint(10, 0)], {"MIS_TKO_LAND_REQ": 1}),
    ([take_off(10.0)], {"MIS_TKO_LAND_REQ": 2}),
    ([take_off(10.0)], {"MIS_TKO_LAND_REQ": 3}),
    ([take_off(10.0)], {"MIS_TKO_LAND_REQ": 4}),
]


@pytest.mark.parametrize(("mission", "parameters"), REFUSED)
def test_an_infeasible_mission_is_no_mission_and_only_a_violated_fence_is_said(
    mission: list[Message], parameters: dict[str, float]
) -> None:
    # The take-off has a place here: zeros are read as a place by the fence.
    here = [item(m.command, up_m=m.z) if m.command == 22 else m for m in mission]
    ground = judged(here, parameters)
    said = ["Geofence violation for waypoint 2\t"] if "GF_MAX_HOR_DIST" in parameters else []
    assert ground.texts() == said
    ground.run(1.0)
    assert ground.last("MISSION_CURRENT").mission_state == 1
    assert ground.mode(px4.MISSION) == ACCEPTED
    assert ground.arm() == TEMPORARILY_REJECTED


@pytest.mark.parametrize(
    "mission",
    [
        [waypoint(40_000.0, 0.0)],
        [waypoint(10.0, 0.0, -5.0)],
        [take_off(10.0), item(LAND, 10.0), waypoint(20.0, 0.0)],
        [item(RTL, frame=2, anywhere=True)],
        [item(178, frame=2, params=(1.0, 3.0, -1.0), anywhere=True)],
        [item(up_m=math.nan)],
    ],
    ids=["far", "below home", "landing in the middle", "only RTL", "only a deed", "no height"],
)
def test_what_is_only_strange_is_feasible_and_nothing_is_said(mission: list[Message]) -> None:
    ground = judged(mission)
    assert ground.texts() == []
    assert ground.mode(px4.MISSION) == ACCEPTED
    assert ground.arm() == ACCEPTED


# Uploads.

CAMERAS = (200, 206, 214, 260, 530, 531, 532, 2000, 2001, 2003, 2500, 2501)
DEVICES = (*CAMERAS, 187, 196, 205, 211, 1000, 1001, 42600)
DEEDS = (20, 93, 112, 114, 178, 179, 189, 197, 201, *DEVICES, 3000)
PLACES = (16, 17, 19, 21, 22, 31, 84, 85)
UNSUPPORTED_ITEM, UNSUPPORTED_FRAME = 3, 2


@pytest.mark.parametrize(("commands", "frame"), [(DEEDS, 2), (PLACES, 6), (PLACES, 0)])
def test_items_without_a_place_come_in_the_frame_mission_and_others_in_a_global_one(
    commands: tuple[int, ...], frame: int
) -> None:
    ground = ready_px4()
    for command in commands:
        assert upload(ground, [item(command, 10.0, up_m=10.0, frame=frame)]) == 0, command
        other = 6 if frame == 2 else 2
        if command != 201:
            wrong = upload(ground, [item(command, 10.0, up_m=10.0, frame=other)])
            assert wrong == UNSUPPORTED_ITEM, command
    assert "IGN MISSION_ITEM: Invalid item\t" not in ground.texts(), "no ground station is heard"


def test_items_for_cameras_and_gimbals_are_passed_in_flight() -> None:
    """As MAVSDK sends them, before the take-off too: with NaN where nothing is meant."""
    ground = ready_px4()
    nothing = (math.nan,) * 4
    devices = [item(c, frame=2, params=nothing, up_m=math.nan, anywhere=True) for c in DEVICES]
    mission = [devices[0], item(22, up_m=10.0), *devices, waypoint(15.0, 0.0), *devices]
    assert upload(ground, near_home(mission)) == 0
    back = download(ground)
    assert [m.command for m in back[2:-20]] == list(DEVICES)
    ground.run(0.2)
    assert ground.command(300, 0, 0) == ACCEPTED
    ground.run(30.0)
    assert ground.last("MISSION_ITEM_REACHED").seq == len(mission) - 1
    assert math.dist(ground.position[:2], (15.0, 0.0)) < 2.0
    assert ground.custom_mode == px4.LOITER


def test_what_px4_does_not_fly_is_rejected_and_so_are_other_frames() -> None:
    ground = ready_px4()
    for command in (18, 34, 82, 94):
        assert upload(ground, [item(command, 10.0, up_m=10.0, frame=6)]) == UNSUPPORTED_ITEM
    for command in (92, 113, 115, 183, 192, 194, 195, 420, 600):
        assert upload(ground, [item(command, frame=2)]) == UNSUPPORTED_ITEM
    for frame in (1, 7, 10, 11):
        assert upload(ground, [item(frame=frame)]) == UNSUPPORTED_FRAME


def test_numbers_in_an_upload_are_not_looked_at() -> None:
    ground = ready_px4()
    strange = item(up_m=math.nan)
    strange.x = 2_000_000_000
    assert upload(ground, [strange]) == 0
    two, other = square(5001, 0.0, 30.0)[:2], circle(5003, 0.0, -5.0)
    point = [item(16, mission_type=1)]
    for fence in (two, other, point):
        assert upload(ground, fence, mission_type=1) == 0
    assert upload(ground, [item(16, mission_type=2)], mission_type=2) == 0
    ground.run(1.0)


def test_mission_start_arms_but_not_right_after_the_upload() -> None:
    ground = ready_px4()
    ground.gcs_heartbeat()
    assert upload(ground, near_home([item(22, up_m=10.0), waypoint(10.0, 0.0)])) == 0
    assert ground.command(300, 0, 0) == DENIED
    assert ground.texts()[-1] == "Mission start denied! No valid mission\t"
    ground.run(0.2)
    assert ground.command(300, 9, 0) == DENIED, "there is no such item"
    assert ground.command(300, 0, 0) == ACCEPTED
    assert ground.armed
    assert ground.custom_mode == px4.MISSION


def test_whoever_arms_after_the_upload_may_start_the_mission_at_once() -> None:
    """The commander looks at the mission whenever it is to arm, not only ten times a second."""
    ground = ready_px4()
    assert upload(ground, near_home([item(22, up_m=10.0), waypoint(10.0, 0.0)])) == 0
    assert ground.arm() == ACCEPTED
    ground.run(0.03, step_s=0.01)
    assert ground.command_results(mav.MAV_CMD_DO_SET_MODE, 1, 4, 4) == [ACCEPTED, ACCEPTED]
    assert ground.custom_mode == px4.MISSION


def test_a_mission_uploaded_in_flight_is_entered_at_the_old_number_and_rtl_changes_the_mode() -> (
    None
):
    air = flying_px4()
    places = [waypoint(4.0 * n, 0.0) for n in range(6)]
    assert upload(air, near_home(places)) == 0
    air.run(0.2)
    assert air.mode(px4.MISSION) == ACCEPTED
    air.send(mav.MAVLink_mission_set_current_message(1, 1, 5))
    home = item(RTL, frame=2, anywhere=True)
    assert upload(air, [*near_home([waypoint(30.0, 0.0), waypoint(30.0, 30.0)]), home]) == 0
    air.run(1.1)
    assert air.custom_mode == px4.RTL
    assert air.changes("MISSION_ITEM_REACHED", "seq") == [2]
    assert air.last("MISSION_CURRENT").seq == 2


def test_an_item_marked_as_current_is_where_a_new_mission_begins() -> None:
    air = flying_px4()
    assert upload(air, near_home([waypoint(4.0 * n, 0.0) for n in range(6)])) == 0
    air.run(0.2)
    assert air.mode(px4.MISSION) == ACCEPTED
    air.send(mav.MAVLink_mission_set_current_message(1, 1, 5))
    first, second = near_home([waypoint(30.0, 0.0), waypoint(30.0, 30.0)])
    first.current = 1
    assert upload(air, [first, second]) == 0
    air.run(1.1)
    assert air.last("MISSION_CURRENT").seq == 0


def test_of_a_waypoint_and_a_deed_after_it_only_the_deed_is_reported_as_reached() -> None:
    air = flying_px4()
    slower = item(178, frame=2, params=(1.0, 2.0, -1.0), anywhere=True)
    mission = [*near_home([waypoint(3.0, 0.0)]), slower, *near_home([waypoint(60.0, 0.0)])]
    assert upload(air, mission) == 0
    air.run(0.2)
    assert air.mode(px4.MISSION) == ACCEPTED
    air.run(8.0)
    assert air.changes("MISSION_ITEM_REACHED", "seq") == [1]


def test_an_infeasible_mission_is_rejected_in_the_air() -> None:
    air = flying_px4()
    mission = [waypoint(10.0, 0.0), take_off(10.0)]
    assert upload(air, near_home(mission)) == 0
    assert air.mode(px4.MISSION) == TEMPORARILY_REJECTED
    assert air.custom_mode == px4.OFFBOARD


def test_an_infeasible_mission_uploaded_over_the_one_that_flies_ends_in_a_hold() -> None:
    air = flying_px4()
    assert upload(air, near_home([waypoint(30.0, 0.0), waypoint(30.0, 30.0)])) == 0
    air.run(0.2)
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
