"""Goals on simulated rovers and boats."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.profiles import px4
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.requests import (
    LandRequest,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from tests.support.flights.driving import drive_to_end
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


VEHICLES = [
    ("rover", "ardupilot"),
    ("boat", "ardupilot"),
    ("rover", "px4"),
    ("boat", "px4"),
]
# How near a vehicle comes to its target: a boat has no brakes.
ERROR_M = {"rover": 0.5, "boat": 2.0}


@pytest.fixture(params=VEHICLES, ids=" ".join)
def drive(request: pytest.FixtureRequest) -> SimulatedFlight:
    kind, autopilot = request.param
    vehicle = VehicleConfig(vehicle=kind, autopilot=autopilot, ready_after_s=1.0)
    return SimulatedFlight(simulated=vehicle).ready()


def _off(drive: SimulatedFlight, x: float, y: float) -> float:
    (east, north, _), _ = drive.truth()
    return math.hypot(east - x, north - y)


# Ahead, behind, and beside within the circle of the tightest turn.
@pytest.mark.parametrize("target", [(20.0, 5.0), (-4.0, -10.0), (2.2, 0.4)])
def test_a_goal_is_driven_to_without_circles_and_the_vehicle_stands_there(
    drive: SimulatedFlight, target: tuple[float, float]
) -> None:
    goal_id = drive.send(*target, 0.0)
    turns, _ = drive_to_end(drive, goal_id)
    (end,) = drive.ends(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert turns < 1.4
    # The reported position is an estimate, which is off by some decimetres.
    assert _off(drive, *target) < ERROR_M[drive.kind] + 0.2
    drive.run_for(5.0)
    assert _off(drive, *target) < ERROR_M[drive.kind] + 0.5
    assert drive.truth()[1] < 0.3


def test_the_speed_of_a_goal_is_kept(drive: SimulatedFlight) -> None:
    goal_id = drive.send(30.0, 0.0, 0.0, 1.5)
    speeds = []
    while not drive.ends(goal_id):
        drive.run_for(0.1)
        speeds.append(drive.truth()[1])
    assert drive.ends(goal_id)[0].code.value == "SUCCESS"
    speeds.sort()
    # A boat slides while it turns, and that counts over ground.
    assert speeds[int(0.99 * len(speeds))] <= 1.5 * (1.15 if drive.kind == "boat" else 1.05)
    assert speeds[len(speeds) // 2] > 1.0


def test_a_target_in_the_air_is_rejected(drive: SimulatedFlight) -> None:
    rejection = drive.check(drive.request(10.0, 5.0, 8.0))
    assert rejection is not None
    assert rejection.code.value == "UNSUPPORTED_VEHICLE"
    assert "cannot climb" in rejection.message


@pytest.mark.parametrize("request_", [TakeoffRequest(3.0), LandRequest()])
def test_what_flies_is_rejected(
    drive: SimulatedFlight, request_: TakeoffRequest | LandRequest
) -> None:
    rejection = drive.check(request_)
    assert rejection is not None
    assert rejection.code.value == "UNSUPPORTED_VEHICLE"


@pytest.mark.night
def test_a_route_is_driven_without_a_stop(drive: SimulatedFlight) -> None:
    places = [(20.0, 0.0), (20.0, 20.0), (0.0, 20.0)]
    waypoints = tuple(WaypointRequest((*p, 0.0), acceptance_radius_m=3.0) for p in places)
    goal_id = drive.start(WaypointsRequest(waypoints))
    slowest = math.inf
    while drive.truth()[1] < 1.5:
        drive.run_for(0.1)
    while (route := drive.feedback(goal_id)[-1].route) is not None and route.current < 2:
        drive.run_for(0.1)
        slowest = min(slowest, drive.truth()[1])
    assert slowest > 0.5
    end = drive.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert end.waypoints_reached == 3


def test_a_cancel_stops_it(drive: SimulatedFlight) -> None:
    goal_id = drive.send(60.0, 0.0, 0.0)
    drive.run_until(lambda: drive.truth()[1] > 1.5)
    drive.bridge.goals.cancel(goal_id, drive.now)
    end = drive.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message
    assert drive.truth()[1] < 0.3
    drive.run_for(5.0)
    assert drive.truth()[1] < 0.3


@pytest.mark.night
def test_a_pause_stands_and_a_resume_continues(drive: SimulatedFlight) -> None:
    goal_id = drive.send(40.0, 0.0, 0.0)
    drive.run_until(lambda: drive.truth()[1] > 1.5)
    drive.bridge.services.pause(drive.now)
    drive.run_for(8.0)
    assert drive.truth()[1] < 0.3
    drive.bridge.services.resume(drive.now)
    assert drive.run_to_end(goal_id).code.value == "SUCCESS"


def test_it_returns_to_where_it_started_or_says_that_it_does_not(drive: SimulatedFlight) -> None:
    assert drive.run_to_end(drive.send(20.0, 0.0, 0.0)).code.value == "SUCCESS"
    end = drive.run_to_end(drive.start(ReturnRequest()), 120.0)
    # PX4 has no law for boats: with a rover's it circles about the launch point.
    expected = "TIMEOUT" if drive.vehicle.profile is px4.BOAT else "SUCCESS"
    assert end.code.value == expected, end.message
    assert _off(drive, 0.0, 0.0) < 3.0 + ERROR_M[drive.kind]


def test_nothing_moves_a_rover_that_is_armed_later(drive: SimulatedFlight) -> None:
    goal_id = drive.send(20.0, 0.0, 0.0)
    drive.run_until(lambda: drive.truth()[1] > 1.0)
    drive.bridge.goals.cancel(goal_id, drive.now)
    drive.run_to_end(goal_id)
    assert drive.serve(Service.DISARM).success
    place = drive.truth()[0]
    assert drive.serve(Service.ARM).success
    drive.run_for(5.0)
    # A boat drifts on.
    assert math.dist(drive.truth()[0][:2], place[:2]) < (0.4 if drive.kind == "boat" else 0.2)


def test_a_dead_bridge_leaves_it_standing(drive: SimulatedFlight) -> None:
    drive.send(80.0, 0.0, 0.0)
    drive.run_until(lambda: drive.truth()[1] > 2.0)
    drive.link_up = False
    # ArduRover stops after three seconds; PX4 turns back after one, and stops at home.
    drive.run_for(5.0)
    if drive.vehicle.profile is px4.BOAT:
        # PX4 has no law for boats: with a rover's it may circle about the launch point.
        drive.run_until(lambda: _off(drive, 0.0, 0.0) < 8.0)
        drive.run_for(20.0)
        assert _off(drive, 0.0, 0.0) < 8.0
        return
    drive.run_until(lambda: drive.truth()[1] < 0.2)
    place = drive.truth()[0]
    drive.run_for(5.0)
    assert math.dist(drive.truth()[0][:2], place[:2]) < 1.0


@pytest.mark.night
def test_a_goal_is_replaced_without_a_stop(drive: SimulatedFlight) -> None:
    old = drive.send(40.0, 0.0, 0.0)
    drive.run_until(lambda: drive.truth()[1] > 1.5)
    new = drive.send(50.0, 20.0, 0.0)
    assert drive.slowest_m_s(5.0) > 0.8
    assert drive.ends(old)[0].code.value == "PREEMPTED"
    assert drive.run_to_end(new).code.value == "SUCCESS"


def test_no_setpoint_is_sent_before_it_is_armed(drive: SimulatedFlight) -> None:
    drive.send(10.0, 0.0, 0.0)
    drive.run_until(lambda: bool(drive.setpoint_times(0.0)), 20.0)
    assert drive.vehicle.state.armed
