"""Goals on the simulated PX4 copter: take-off before control, a stream before it, parking after."""

from __future__ import annotations

import itertools
import math

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.requests import (
    LandRequest,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from tests.support.flights.simulated_flight import SimulatedFlight


@pytest.fixture
def flight() -> SimulatedFlight:
    return SimulatedFlight(simulated=VehicleConfig(autopilot="px4", ready_after_s=1.0)).ready()


def test_a_goal_is_flown_from_the_ground_and_left_in_hold(flight: SimulatedFlight) -> None:
    goal_id = flight.send(10.0, 5.0, 4.0)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message
    position, speed_m_s = flight.truth()
    assert math.dist(position, (10.0, 5.0, 4.0)) < 1.0
    assert speed_m_s < 0.4
    modes = [line for _, line in flight.outputs if "Vehicle mode" in str(line)]
    assert any("AUTO.TAKEOFF" in str(line) for line in modes)
    # Once it holds by itself, nothing is streamed any more, for good.
    assert flight.vehicle.mode_name == "AUTO.LOITER"
    quiet_from_s = flight.now
    flight.run_for(20.0)
    assert flight.setpoint_times(quiet_from_s) == []
    assert flight.vehicle.mode_name == "AUTO.LOITER"
    assert math.dist(flight.truth()[0], (10.0, 5.0, 4.0)) < 1.5


def test_control_is_asked_for_after_a_second_of_setpoints(flight: SimulatedFlight) -> None:
    flight.fly_up()
    since_s = flight.now
    goal_id = flight.send(10.0, 0.0, 3.0)
    flight.run_until(lambda: flight.vehicle.in_control_mode, 10.0)
    asked_s = min(
        time_s
        for time_s, message in flight.sent
        if time_s >= since_s and message.get_type() == "COMMAND_LONG" and message.command == 176
    )
    times = flight.setpoint_times(since_s)
    assert asked_s - times[0] > 1.0
    assert max(b - a for a, b in itertools.pairwise(times)) < 0.2
    assert flight.run_to_end(goal_id).code.value == "SUCCESS"


@pytest.mark.wide
def test_a_goal_that_replaces_another_continues_in_offboard(flight: SimulatedFlight) -> None:
    flight.fly_up()
    flight.send(40.0, 0.0, 3.0)
    flight.run_until(lambda: flight.truth()[1] > 2.5, 20.0)
    since_s = flight.now
    new = flight.send(40.0, 20.0, 3.0)
    flight.run_for(4.0)
    times = flight.setpoint_times(since_s)
    assert max(b - a for a, b in itertools.pairwise(times)) <= 0.1
    assert flight.truth()[1] > 1.0
    assert flight.run_to_end(new).code.value == "SUCCESS"


@pytest.mark.wide
def test_a_goal_right_after_another_takes_it_out_of_hold_again(flight: SimulatedFlight) -> None:
    flight.fly_up()
    for x_m in (6.0, 12.0):
        goal_id = flight.send(x_m, 0.0, 3.0)
        flight.run_until(lambda goal_id=goal_id: bool(flight.ends(goal_id)))  # type: ignore[misc]
        assert flight.ends(goal_id)[0].code.value == "SUCCESS"


@pytest.mark.wide
def test_take_off_land_and_return(flight: SimulatedFlight) -> None:
    end = flight.run_to_end(flight.start(TakeoffRequest(5.0)))
    assert end.code.value == "SUCCESS", end.message
    assert flight.truth()[0][2] == pytest.approx(5.0, abs=0.7)
    assert flight.run_to_end(flight.send(15.0, 0.0, 5.0)).code.value == "SUCCESS"
    end = flight.run_to_end(flight.start(ReturnRequest()), 240.0)
    assert end.code.value == "SUCCESS", end.message
    assert not flight.vehicle.state.armed
    flight.fly_up()
    end = flight.run_to_end(flight.start(LandRequest()), 60.0)
    assert end.code.value == "SUCCESS", end.message
    assert not flight.vehicle.state.armed


def test_a_cancel_stops_and_leaves_it_in_hold(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal_id = flight.send(40.0, 0.0, 3.0)
    flight.run_until(lambda: flight.truth()[1] > 2.0, 20.0)
    flight.bridge.goals.cancel(goal_id, flight.now)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message
    assert flight.truth()[1] < 0.4
    flight.run_for(10.0)
    assert flight.vehicle.mode_name == "AUTO.LOITER"


def test_the_hold_service_stops_it_without_a_failsafe(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal_id = flight.send(40.0, 0.0, 3.0)
    flight.run_until(lambda: flight.truth()[1] > 2.0, 20.0)
    done = flight.serve(Service.HOLD)
    assert done.success, done.message
    assert flight.ends(goal_id)[0].code.value == "PREEMPTED"
    flight.run_for(6.0)
    assert flight.vehicle.mode_name == "AUTO.LOITER"
    assert flight.truth()[1] < 0.4
    assert flight.vehicle.state.failsafe is None


def test_a_landing_begins_without_a_failsafe(flight: SimulatedFlight) -> None:
    flight.fly_up()
    flight.send(40.0, 0.0, 3.0)
    flight.run_until(lambda: flight.truth()[1] > 2.0, 20.0)
    landing = flight.start(LandRequest())
    assert flight.run_to_end(landing, 60.0).code.value == "SUCCESS"
    assert not [line for _, line in flight.outputs if "ailsafe" in str(line)]


def test_a_pilot_who_takes_over_is_not_fought(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal_id = flight.send(40.0, 0.0, 3.0)
    flight.run_until(lambda: flight.truth()[1] > 2.0, 20.0)
    flight.set_mode_as_pilot("AUTO.LAND")
    assert flight.run_to_end(goal_id).code.value == "PILOT_OVERRIDE"
    quiet_from_s = flight.now
    flight.run_for(5.0)
    assert flight.setpoint_times(quiet_from_s) == []
    assert flight.vehicle.mode_name == "AUTO.LAND"


@pytest.mark.wide
def test_a_fast_flight_stops_at_its_goal_and_not_beyond(flight: SimulatedFlight) -> None:
    flight.fly_up()
    radius_m = flight.config.bridge.goto.arrival_radius_m
    for goal in ((30.0, 0.0, 3.0), (30.0, 25.0, 3.0)):
        start = flight.truth()[0]
        goal_id, beyond_m = flight.send(*goal, 4.0), 0.0
        while not flight.ends(goal_id):
            flight.run_for(0.1)
            beyond_m = max(beyond_m, math.dist(start, flight.truth()[0]) - math.dist(start, goal))
        assert flight.ends(goal_id)[0].code.value == "SUCCESS"
        assert beyond_m < radius_m


def landed_by_its_failsafe(kind: str = "copter") -> SimulatedFlight:
    """A PX4 whose server fell silent under way; it came home by itself and disarmed."""
    vehicle = VehicleConfig(autopilot="px4", vehicle=kind, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=vehicle).ready()
    goal = flight.send(20.0, 0.0, 6.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(1.0)
    flight.link_up = False
    flight.run_for(20.0)
    flight.link_up = True
    flight.run_until(lambda: not flight.vehicle.state.armed, 120.0)
    flight.run_for(2.0)
    assert flight.vehicle.mode_name == "OFFBOARD"
    assert flight.vehicle.state.system_status == 0
    return flight


@pytest.mark.wide
def test_a_px4_that_disarmed_in_offboard_is_flown_again() -> None:
    flight = landed_by_its_failsafe()
    end = flight.run_to_end(flight.send(5.0, 0.0, 4.0))
    assert end.code.value == "SUCCESS", end.message


@pytest.mark.wide
def test_a_px4_that_disarmed_in_offboard_flies_a_mission() -> None:
    flight = landed_by_its_failsafe()
    request = WaypointsRequest((WaypointRequest((15.0, 0.0, 5.0)),), by_mission=True)
    end = flight.run_to_end(flight.start(request), 200.0)
    assert end.code.value == "SUCCESS", end.message


@pytest.mark.wide
def test_the_arm_service_leaves_offboard_first() -> None:
    flight = landed_by_its_failsafe()
    since_s = flight.now
    answer = flight.serve(Service.ARM)
    assert answer.success, answer.message
    assert flight.vehicle.state.armed
    assert flight.vehicle.mode_name == "AUTO.LOITER"
    assert flight.setpoint_times(since_s) == []
