"""Names of clients in the events of their goals and in the recording."""

from __future__ import annotations

from navigation_bridge.goals.goal import Annotation, GoalHappened
from navigation_bridge.requests.goal_origins import ORIGIN_MAX, GoalOrigins
from tests.support.flights.simulated_flight import SimulatedFlight


def sent_by(flight: SimulatedFlight, goal_id: str) -> list[str]:
    found = [each for each in flight.all(GoalHappened) if each.goal_id == goal_id]
    return [each.message for each in found if each.message.startswith("Sent by")]


def test_the_active_goal_is_named_once_and_no_other_is() -> None:
    flight = SimulatedFlight().ready()
    origins = flight.bridge.feature(GoalOrigins)
    first = flight.send(10.0, 0.0, 3.0)
    origins.name("f" * 32, "another goal")
    origins.name(first, "planner")
    origins.name(first, "somebody else")
    flight.run_for(1.0)
    assert sent_by(flight, first) == ["Sent by planner."]
    noted = "".join(getattr(each.message, "text", "") for each in flight.all(Annotation))
    assert "Sent by planner." in noted

    # A client's text stays on one line of the log, and is cut to a length.
    second = flight.send(0.0, 0.0, 3.0)
    origins.name(first, "too late")
    origins.name(second, "a\nb\x1b[2J\u00e9" + "x" * 1000)
    flight.run_for(1.0)
    (text,) = sent_by(flight, second)
    assert text.startswith("Sent by a?b?[2J?xxx")
    assert len(text) == len("Sent by .") + ORIGIN_MAX
    flight.run_to_end(second)
    assert not sent_by(flight, "")
