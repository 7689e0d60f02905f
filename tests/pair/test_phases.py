"""All tasks pass through their phases in the order of their tables."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.requests import LandRequest, WaypointRequest, WaypointsRequest
from navigation_core.tasks.phased_task import PhasedTask
from navigation_core.tasks.phases import Phase, PhaseError
from navigation_core.tasks.steering.follow_velocity import FollowVelocity
from navigation_core.tasks.watching.mission import FlyMission
from navigation_core.tasks.watching.plane import FlyPlane
from navigation_core.tasks.watching.vehicle_led import VehicleLed
from tests.pair.conftest import Changes
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.velocity_stick import SteeredFlight


def _passed(changes: Changes, kind: type[PhasedTask]) -> list[str]:
    """Return the phases of the only task of a kind, in order."""
    return [after.name for task, _, after in changes if task is kind]


def test_a_flight_and_a_landing_after_it(phases_flown: Changes) -> None:
    flight = SimulatedFlight().ready()
    goal_id = flight.send(6.0, 0.0, 3.0)
    flight.run_to_status(goal_id, "NAVIGATING")
    assert flight.bridge.services.pause(flight.now)[0]
    flight.run_for(1.0)
    assert flight.bridge.services.resume(flight.now)[0]
    assert flight.run_to_end(goal_id).code.value == "SUCCESS"
    passed = [after.name for _, _, after in phases_flown]
    assert passed == [
        *("ARMING", "TAKING_OFF", "NAVIGATING", "PAUSED", "NAVIGATING", "SETTLING", "ENDED"),
    ]
    assert flight.run_to_end(flight.start(LandRequest())).code.value == "SUCCESS"
    assert _passed(phases_flown, VehicleLed) == ["NAVIGATING", "ENDED"]


def test_a_mission_that_is_cancelled(phases_flown: Changes) -> None:
    flight = SimulatedFlight().ready()
    route = (WaypointRequest((12.0, 0.0, 3.0), acceptance_radius_m=2.0),)
    goal_id = flight.start(WaypointsRequest(route, by_mission=True))
    flight.run_to_status(goal_id, "NAVIGATING")
    assert flight.bridge.goals.cancel(goal_id, flight.now)
    assert flight.run_to_end(goal_id).code.value == "CANCELED"
    assert _passed(phases_flown, FlyMission) == [
        *("UPLOADING", "PREPARING", "ARMING", "STARTING", "NAVIGATING"),
        *("STOPPING", "CLEARING", "ENDED"),
    ]


def test_a_plane_that_is_cancelled_in_its_climb(phases_flown: Changes) -> None:
    vehicle = VehicleConfig(vehicle="plane", ready_after_s=1.0)
    flight = SimulatedFlight(simulated=vehicle).ready()
    goal_id = flight.send(300.0, 100.0, 60.0)
    flight.run_until(lambda: flight.truth()[0][2] > 10.0)
    assert flight.bridge.goals.cancel(goal_id, flight.now)
    assert flight.run_to_end(goal_id).code.value == "CANCELED"
    assert _passed(phases_flown, FlyPlane) == ["ARMING", "TAKING_OFF", "STOPPING", "ENDED"]


def test_velocity_commands_that_stop(phases_flown: Changes) -> None:
    flight = SteeredFlight()
    goal_id = flight.begin()
    flight.steer(2.0, (1.0, 0.0, 0.0))
    assert flight.bridge.goals.cancel(goal_id, flight.now)
    assert flight.run_to_end(goal_id).code.value == "CANCELED"
    assert _passed(phases_flown, FollowVelocity) == ["NAVIGATING", "STOPPING", "ENDED"]


def test_a_phase_that_the_table_does_not_hold_ends_the_flight(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    flight = SimulatedFlight().ready()
    flight.fly_up()
    goal_id = flight.start(LandRequest())
    table = dict(VehicleLed.table)
    table[Phase.NAVIGATING] = table[Phase.NAVIGATING] - {Phase.STOPPING}
    monkeypatch.setattr(VehicleLed, "table", table)
    flight.run_to_status(goal_id, "LANDING")
    assert flight.bridge.goals.cancel(goal_id, flight.now)
    with pytest.raises(PhaseError, match="STOPPING cannot follow NAVIGATING"):
        flight.run_to_end(goal_id)
