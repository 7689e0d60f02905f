"""The parameter ``arming`` decides who may make a vehicle leave the ground."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, make
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.requests import (
    NavigateRequest,
    Request,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


TARGET = (60.0, 0.0, 40.0)
REQUESTS: dict[str, Request] = {
    "navigate": NavigateRequest("map", TARGET, (0.0, 0.0, 0.0, 1.0), False, 0.0),
    "route": WaypointsRequest((WaypointRequest(TARGET),)),
    "mission": WaypointsRequest((WaypointRequest(TARGET),), by_mission=True),
    "takeoff": TakeoffRequest(0.0),
    "return": ReturnRequest(),
}
FLYING_KINDS = [
    ("ardupilot", "copter", "STABILIZE"),
    ("ardupilot", "plane", "MANUAL"),
    ("px4", "copter", "AUTO.LOITER"),
    ("px4", "plane", "AUTO.LOITER"),
]


def armed_by_its_pilot(
    autopilot: str, kind: str, mode: str, arming: str = "never"
) -> SimulatedFlight:
    """A vehicle on the ground that a pilot has armed; it does not disarm by itself."""
    stays_armed = {("ardupilot", "copter"): "DISARM_DELAY", ("px4", kind): "COM_DISARM_PRFLT"}
    name = stays_armed.get((autopilot, kind))
    vehicle = VehicleConfig(
        autopilot=autopilot,
        vehicle=kind,
        ready_after_s=1.0,
        parameters={} if name is None else {name: 0.0},
    )
    flight = SimulatedFlight(simulated=vehicle, arming=arming).ready()
    flight.run_for(2.0)
    flight.set_mode_as_pilot(mode)
    flight.run_for(1.5)
    command = make("COMMAND_LONG", target_system=1, target_component=1, command=400, param1=1.0)
    flight.simulation.link.write(Codec(255, 190).encode(command))
    flight.run_until(lambda: flight.vehicle.state.armed, 5.0)
    flight.run_for(1.0)
    assert flight.vehicle.mode_name == mode
    return flight


@pytest.mark.parametrize(("autopilot", "kind", "mode"), FLYING_KINDS)
def test_never_leaves_a_vehicle_on_the_ground_that_its_pilot_has_armed(
    autopilot: str, kind: str, mode: str
) -> None:
    flight = armed_by_its_pilot(autopilot, kind, mode)
    for name, request in REQUESTS.items():
        rejection = flight.check(request)
        assert rejection is not None, name
        wanted = OutcomeCode.NOT_FLYING if name == "return" else OutcomeCode.TAKEOFF_NOT_ALLOWED
        assert rejection.code is wanted, (name, rejection)
        # The moment between the check and the start is another way in.
        flight.bridge.goals.start(name, request, flight.now)
        flight.run_for(3.0)
        assert flight.ends(name)[0].code is wanted, name
    flight.run_for(5.0)
    assert flight.vehicle.mode_name == mode, "its pilot's mode was changed"
    assert flight.truth()[0][2] < 0.3
    asked = {m.command for _, m in flight.sent if m.get_type().startswith("COMMAND_")}
    assert asked.isdisjoint({16, 20, 22, 176, 192, 300, 400}), asked
    assert flight.setpoint_times(0.0) == []


@pytest.mark.parametrize(("autopilot", "kind", "mode"), FLYING_KINDS)
def test_pilot_takes_off_once_the_pilot_has_armed(autopilot: str, kind: str, mode: str) -> None:
    flight = armed_by_its_pilot(autopilot, kind, mode, arming="pilot")
    end = flight.run_to_end(flight.start(TakeoffRequest(0.0)), 200.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert flight.truth()[0][2] > 2.0


def test_pilot_does_not_arm() -> None:
    flight = SimulatedFlight(arming="pilot").ready()
    rejection = flight.check(flight.request(5.0, 0.0, 3.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.ARMING_NOT_ALLOWED
    assert "'pilot'" in rejection.message


@pytest.mark.parametrize(("arming", "arms"), [("never", False), ("pilot", True), ("auto", True)])
def test_the_arm_service_keeps_to_the_parameter(arming: str, arms: bool) -> None:
    flight = SimulatedFlight(arming=arming).ready()
    flight.run_for(2.0)
    answer = flight.serve(Service.ARM)
    assert answer.success is arms, answer.message
    flight.run_for(1.5)
    assert flight.vehicle.state.armed is arms
    assert arms or "arming" in answer.message


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_never_lets_a_rover_drive_that_its_pilot_has_armed(autopilot: str) -> None:
    flight = armed_by_its_pilot(
        autopilot, "rover", "HOLD" if autopilot == "ardupilot" else "AUTO.LOITER"
    )
    end = flight.run_to_end(flight.send(8.0, 0.0, 0.0))
    assert end.code is OutcomeCode.SUCCESS, end.message


def test_never_flies_on_a_vehicle_in_the_air() -> None:
    flight = armed_by_its_pilot("ardupilot", "copter", "STABILIZE", arming="pilot")
    flight.run_to_end(flight.start(TakeoffRequest(4.0)))
    flight.reconfigure(arming="never")
    end = flight.run_to_end(flight.send(6.0, 0.0, 4.0))
    assert end.code is OutcomeCode.SUCCESS, end.message


@pytest.mark.parametrize(
    ("autopilot", "kind", "mode", "then"),
    [
        ("ardupilot", "copter", "RTL", "GUIDED"),
        ("ardupilot", "copter", "LAND", "GUIDED"),
        ("ardupilot", "rover", "RTL", "HOLD"),
        ("ardupilot", "plane", "RTL", "LOITER"),
        ("px4", "copter", "AUTO.LAND", "AUTO.LOITER"),
        ("px4", "plane", "AUTO.RTL", "AUTO.LOITER"),
        ("px4", "rover", "OFFBOARD", "AUTO.LOITER"),
        # These it could be armed in, and would set off at once.
        ("ardupilot", "plane", "TAKEOFF", "LOITER"),
        ("px4", "copter", "AUTO.TAKEOFF", "AUTO.LOITER"),
    ],
)
def test_a_mode_that_is_not_armed_in_is_left_first(
    autopilot: str, kind: str, mode: str, then: str
) -> None:
    vehicle = VehicleConfig(autopilot=autopilot, vehicle=kind, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=vehicle).ready()
    flight.run_for(2.0)
    flight.set_mode_as_pilot(mode)
    flight.run_until(lambda: flight.vehicle.mode_name == mode, 3.0)
    flight.run_for(1.0)
    answer = flight.serve(Service.ARM)
    assert answer.success, answer.message
    assert flight.vehicle.mode_name == then
    place = flight.truth()[0]
    flight.run_for(6.0)
    assert math.dist(flight.truth()[0], place) < 0.5, "it was set off by being armed"


def test_an_armable_mode_is_the_pilots_to_choose() -> None:
    flight = SimulatedFlight().ready()
    flight.run_for(2.0)
    flight.set_mode_as_pilot("ALT_HOLD")
    flight.run_for(1.5)
    assert flight.serve(Service.ARM).success
    assert flight.vehicle.mode_name == "ALT_HOLD"
