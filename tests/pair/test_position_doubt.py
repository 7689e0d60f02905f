"""A receiver that errs while a goal is flown: never a success beside the target.

The simulated vehicles then behave as both firmwares' own simulators were seen to.
"""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.goal import GoalHappened
from navigation_bridge.goals.requests import (
    LandRequest,
    ReturnRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


AUTOPILOTS = ["ardupilot", "px4"]
GLITCH_M = 20.0
SPEED_M_S = 3.0


def under_way(
    autopilot: str, kind: str = "copter", far_m: float = 60.0, **parameters: object
) -> tuple[SimulatedFlight, str]:
    """A flight to the North that is under way, and the goal's id."""
    simulated = VehicleConfig(autopilot=autopilot, vehicle=kind, ready_after_s=1.0)
    flight = SimulatedFlight(
        simulated=simulated,
        volume_radius_m=2000.0,
        battery_policy="ignore",
        **parameters,  # type: ignore[arg-type]
    ).ready()
    height_m = {"copter": 6.0, "plane": 60.0}.get(kind, 0.0)
    goal = flight.send(0.0, far_m, height_m, speed=0.0 if kind == "plane" else SPEED_M_S)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(4.0)
    return flight, goal


def shift(flight: SimulatedFlight, north_m: float, east_m: float = 0.0) -> None:
    flight.simulation.vehicles[0].shift_gps((north_m, east_m, 0.0))


def told(flight: SimulatedFlight, words: str) -> list[GoalHappened]:
    return [output for _, output in flight.outputs
            if isinstance(output, GoalHappened) and words in output.message]  # fmt: skip


def moved_m(flight: SimulatedFlight, since: tuple[float, float, float]) -> float:
    return math.dist(flight.truth()[0], since)


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("kind", ["copter", "rover"])
def test_a_glitch_that_passes_is_waited_for(autopilot: str, kind: str) -> None:
    flight, goal = under_way(autopilot, kind)
    shift(flight, GLITCH_M)
    flight.run_to_status(goal, "HOLDING")
    flight.run_for(5.0)  # a rover rolls back a little at its stop
    begun = flight.truth()[0]
    flight.run_for(2.0)
    assert moved_m(flight, begun) < 0.3
    shift(flight, 0.0)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "The position was in doubt for" in end.message
    assert math.dist(flight.truth()[0][:2], (0.0, 60.0)) < 1.0, flight.truth()
    assert told(flight, "The position is in doubt: ")
    assert told(flight, "The position is reliable again.")


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize(("kind", "east_m"), [("copter", 0.0), ("copter", 9.0), ("rover", 0.0)])
def test_a_glitch_that_stays_ends_the_goal_where_the_vehicle_stopped(
    autopilot: str, kind: str, east_m: float
) -> None:
    """The estimate gives in and jumps; the vehicle does not fly the jump back."""
    flight, goal = under_way(autopilot, kind)
    shift(flight, GLITCH_M, east_m)
    flight.run_to_status(goal, "HOLDING")
    flight.run_for(3.0)
    stood = flight.truth()[0]
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.NO_POSITION, end.message
    assert f"has jumped by {math.hypot(GLITCH_M, east_m):.1f} m" in end.message
    assert moved_m(flight, stood) < 1.5
    flight.run_for(5.0)
    assert moved_m(flight, stood) < 1.5, "nor after the goal"
    # Sent again at once, the goal would end 20 m beside its target.
    again = flight.check(flight.request(0.0, 30.0, 6.0 if kind == "copter" else 0.0))
    assert again is not None
    assert again.code is OutcomeCode.NO_POSITION
    assert "jumped" in again.message


def test_a_goal_long_after_a_jump_reports_the_jump() -> None:
    flight, goal = under_way("px4", position_doubt_timeout_s=10.0)
    shift(flight, GLITCH_M)
    assert flight.run_to_end(goal).code is OutcomeCode.NO_POSITION
    flight.run_for(60.0)
    end = flight.run_to_end(flight.send(0.0, 30.0, 6.0))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "The position jumped by 20.0 m" in end.message


@pytest.mark.night
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_jump_without_a_word_before_it_is_seen_at_once(autopilot: str) -> None:
    """The estimator's messages may be lost, or not sent at all."""
    flight, goal = under_way(autopilot)
    vehicle = flight.simulation.vehicles[0]
    vehicle.firmware.estimator.glitch_rules = vehicle.firmware.estimator.glitch_rules._replace(
        gives_in_s=0.3
    )
    shift(flight, GLITCH_M)
    flight.run_to_status(goal, "HOLDING")
    begun = flight.truth()[0]
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.NO_POSITION, end.message
    assert moved_m(flight, begun) < 0.5 * SPEED_M_S**2 / 0.5, "it only brakes"


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_glitch_at_the_target_is_no_success_beside_it(autopilot: str) -> None:
    flight, goal = under_way(autopilot, far_m=25.0)
    flight.run_to_status(goal, "SETTLING")
    shift(flight, GLITCH_M)
    end = flight.run_to_end(goal)
    beside_m = math.dist(flight.truth()[0][:2], (0.0, 25.0))
    assert (end.code is OutcomeCode.SUCCESS and beside_m < 1.0) or (
        end.code is OutcomeCode.NO_POSITION
    ), (end.message, beside_m)


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_cancel_while_the_position_is_in_doubt_stops_by_the_velocity(autopilot: str) -> None:
    flight, goal = under_way(autopilot)
    shift(flight, GLITCH_M)
    flight.run_to_status(goal, "HOLDING")
    flight.bridge.goals.cancel(goal, flight.now)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.CANCELED, end.message
    assert "in doubt" in end.message
    assert flight.truth()[1] < 0.3


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_no_goal_begins_while_the_position_is_in_doubt(autopilot: str) -> None:
    flight, goal = under_way(autopilot, far_m=20.0)
    flight.run_to_end(goal)
    shift(flight, GLITCH_M)
    flight.run_for(4.0)
    rejection = flight.check(flight.request(5.0, 5.0, 6.0))
    assert rejection is not None
    assert rejection.code in (OutcomeCode.UNHEALTHY, OutcomeCode.NO_POSITION)


@pytest.mark.night
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("request_", [LandRequest(), ReturnRequest()], ids=["land", "return"])
def test_a_landing_and_a_return_continue_and_say_it(
    autopilot: str, request_: LandRequest | ReturnRequest
) -> None:
    flight, goal = under_way(autopilot, far_m=15.0)
    flight.run_to_end(goal)
    goal = flight.start(request_)
    shift(flight, GLITCH_M)
    end = flight.run_to_end(goal, 200.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "The position was in doubt" in end.message


@pytest.mark.night
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_mission_is_held_and_continues(autopilot: str) -> None:
    flight, goal = under_way(autopilot, far_m=15.0)
    flight.run_to_end(goal)
    waypoint = WaypointRequest((0.0, 60.0, 6.0), acceptance_radius_m=2.0)
    goal = flight.start(WaypointsRequest((waypoint,), by_mission=True))
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(2.0)
    shift(flight, GLITCH_M)
    flight.run_to_status(goal, "HOLDING")
    flight.run_for(4.5)
    assert flight.truth()[1] < 0.3
    shift(flight, 0.0)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "The position was in doubt" in end.message


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_plane_circles_meanwhile(autopilot: str) -> None:
    flight, goal = under_way(autopilot, "plane", far_m=700.0)
    shift(flight, GLITCH_M)
    flight.run_to_status(goal, "HOLDING")
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.NO_POSITION, end.message
    assert "circles" in end.message


def test_the_limit_is_a_parameter() -> None:
    flight, goal = under_way("ardupilot", position_doubt_timeout_s=6.0)
    shift(flight, GLITCH_M)
    flight.run_to_status(goal, "HOLDING")
    held_s = flight.now
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.NO_POSITION, end.message
    assert flight.now - held_s < 12.0
    assert "the GPS is 20 m from the estimated position" in end.message


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_what_the_autopilot_does_about_a_lost_fix_is_its_own_failsafe(autopilot: str) -> None:
    flight, goal = under_way(autopilot)
    flight.simulation.vehicles[0].lose_gps()
    flight.run_to_status(goal, "HOLDING")
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.FAILSAFE_GPS, end.message
    assert "the GPS has lost its 3D fix" in end.message


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("kind", ["copter", "rover", "boat", "plane"])
def test_a_flight_without_a_glitch_is_never_in_doubt(autopilot: str, kind: str) -> None:
    flight, goal = under_way(autopilot, kind, far_m=400.0 if kind == "plane" else 40.0)
    end = flight.run_to_end(goal, 200.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "doubt" not in end.message
    assert not told(flight, "doubt")
