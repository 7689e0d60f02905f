"""Requests for logs at the bridge: what ends them, and what rejects them."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.events import StoredLog
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.requests.log_requests import (
    LogBytes,
    LogOutput,
    LogRequestDone,
    LogRequests,
    LogsFound,
)
from navigation_core.outcomes import OutcomeCode, Rejection
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


def logged(autopilot: str) -> SimulatedFlight:
    """A vehicle with one log, longer than what is sent in a second."""
    flight = SimulatedFlight(simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0))
    flight.ready()
    copter = flight.simulation.vehicles[0]
    copter.firmware.arm(force=True)
    flight.run_for(2.0)
    copter.firmware.disarm(force=True)
    flight.run_until(lambda: not flight.vehicle.state.armed)
    copter.logbook.logs[0].data += bytes(300_000)
    return flight


Answers = list[LogOutput]


def logs_of(flight: SimulatedFlight) -> LogRequests:
    return flight.bridge.feature(LogRequests)


def listing(flight: SimulatedFlight) -> Answers:
    answers: Answers = []
    logs_of(flight).list_logs(answers.append, flight.now)
    return answers


def done(flight: SimulatedFlight, answers: Answers) -> LogRequestDone:
    flight.run_until(lambda: any(isinstance(answer, LogRequestDone) for answer in answers), 30.0)
    (end,) = [answer for answer in answers if isinstance(answer, LogRequestDone)]
    return end


def found(flight: SimulatedFlight) -> LogsFound:
    answers = listing(flight)
    assert done(flight, answers).code is OutcomeCode.SUCCESS
    (listed,) = [answer for answer in answers if isinstance(answer, LogsFound)]
    return listed


def downloading(autopilot: str) -> tuple[SimulatedFlight, Answers]:
    flight = logged(autopilot)
    log = found(flight).newest
    assert log is not None
    answers: Answers = []
    logs_of(flight).download(log, 0, answers.append, flight.now)
    flight.run_until(lambda: bool(answers), 5.0)
    assert isinstance(answers[0], LogBytes)
    return flight, answers


@pytest.mark.parametrize(("autopilot", "suffix"), [("ardupilot", ".bin"), ("px4", ".ulg")])
def test_the_newest_log_and_its_format_are_reported(autopilot: str, suffix: str) -> None:
    listed = found(logged(autopilot))
    assert listed.newest is not None
    assert listed.newest in listed.logs
    assert (listed.system_id, listed.suffix) == (1, suffix)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_goal_ends_a_download_before_it_arms(autopilot: str) -> None:
    flight, answers = downloading(autopilot)
    flight.send(5.0, 0.0, 5.0)
    end = done(flight, answers)
    assert (end.code, end.message) == (OutcomeCode.PREEMPTED, "A goal was started.")
    flight.run_until(lambda: flight.vehicle.state.armed, 30.0)
    names = [message.get_type() for _, message in flight.sent]
    assert "LOG_REQUEST_DATA" not in names[names.index("LOG_REQUEST_END") :]
    armed = [
        place
        for place, (_, message) in enumerate(flight.sent)
        if message.get_type() == "COMMAND_LONG" and message.command == 400
    ]
    assert names.index("LOG_REQUEST_END") < armed[0]
    # The flight is logged.
    flight.run_for(3.0)
    assert len(flight.simulation.vehicles[0].logbook.logs) == 2


@pytest.mark.parametrize("service", [Service.ARM, Service.HOLD])
def test_a_service_that_commands_ends_a_download(service: Service) -> None:
    flight, answers = downloading("ardupilot")
    flight.bridge.services.serve(9, service, flight.now)
    assert done(flight, answers).code is OutcomeCode.PREEMPTED


def test_a_request_is_rejected_while_it_would_disturb() -> None:
    flight, answers = downloading("ardupilot")
    others = listing(flight)
    assert done(flight, others).code is OutcomeCode.BUSY
    logs_of(flight).stop(others.append)  # not the one under way
    logs_of(flight).stop(answers.append)
    end = done(flight, answers)
    assert (end.code, end.message) == (OutcomeCode.CANCELED, "The download was canceled.")

    flight.send(5.0, 0.0, 5.0)
    assert done(flight, listing(flight)).message.startswith("A goal is active")
    flight.bridge.goals.shut_down(flight.now)

    flight = logged("px4")
    flight.simulation.vehicles[0].firmware.arm(force=True)
    flight.run_until(lambda: flight.vehicle.state.armed)
    answers = []
    logs_of(flight).download(StoredLog(0, 100, 0), 0, answers.append, flight.now)
    assert done(flight, answers).message.startswith("The vehicle is armed;")

    flight.bridge.refuse(Rejection(OutcomeCode.NO_VEHICLE, "a recording"))
    assert done(flight, listing(flight)).message == "a recording"


def test_without_a_vehicle_nothing_is_asked() -> None:
    flight = SimulatedFlight()
    assert done(flight, listing(flight)).code is OutcomeCode.NO_VEHICLE
