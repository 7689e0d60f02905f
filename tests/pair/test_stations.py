"""What a ground station does to the vehicle while a goal is flown: one table for all vehicles."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from drone_navigation.goal import CancelWanted
from drone_navigation.lifecycle import GoalState
from tests.support.station_flight import StationFlight

VEHICLES = [
    (autopilot, vehicle)
    for autopilot in ("ardupilot", "px4")
    for vehicle in ("copter", "rover", "boat", "plane")
]
GOALS = [pytest.param(False, id="setpoints"), pytest.param(True, id="mission")]
_Act = Callable[[StationFlight], None]
ACTS: dict[str, _Act] = {
    "cleared": StationFlight.clear,
    "DO_PAUSE_CONTINUE": lambda flight: flight.pause_or_continue(False),
    "DO_REPOSITION": StationFlight.reposition_nowhere,
    "DO_SET_MODE": StationFlight.hold_mode,
}


def check_cancelled(flight: StationFlight, goal_id: str, words: str) -> None:
    """It ends CANCELED, names who did it and how, after the measured stop, nothing is left."""
    flight.run_until(lambda: bool(flight.ends(goal_id)), 30.0)
    speed_m_s = flight.truth()[1]
    end = flight.run_to_end(goal_id)
    assert end.state is GoalState.CANCELED, end.message
    assert end.message.startswith("CANCELED: ")
    assert words in end.message
    if flight.kind == "boat":
        # It glides; and PX4 has no law for boats, so that one circles about where it holds.
        assert speed_m_s < 0.4 or flight.vehicle.mode_name in ("HOLD", "AUTO.LOITER")
    elif flight.hovers:
        assert speed_m_s < 0.4
        assert "had not stopped" not in end.message
    assert CancelWanted(goal_id) in [output for _, output in flight.outputs]


@pytest.mark.parametrize("by_mission", GOALS)
@pytest.mark.parametrize(("autopilot", "vehicle"), VEHICLES)
def test_whatever_stops_a_vehicle_cancels_its_goal_and_the_next_goal_flies(
    autopilot: str, vehicle: str, by_mission: bool
) -> None:
    flight = StationFlight(autopilot, vehicle)
    for name, act in ACTS.items():
        goal_id = flight.begin(by_mission)
        act(flight)
        check_cancelled(flight, goal_id, "Station 255/190")
        assert (name in flight.ends(goal_id)[0].message) or name == "cleared"
        assert flight.stored == 0
    if by_mission:
        goal_id = flight.begin(by_mission)
        flight.upload(4)
        check_cancelled(flight, goal_id, "Station 255/190 uploaded another mission")
        flight.run_for(1.0)
        # Home does not count.
        assert flight.stored == (3 if autopilot == "ardupilot" else 4), "theirs is left"


@pytest.mark.parametrize(("autopilot", "vehicle"), VEHICLES)
def test_a_mission_changed_by_a_station_that_is_not_seen_cancels_the_goal(
    autopilot: str, vehicle: str
) -> None:
    flight = StationFlight(autopilot, vehicle)
    goal_id = flight.begin(True)
    if autopilot == "px4":
        flight.clear(seen=False)
    else:
        flight.upload(4, seen=False)
    check_cancelled(flight, goal_id, "A station that was not seen")
