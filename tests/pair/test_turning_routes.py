"""Routes on which a copter turns on and on, with the rate that is asked for."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.requests import WaypointRequest, WaypointsRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

PLACES = ((0.0, 0.0, 6.0), (30.0, 0.0, 6.0), (30.0, 20.0, 6.0))
ROUTE = WaypointsRequest(tuple(WaypointRequest(place, acceptance_radius_m=1.0) for place in PLACES))
RATE_RAD_S = -0.6


def flown(autopilot: str = "ardupilot", vehicle: str = "copter") -> SimulatedFlight:
    simulated = VehicleConfig(autopilot=autopilot, vehicle=vehicle, ready_after_s=1.0)
    return SimulatedFlight(simulated=simulated).ready()


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_copter_turns_while_it_moves_and_keeps_its_yaw_at_the_end(autopilot: str) -> None:
    flight = flown(autopilot)
    goal_id = flight.start(replace(ROUTE, yaw_rate_rad_s=RATE_RAD_S))
    turned_rad, moved_s, before_rad = 0.0, 0.0, None
    while not flight.ends(goal_id):
        assert flight.now < 200.0
        flight.run_for(0.1)
        pose, (_, speed_m_s) = flight.bridge.pose, flight.truth()
        moves = pose is not None and pose.position_enu_m[0] > 1.0 and speed_m_s > 0.3
        if pose is not None and before_rad is not None and moves:
            turned_rad += math.remainder(pose.yaw_enu_rad - before_rad, math.tau)
            moved_s += 0.1
        before_rad = None if pose is None else pose.yaw_enu_rad
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert end.waypoints_reached == 3
    assert moved_s > 12.0
    assert turned_rad / moved_s == pytest.approx(RATE_RAD_S, rel=0.1)
    at_end = flight.bridge.pose
    flight.run_for(5.0)
    later = flight.bridge.pose
    assert at_end is not None
    assert later is not None
    assert abs(math.remainder(later.yaw_enu_rad - at_end.yaw_enu_rad, math.tau)) < 0.3


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        ({"yaw_rate_rad_s": math.nan}, OutcomeCode.INVALID_WAYPOINTS, "yaw_rate is nan; give"),
        ({"yaw_rate_rad_s": 3.0}, OutcomeCode.INVALID_NUMBER, "turns with at most"),
        (
            {"yaw_rate_rad_s": 0.5, "by_mission": True},
            OutcomeCode.INVALID_WAYPOINTS,
            "only a route by setpoints",
        ),
        (
            {"yaw_rate_rad_s": 0.5, "waypoints": (replace(ROUTE.waypoints[0], yaw_enu_rad=1.0),)},
            OutcomeCode.INVALID_WAYPOINTS,
            "Waypoint 1 has a yaw, and the route a yaw_rate",
        ),
    ],
)
def test_a_rate_that_cannot_be_kept_is_rejected(
    change: dict[str, object], code: OutcomeCode, words: str
) -> None:
    rejection = flown().check(replace(ROUTE, **change))  # type: ignore[arg-type]
    assert rejection is not None
    assert rejection.code is code
    assert words in rejection.message


@pytest.mark.parametrize("vehicle", ["rover", "plane"])
def test_only_copters_turn_on_and_on(vehicle: str) -> None:
    height_m = 0.0 if vehicle == "rover" else 60.0
    route = WaypointsRequest((WaypointRequest((30.0, 0.0, height_m)),), yaw_rate_rad_s=0.5)
    rejection = flown(vehicle=vehicle).check(route)
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
    assert f"A {vehicle} has the yaw of its path" in rejection.message
