"""Texts are for people: a flight is the same whatever the vehicle's events say in words."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import pytest

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.goals.goal import Annotation, GoalFeedback, GoalFinished, LogLine
from tests.support.flights.station_flight import StationFlight

pytestmark = pytest.mark.wide


TEXTS = {"how", "text"}
"""The fields of the event classes that are for people."""


def paused_and_resumed(flight: StationFlight) -> None:
    goal_id = flight.begin(False, far_m=50.0)
    flight.pause_or_continue(False)
    flight.run_for(3.0)
    flight.pause_or_continue(True)
    flight.run_for(3.0)
    flight.hold_mode()
    flight.run_for(3.0)
    flight.working_mode()
    flight.run_for(3.0)
    flight.reposition_nowhere()
    flight.run_for(3.0)
    flight.command(mavlink.MAV_CMD_MISSION_START, 0.0)
    flight.run_for(3.0)
    flight.bridge.goals.cancel(goal_id, flight.now)
    flight.run_for(10.0)


def sent_elsewhere(flight: StationFlight) -> None:
    flight.begin(False)
    flight.hold_mode()
    flight.run_for(0.6)
    flight.reposition(-35.3600, 149.1652, 700.0)
    flight.run_for(5.0)


def mission_cleared(flight: StationFlight) -> None:
    flight.begin(True)
    flight.clear()
    flight.run_for(10.0)


FLIGHTS = [paused_and_resumed, sent_elsewhere, mission_cleared]


def course(flown: Callable[[StationFlight], None], autopilot: str) -> list[object]:
    """Fly, and return all that was done and told, without its words."""
    flight = StationFlight(autopilot, "copter", on_station_pause="pause")
    flown(flight)
    told: list[object] = []
    for time_s, output in flight.outputs:
        if isinstance(output, GoalFinished):
            told.append((time_s, output.code, output.state))
        elif isinstance(output, GoalFeedback):
            told.append((time_s, output.status))
        elif not isinstance(output, Annotation | LogLine):
            told.append((time_s, type(output).__name__))
    return [*told, flight.truth()]


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("flown", FLIGHTS)
def test_a_flight_is_the_same_with_other_texts(
    flown: Callable[[StationFlight], None], autopilot: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    as_it_is = course(flown, autopilot)
    next_event, changed = Vehicle.next_event, []

    def with_other_texts(vehicle: Vehicle) -> VehicleEvent | None:
        event = next_event(vehicle)
        texts = {} if event is None else {field.name for field in dataclasses.fields(event)} & TEXTS
        if event is None or not texts:
            return event
        changed.append(event)
        others: dict[str, Any] = dict.fromkeys(texts, "Lorem ipsum")
        return dataclasses.replace(event, **others)

    monkeypatch.setattr(Vehicle, "next_event", with_other_texts)
    assert course(flown, autopilot) == as_it_is
    assert any(type(event).__name__ == "StationActed" for event in changed)
