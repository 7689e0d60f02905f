"""Goals over a link that loses, delays and repeats; and goals among everything at once."""

from __future__ import annotations

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavlink_sitl import LinkFaults
from navigation_bridge.goals.goal import GoalHappened
from navigation_bridge.goals.lifecycle import TERMINAL_STATES
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


FAULTS = {
    "loss 20 %": LinkFaults(loss=0.2),
    "delay 500 ms": LinkFaults(delay_s=0.5),
    "duplicates": LinkFaults(duplicate=0.5),
    "reordering": LinkFaults(jitter_s=0.1),
    "all of it": LinkFaults(loss=0.2, delay_s=0.5, duplicate=0.3, jitter_s=0.05),
}


def ready_over(faults: LinkFaults) -> SimulatedFlight:
    flight = SimulatedFlight()
    flight.simulation.link.set_faults(faults)
    flight.ready()
    flight.run_for(5.0)
    return flight


@pytest.mark.parametrize("faults", FAULTS.values(), ids=FAULTS.keys())
def test_a_goal_is_flown_over_a_bad_link(faults: LinkFaults) -> None:
    flight = ready_over(faults)
    end = flight.run_to_end(flight.send(10.0, 5.0, 2.0), 180.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert math.dist(flight.truth()[0], (10.0, 5.0, 2.0)) < 1.0


@pytest.mark.parametrize("faults", FAULTS.values(), ids=FAULTS.keys())
def test_a_cancel_over_a_bad_link_stops_the_vehicle(faults: LinkFaults) -> None:
    flight = ready_over(faults)
    goal = flight.send(60.0, 0.0, 3.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(3.0)
    assert flight.bridge.goals.cancel(goal, flight.now)
    end = flight.run_to_end(goal, 30.0)
    assert end.code is OutcomeCode.CANCELED, end.message
    flight.run_for(1.5)
    assert flight.truth()[1] < 0.3


ACTIONS = ("send", "cancel", "pilot", "cut", "join", "lose_gps", "restore_gps", "restart", "wait")
STEPS = st.lists(
    st.tuples(st.sampled_from(ACTIONS), st.floats(0.05, 6.0), st.integers(0, 2**16)),
    min_size=1,
    max_size=10,
)


@pytest.mark.night
@given(STEPS)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_every_accepted_goal_ends_exactly_once_whatever_happens(
    steps: list[tuple[str, float, int]],
) -> None:
    flight = SimulatedFlight().ready()
    flight.run_for(3.0)
    goals: list[str] = []
    for action, seconds, number in steps:
        _act(flight, goals, action, number)
        flight.run_for(seconds)
    flight.link_up = True
    flight.simulation.vehicles[0].restore_gps()
    flight.run_until(lambda: all(flight.ends(goal) for goal in goals), 240.0)
    flight.run_for(3.0)
    for goal in goals:
        (end,) = flight.ends(goal)
        assert end.state in TERMINAL_STATES
        assert end.message.startswith(f"{end.code.value}: ")
        told = [item for _, item in flight.outputs if getattr(item, "goal_id", "") == goal]
        after = told[told.index(end) + 1 :]
        assert [item.event for item in after if isinstance(item, GoalHappened)] == ["ENDED"]
        assert len(after) == 1  # nothing else follows the end
    assert flight.bridge.goals.active_id is None


def _act(flight: SimulatedFlight, goals: list[str], action: str, number: int) -> None:
    vehicle = flight.simulation.vehicles[0]
    if action == "send":
        x, y, z = number % 31 - 15, (number // 31) % 31 - 15, 2 + number % 4
        if flight.check(flight.request(x, y, z)) is None:
            goals.append(flight.send(x, y, z))
    elif action == "cancel" and goals:
        flight.bridge.goals.cancel(goals[-1], flight.now)
    elif action == "pilot":
        vehicle.pilot_mode_change(("LOITER", "LAND", "RTL", "BRAKE")[number % 4])
    elif action in ("cut", "join"):
        flight.link_up = action == "join"
    elif action == "lose_gps":
        vehicle.lose_gps()
    elif action == "restore_gps":
        vehicle.restore_gps()
    elif action == "restart":
        vehicle.power_cycle()
