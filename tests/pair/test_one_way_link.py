"""Links that pass one direction only, and links that only seem to."""

from __future__ import annotations

import pytest

from mavlink_sitl import LinkFaults, VehicleConfig
from mavlink_vehicle.vehicle import VehicleConfig as ServerSide
from navigation_bridge.goals.requests import (
    LandRequest,
    Request,
    ReturnRequest,
    VelocityRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.vehicle_pair import VehiclePair

pytestmark = pytest.mark.wide_but_first


VEHICLES = [
    ("ardupilot", "copter"), ("px4", "copter"), ("ardupilot", "rover"), ("px4", "rover"),
    ("ardupilot", "boat"), ("ardupilot", "plane"), ("px4", "plane"),
]  # fmt: skip
HEIGHTS_M = {"copter": 5.0, "plane": 60.0}


def flight_of(
    autopilot: str, kind: str, faults: LinkFaults | None = None, **parameters: object
) -> SimulatedFlight:
    vehicle = VehicleConfig(autopilot=autopilot, vehicle=kind, ready_after_s=1.0)
    flight = SimulatedFlight(
        simulated=vehicle,
        volume_radius_m=3000.0,
        battery_policy="ignore",
        **parameters,  # type: ignore[arg-type]
    )
    flight.simulation.link.set_faults(faults)
    return flight.ready()


def far(flight: SimulatedFlight, kind: str, far_m: float = 200.0) -> Request:
    distance_m = 1000.0 if kind == "plane" else far_m
    return flight.request(0.0, distance_m, HEIGHTS_M.get(kind, 0.0))


def under_way(flight: SimulatedFlight, kind: str, far_m: float = 200.0) -> str:
    goal = flight.start(far(flight, kind, far_m))
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(5.0)
    return goal


def loses_uplink(flight: SimulatedFlight, goal: str, within_s: float = 3.0) -> None:
    flight.uplink_up = False
    began_s = flight.now
    flight.run_until(lambda: bool(flight.ends(goal)), 30.0)
    (end,) = flight.ends(goal)
    assert end.code is OutcomeCode.LINK_LOST, end.message
    assert "one way" in end.message
    assert flight.now - began_s <= within_s


@pytest.mark.parametrize(("autopilot", "kind"), VEHICLES)
def test_a_lost_uplink_ends_a_goal(autopilot: str, kind: str) -> None:
    flight = flight_of(autopilot, kind)
    goal = under_way(flight, kind)
    loses_uplink(flight, goal)
    rejection = flight.check(far(flight, kind))
    assert rejection is not None
    assert rejection.code is OutcomeCode.NO_VEHICLE
    flight.uplink_up = True
    flight.run_for(2.0)
    rejection = flight.check(far(flight, kind))  # a PX4 returns meanwhile
    assert rejection is None or rejection.code is not OutcomeCode.NO_VEHICLE, rejection


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("action", ["mission", "land", "return"])
def test_a_goal_that_sends_no_setpoints_ends_too(autopilot: str, action: str) -> None:
    flight = flight_of(autopilot, "copter")
    points = tuple(WaypointRequest((0.0, y, 20.0)) for y in (40.0, 80.0, 120.0))
    if action == "mission":
        goal = flight.start(WaypointsRequest(points, by_mission=True))
        flight.run_to_status(goal, "NAVIGATING")
    else:
        end = flight.run_to_end(flight.start(flight.request(0.0, 40.0, 20.0)))
        assert end.code is OutcomeCode.SUCCESS, end.message
        goal = flight.start(LandRequest() if action == "land" else ReturnRequest())
    flight.run_for(4.0)
    loses_uplink(flight, goal)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_an_autopilot_without_timesync_is_known_by_its_acknowledgements(autopilot: str) -> None:
    flight = flight_of(autopilot, "copter")
    flight.unheard = frozenset({"TIMESYNC"})
    points = tuple(WaypointRequest((0.0, y, 20.0)) for y in (40.0, 80.0, 120.0))
    goal = flight.start(WaypointsRequest(points, by_mission=True))
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(6.0)
    loses_uplink(flight, goal, within_s=4.0)


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_an_autopilot_without_timesync_is_flown_all_the_same(autopilot: str) -> None:
    flight = flight_of(autopilot, "copter")
    flight.unheard = frozenset({"TIMESYNC"})
    end = flight.run_to_end(flight.start(flight.request(0.0, 60.0, 5.0)))
    assert end.code is OutcomeCode.SUCCESS, end.message


BAD_LINKS = {
    "20 % loss": LinkFaults(loss=0.2),
    "half a second each way": LinkFaults(delay_s=0.5, jitter_s=0.3),
    "two seconds each way": LinkFaults(delay_s=2.0),
    "both": LinkFaults(loss=0.2, delay_s=0.4, jitter_s=0.2),
}


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("name", BAD_LINKS)
def test_a_bad_link_is_not_one_way(autopilot: str, name: str) -> None:
    pair = VehiclePair(
        faults=BAD_LINKS[name],
        config=ServerSide(heartbeat_timeout_s=6.0),
        simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0, faults=BAD_LINKS[name]),
    )
    pair.run_until(lambda: pair.vehicle.heartbeats.alive)
    for _ in range(600):
        pair.vehicle.answers.expect(pair.vehicle.heartbeats.alive, pair.now)
        pair.run_for(0.1)
        assert not pair.vehicle.answers.one_way, pair.now
    assert pair.vehicle.timesync.round_trip_s is not None


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("loss", [0.8, 0.9, 0.95])
def test_answers_lost_among_much_else_are_not_one_way(loss: float) -> None:
    """A flood on the port lets few packets through, whichever they are."""
    flight = flight_of("ardupilot", "copter")
    goal = under_way(flight, "copter", 100.0)
    for _ in range(3):
        flight.simulation.link.set_faults(LinkFaults(loss=loss))
        flight.run_for(5.0)
        flight.simulation.link.set_faults(None)
        flight.run_for(1.0)
    assert flight.run_to_end(goal).code is OutcomeCode.SUCCESS


def test_a_lost_uplink_is_noticed_on_a_link_that_loses() -> None:
    flight = flight_of("ardupilot", "copter", LinkFaults(loss=0.2))
    loses_uplink(flight, under_way(flight, "copter"), within_s=4.0)


@pytest.mark.night
def test_a_silence_and_a_standstill_are_not_one_way() -> None:
    flight = flight_of("ardupilot", "copter")
    goal = under_way(flight, "copter", 60.0)
    flight.simulation.link.silent = True
    flight.run_for(2.0)
    flight.simulation.link.silent = False
    flight.run_for(3.0)
    flight.stall(2.5)
    assert flight.run_to_end(goal).code is OutcomeCode.SUCCESS


def test_velocity_commands_end_too() -> None:
    flight = flight_of("ardupilot", "copter")
    flight.fly_up()
    goal = flight.start(VelocityRequest())
    flight.run_for(4.0)
    loses_uplink(flight, goal)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_goal_that_begins_on_a_one_way_link_ends(autopilot: str) -> None:
    flight = flight_of(autopilot, "copter")
    flight.run_for(6.0)
    flight.uplink_up = False
    goal = flight.start(far(flight, "copter"))
    loses_uplink(flight, goal)
