"""A pilot, a ground station and a restart within two seconds of each other: which ends the goal.

A ground station's command is seen at once, a pilot's mode with the next HEARTBEAT, a restart when
the time since boot goes back. Whatever the order, the goal ends once, for one of them, and nothing
that moves the vehicle is sent afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from tests.support.flights.station_flight import StationFlight

ACTS: dict[str, Callable[[StationFlight], None]] = {
    "pilot": lambda flight: flight.set_mode_as_pilot("ALT_HOLD"),
    "pause": lambda flight: flight.hold_mode(),
    "clear": lambda flight: flight.clear(),
    "restart": lambda flight: flight.simulation.vehicles[0].power_cycle(),
}
ORDERS = (
    (("pilot", "pause", "restart"), 0.2, "PILOT_OVERRIDE"),
    (("pilot", "pause", "restart"), 0.6, "PILOT_OVERRIDE"),
    (("pilot", "restart", "pause"), 0.2, "PILOT_OVERRIDE"),
    (("pilot", "restart", "pause"), 0.6, "PILOT_OVERRIDE"),
    (("pause", "pilot", "restart"), 0.2, "CANCELED"),
    (("pause", "pilot", "restart"), 0.6, "CANCELED"),
    (("pause", "restart", "pilot"), 0.2, "VEHICLE_REBOOTED"),
    (("pause", "restart", "pilot"), 0.6, "VEHICLE_REBOOTED"),
    (("restart", "pilot", "pause"), 0.2, "VEHICLE_REBOOTED"),
    (("restart", "pilot", "pause"), 0.6, "VEHICLE_REBOOTED"),
    (("restart", "pause", "pilot"), 0.6, "VEHICLE_REBOOTED"),
    (("clear", "pilot"), 0.6, "CANCELED"),
    (("pilot", "clear"), 0.6, "PILOT_OVERRIDE"),
    (("clear", "restart"), 0.6, "VEHICLE_REBOOTED"),
)


@pytest.mark.parametrize("by_mission", [False, True])
@pytest.mark.parametrize(("acts", "gap_s", "code"), ORDERS)
def test_one_of_them_ends_the_goal_and_nothing_moves_the_vehicle_afterwards(
    acts: Sequence[str], gap_s: float, code: str, by_mission: bool
) -> None:
    flight = StationFlight("ardupilot", "copter")
    goal_id = flight.begin(by_mission)
    for act in acts:
        ACTS[act](flight)
        flight.run_for(gap_s)
    end = flight.run_to_end(goal_id, 20.0)
    ended_s = next(time_s for time_s, output in flight.outputs if output is end)
    assert end.code.value == code, end.message
    assert flight.setpoint_times(ended_s) == []
    assert flight.modes_asked(ended_s) == []
