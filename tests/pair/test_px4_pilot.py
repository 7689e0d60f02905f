"""A pilot at the sticks of a PX4; and a take-off that a pilot ends, of copters and planes."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import mavlink
from navigation_bridge.goals.goal import GoalFinished
from navigation_bridge.goals.requests import (
    LandRequest,
    Request,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first

ASKS = {
    mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
}  # fmt: skip
STICKS_S = 0.1
ROUTE = WaypointsRequest(
    tuple(WaypointRequest(place) for place in ((30.0, 0.0, 5.0), (30.0, 20.0, 5.0))),
    by_mission=True,
)


class PilotedFlight(SimulatedFlight):
    """A flight of a PX4 whose pilot holds the sticks.

    Attributes:
        forward: where the stick is; None while the radio is lost.
    """

    def __init__(self, **parameters: float) -> None:
        self.forward: float | None = 0.0
        self._sticks_s = 0.0
        simulated = VehicleConfig(autopilot="px4", ready_after_s=1.0, parameters=parameters)
        super().__init__(simulated=simulated)

    def tick(self) -> None:
        if self.forward is not None and self.now >= self._sticks_s:
            self._sticks_s = self.now + STICKS_S
            self.simulation.vehicles[0].hold_sticks(self.forward)
        super().tick()

    @property
    def true_mode(self) -> str:
        """The vehicle's mode."""
        return str(self.simulation.vehicles[0].firmware.mode.spec.name)


def piloted(**parameters: float) -> PilotedFlight:
    """Return a flight that is ready for goals."""
    flight = PilotedFlight(**parameters)
    flight.ready()
    return flight


def asked(flight: SimulatedFlight, since_s: float) -> list[int]:
    """Return the commands since a time that change mode or motors."""
    commands = [m for t, m in flight.sent if t > since_s and m.get_type() == "COMMAND_LONG"]
    return [message.command for message in commands if message.command in ASKS]


def left_alone(flight: SimulatedFlight, goal_id: str, since_s: float) -> GoalFinished:
    """Return the end of a goal after which nothing was asked of the vehicle."""
    end = flight.run_to_end(goal_id)
    flight.run_for(5.0)
    assert not asked(flight, since_s)
    return end


def moves_the_stick(flight: PilotedFlight) -> None:
    flight.forward = 0.6


def holds(flight: PilotedFlight) -> None:
    flight.set_mode_as_pilot("AUTO.LOITER")


GOALS: dict[str, Callable[[PilotedFlight], str]] = {
    "Navigate": lambda flight: flight.send(40.0, 0.0, 6.0),
    "Land": lambda flight: begun(flight, LandRequest()),
    "ReturnToLaunch": lambda flight: begun(flight, ReturnRequest()),
    "mission": lambda flight: begun(flight, ROUTE),
}


def begun(flight: PilotedFlight, request: Request) -> str:
    flight.fly_up()
    return flight.start(request)


@pytest.mark.parametrize("goal", GOALS)
def test_a_stick_that_is_moved_takes_the_vehicle(goal: str) -> None:
    flight = piloted(COM_RC_OVERRIDE=3.0)
    goal_id = GOALS[goal](flight)
    flight.run_until(lambda: flight.status(goal_id) in ("NAVIGATING", "LANDING", "RETURNING"))
    flight.run_for(2.0)
    assert not flight.ends(goal_id), "sticks in the middle take nothing"
    moves_the_stick(flight)
    end = left_alone(flight, goal_id, flight.now)
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message
    assert flight.true_mode == "POSCTL"


def test_a_stick_takes_nothing_from_offboard_by_default() -> None:
    flight = piloted()
    goal_id = flight.send(20.0, 0.0, 4.0)
    flight.run_to_status(goal_id, "NAVIGATING")
    moves_the_stick(flight)
    assert flight.run_to_end(goal_id).code is OutcomeCode.SUCCESS


@pytest.mark.parametrize("later_s", [0.3, 2.0, 6.0])
@pytest.mark.parametrize("takes", [holds, moves_the_stick])
def test_a_take_off_that_the_pilot_ends_is_left_to_the_pilot(
    takes: Callable[[PilotedFlight], None], later_s: float
) -> None:
    """AUTO.LOITER is the mode, too, in which a PX4 ends its take-off by itself."""
    flight = piloted()
    goal_id = flight.start(TakeoffRequest(8.0))
    flight.run_to_status(goal_id, "TAKING_OFF")
    flight.run_for(later_s)
    takes(flight)
    end = left_alone(flight, goal_id, flight.now)
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message


@pytest.mark.parametrize("later_s", [1.0, 4.0])
@pytest.mark.parametrize(("autopilot", "mode"), [("px4", "AUTO.LOITER"), ("ardupilot", "LOITER")])
def test_a_take_off_of_a_plane_that_the_pilot_ends_is_left_to_the_pilot(
    autopilot: str, mode: str, later_s: float
) -> None:
    own = {"MIS_TKO_LAND_REQ": 0.0} if autopilot == "px4" else {}
    plane = VehicleConfig(vehicle="plane", autopilot=autopilot, ready_after_s=1.0, parameters=own)
    flight = SimulatedFlight(simulated=plane, volume_radius_m=3000.0).ready()
    goal_id = flight.start(TakeoffRequest(50.0))
    flight.run_to_status(goal_id, "TAKING_OFF")
    flight.run_for(later_s)
    flight.set_mode_as_pilot(mode)
    end = left_alone(flight, goal_id, flight.now)
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message


def test_a_pilot_who_has_it_hold_while_control_is_taken_is_a_pilot() -> None:
    """AUTO.LOITER is neither the mode that was asked for nor the one of before."""
    flight = piloted()
    flight.fly_up()
    flight.set_mode_as_pilot("POSCTL")
    flight.run_for(1.0)
    goal_id = flight.send(40.0, 0.0, 6.0)
    flight.set_mode_as_pilot("AUTO.LOITER")
    end = flight.run_to_end(goal_id)
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message
    assert flight.true_mode == "AUTO.LOITER"
    assert not asked(flight, flight.now - 2.0)


@pytest.mark.parametrize("request_", [TakeoffRequest(8.0), ROUTE], ids=["Takeoff", "mission"])
def test_sticks_that_are_lost_in_a_take_off_are_a_failsafe(request_: Request) -> None:
    flight = piloted()
    goal_id = flight.start(request_)
    flight.run_to_status(goal_id, "TAKING_OFF")
    flight.forward = None
    end = left_alone(flight, goal_id, flight.now)
    assert end.code is OutcomeCode.FAILSAFE_RC, end.message


def test_a_take_off_that_is_stopped_goes_back_to_the_pilots_mode() -> None:
    """Disarmed, a PX4 is in the mode of before: the pilot has not chosen that now."""
    flight = piloted()
    assert flight.true_mode == "POSCTL"
    goal_id = flight.start(TakeoffRequest(8.0))
    flight.run_to_status(goal_id, "TAKING_OFF")
    flight.simulation.vehicles[0].set_battery_remaining(0.05)
    end = flight.run_to_end(goal_id)
    assert flight.true_mode == "POSCTL"
    assert end.code is OutcomeCode.LOW_BATTERY, end.message
