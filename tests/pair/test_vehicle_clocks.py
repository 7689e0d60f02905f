"""Goals of vehicles whose time since boot is wrong in every message: nothing hangs on it."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.goal import LogLine
from navigation_bridge.goals.requests import LandRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.messages.vehicle_clocks import CLOCKS, Clock, OtherClock, backward

pytestmark = pytest.mark.wide_but_first

# Of a report that blames a clock on the server, the link or the receiver.
_BLAMED = ("late", "old when it is read", "in doubt", "restarted", "stood still")


def flight_by(autopilot: str, clock: Clock) -> SimulatedFlight:
    flight = SimulatedFlight(simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0))
    flight.codec = OtherClock(flight, clock)
    flight.ready().run_for(5.0)
    return flight


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("name", CLOCKS)
def test_a_goal_does_not_hang_on_the_time_since_boot(name: str, autopilot: str) -> None:
    flight = flight_by(autopilot, CLOCKS[name])
    for request in (flight.request(15.0, 5.0, 6.0, speed=4.0), LandRequest()):
        end = flight.run_to_end(flight.start(request))
        assert end.code is OutcomeCode.SUCCESS, end.message
    assert flight.vehicle.state.boot_count == 0
    texts = [output.text for output in flight.all(LogLine)]
    assert [text for text in texts for word in _BLAMED if word in text] == []


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_clock_that_runs_backward_gives_no_fresh_position(autopilot: str) -> None:
    """Each message looks older than the one before: a goal is rejected, or is flown."""
    flight = flight_by(autopilot, backward)
    request = flight.request(15.0, 5.0, 6.0, speed=4.0)
    rejection = flight.check(request)
    if rejection is not None:
        assert rejection.code is OutcomeCode.NO_POSITION, rejection.message
        return
    end = flight.run_to_end(flight.start(request))
    assert end.code in (OutcomeCode.SUCCESS, OutcomeCode.NO_POSITION), end.message
    if end.code is OutcomeCode.SUCCESS:
        (east_m, north_m, _), _ = flight.truth()
        assert abs(east_m - 15.0) + abs(north_m - 5.0) < 3.0
