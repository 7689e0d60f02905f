"""Acts of a ground station during a goal: one table for all vehicles."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from navigation_bridge.goals.goal import CancelWanted
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.goals.requests import LandRequest, ReturnRequest
from tests.support.flights.station_flight import StationFlight

pytestmark = pytest.mark.wide


VEHICLES = [
    (autopilot, vehicle)
    for autopilot in ("ardupilot", "px4")
    for vehicle in ("copter", "rover", "boat", "plane")
]
KINDS = [kind for kind in VEHICLES if kind[1] != "boat"]
"""Boats are rovers to all that follows."""
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
    wanted = [output for _, output in flight.outputs if isinstance(output, CancelWanted)]
    assert goal_id in [output.goal_id for output in wanted]


@pytest.mark.parametrize("by_mission", GOALS)
@pytest.mark.parametrize(("autopilot", "vehicle"), VEHICLES)
def test_whatever_stops_a_vehicle_cancels_its_goal_and_the_next_goal_flies(
    autopilot: str, vehicle: str, by_mission: bool
) -> None:
    flight = StationFlight(autopilot, vehicle)
    for name, act in ACTS.items():
        goal_id = flight.begin(by_mission)
        act(flight)
        check_cancelled(flight, goal_id, "Ground station 255/190")
        assert (name in flight.ends(goal_id)[0].message) or name == "cleared"
        assert flight.stored == 0
    if by_mission:
        goal_id = flight.begin(by_mission)
        flight.upload(4)
        check_cancelled(flight, goal_id, "Ground station 255/190 uploaded another mission")
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
    check_cancelled(flight, goal_id, "An unknown ground station")


def test_a_pause_in_auto_that_nobody_was_seen_to_ask_for_cancels_the_goal() -> None:
    flight = StationFlight("ardupilot", "copter")
    goal_id = flight.begin(True)
    flight.run_for(5.0)  # a take-off is not paused
    flight.pause_or_continue(False, seen=False)
    check_cancelled(flight, goal_id, "An unknown ground station paused the vehicle")


def test_a_mission_emptied_but_for_home_cancels_a_goal_flown_by_setpoints() -> None:
    """So does MAVSDK clear an ArduPilot's mission."""
    flight = StationFlight("ardupilot", "copter")
    goal_id = flight.begin(False)
    flight.upload(1)
    check_cancelled(flight, goal_id, "Ground station 255/190 cleared the mission (MISSION_COUNT 1)")


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_another_mission_leaves_a_goal_flown_by_setpoints_alone(autopilot: str) -> None:
    flight = StationFlight(autopilot, "copter")
    goal_id = flight.begin(False)
    flight.upload(4)
    assert flight.run_to_end(goal_id).state is GoalState.SUCCEEDED


# --- in which order it is seen ---------------------------------------------------------


@pytest.mark.parametrize("by_mission", GOALS)
@pytest.mark.parametrize(("autopilot", "vehicle"), KINDS)
def test_a_command_that_is_seen_after_the_change_of_mode_is_no_pilots_doing(
    autopilot: str, vehicle: str, by_mission: bool
) -> None:
    flight = StationFlight(autopilot, vehicle)
    goal_id = flight.begin(by_mission)
    begun_s = flight.now
    flight.hold_mode(heard_late_s=0.9)
    check_cancelled(flight, goal_id, "Ground station 255/190 paused the vehicle (DO_SET_MODE")
    profile = flight.vehicle.profile
    assert profile is not None
    retaken = profile.mode_number(profile.control_mode)
    assert profile.hold_mode == profile.control_mode or retaken not in flight.modes_asked(begun_s)


@pytest.mark.parametrize("by_mission", GOALS)
def test_px4_clears_and_loiters_before_the_command_is_seen(by_mission: bool) -> None:
    flight = StationFlight("px4", "copter")
    goal_id = flight.begin(by_mission)
    # A mission is known to be cleared, and the vehicle to stand, before it is heard who did it.
    flight.clear(heard_late_s=1.2 if by_mission else 0.5)
    who = "An unknown ground station" if by_mission else "Ground station 255/190"
    check_cancelled(flight, goal_id, f"{who} cleared the mission")


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_nothing_that_moves_it_is_sent_to_a_vehicle_that_a_station_has_stopped(
    autopilot: str,
) -> None:
    flight = StationFlight(autopilot, "copter")
    goal_id = flight.begin(False)
    flight.hold_mode()
    profile = flight.vehicle.profile
    assert profile is not None
    flight.run_until(lambda: flight.vehicle.mode_name == profile.hold_mode)
    held_s = flight.now
    flight.tick()
    check_cancelled(flight, goal_id, "Ground station 255/190")
    flight.run_for(3.0)
    assert flight.setpoint_times(held_s + 0.05) == []
    assert flight.modes_asked(held_s) == []
    assert flight.vehicle.mode_name == profile.hold_mode


