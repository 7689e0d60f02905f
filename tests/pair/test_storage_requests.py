"""Requests about fence, rally points and parameters, beside goals, on simulated vehicles."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from mavlink_sitl import DEFAULT_HOME, LinkFaults, VehicleConfig
from mavlink_vehicle.events import ParameterChange
from mavlink_vehicle.mission_items import MissionType
from navigation_bridge.goals.goal import LogLine
from navigation_bridge.goals.requests import LandRequest
from navigation_bridge.storage.geographic import Degrees, GeoArea, GeoFence, RallyPoint
from navigation_bridge.storage.storage_requests import ListAnswer, ParametersAnswer, StorageRequests
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


AUTOPILOTS = ("ardupilot", "px4")
METRES_PER_DEGREE = 111_319.0


def place(north_m: float, east_m: float) -> Degrees:
    scale = math.cos(math.radians(DEFAULT_HOME.latitude_deg))
    return (
        DEFAULT_HOME.latitude_deg + north_m / METRES_PER_DEGREE,
        DEFAULT_HOME.longitude_deg + east_m / METRES_PER_DEGREE / scale,
    )


def square(half_m: float, north_m: float = 0.0, inclusion: bool = True) -> GeoArea:
    corners = [(-half_m, -half_m), (-half_m, half_m), (half_m, half_m), (half_m, -half_m)]
    return GeoArea(tuple(place(north_m + n, e) for n, e in corners), None, inclusion)


def flight_of(autopilot: str, faults: LinkFaults | None = None) -> SimulatedFlight:
    simulated = VehicleConfig(autopilot=autopilot, ready_after_s=1.0, faults=faults)
    return SimulatedFlight(simulated=simulated).ready()


def answered(
    flight: SimulatedFlight, ask: Callable[[Callable[[ListAnswer], None]], None]
) -> ListAnswer:
    answers: list[ListAnswer] = []
    ask(answers.append)
    flight.run_until(lambda: bool(answers), 100.0)
    (answer,) = answers
    return answer


def write(flight: SimulatedFlight, *areas: GeoArea) -> ListAnswer:
    fence = GeoFence(areas)
    return answered(
        flight,
        lambda take: flight.bridge.feature(StorageRequests).write_fence(fence, take, flight.now),
    )


def read(flight: SimulatedFlight, kind: MissionType) -> ListAnswer:
    return answered(
        flight,
        lambda take: flight.bridge.feature(StorageRequests).read_list(kind, take, flight.now),
    )


def change(
    flight: SimulatedFlight, wanted: dict[str, float], while_armed: bool = False
) -> ParametersAnswer:
    answers: list[ParametersAnswer] = []
    flight.bridge.feature(StorageRequests).change_parameters(
        wanted, while_armed, answers.append, flight.now
    )
    flight.run_until(lambda: bool(answers), 100.0)
    (answer,) = answers
    return answer


@pytest.mark.parametrize(
    ("autopilot", "name", "value", "sentence"),
    [
        ("ardupilot", "FENCE_ENABLE", 0.0, "does not enforce it (FENCE_ENABLE 0"),
        ("ardupilot", "FENCE_ENABLE", 1.0, "The autopilot enforces it (FENCE_ENABLE 1"),
        ("ardupilot", "FENCE_TYPE", 1.0, "does not enforce it (FENCE_ENABLE 1"),
        ("px4", "GF_ACTION", 0.0, "does not enforce it (GF_ACTION 0)."),
        ("px4", "GF_ACTION", 2.0, "The autopilot enforces it (GF_ACTION 2)."),
    ],
)
def test_the_answer_says_whether_the_fence_is_enforced_as_it_is_now(
    autopilot: str, name: str, value: float, sentence: str
) -> None:
    flight = flight_of(autopilot)
    parameters = flight.simulation.vehicles[0].parameters
    if name == "FENCE_TYPE":
        parameters.set("FENCE_ENABLE", 1.0)
    parameters.set(name, value)  # by somebody else: no PARAM_VALUE comes of it
    answer = write(flight, square(100.0), GeoArea((place(0.0, 50.0),), 5.0, False))
    assert answer.success, answer.message
    assert sentence in answer.message
    again = read(flight, MissionType.FENCE)
    assert again.fence is not None
    assert len(again.fence.areas) == 2
    assert again.in_force == ("does not" not in sentence)


def test_a_goal_outside_is_rejected_as_soon_as_the_fence_is_written() -> None:
    flight = flight_of("px4")
    far = flight.request(60.0, 0.0, 5.0)
    assert flight.check(far) is None
    assert write(flight, square(30.0)).success
    rejection = flight.check(far)
    assert rejection is not None
    assert rejection.code is OutcomeCode.OUTSIDE_FENCE
    assert write(flight).success
    assert flight.check(far) is None


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_an_armed_vehicle_gets_no_fence_that_it_is_outside_of(autopilot: str) -> None:
    flight = flight_of(autopilot)
    elsewhere = square(20.0, north_m=500.0)
    assert write(flight, elsewhere).success, "it stands on the ground, disarmed"
    assert write(flight).success
    flight.fly_up()
    for area in (elsewhere, square(30.0, inclusion=False)):
        answer = write(flight, area)
        assert not answer.success
        assert "would be outside" in answer.message
    assert read(flight, MissionType.FENCE).fence == GeoFence()
    answer = write(flight, square(50.0), elsewhere)
    # Inside one inclusion is enough for a PX4; an ArduPilot wants all (FENCE_OPTIONS).
    assert answer.success == (autopilot == "px4"), answer.message


def test_nothing_is_written_beside_a_goal_and_no_goal_begins_beside_a_writing() -> None:
    flight = flight_of("ardupilot")
    flight.fly_up()
    goal = flight.send(30.0, 0.0, 3.0)
    answer = write(flight, square(100.0))
    assert not answer.success
    assert "A goal is active" in answer.message
    answer = answered(
        flight,
        lambda take: flight.bridge.feature(StorageRequests).write_rally(
            [RallyPoint(place(5.0, 5.0), 10.0)], take, flight.now
        ),
    )
    assert not answer.success
    assert read(flight, MissionType.RALLY).success, "reading is no harm"
    flight.run_to_end(goal)
    answers: list[ListAnswer] = []
    flight.bridge.feature(StorageRequests).write_fence(
        GeoFence((square(100.0),)), answers.append, flight.now
    )
    rejection = flight.check(flight.request(0.0, 0.0, 3.0))
    assert isinstance(rejection, Rejection)
    assert rejection.code is OutcomeCode.BUSY
    assert flight.check(LandRequest()) is None, "a landing is never rejected"
    flight.run_until(lambda: bool(answers))
    assert answers[0].success, answers[0].message
    assert flight.check(flight.request(0.0, 0.0, 3.0)) is None


def test_parameters_are_not_changed_while_armed_unless_that_is_asked_for() -> None:
    flight = flight_of("ardupilot")
    flight.fly_up()
    before = flight.simulation.vehicles[0].parameters["WPNAV_SPEED"]
    answer = change(flight, {"WPNAV_SPEED": before + 50.0})
    assert not answer.success
    assert "the vehicle is armed" in answer.message
    assert flight.simulation.vehicles[0].parameters["WPNAV_SPEED"] == before
    answer = change(flight, {"WPNAV_SPEED": before + 50.0}, while_armed=True)
    assert answer.success, answer.message
    assert flight.simulation.vehicles[0].parameters["WPNAV_SPEED"] == before + 50.0
    assert any("WPNAV_SPEED" in line.text for line in flight.all(LogLine))


def test_arming_ends_the_changes_and_names_what_was_not_done() -> None:
    flight = flight_of("ardupilot", LinkFaults(delay_s=0.2))
    parameters = flight.simulation.vehicles[0].parameters
    names = [name for name in parameters.names() if name.startswith(("FENCE", "WPNAV", "RTL"))]
    wanted = {name: parameters[name] + 1.0 for name in names}
    answers: list[ParametersAnswer] = []
    flight.bridge.feature(StorageRequests).change_parameters(
        wanted, False, answers.append, flight.now
    )
    flight.run_until(lambda: parameters[names[1]] == wanted[names[1]], 30.0)
    flight.vehicle.arm(flight.now)
    flight.run_until(lambda: bool(answers), 30.0)
    (answer,) = answers
    assert not answer.success
    assert "the vehicle is armed" in answer.message
    assert [outcome.name for outcome in answer.outcomes] == list(wanted)
    changed = [o.name for o in answer.outcomes if o.change is ParameterChange.CHANGED]
    assert 0 < len(changed) < len(wanted)
    assert [name for name in wanted if parameters[name] == wanted[name]] == changed


def test_the_server_sets_no_parameter_and_writes_no_list_by_itself() -> None:
    flight = flight_of("px4")
    flight.fly_up()
    assert read(flight, MissionType.FENCE).success
    answers: list[ParametersAnswer] = []
    flight.bridge.feature(StorageRequests).list_parameters(answers.append, flight.now)
    flight.run_until(lambda: bool(answers))
    names = {message.get_type() for _, message in flight.sent}
    assert not names & {"PARAM_SET", "MISSION_COUNT", "MISSION_CLEAR_ALL"}
