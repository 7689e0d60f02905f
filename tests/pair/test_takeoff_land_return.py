"""Take-off, landing, return, pause and the services, against the simulated ArduCopter."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.requests import LandRequest, Request, ReturnRequest, TakeoffRequest
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


@pytest.fixture
def flight() -> SimulatedFlight:
    return SimulatedFlight().ready()


def test_take_off_ends_at_its_height_in_the_air(flight: SimulatedFlight) -> None:
    goal_id = flight.start(TakeoffRequest(6.0))
    end = flight.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message
    (_, _, height_m), speed_m_s = flight.truth()
    assert height_m == pytest.approx(6.0, abs=0.5)
    assert speed_m_s < 0.3
    heights = [item.height_m for item in flight.feedback(goal_id) if item.height_m is not None]
    assert heights[0] < 0.5
    assert heights[-1] == pytest.approx(6.0, abs=0.5)


def test_take_off_in_the_air_is_rejected(flight: SimulatedFlight) -> None:
    flight.fly_up()
    rejection = flight.check(TakeoffRequest(5.0))
    assert rejection is not None
    assert rejection.code.value == "ALREADY_FLYING"


def test_landing_ends_on_the_ground_with_the_motors_off(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal_id = flight.start(LandRequest())
    end = flight.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert not flight.vehicle.state.armed
    assert flight.truth()[0][2] == pytest.approx(0.0, abs=0.1)
    feedback = flight.feedback(goal_id)
    distances = [item.distance_remaining_m for item in feedback]
    assert distances[0] == pytest.approx(3.0, abs=0.5)
    assert distances[-1] < 0.3
    assert "LANDING" in {item.status.value for item in feedback}


def test_return_lands_where_the_flight_began(flight: SimulatedFlight) -> None:
    flight.fly_up()
    assert flight.run_to_end(flight.send(20.0, 0.0, 5.0)).code.value == "SUCCESS"
    goal_id = flight.start(ReturnRequest())
    end = flight.run_to_end(goal_id, 180.0)
    assert end.code.value == "SUCCESS", end.message
    assert end.final_error_m is not None
    assert end.final_error_m < 1.0
    assert not flight.vehicle.state.armed
    statuses = [item.status.value for item in flight.feedback(goal_id)]
    assert statuses.index("RETURNING") < statuses.index("LANDING")


@pytest.mark.parametrize("request_", [LandRequest(), ReturnRequest()])
def test_a_vehicle_on_the_ground_has_nothing_to_land(
    flight: SimulatedFlight, request_: Request
) -> None:
    rejection = flight.check(request_)
    assert rejection is not None
    assert rejection.code.value == "NOT_FLYING"


@pytest.mark.parametrize("request_", [LandRequest(), ReturnRequest()])
def test_a_cancelled_descent_holds_where_it_is(flight: SimulatedFlight, request_: Request) -> None:
    assert flight.run_to_end(flight.send(0.0, 15.0, 12.0)).code.value == "SUCCESS"
    goal_id = flight.start(request_)
    flight.run_for(4.0)
    assert flight.bridge.goals.cancel(goal_id, flight.now)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message
    assert flight.truth()[1] < 0.3
    height_m = flight.truth()[0][2]
    flight.run_for(5.0)
    assert flight.truth()[0][2] == pytest.approx(height_m, abs=0.5)
    assert flight.vehicle.mode_name == "BRAKE"


def test_a_new_goal_takes_over_from_a_landing(flight: SimulatedFlight) -> None:
    flight.fly_up()
    landing = flight.start(LandRequest())
    flight.run_for(1.0)
    goal_id = flight.send(5.0, 0.0, 3.0)
    assert flight.run_to_end(goal_id).code.value == "SUCCESS"
    (end,) = flight.ends(landing)
    assert end.code.value == "PREEMPTED"


def test_a_pilot_who_takes_over_ends_a_landing(flight: SimulatedFlight) -> None:
    flight.fly_up()
    landing = flight.start(LandRequest())
    flight.run_until(lambda: flight.status(landing) == "LANDING")
    flight.set_mode_as_pilot("LOITER")
    assert flight.run_to_end(landing).code.value == "PILOT_OVERRIDE"


def test_a_paused_goal_stands_still_until_it_is_resumed(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal_id = flight.send(30.0, 0.0, 3.0)
    flight.run_until(lambda: flight.truth()[0][0] > 8.0)
    done, text = flight.bridge.services.pause(flight.now)
    assert done, text
    flight.run_for(6.0)
    assert flight.status(goal_id) == "PAUSED"
    (x_m, _, _), speed_m_s = flight.truth()
    assert speed_m_s < 0.3
    flight.run_for(3.0)
    assert flight.truth()[0][0] == pytest.approx(x_m, abs=0.3)
    done, text = flight.bridge.services.resume(flight.now)
    assert done, text
    end = flight.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert flight.truth()[0][0] == pytest.approx(30.0, abs=0.5)


def test_a_paused_goal_can_be_cancelled(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal_id = flight.send(30.0, 0.0, 3.0)
    flight.run_for(4.0)
    flight.bridge.services.pause(flight.now)
    flight.run_for(6.0)
    flight.bridge.goals.cancel(goal_id, flight.now)
    assert flight.run_to_end(goal_id).code.value == "CANCELED"


def test_a_goal_that_is_being_cancelled_neither_continues_nor_pauses(
    flight: SimulatedFlight,
) -> None:
    flight.fly_up()
    goal_id = flight.send(30.0, 0.0, 3.0)
    flight.run_until(lambda: flight.truth()[1] > 2.0)
    flight.bridge.goals.cancel(goal_id, flight.now)
    refused = (False, "The goal is being cancelled.")
    assert flight.bridge.services.resume(flight.now) == refused
    assert flight.bridge.services.pause(flight.now) == refused
    assert flight.run_to_end(goal_id).code.value == "CANCELED"


def test_without_a_goal_there_is_nothing_to_pause(flight: SimulatedFlight) -> None:
    assert flight.bridge.services.pause(flight.now) == (False, "No goal is active.")
    assert flight.bridge.services.resume(flight.now) == (False, "No goal is active.")


def test_arm_and_disarm_are_confirmed_by_the_vehicle(flight: SimulatedFlight) -> None:
    done = flight.serve(Service.ARM)
    assert done.success, done.message
    assert flight.vehicle.state.armed
    done = flight.serve(Service.DISARM)
    assert done.success, done.message
    assert not flight.vehicle.state.armed


def test_disarm_in_the_air_is_rejected_with_the_vehicles_reason(flight: SimulatedFlight) -> None:
    flight.fly_up()
    done = flight.serve(Service.DISARM)
    assert not done.success
    assert "FAILED" in done.message


def test_a_mode_is_set_in_any_case_and_confirmed_by_the_vehicle(flight: SimulatedFlight) -> None:
    for name in ("loiter", " LAND", "Guided"):
        done = flight.serve(Service.SET_MODE, name)
        assert done.success, done.message
        assert flight.vehicle.mode_name == name.strip().upper()


def test_a_mode_that_does_not_exist_is_rejected_with_those_that_do(flight: SimulatedFlight) -> None:
    done = flight.serve(Service.SET_MODE, "HOVER")
    assert not done.success
    assert "has no mode 'HOVER'" in done.message
    assert "GUIDED" in done.message


def test_after_a_landing_arming_leaves_the_mode_that_is_not_armed_in(
    flight: SimulatedFlight,
) -> None:
    assert flight.serve(Service.SET_MODE, "LAND").success
    done = flight.serve(Service.ARM)
    assert done.success, done.message
    assert flight.vehicle.mode_name == "GUIDED"


def test_a_mode_that_would_take_off_at_once_is_not_set(flight: SimulatedFlight) -> None:
    assert flight.serve(Service.SET_MODE, "GUIDED").success
    assert flight.serve(Service.ARM).success
    done = flight.serve(Service.SET_MODE, "AUTO")
    assert not done.success
    assert "would move immediately" in done.message
    assert flight.vehicle.mode_name == "GUIDED"


def test_no_mode_is_set_while_a_goal_is_active(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal_id = flight.send(10.0, 0.0, 3.0)
    done = flight.serve(Service.SET_MODE, "LOITER")
    assert not done.success
    assert "A goal is active" in done.message
    assert flight.run_to_end(goal_id).code.value == "SUCCESS"


def test_hold_ends_the_goal_and_stops_the_vehicle(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal_id = flight.send(40.0, 0.0, 3.0)
    flight.run_until(lambda: flight.truth()[1] > 2.0)
    done = flight.serve(Service.HOLD)
    assert done.success, done.message
    (end,) = flight.ends(goal_id)
    assert end.code.value == "PREEMPTED"
    flight.run_for(5.0)
    assert flight.truth()[1] < 0.3


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_the_last_setpoint_before_a_hold_stops_the_vehicle(autopilot: str) -> None:
    """The command to hold may be lost; the vehicle would follow a velocity until it is repeated."""
    vehicle = VehicleConfig(autopilot=autopilot, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=vehicle).ready()
    flight.fly_up()
    flight.send(40.0, 0.0, 3.0)
    flight.run_until(lambda: flight.truth()[1] > 2.0)
    assert flight.serve(Service.HOLD).success
    *_, last = (m for _, m in flight.sent if m.get_type() == "SET_POSITION_TARGET_LOCAL_NED")
    assert (last.vx, last.vy, last.vz) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("service", [Service.ARM, Service.DISARM])
def test_motors_are_left_alone_while_a_goal_is_active(
    flight: SimulatedFlight, service: Service
) -> None:
    flight.fly_up()
    goal_id = flight.send(10.0, 0.0, 3.0)
    done = flight.serve(service)
    assert not done.success
    assert "A goal is active" in done.message
    assert flight.run_to_end(goal_id).code.value == "SUCCESS"