@pytest.mark.parametrize("late_s", [0.0, 0.5])
@pytest.mark.parametrize(("autopilot", "mode"), [("ardupilot", "LOITER"), ("px4", "AUTO.RTL")])
def test_a_mode_that_does_not_only_hold_is_an_override_that_names_who_chose_it(
    autopilot: str, mode: str, late_s: float
) -> None:
    flight = StationFlight(autopilot, "copter")
    goal_id = flight.begin(False)
    flight.mode(mode, heard_late_s=late_s)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "PILOT_OVERRIDE", end.message
    assert f"Ground station 255/190 changed the mode (DO_SET_MODE {mode})" in end.message


def test_a_pilot_who_takes_over_during_a_stations_pause_overrides() -> None:
    flight = StationFlight("ardupilot", "copter", on_station_pause="pause")
    goal_id = flight.begin(False)
    flight.hold_mode()
    flight.run_to_status(goal_id, "PAUSED")
    flight.run_for(5.0)
    flight.set_mode_as_pilot("LOITER")
    end = flight.run_to_end(goal_id)
    assert end.code.value == "PILOT_OVERRIDE", end.message
    assert "Station" not in end.message


def test_a_pilot_who_holds_a_paused_vehicle_overrides_and_is_not_fought() -> None:
    flight = StationFlight("ardupilot", "rover", on_station_pause="pause")
    goal_id = flight.begin(False)
    flight.pause_or_continue(False)  # which rovers do not know: the server stops it
    flight.run_to_status(goal_id, "PAUSED")
    flight.run_for(5.0)
    flight.set_mode_as_pilot("HOLD")
    end = flight.run_to_end(goal_id)
    assert end.code.value == "PILOT_OVERRIDE", end.message


@pytest.mark.parametrize("by_mission", GOALS)
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("status", ["PREPARING", "ARMING", "TAKING_OFF"])
def test_what_does_not_fly_yet_is_cancelled_by_a_pause(
    autopilot: str, by_mission: bool, status: str
) -> None:
    flight = StationFlight(autopilot, "copter", on_station_pause="pause")
    goal_id = flight.start(flight.goal((10.0, 0.0, 4.0), by_mission))
    if status != "PREPARING":
        flight.run_to_status(goal_id, status)
    flight.pause_or_continue(False)
    end = flight.run_to_end(goal_id, 40.0)
    assert end.code.value == "CANCELED", end.message
    assert "Ground station 255/190" in end.message
    flight.run_for(3.0)
    if status != "TAKING_OFF":
        assert not flight.vehicle.state.armed
    flight.run_to_status(flight.send(5.0, 0.0, 4.0), "NAVIGATING")


@pytest.mark.parametrize(
    ("autopilot", "vehicle"), [("ardupilot", "copter"), ("ardupilot", "plane"), ("px4", "plane")]
)
def test_a_vehicle_that_is_sent_elsewhere_in_the_same_mode_is_left_to_the_station(
    autopilot: str, vehicle: str
) -> None:
    flight = StationFlight(autopilot, vehicle)
    goal_id = flight.begin(False)
    flight.reposition(-35.3600, 149.1652, 700.0)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "PILOT_OVERRIDE", end.message
    assert "Ground station 255/190" in end.message
    assert "DO_REPOSITION to a position" in end.message
    north_m = flight.truth()[0][1]
    flight.run_for(20.0)
    assert flight.truth()[0][1] > north_m + 20.0


@pytest.mark.parametrize("by_mission", GOALS)
@pytest.mark.parametrize("pause", ["cancel", "pause"])
@pytest.mark.parametrize(
    ("autopilot", "vehicle"), [("px4", "copter"), ("px4", "rover"), ("ardupilot", "rover")]
)
@pytest.mark.parametrize("after_s", [0.02, 0.6])
def test_a_hold_on_the_way_to_somewhere_else_is_an_override(
    autopilot: str, vehicle: str, pause: str, by_mission: bool, after_s: float
) -> None:
    """MAVSDK's goto_location: the hold mode, and once that is acknowledged DO_REPOSITION."""
    flight = StationFlight(autopilot, vehicle, on_station_pause=pause)
    goal_id = flight.begin(by_mission)
    flight.hold_mode()
    flight.run_for(after_s)
    begun_s = flight.now
    flight.reposition(-35.3600, 149.1652, 700.0 if vehicle == "copter" else 584.0)
    end = flight.run_to_end(goal_id, 3.0)
    assert end.code.value == "PILOT_OVERRIDE", end.message
    assert "Ground station 255/190" in end.message
    assert "DO_REPOSITION to a position" in end.message
    north_m = flight.truth()[0][1]
    flight.run_for(15.0)
    assert flight.truth()[0][1] > north_m + 5.0, "it goes where the station sent it"
    assert flight.setpoint_times(begun_s) == []
    assert flight.modes_asked(begun_s) == []


def test_who_disarms_a_vehicle_is_named() -> None:
    flight = StationFlight("ardupilot", "rover")
    goal_id = flight.begin(False)
    flight.command(400, 0.0, 21196.0)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "DISARMED", end.message
    assert "Ground station 255/190 changed the mode (COMPONENT_ARM_DISARM 0" in end.message


