"""Goals on simulated planes: sent from place to place, circling instead of standing."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.requests import (
    AltitudeReference,
    LandRequest,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


# ArduPlane's WP_LOITER_RAD is 60 m, PX4's NAV_LOITER_RAD 80 m; both fly wider than that.
CIRCLE_M = 120.0
Place = tuple[float, float, float]


@pytest.fixture(params=["ardupilot", "px4"])
def plane(request: pytest.FixtureRequest) -> SimulatedFlight:
    vehicle = VehicleConfig(vehicle="plane", autopilot=request.param, ready_after_s=1.0)
    return SimulatedFlight(simulated=vehicle).ready()


@pytest.fixture
def flying(plane: SimulatedFlight) -> SimulatedFlight:
    plane.start(TakeoffRequest(50.0))
    plane.run_until(lambda: plane.truth()[0][2] > 40.0)
    return plane


def _away_m(plane: SimulatedFlight, place: Place) -> float:
    return math.dist(plane.truth()[0][:2], place[:2])


def _circles(plane: SimulatedFlight, place: Place, seconds: float = 40.0) -> bool:
    """Whether it stays about a place, at its height, and does not stop."""
    for _ in range(int(seconds)):
        plane.run_for(1.0)
        (_, _, up_m), speed_m_s = plane.truth()
        if _away_m(plane, place) > CIRCLE_M or abs(up_m - place[2]) > 8.0 or speed_m_s < 8.0:
            return False
    return True


def test_a_goal_takes_off_flies_there_and_circles(plane: SimulatedFlight) -> None:
    place = (300.0, 100.0, 60.0)
    goal_id = plane.send(*place)
    end = plane.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert "circles" in end.message
    assert "orientation was ignored" in end.message
    assert end.final_error_m == pytest.approx(_away_m(plane, place), abs=50.0)
    assert _circles(plane, place)
    seen = [item.status.value for item in plane.feedback(goal_id)]
    order = ["ARMING", "TAKING_OFF", "NAVIGATING", "SETTLING"]
    assert [status for status in dict.fromkeys(seen) if status in order] == order
    assert plane.setpoint_times(0.0) == [], "a plane follows none"


def test_the_time_that_is_left_is_told_about_right(flying: SimulatedFlight) -> None:
    goal_id = flying.send(330.0, 0.0, 60.0)
    flying.run_until(lambda: flying.status(goal_id) == "NAVIGATING")
    flying.run_for(8.0)
    told, at_s = flying.feedback(goal_id)[-1].time_remaining_s, flying.now
    flying.run_until(lambda: bool(flying.ends(goal_id)))
    assert told == pytest.approx(flying.now - at_s, rel=0.5)


@pytest.mark.night
def test_a_route_is_flown_through_and_a_hold_time_is_circled(flying: SimulatedFlight) -> None:
    route = WaypointsRequest(
        (
            WaypointRequest((200.0, -200.0, 60.0)),
            WaypointRequest((-200.0, -200.0, 70.0), hold_time_s=20.0),
            WaypointRequest((-100.0, 200.0, 50.0)),
        )
    )
    goal_id = flying.start(route)
    circled_s, nearest_m = 0.0, math.inf
    while not flying.ends(goal_id):
        flying.run_for(0.5)
        nearest_m = min(nearest_m, _away_m(flying, (200.0, -200.0, 60.0)))
        circled_s += 0.5 * (flying.status(goal_id) == "HOLDING")
    (end,) = flying.ends(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert end.waypoints_reached == 3
    assert nearest_m < CIRCLE_M
    assert circled_s == pytest.approx(20.0, abs=3.0)
    assert _circles(flying, (-100.0, 200.0, 50.0), 20.0)


@pytest.mark.night
def test_a_pause_circles_where_it_is_and_a_resume_continues(flying: SimulatedFlight) -> None:
    goal_id = flying.send(330.0, 0.0, 60.0)
    flying.run_until(lambda: flying.status(goal_id) == "NAVIGATING")
    flying.run_for(5.0)
    place = flying.truth()[0]
    assert flying.bridge.services.pause(flying.now)[0]
    flying.run_for(15.0)
    assert flying.status(goal_id) == "PAUSED"
    assert _circles(flying, place, 20.0)
    flying.bridge.services.resume(flying.now)
    assert flying.run_to_end(goal_id).code.value == "SUCCESS"
    assert _away_m(flying, (330.0, 0.0, 60.0)) < CIRCLE_M


def test_a_cancel_ends_in_a_circle_because_a_plane_cannot_stop(flying: SimulatedFlight) -> None:
    goal_id = flying.send(330.0, 0.0, 60.0)
    flying.run_until(lambda: flying.status(goal_id) == "NAVIGATING")
    flying.run_for(5.0)
    place = flying.truth()[0]
    flying.bridge.goals.cancel(goal_id, flying.now)
    end = flying.run_to_end(goal_id)
    assert end.code.value == "CANCELED"
    assert "cannot stop" in end.message
    flying.run_for(12.0)
    assert _circles(flying, place, 20.0)


def test_the_hold_service_circles_where_it_is(flying: SimulatedFlight) -> None:
    goal_id = flying.send(330.0, 0.0, 60.0)
    flying.run_until(lambda: flying.status(goal_id) == "NAVIGATING")
    flying.run_for(5.0)
    place = flying.truth()[0]
    assert flying.serve(Service.HOLD).success
    assert flying.ends(goal_id)[0].code.value == "PREEMPTED"
    flying.run_for(12.0)
    assert _circles(flying, place, 20.0)


def test_a_cancel_on_the_ground_leaves_it_disarmed(plane: SimulatedFlight) -> None:
    goal_id = plane.send(300.0, 100.0, 60.0)
    plane.run_until(lambda: plane.vehicle.state.armed)
    plane.bridge.goals.cancel(goal_id, plane.now)
    end = plane.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message
    assert not plane.vehicle.state.armed
    assert plane.truth()[0][2] < 1.0


def test_a_cancel_during_the_climb_continues_to_a_safe_height(plane: SimulatedFlight) -> None:
    goal_id = plane.send(300.0, 100.0, 60.0)
    plane.run_until(lambda: plane.truth()[0][2] > 4.0)
    plane.bridge.goals.cancel(goal_id, plane.now)
    assert plane.run_to_end(goal_id).code.value == "CANCELED"
    plane.run_for(20.0)
    assert plane.truth()[0][2] > 15.0


def test_a_goal_that_replaces_another_is_flown_to(flying: SimulatedFlight) -> None:
    old = flying.send(330.0, 0.0, 60.0)
    flying.run_for(0.05)  # the reposition is not acknowledged yet
    new = flying.send(-300.0, 0.0, 70.0)
    assert flying.run_to_end(new).code.value == "SUCCESS"
    assert flying.ends(old)[0].code.value == "PREEMPTED"
    assert _circles(flying, (-300.0, 0.0, 70.0), 20.0)


def test_a_take_off_ends_at_its_height_above_where_it_stood(plane: SimulatedFlight) -> None:
    end = plane.run_to_end(plane.start(TakeoffRequest(35.0)))
    assert end.code.value == "SUCCESS", end.message
    assert _circles(plane, (0.0, 0.0, 35.0), 20.0)


@pytest.mark.night
def test_a_dead_bridge_leaves_it_circling_its_target(flying: SimulatedFlight) -> None:
    goal_id = flying.send(300.0, 0.0, 60.0)
    flying.run_until(lambda: flying.status(goal_id) == "NAVIGATING")
    flying.run_for(1.0)
    flying.link_up = False
    flying.run_for(50.0)
    assert _circles(flying, (300.0, 0.0, 60.0), 20.0)


@pytest.mark.night
def test_it_returns_and_circles_the_launch_point(flying: SimulatedFlight) -> None:
    flying.run_for(10.0)
    end = flying.run_to_end(flying.start(ReturnRequest()), 180.0)
    assert end.code.value == "SUCCESS", end.message
    assert _away_m(flying, (0.0, 0.0, 0.0)) < CIRCLE_M + 20.0


@pytest.mark.night
@pytest.mark.parametrize(
    ("autopilot", "parameters", "circle_m", "return_m"),
    [
        ("ardupilot", {"WP_LOITER_RAD": 150.0}, 150.0, 150.0),
        ("ardupilot", {"WP_LOITER_RAD": 60.0, "RTL_RADIUS": -200.0}, 60.0, 200.0),
        ("px4", {"NAV_LOITER_RAD": 50.0, "RTL_LOITER_RAD": -160.0}, 50.0, 160.0),
    ],
)
def test_its_circles_are_those_of_its_own_parameters(
    autopilot: str, parameters: dict[str, float], circle_m: float, return_m: float
) -> None:
    vehicle = VehicleConfig(
        vehicle="plane", autopilot=autopilot, ready_after_s=1.0, parameters=parameters
    )
    plane = SimulatedFlight(simulated=vehicle).ready()
    plane.run_to_end(plane.start(TakeoffRequest(50.0)))
    room_m = 500.0 - 2.0 * circle_m  # of volume_radius_m
    assert plane.check(plane.request(room_m - 5.0, 0.0, 60.0)) is None
    assert plane.check(plane.request(room_m + 5.0, 0.0, 60.0)) is not None
    end = plane.run_to_end(plane.start(ReturnRequest()), 300.0)
    assert end.code.value == "SUCCESS", end.message
    plane.run_for(60.0)
    assert 0.8 * return_m < _away_m(plane, (0.0, 0.0, 0.0)) < 1.4 * return_m


@pytest.mark.parametrize(
    ("reference", "height_m", "up_m"),
    [(AltitudeReference.HOME, 45.0, 45.0), (AltitudeReference.AMSL, 584.0 + 65.0, 65.0)],
)
def test_heights_above_home_and_above_the_sea_are_what_they_say(
    flying: SimulatedFlight, reference: AltitudeReference, height_m: float, up_m: float
) -> None:
    place = (-35.363261 + 1.8e-3, 149.16523, height_m)
    end = flying.run_to_end(flying.start(WaypointsRequest((WaypointRequest(place, reference),))))
    assert end.code.value == "SUCCESS", end.message
    assert _circles(flying, (0.0, 200.0, up_m), 15.0)


def test_a_speed_is_flown_and_one_that_it_cannot_fly_is_reported(flying: SimulatedFlight) -> None:
    goal_id = flying.send(330.0, 0.0, 60.0, 19.0)
    end = flying.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert "airspeed" in end.message
    assert flying.truth()[1] == pytest.approx(19.0, abs=1.5)


def test_a_target_that_is_too_low_is_rejected(plane: SimulatedFlight) -> None:
    rejection = plane.check(plane.request(100.0, 0.0, 8.0))
    assert rejection is not None
    assert rejection.code.value == "UNSUPPORTED_VEHICLE"
    assert "cannot hover" in rejection.message
    assert "20 m" in rejection.message


def test_a_target_whose_circle_leaves_the_flight_volume_is_rejected(plane: SimulatedFlight) -> None:
    rejection = plane.check(plane.request(450.0, 0.0, 60.0))
    assert rejection is not None
    assert rejection.code.value == "OUTSIDE_VOLUME"
    assert "circle" in rejection.message


def test_what_has_no_landing_mode_rejects_a_landing(flying: SimulatedFlight) -> None:
    rejection = flying.check(LandRequest())
    if flying.vehicle.profile is not None and flying.vehicle.profile.land_mode is not None:
        assert rejection is None
        return
    assert rejection is not None
    assert rejection.code.value == "UNSUPPORTED_VEHICLE"
    assert "no mode for a landing" in rejection.message
