"""Goals while the position is not received: the autopilot's own ones need none."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.goal import GoalHappened
from navigation_bridge.goals.requests import LandRequest, Request, ReturnRequest, VelocityRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


POSITIONS = frozenset({"GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"})
AUTOPILOTS = ["ardupilot", "px4"]


def far_out(autopilot: str, kind: str = "copter", **parameters: object) -> SimulatedFlight:
    """A vehicle under way, 15 m or more from the launch point, whose positions are lost."""
    flight = SimulatedFlight(
        simulated=VehicleConfig(autopilot=autopilot, vehicle=kind, ready_after_s=1.0),
        volume_radius_m=2000.0,
        battery_policy="ignore",
        **parameters,  # type: ignore[arg-type]
    ).ready()
    height_m = {"copter": 5.0, "plane": 60.0}.get(kind, 0.0)
    far_m = 200.0 if kind == "plane" else 20.0
    end = flight.run_to_end(flight.send(0.0, far_m, height_m))
    assert end.code is OutcomeCode.SUCCESS, end.message
    return flight


@pytest.mark.night_but_first
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("lost_s", [1.5, 30.0])
def test_a_return_is_flown_without_a_recent_position(autopilot: str, lost_s: float) -> None:
    flight = far_out(autopilot)
    flight.unheard = POSITIONS
    flight.run_for(lost_s)
    goal = flight.start(ReturnRequest())
    (accepted,) = [
        output for output in flight.all(GoalHappened)
        if output.goal_id == goal and output.event == "ACCEPTED"
    ]  # fmt: skip
    assert "without a recent position" in accepted.message
    flight.run_for(5.0)
    flight.unheard = frozenset()
    end = flight.run_to_end(goal, 200.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "the autopilot carries out the return by itself" in end.message
    assert max(map(abs, flight.truth()[0][:2])) < 2.0


@pytest.mark.night_but_first
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_return_that_is_never_located_again_does_not_claim_to_be_home(autopilot: str) -> None:
    flight = far_out(autopilot)
    flight.unheard = POSITIONS
    flight.run_for(8.0)
    end = flight.run_to_end(flight.start(ReturnRequest()), 300.0)
    assert end.code is OutcomeCode.LANDED, end.message
    assert "where it is is unknown" in end.message
    assert max(map(abs, flight.truth()[0][:2])) < 2.0


@pytest.mark.wide
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_rover_returns_without_being_located(autopilot: str) -> None:
    """A PX4 disarms at home; an ArduRover stands there, and it is not stuck after a minute."""
    flight = far_out(autopilot, "rover")
    goal = flight.start(ReturnRequest())
    flight.run_for(3.0)
    flight.unheard = POSITIONS
    if autopilot == "px4":
        flight.run_until(lambda: not flight.vehicle.state.armed)
        flight.run_for(3.0)
    else:
        flight.run_for(90.0)
    assert not flight.ends(goal)
    flight.unheard = frozenset()
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_landing_and_a_hold_need_no_position(autopilot: str) -> None:
    flight = far_out(autopilot)
    flight.unheard = POSITIONS
    flight.run_for(8.0)
    assert flight.serve(Service.HOLD).success
    end = flight.run_to_end(flight.start(LandRequest()), 120.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "the autopilot carries out the landing by itself" in end.message


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("way", ["navigate", "velocity"])
def test_other_goals_are_rejected_with_the_bound_that_holds(autopilot: str, way: str) -> None:
    flight = far_out(autopilot)
    goal: Request = (
        flight.request(0.0, 30.0, 5.0) if way == "navigate" else VelocityRequest()
    )  # fmt: skip
    flight.unheard = POSITIONS
    flight.run_for(0.7)
    assert flight.check(goal) is None
    flight.run_for(0.8)
    rejection = flight.check(goal)
    assert rejection is not None
    assert rejection.code is OutcomeCode.NO_POSITION
    assert "needs one of the last 1 s" in rejection.message
    flight.unheard = frozenset()
    flight.run_for(0.5)
    assert flight.check(goal) is None