def test_a_server_that_stops_while_a_station_has_the_vehicle_paused_says_so() -> None:
    flight = StationFlight("px4", "copter", on_station_pause="pause")
    goal_id = flight.begin(False)
    flight.hold_mode()
    flight.run_to_status(goal_id, "PAUSED")
    flight.bridge.goals.shut_down(flight.now)
    end = flight.run_to_end(goal_id, 15.0)
    assert end.code.value == "SHUTTING_DOWN", end.message


# --- pause and resume --------------------------------------------------------------------

PAUSES: dict[str, tuple[_Act, _Act]] = {
    "DO_PAUSE_CONTINUE": (
        lambda flight: flight.pause_or_continue(False),
        lambda flight: flight.pause_or_continue(True),
    ),
    "DO_REPOSITION": (
        StationFlight.reposition_nowhere,
        lambda flight: flight.pause_or_continue(True),
    ),
    "DO_SET_MODE": (StationFlight.hold_mode, StationFlight.working_mode),
}


@pytest.mark.parametrize("by_mission", GOALS)
@pytest.mark.parametrize(("autopilot", "vehicle"), KINDS)
def test_a_pause_may_be_a_pause_until_the_station_lets_it_continue(
    autopilot: str, vehicle: str, by_mission: bool
) -> None:
    flight = StationFlight(autopilot, vehicle, on_station_pause="pause")
    goal_id = flight.begin(by_mission, far_m=50.0)
    for name, (pause, go_on) in PAUSES.items():
        pause(flight)
        flight.run_until(lambda: flight.status(goal_id) == "PAUSED", 5.0)
        if flight.hovers:
            flight.run_until(lambda: flight.truth()[1] < 0.3, 10.0)
        flight.run_for(2.0)
        assert not flight.ends(goal_id), (name, flight.ends(goal_id))
        assert flight.status(goal_id) == "PAUSED"
        if (autopilot, vehicle, by_mission) == ("px4", "plane", False):
            flight.pause_or_continue(True)  # its mode is the same, whether it holds or goes on
        else:
            go_on(flight)
        flight.run_until(lambda: flight.status(goal_id) == "NAVIGATING", 15.0)
        flight.run_until(lambda: flight.truth()[1] > 0.5, 15.0)
        flight.run_for(1.0)
        assert flight.status(goal_id) == "NAVIGATING", name
    if vehicle == "copter":
        assert flight.run_to_end(goal_id).code.value == "SUCCESS", flight.ends(goal_id)


@pytest.mark.parametrize("pause", [pytest.param(p, id=n) for n, (p, _) in PAUSES.items()])
@pytest.mark.parametrize("by_mission", GOALS)
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_goal_that_a_station_paused_can_be_cancelled_and_replaced(
    autopilot: str, by_mission: bool, pause: _Act
) -> None:
    flight = StationFlight(autopilot, "copter", on_station_pause="pause")
    first = flight.begin(by_mission)
    pause(flight)
    flight.run_to_status(first, "PAUSED")
    flight.run_for(1.0)
    done, text = flight.bridge.services.resume(flight.now)
    assert not done
    assert "Ground station 255/190 paused the vehicle" in text
    assert flight.bridge.goals.cancel(first, flight.now)
    end = flight.run_to_end(first, 15.0)
    assert end.code.value == "CANCELED", end.message
    assert flight.stored == 0
    second = flight.begin(by_mission)
    pause(flight)
    flight.run_to_status(second, "PAUSED")
    flight.run_for(2.0)
    third = flight.send(0.0, -20.0, 4.0)
    assert flight.ends(second)[0].code.value == "PREEMPTED"
    flight.run_to_status(third, "NAVIGATING")
    flight.run_until(lambda: flight.truth()[1] > 1.0, 10.0)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_lost_link_ends_a_paused_goal_and_a_short_silence_does_not(autopilot: str) -> None:
    flight = StationFlight(autopilot, "copter", on_station_pause="pause")
    goal_id = flight.begin(False)
    flight.hold_mode()
    flight.run_to_status(goal_id, "PAUSED")
    flight.run_for(1.0)  # the vehicle's HEARTBEAT shows the mode
    flight.link_up = False
    flight.run_for(4.0)
    flight.link_up = True
    flight.run_for(3.0)
    assert flight.status(goal_id) == "PAUSED"
    flight.link_up = False
    end = flight.run_to_end(goal_id)
    assert end.code.value == "LINK_LOST", end.message


# --- landing and return --------------------------------------------------------------------


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("request_", [LandRequest(), ReturnRequest()], ids=["land", "return"])
def test_a_landing_and_a_return_end_only_where_the_vehicle_itself_stops(
    autopilot: str, request_: LandRequest | ReturnRequest
) -> None:
    flight = StationFlight(autopilot, "copter")
    flight.run_to_end(flight.send(8.0, 0.0, 12.0))
    goal_id = flight.start(request_)
    flight.run_for(2.0)
    flight.clear()
    flight.pause_or_continue(False)
    flight.run_for(1.0)
    assert not flight.ends(goal_id), "neither stops what brings it down"
    flight.hold_mode()
    check_cancelled(flight, goal_id, "Ground station 255/190 paused the vehicle")
    assert flight.truth()[0][2] > 2.0
