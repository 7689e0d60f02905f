"""Goals from acceptance to their end, on the simulated copter and a simulated clock."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace

import pytest

from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.goals.requests import NavigateRequest
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.navigate import NAVIGATE
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


@pytest.fixture
def flight() -> SimulatedFlight:
    return SimulatedFlight().ready()


def test_from_the_ground_to_the_target(flight: SimulatedFlight) -> None:
    goal = flight.send(10.0, 5.0, 2.0)
    end = flight.run_to_end(goal)
    assert end.state is GoalState.SUCCEEDED
    place, speed = flight.truth()
    assert math.dist(place, (10.0, 5.0, 2.0)) < 0.8  # tolerance and what the GPS errs
    assert speed < 0.3
    assert end.final_error_m is not None
    assert 0.0 < end.final_error_m <= flight.config.bridge.goto.arrival_radius_m
    statuses = list(dict.fromkeys(item.status.value for item in flight.feedback(goal)))
    assert statuses[-3:] == ["TAKING_OFF", "NAVIGATING", "SETTLING"]


def test_no_setpoint_before_the_take_off_is_complete(flight: SimulatedFlight) -> None:
    goal = flight.send(10.0, 0.0, 2.0)
    flight.run_to_status(goal, "NAVIGATING")
    times = flight.setpoint_times(0.0)
    began = min(
        time_s
        for (time_s, output) in flight.outputs
        if getattr(getattr(output, "status", None), "value", "") == "NAVIGATING"
    )
    assert not [time_s for time_s in times if time_s < began - 0.2]
    assert flight.truth()[0][2] > 1.3


def test_a_flight_that_avoids_nothing_has_no_turns_for_replanning(flight: SimulatedFlight) -> None:
    flight.run_to_status(flight.send(20.0, 0.0, 3.0), "NAVIGATING")
    count = 0
    for _ in range(50):
        flight.tick()
        if flight.setpoint_times(flight.now):
            count += 1
            assert (flight.bridge.next_deadline() or 0.0) > flight.now
    assert count > 5


@pytest.mark.parametrize("speed", [0.5, 1.0, 3.0, 6.0])
def test_ground_speed_stays_within_the_goal(flight: SimulatedFlight, speed: float) -> None:
    flight.fly_up()
    nearer = min(speed / 2.0, 1.0)
    goal = flight.send(25.0 * nearer, 15.0 * nearer, 5.0, speed=speed)
    fastest = 0.0
    while not flight.ends(goal):
        flight.run_for(0.05)
        velocity = flight.simulation.truth.velocity_ned_m_s[0]
        fastest = max(fastest, math.hypot(velocity[0], velocity[1]))
    assert flight.ends(goal)[0].code is OutcomeCode.SUCCESS
    # The peak, with what a hovering vehicle wanders by.
    assert 0.8 * speed < fastest <= 1.05 * speed


def test_feedback_comes_at_its_rate_and_reports_finite_times(flight: SimulatedFlight) -> None:
    goal = flight.send(20.0, 0.0, 3.0)
    begin_s = flight.now
    end = flight.run_to_end(goal)
    feedback = flight.feedback(goal)
    assert len(feedback) == pytest.approx(10.0 * end.elapsed_s, rel=0.1)
    assert flight.now > begin_s
    for item in feedback:
        assert math.isfinite(item.time_remaining_s)
        assert math.isfinite(item.distance_remaining_m)
    half = feedback[len(feedback) // 2]
    assert half.time_remaining_s == pytest.approx(0.5 * end.elapsed_s, rel=0.5)


PHASES = ["", "ARMING", "TAKING_OFF", "NAVIGATING", "SETTLING"]


@pytest.mark.parametrize("phase", PHASES, ids=lambda phase: phase or "at once")
def test_cancel_in_every_phase(flight: SimulatedFlight, phase: str) -> None:
    goal = flight.send(15.0, 0.0, 2.0)
    if phase:
        flight.run_to_status(goal, phase)
    assert flight.bridge.goals.cancel(goal, flight.now)
    end = flight.run_to_end(goal, 30.0)
    assert end.state is GoalState.CANCELED
    assert end.code is OutcomeCode.CANCELED
    assert flight.truth()[1] < 0.3
    if phase in ("", "ARMING"):
        assert not flight.vehicle.state.armed


def test_cancel_in_the_middle_of_the_climb_holds_the_height(flight: SimulatedFlight) -> None:
    goal = flight.send(5.0, 0.0, 8.0)
    flight.run_until(lambda: flight.truth()[0][2] > 1.2)
    assert flight.status(goal) == "TAKING_OFF"
    assert flight.bridge.goals.cancel(goal, flight.now)
    end = flight.run_to_end(goal, 30.0)
    assert end.state is GoalState.CANCELED
    height = flight.truth()[0][2]
    assert 1.2 < height < 3.0
    flight.run_for(10.0)
    assert flight.truth()[0][2] == pytest.approx(height, abs=0.4)


def test_a_cancelled_vehicle_brakes_and_stays(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal = flight.send(80.0, 0.0, 3.0, speed=5.0)
    flight.run_for(8.0)
    assert flight.truth()[1] > 3.0
    flight.bridge.goals.cancel(goal, flight.now)
    end = flight.run_to_end(goal, 30.0)
    assert end.state is GoalState.CANCELED
    place, _ = flight.truth()
    flight.run_for(10.0)
    assert math.dist(flight.truth()[0], place) < 0.7


def test_a_replaced_goal_ends_preempted_without_stop_or_gap(flight: SimulatedFlight) -> None:
    flight.fly_up()
    old = flight.send(40.0, 0.0, 3.0, speed=4.0)
    flight.run_for(6.0)
    changed_s = flight.now
    new = flight.send(15.0, 20.0, 5.0, speed=4.0)
    (old_end,) = flight.ends(old)
    assert old_end.state is GoalState.ABORTED
    assert old_end.code is OutcomeCode.PREEMPTED
    assert "another goal" in old_end.message
    slowest = math.inf
    while flight.now < changed_s + 1.0:
        flight.tick()
        slowest = min(slowest, flight.truth()[1])
    assert slowest > 0.5
    times = flight.setpoint_times(changed_s - 1.0)
    assert max(b - a for a, b in itertools.pairwise(times)) <= 0.1
    assert flight.run_to_end(new).code is OutcomeCode.SUCCESS


@pytest.mark.parametrize("phase", ["ARMING", "TAKING_OFF"])
def test_a_goal_is_replaced_before_it_flies(flight: SimulatedFlight, phase: str) -> None:
    old = flight.send(10.0, 0.0, 2.0)
    flight.run_to_status(old, phase)
    new = flight.send(-5.0, 3.0, 3.0)
    assert flight.ends(old)[0].code is OutcomeCode.PREEMPTED
    end = flight.run_to_end(new)
    assert end.code is OutcomeCode.SUCCESS, end.message


def test_a_server_may_reject_a_replacement() -> None:
    flight = SimulatedFlight(on_new_goal="reject").ready()
    goal = flight.send(10.0, 0.0, 2.0)
    rejection = flight.check(flight.request(1.0, 1.0, 2.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.BUSY
    assert "A goal is active" in rejection.message
    assert flight.run_to_end(goal).code is OutcomeCode.SUCCESS


def test_no_sentence_for_people_has_the_id_of_a_goal(flight: SimulatedFlight) -> None:
    first = flight.send(20.0, 0.0, 2.0)
    services = flight.bridge.services
    texts = [services.pause(flight.now)[1], services.resume(flight.now)[1]]
    occupied = services.occupied
    assert occupied is not None
    texts.append(occupied.message)
    second = flight.send(10.0, 0.0, 2.0)
    flight.bridge.goals.cancel(second, flight.now)
    texts += [services.pause(flight.now)[1], flight.run_to_end(second).message]
    texts += [end.message for end in flight.ends(first)]
    assert len(texts) == 6
    for text in texts:
        assert not re.search("[0-9a-f]{32}", text), text


@pytest.mark.parametrize("phase", ["TAKING_OFF", "NAVIGATING"])
@pytest.mark.parametrize("mode", ["LOITER", "BRAKE", "RTL", "LAND", "ALT_HOLD"])
def test_the_pilot_wins_and_the_server_falls_silent(
    flight: SimulatedFlight, mode: str, phase: str
) -> None:
    goal = flight.send(30.0, 0.0, 3.0)
    flight.run_to_status(goal, phase)
    flight.run_for(1.5)
    flight.set_mode_as_pilot(mode)
    switched_s = flight.now
    end = flight.run_to_end(goal, 5.0)
    assert end.state is GoalState.ABORTED
    assert end.code is OutcomeCode.PILOT_OVERRIDE
    assert mode in end.message
    flight.run_for(5.0)
    moving = {"SET_POSITION_TARGET_LOCAL_NED", "COMMAND_LONG", "COMMAND_INT", "SET_MODE"}
    late = [m for t, m in flight.sent if t > switched_s + 0.2 and m.get_type() in moving]
    assert not late


def test_a_cancel_during_a_pilots_flight_is_rejected(flight: SimulatedFlight) -> None:
    goal = flight.send(30.0, 0.0, 3.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.set_mode_as_pilot("LOITER")
    flight.run_to_end(goal, 5.0)
    assert not flight.bridge.goals.cancel(goal, flight.now)


def test_silence_is_reported_then_ends_the_goal_and_is_not_revived(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal = flight.send(60.0, 0.0, 3.0)
    flight.run_for(4.0)
    flight.link_up = False
    cut_s = flight.now
    flight.run_to_status(goal, "LINK_LOST")
    end = flight.run_to_end(goal, 20.0)
    assert end.code is OutcomeCode.LINK_LOST
    limits = flight.config
    assert flight.now - cut_s == pytest.approx(limits.bridge.link_lost_abort_s + 2.0, abs=1.2)
    rejection = flight.check(flight.request(1.0, 1.0, 3.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.NO_VEHICLE
    flight.link_up = True
    back_s = flight.now
    flight.run_for(5.0)
    assert not flight.setpoint_times(back_s)
    assert flight.truth()[1] < 0.3  # GUID_TIMEOUT stopped it long ago
    assert flight.run_to_end(flight.send(0.0, 0.0, 3.0)).code is OutcomeCode.SUCCESS


def fallen_silent(flight: SimulatedFlight, east_m: float, seconds: float) -> str:
    """Let the link fall silent for a while on the flight to a goal; return the goal."""
    flight.fly_up()
    goal = flight.send(east_m, 0.0, 3.0)
    flight.run_for(4.0)
    flight.link_up = False
    flight.run_for(seconds)
    return goal


def test_a_short_silence_is_flown_through(flight: SimulatedFlight) -> None:
    goal = fallen_silent(flight, 40.0, 5.0)
    assert flight.status(goal) == "LINK_LOST"
    flight.link_up = True
    assert flight.run_to_end(goal).code is OutcomeCode.SUCCESS


def test_a_cancel_without_link_ends_in_bounded_time_and_says_so(flight: SimulatedFlight) -> None:
    goal = fallen_silent(flight, 60.0, 1.0)
    assert flight.bridge.goals.cancel(goal, flight.now)
    end = flight.run_to_end(goal, 15.0)
    assert end.code in (OutcomeCode.CANCELED, OutcomeCode.LINK_LOST)
    assert "silent" in end.message or "HEARTBEAT" in end.message or "not stopped" in end.message


def test_a_restart_of_the_autopilot_ends_the_goal(flight: SimulatedFlight) -> None:
    goal = flight.send(30.0, 0.0, 3.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.simulation.vehicles[0].power_cycle()
    end = flight.run_to_end(goal, 30.0)
    assert end.state is GoalState.ABORTED
    assert end.code is OutcomeCode.VEHICLE_REBOOTED
    flight.ready()
    flight.run_for(10.0)
    assert flight.run_to_end(flight.send(3.0, 0.0, 2.0)).code is OutcomeCode.SUCCESS


def test_arming_that_is_rejected_gives_the_autopilots_words() -> None:
    flight = SimulatedFlight(battery_policy="ignore").ready()
    flight.simulation.vehicles[0].parameters.set("BATT_LOW_VOLT", 20.0)
    flight.run_for(15.0)
    goal = flight.send(5.0, 0.0, 2.0)
    end = flight.run_to_end(goal, 60.0)
    assert end.state is GoalState.ABORTED
    assert end.code is OutcomeCode.ARMING_REFUSED
    assert "Battery" in end.message


def test_goals_with_arming_never_need_a_flying_vehicle() -> None:
    flight = SimulatedFlight(arming="never").ready()
    rejection = flight.check(flight.request(5.0, 0.0, 2.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.ARMING_NOT_ALLOWED
    assert "arming" in rejection.message


def test_shutting_down_stops_the_vehicle_first(flight: SimulatedFlight) -> None:
    flight.fly_up()
    goal = flight.send(60.0, 0.0, 3.0, speed=5.0)
    flight.run_for(6.0)
    flight.bridge.goals.shut_down(flight.now)
    end = flight.run_to_end(goal, 20.0)
    assert end.state is GoalState.ABORTED
    assert end.code is OutcomeCode.SHUTTING_DOWN
    assert flight.truth()[1] < 0.3


def test_no_vehicle_and_no_position_are_rejected() -> None:
    flight = SimulatedFlight()
    nobody = flight.check(flight.request(1.0, 1.0, 2.0))
    assert nobody is not None
    assert nobody.code is OutcomeCode.NO_VEHICLE
    flight.run_until(lambda: flight.vehicle.heartbeats.alive, 10.0)
    lost = flight.check(flight.request(1.0, 1.0, 2.0))
    assert lost is not None
    assert lost.code is OutcomeCode.NO_POSITION


def test_an_unknown_battery_is_none_not_zero(flight: SimulatedFlight) -> None:
    goal = flight.send(5.0, 0.0, 2.0)
    flight.run_to_end(goal)
    known = [item.battery_remaining for item in flight.feedback(goal)]
    assert all(value is None or 0.0 < value <= 1.0 for value in known)
    assert known[-1] is not None


def test_a_goal_is_admitted_once_unless_the_vehicle_reports_before_it_starts() -> None:
    asked: list[float] = []

    def admit(request: NavigateRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
        asked.append(snapshot.time_s)
        return NAVIGATE.admit(request, snapshot)

    flight = SimulatedFlight(tasks=(replace(NAVIGATE, admit=admit),)).ready()
    flight.send(5.0, 0.0, 5.0)
    assert len(asked) == 1
    request = flight.request(6.0, 0.0, 5.0)
    assert flight.check(request) is None
    flight.run_for(0.1)
    flight.bridge.goals.start("2" * 32, request, flight.now)
    assert len(asked) == 3
    assert flight.check(request) is None
    flight.bridge.goals.start("3" * 32, flight.request(7.0, 0.0, 5.0), flight.now)
    assert len(asked) == 5
