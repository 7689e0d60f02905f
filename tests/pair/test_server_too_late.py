"""A server that runs late, or hangs, while the vehicle has to be asked for something.

A vehicle has not rejected a request that it never got: the server tries again, and ends a goal
with SERVER_LATE when that does not help.
"""

from __future__ import annotations

from collections import deque

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.requests import LandRequest, Request, TakeoffRequest
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


FIRMWARES = ("px4", "ardupilot")
SPEED_M_S = 3.0
BLAMES_THE_VEHICLE = ("MODE_REFUSED", "ARMING_REFUSED", "TAKEOFF_REFUSED", "TIMEOUT", "LINK_LOST")


def in_the_air(autopilot: str) -> SimulatedFlight:
    flight = SimulatedFlight(simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0))
    flight.ready()
    flight.fly_up()
    flight.set_mode_as_pilot({"px4": "AUTO.LOITER", "ardupilot": "BRAKE"}[autopilot])
    flight.run_for(2.5)
    return flight


def run_late(flight: SimulatedFlight, late_s: float, for_s: float) -> None:
    """Let the server take its turns late, one after the other."""
    end_s = flight.now + for_s
    while flight.now < end_s:
        flight.stall(late_s)
        flight.tick()


@pytest.mark.parametrize("late_s", [0.8, 0.55, 0.65])
def test_a_late_server_takes_control_once_it_is_in_time_again(late_s: float) -> None:
    flight = in_the_air("px4")
    goal_id = flight.send(10.0, 0.0, 3.0)
    run_late(flight, late_s, 5.0)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message


@pytest.mark.parametrize("late_s", [0.8, 0.55, 0.65])
def test_a_server_that_stays_late_says_so_and_does_not_blame_the_vehicle(late_s: float) -> None:
    flight = in_the_air("px4")
    goal_id = flight.send(10.0, 0.0, 3.0)
    run_late(flight, late_s, 25.0)
    (end,) = flight.ends(goal_id)
    assert end.code.value == "SERVER_LATE", end.message
    assert "rejected" not in end.message
    assert flight.vehicle.mode_name == "AUTO.LOITER"


@pytest.mark.night
@pytest.mark.wide
def test_a_server_that_stands_still_again_and_again_comes_to_an_end() -> None:
    """Each gap is long enough to be excused, but not all of them together."""
    flight = in_the_air("px4")
    goal_id = flight.send(10.0, 0.0, 3.0)
    run_late(flight, 1.4, 120.0)
    (end,) = flight.ends(goal_id)
    assert end.code.value in ("SERVER_LATE", "FAILSAFE_OFFBOARD"), end.message


@pytest.mark.night
@pytest.mark.wide
@pytest.mark.parametrize("stall_s", [1.0, 12.0, 30.0])
@pytest.mark.parametrize("autopilot", FIRMWARES)
@pytest.mark.parametrize("asked", [TakeoffRequest(5.0), LandRequest()])
def test_a_hang_is_not_held_against_the_vehicle(
    asked: Request, autopilot: str, stall_s: float
) -> None:
    """In every phase: a vehicle that is left alone on the ground disarms itself."""
    for begun_s in (0.0, 0.05, 0.3, 0.6, 1.0, 1.5):
        if isinstance(asked, TakeoffRequest):
            simulated = VehicleConfig(autopilot=autopilot, ready_after_s=1.0)
            flight = SimulatedFlight(simulated=simulated).ready()
        else:
            flight = in_the_air(autopilot)
        goal_id = flight.start(asked)
        flight.run_for(begun_s)
        flight.stall(stall_s)
        end = flight.run_to_end(goal_id, 150.0)
        assert end.code.value not in BLAMES_THE_VEHICLE, (begun_s, end.message)


class StarvedFlight(SimulatedFlight):
    """A flight whose server reads less than comes, in order, as from a full receive buffer."""

    def __init__(self, autopilot: str) -> None:
        super().__init__(simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0))
        self.waiting: deque[bytes] = deque()
        self.read_share = 1.0
        self._room = 0.0
        read = self.simulation.link.read_datagrams

        def read_some() -> list[bytes]:
            came = read()
            self.waiting.extend(came)
            self._room = min(self._room + self.read_share * len(came), len(self.waiting))
            if self.read_share == 1.0:
                self._room = len(self.waiting)
            count = int(self._room)
            self._room -= count
            return [self.waiting.popleft() for _ in range(count)]

        self.simulation.link.read_datagrams = read_some  # type: ignore[method-assign]


@pytest.mark.night
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", FIRMWARES)
def test_data_that_is_old_when_it_is_read_slows_and_stops_the_vehicle(autopilot: str) -> None:
    """The control loop is in time; its data is seconds old."""
    flight = StarvedFlight(autopilot)
    flight.ready()
    flight.fly_up()
    goal_id = flight.start(flight.request(0.0, 90.0, 5.0, speed=SPEED_M_S))
    flight.run_for(10.0)
    assert flight.truth()[1] > 0.9 * SPEED_M_S
    assert flight.feedback(goal_id)[-1].late_s < 0.2
    flight.read_share = 0.8
    flight.run_for(4.0)
    assert 0.25 < flight.feedback(goal_id)[-1].late_s < 1.1
    flight.run_for(7.0)
    assert max(item.late_s for item in flight.feedback(goal_id)) > 1.0
    assert flight.truth()[1] < 0.3
    assert any("data is" in line.text for line in flight.log_lines())
    flight.run_for(8.0)
    (end,) = flight.ends(goal_id)
    assert end.code.value == "SERVER_LATE", end.message
    flight.read_share = 1.0
    flight.run_for(4.0)
    end = flight.run_to_end(flight.send(0.0, 5.0, 5.0))
    assert end.code.value == "SUCCESS", end.message
