"""Routes as items, as each firmware and kind of vehicle takes them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.mission_items import (
    AMSL,
    NO_FRAME,
    RELATIVE_ALT,
    TERRAIN_ALT,
)
from mavlink_vehicle.profiles import Profile, ardupilot, px4
from mavlink_vehicle.state.telemetry import Home, MissionProgress, Origin
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.goals.mission_plan import MissionTracker, PlannedItem, plan_items
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.tasks.inputs.waypoint_acts import (
    PointAngle,
    TakePhoto,
    UseGripper,
    WaitHere,
    WaypointAct,
)
from navigation_core.tasks.waypoint import MissionPlan, RouteWaypoint

LATITUDE, LONGITUDE, AMSL_M = 47.3977, 8.5456, 488.0
STATE = VehicleState(
    home=Home(0.0, LATITUDE, LONGITUDE, AMSL_M, None),
    origin=Origin(0.0, LATITUDE, LONGITUDE, AMSL_M),
)
WAYPOINT, SPEED, YAW = 16, 178, 115
TAKEOFF, LOITER_UNLIM, LOITER_TIME = 22, 17, 19
PITCHYAW, DELAY, PHOTO, GRIPPER = 1000, 93, 2000, 211
EAST = RouteWaypoint((30.0, 0.0, 6.0), 1.5, hold_time_s=2.4, yaw_enu_rad=0.0, max_speed_m_s=2.0)
NORTH = RouteWaypoint((0.0, 50.0, 8.0), 2.0)
PLAN = MissionPlan((EAST, NORTH), (1.0, 2.0, 0.0), 2.5, 5.0)


def planned(profile: Profile, plan: MissionPlan = PLAN) -> tuple[PlannedItem, ...]:
    frame = MapFrame()
    frame.update(STATE)
    assert profile.missions is not None
    return plan_items(plan, profile, profile.missions, frame, STATE)


def commands(profile: Profile, plan: MissionPlan = PLAN) -> list[int]:
    return [entry.item.command for entry in planned(profile, plan)]


def test_an_arducopter_takes_off_above_home_and_turns_by_an_item() -> None:
    items = planned(ardupilot.COPTER)
    assert commands(ardupilot.COPTER) == [TAKEOFF, SPEED, YAW, WAYPOINT, SPEED, WAYPOINT]
    assert [entry.waypoint for entry in items] == [0, 0, 0, 0, 1, 1]
    takeoff, slow, turn, east, fast, _ = (entry.item for entry in items)
    assert (takeoff.frame, takeoff.z) == (RELATIVE_ALT, pytest.approx(2.5))
    assert (slow.frame, slow.params) == (NO_FRAME, (1.0, 2.0, -1.0, 0.0))
    assert turn.params[0] == pytest.approx(90.0), "a heading from north, clockwise"
    assert (east.frame, east.z) == (RELATIVE_ALT, pytest.approx(6.0))
    assert east.params[0] == 3.0, "whole seconds, and not fewer"
    assert (east.x, round(east.y * 1e-7, 4)) == (473977000, 8.5460)
    assert fast.params[1] == 5.0


def test_a_px4_counts_from_the_sea_and_has_headings_in_waypoints() -> None:
    takeoff, _, east, _, north = (entry.item for entry in planned(px4.COPTER))
    assert (takeoff.frame, takeoff.z) == (AMSL, pytest.approx(AMSL_M + 3.5)), "3.5 m at least"
    assert (east.frame, east.z) == (AMSL, pytest.approx(AMSL_M + 6.0))
    assert east.params[1:] == (1.5, 0.0, pytest.approx(90.0))
    assert math.isnan(north.params[3]), "the direction of travel"


def test_a_plane_holds_by_circling_and_never_stops() -> None:
    plan = MissionPlan((EAST, NORTH), (0.0, 0.0, 0.0), 30.0, circle_at_end=True)
    items = planned(ardupilot.PLANE, plan)
    assert [entry.item.command for entry in items] == [
        TAKEOFF, SPEED, LOITER_TIME, WAYPOINT, LOITER_UNLIM,
    ]  # fmt: skip
    takeoff, speed, stay, north, _ = (entry.item for entry in items)
    assert takeoff.params[0] > 0.0, "it climbs at an angle"
    assert (takeoff.x, takeoff.y) == (stay.x, stay.y), "towards the first waypoint"
    assert speed.params[0] == 0.0, "an airspeed"
    assert north.params[1] == 2.0
    assert items[-1].waypoint == 2


def test_a_rover_has_neither_take_off_nor_turns() -> None:
    plan = MissionPlan((EAST,), speed_m_s=1.0)
    assert commands(ardupilot.ROVER, plan) == [SPEED, WAYPOINT]


def test_a_height_above_ground_goes_into_the_terrain_frame() -> None:
    above = RouteWaypoint((30.0, 0.0, 6.0), 1.5, height_above_ground_m=6.0)
    item = planned(ardupilot.COPTER, MissionPlan((above,)))[-1].item
    assert (item.frame, item.z) == (TERRAIN_ALT, 6.0)
    rules = [profile.missions for profile in (ardupilot.COPTER, ardupilot.ROVER, px4.COPTER)]
    assert [rule is not None and rule.terrain for rule in rules] == [True, False, False]


def test_an_unchanged_speed_is_sent_once() -> None:
    plan = MissionPlan((NORTH, NORTH, NORTH), speed_m_s=3.0)
    assert commands(px4.COPTER, plan).count(SPEED) == 1
    assert commands(px4.PLANE, MissionPlan((NORTH,))).count(SPEED) == 0


def report(
    current: int, reached: tuple[int, ...] = (), total: int | None = 6, **more: int
) -> MissionProgress:
    return MissionProgress(5.0, current, total, more.get("state", 3), more.get("id", 7), reached)


def state(mission: MissionProgress | None) -> VehicleState:
    return VehicleState(mission=mission)


def test_reports_are_about_waypoints_without_home() -> None:
    rules = ardupilot.COPTER.missions
    assert rules is not None
    tracker = MissionTracker(planned(ardupilot.COPTER), rules)
    assert tracker.report(state(None)) is None
    now = tracker.report(state(report(6, (1, 2, 3, 4))))
    assert now is not None
    assert (now.current, now.reached, now.complete, now.changed) == (1, frozenset({0}), False, "")
    # A PX4 reports what was reached in the mission before for a while longer.
    early = tracker.report(state(report(2, (6,))))
    assert early is not None
    assert early.reached == frozenset()
    done = tracker.report(state(report(6, state=mavlink.MISSION_STATE_COMPLETE)))
    assert done is not None
    assert done.complete


def test_a_changed_mission_is_reported() -> None:
    rules = px4.COPTER.missions
    assert rules is not None
    tracker = MissionTracker(planned(px4.COPTER), rules)
    now = tracker.report(state(report(0, total=4)), "it was replaced")
    assert now is not None
    assert now.changed == "it was replaced"


def test_acts_are_items_behind_their_waypoint() -> None:
    acts = (WaypointAct(PointAngle(-0.8, 0.5)), WaypointAct(WaitHere(2.5)))
    last = replace(NORTH, acts=(WaypointAct(TakePhoto()), WaypointAct(UseGripper(grabs=True))))
    plan = MissionPlan((replace(NORTH, acts=acts), last))
    items = planned(ardupilot.COPTER, plan)
    assert [entry.item.command for entry in items] == [
        WAYPOINT, PITCHYAW, DELAY, WAYPOINT, PHOTO, GRIPPER, WAYPOINT,
    ]  # fmt: skip
    assert [entry.waypoint for entry in items] == [0, 0, 0, 1, 1, 1, 1]
    point = items[1].item
    assert point.params == (-46.0, -29.0, 0.0, 0.0), "whole degrees, clockwise from the nose"
    assert point.x == 12, "the horizon is kept, the yaw turns with the vehicle"
    assert items[2].item.params[0] == 2.5
    assert items[6].item.params[0] == 2.0, "the acts of the last waypoint need a time to be done in"
    precise = planned(px4.COPTER, plan)
    assert commands(px4.COPTER, plan)[-1] == GRIPPER, "nothing has to follow"
    # A PX4 denies an angle to those who have not taken control.
    assert precise[1].item.params[0] == -2.0
    assert precise[2].item.params[0] == pytest.approx(math.degrees(-0.8))
    assert math.isnan(precise[2].item.params[2]), "an angle, and no rate"


def test_a_plane_waits_by_circling() -> None:
    plan = MissionPlan((replace(NORTH, acts=(WaypointAct(WaitHere(20.0)),)),), circle_at_end=True)
    assert commands(ardupilot.PLANE, plan) == [WAYPOINT, LOITER_TIME, LOITER_UNLIM]
