"""The life cycle of a flight to a point, in every phase and with every event."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import pytest

from navigation_core.geometry import KinematicState, distance, horizontal_norm, norm
from navigation_core.limits import Limits
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.goto import GotoConfig, GotoConfigError, GotoGoal, fly_to
from navigation_core.tasks.intents import Fly, Handover, Outcome, Perform, Wait
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.observation import Observation, OperationStatus, TaskOperation
from navigation_core.tasks.phases import Phase
from navigation_core.tasks.progress import Status
from tests.support.models.point_mass import Flight, PointMass, fly

TARGET = (10.0, 5.0, 2.0)
CONFIG = GotoConfig(may_arm=True)


def hovering(**changes: object) -> PointMass:
    """Return a vehicle that flies and obeys."""
    vehicle = PointMass(position=(0.0, 0.0, 2.5), armed=True, in_control=True, airborne=True)
    for name, value in changes.items():
        setattr(vehicle, name, value)
    return vehicle


def goto(
    target: tuple[float, float, float] = TARGET,
    yaw: float | None = None,
    speed: float | None = None,
    config: GotoConfig = CONFIG,
) -> SetpointFlight:
    return fly_to(GotoGoal(target, yaw, speed), FlightTerms(config))


def cancel_in(task: SetpointFlight, phase: Phase, after_s: float = 0.0) -> Callable[[float], None]:
    """Return what cancels a task once it has been in a phase for a time."""
    entered: list[float] = []

    def each_step(elapsed_s: float) -> None:
        if task.phase is phase and not entered:
            entered.append(elapsed_s)
        if entered and elapsed_s >= entered[0] + after_s:
            task.cancel(elapsed_s)

    return each_step


def _stands(answer: Fly) -> bool:
    return answer.by_velocity and answer.setpoint.velocity_enu_m_s == (0.0, 0.0, 0.0)


def assert_still_on_the_ground(flight: Flight) -> None:
    """On the ground nothing moves it; no setpoint goes out unarmed, or in a take-off."""
    for _, observation, answer in flight.steps:
        if isinstance(answer, Fly):
            assert observation.armed
            assert observation.in_control
            assert observation.airborne is not False or _stands(answer)
            report = observation.operation
            taking_off = report is not None and report.kind is TaskOperation.TAKE_OFF
            assert not (taking_off and report and report.state is OperationStatus.PENDING)


# --- the whole flight ----------------------------------------------------------------


def test_from_the_ground_to_the_target() -> None:
    vehicle, task = PointMass(), goto()
    statuses: list[Status] = []

    def note(_: float) -> None:
        status = task.progress(vehicle.observe(), vehicle.now).status
        if not statuses or statuses[-1] is not status:
            statuses.append(status)

    flight = fly(task, vehicle, note)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert statuses == [
        Status.PREPARING,
        Status.ARMING,
        Status.TAKING_OFF,
        Status.NAVIGATING,
        Status.SETTLING,
    ]
    assert [request.kind for request in vehicle.requests] == [
        TaskOperation.TAKE_CONTROL,
        TaskOperation.ARM,
        TaskOperation.TAKE_OFF,
    ]
    assert_still_on_the_ground(flight)
    error_m = distance(flight.steps[-1][1].position_enu_m or (0.0, 0.0, 0.0), TARGET)
    assert flight.outcome.final_error_m == pytest.approx(error_m)
    assert error_m < CONFIG.arrival_radius_m
    assert task.step(vehicle.observe(), vehicle.now + 1.0) is flight.outcome


def test_a_vehicle_that_flies_and_obeys_goes_at_once() -> None:
    vehicle, task = hovering(), goto()
    flight = fly(task, vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert vehicle.requests == []
    assert all(isinstance(answer, Fly) for _, _, answer in flight.steps[:-1])


def test_a_vehicle_that_flies_in_another_mode_is_only_taken_control_of() -> None:
    vehicle, task = hovering(in_control=False), goto()
    flight = fly(task, vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert [request.kind for request in vehicle.requests] == [TaskOperation.TAKE_CONTROL]
    assert_still_on_the_ground(flight)


def test_a_vehicle_that_does_not_say_whether_it_flies_is_judged_by_its_height() -> None:
    vehicle = hovering(airborne=None)
    assert fly(goto(), vehicle).outcome.code is OutcomeCode.SUCCESS
    assert vehicle.requests == []
    vehicle = PointMass(airborne=None, in_control=True, armed=True)
    assert fly(goto(), vehicle).outcome.code is OutcomeCode.SUCCESS
    assert [request.kind for request in vehicle.requests] == [TaskOperation.TAKE_OFF]


@pytest.mark.parametrize(
    ("z", "expected"), [(0.3, 1.5), (1.5, 1.5), (2.0, 2.0), (2.5, 2.5), (30.0, 2.5)]
)
def test_the_takeoff_climbs_towards_the_target_within_bounds(z: float, expected: float) -> None:
    vehicle = PointMass()
    flight = fly(goto((5.0, 0.0, z)), vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert vehicle.requests[-1] == Perform(TaskOperation.TAKE_OFF, expected)


def test_arrival_does_not_overshoot() -> None:
    vehicle = hovering()
    flight = fly(goto((40.0, 0.0, 2.5)), vehicle)
    furthest = max(o.position_enu_m[0] for _, o, _ in flight.steps if o.position_enu_m)
    assert furthest < 40.0 + CONFIG.arrival_radius_m
    assert max(f.setpoint.position_enu_m[0] for _, f in flight.setpoints) <= 40.0 + 1e-9


def test_the_speed_of_a_goal_bounds_setpoint_and_vehicle() -> None:
    vehicle = hovering()
    flight = fly(goto((40.0, 30.0, 2.5), speed=2.0), vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    for _, observation, answer in flight.steps:
        if isinstance(answer, Fly):
            assert horizontal_norm(answer.setpoint.velocity_enu_m_s) <= 2.0 * 1.001
        assert observation.velocity_enu_m_s is not None
        assert horizontal_norm(observation.velocity_enu_m_s) <= 2.0 * 1.05


def test_success_takes_the_whole_dwell() -> None:
    flight = fly(goto(), hovering())
    inside = [
        t
        for t, o, _ in flight.steps
        if o.position_enu_m is not None
        and o.velocity_enu_m_s is not None
        and distance(o.position_enu_m, TARGET) <= CONFIG.arrival_radius_m
        and norm(o.velocity_enu_m_s) <= CONFIG.arrival_speed_m_s
    ]
    assert flight.steps[-1][0] - inside[0] >= CONFIG.arrival_dwell_s - 1e-9


def test_a_repeated_position_is_not_dwelt_on() -> None:
    vehicle, task = hovering(), goto()
    frozen: list[float] = []

    def lose_after_arrival(_: float) -> None:
        if task.phase is Phase.SETTLING:
            frozen.append(vehicle.now)
            vehicle.position_age_s = vehicle.now - frozen[0]

    flight = fly(task, vehicle, lose_after_arrival)
    assert flight.outcome.code is OutcomeCode.NO_POSITION


def test_a_velocity_that_is_off_does_not_hide_an_arrival() -> None:
    """Observed on a PX4 after a long flight: it stands, and reports 0.3 to 0.7 m/s."""
    vehicle, task = hovering(), goto()
    true = vehicle.observe

    def biased() -> Observation:
        observation = true()
        east, north, up = observation.velocity_enu_m_s or (0.0, 0.0, 0.0)
        return replace(observation, velocity_enu_m_s=(east + 0.3, north - 0.4, up))

    settling: list[float] = []

    def note(_: float) -> None:
        if task.phase is Phase.SETTLING:
            settling.append(vehicle.now)

    vehicle.observe = biased  # type: ignore[method-assign]
    flight = fly(task, vehicle, note)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert settling[-1] - settling[0] < 2.5 * CONFIG.arrival_dwell_s


@pytest.mark.parametrize("yaw", [2.0, None])
def test_a_goal_that_names_a_yaw_is_not_reached_before_the_vehicle_has_it(
    yaw: float | None,
) -> None:
    vehicle, task = hovering(), goto(yaw=yaw)
    turned_s = math.inf
    true = vehicle.observe

    def slowly_turning() -> Observation:
        nonlocal turned_s
        observation = true()
        off = 0.3 if task.phase is Phase.NAVIGATING or vehicle.now < turned_s else 0.05
        if task.phase is Phase.SETTLING and turned_s == math.inf:
            turned_s = vehicle.now + 5.0
        return replace(observation, yaw_enu_rad=(observation.yaw_enu_rad or 0.0) - off)

    vehicle.observe = slowly_turning  # type: ignore[method-assign]
    flight = fly(task, vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    ended_s = flight.steps[-1][0]
    if yaw is None:
        assert ended_s < turned_s - 3.0  # such a goal faces the way it came, and names no yaw
    else:
        assert ended_s > turned_s


def test_a_yaw_that_is_never_reached_ends_in_timeout_and_is_named() -> None:
    vehicle, task = hovering(), goto(yaw=2.0)
    true = vehicle.observe
    vehicle.observe = lambda: replace(true(), yaw_enu_rad=1.8)  # type: ignore[method-assign]
    flight = fly(task, vehicle)
    assert flight.outcome.code is OutcomeCode.TIMEOUT
    assert "yaw error is 11 degrees; arrival requires at most 5" in flight.outcome.message


def test_a_vehicle_that_circles_fast_around_the_target_has_not_arrived() -> None:
    vehicle, task = hovering(), goto()

    def circle(elapsed_s: float) -> None:
        if task.phase is Phase.SETTLING:
            vehicle.position = (TARGET[0] + 0.2 * math.sin(2.0 * elapsed_s), *TARGET[1:])
            vehicle.velocity = (0.4, 0.0, 0.0)

    flight = fly(task, vehicle, circle)
    assert flight.outcome.code is OutcomeCode.TIMEOUT
    assert "moves at 0.40 m/s" in flight.outcome.message


def test_the_dwell_restarts_after_the_position_was_lost() -> None:
    vehicle, task = hovering(), goto()
    settled: list[float] = []

    def lose(elapsed_s: float) -> None:
        if task.phase is Phase.SETTLING and not settled:
            settled.append(elapsed_s)
        lost_s = elapsed_s - settled[0] - 0.6 if settled else 0.0
        vehicle.position_age_s = lost_s if 0.0 < lost_s < 1.5 else 0.0

    flight = fly(task, vehicle, lose)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    back_s = 100.0 + settled[0] + 0.6 + 1.5
    assert flight.steps[-1][0] - back_s >= CONFIG.arrival_dwell_s - 0.06


# --- yaw -----------------------------------------------------------------------------


def test_without_a_yaw_it_faces_the_direction_of_travel() -> None:
    vehicle = hovering(yaw=-2.0)
    fly(goto((0.0, 20.0, 2.5)), vehicle)
    assert vehicle.yaw == pytest.approx(math.pi / 2.0)


@pytest.mark.parametrize("target", [(0.0, 0.0, 12.0), (0.6, 0.5, 2.5), (0.0, 0.0, 2.5)])
def test_close_by_or_straight_up_it_keeps_its_yaw(target: tuple[float, float, float]) -> None:
    vehicle = hovering(yaw=-2.0)
    flight = fly(goto(target), vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert {fly_.setpoint.yaw_enu_rad for _, fly_ in flight.setpoints} == {-2.0}


def test_the_yaw_turns_in_the_shorter_direction_at_its_rate_and_arrives() -> None:
    vehicle = hovering(yaw=3.0)
    task = goto((0.0, 0.0, 2.5), yaw=-2.5)
    flight = fly(task, vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    yaws = [fly_.setpoint.yaw_enu_rad for _, fly_ in flight.setpoints]
    assert yaws[-1] == -2.5
    rate = CONFIG.limits.yaw_rate_rad_s
    for before, after in pairwise(yaws):
        assert abs(math.remainder(after - before, math.tau)) <= rate * 0.05 + 1e-9
        assert abs(after) > 2.4  # never through zero
    expected_s = (math.tau - 5.5) / rate + CONFIG.arrival_dwell_s
    assert flight.steps[-1][0] - 100.0 == pytest.approx(expected_s, abs=0.15)


# --- refusals ------------------------------------------------------------------------


def test_without_leave_to_arm_nothing_is_asked_of_the_vehicle() -> None:
    vehicle = PointMass()
    flight = fly(goto(config=GotoConfig(may_arm=False)), vehicle)
    assert flight.outcome.code is OutcomeCode.ARMING_NOT_ALLOWED
    assert "arm it" in flight.outcome.message
    assert vehicle.requests == []


@pytest.mark.parametrize("airborne", [False, None])
def test_without_leave_to_take_off_nothing_is_asked_of_an_armed_vehicle_on_the_ground(
    airborne: bool | None,
) -> None:
    vehicle = PointMass(armed=True, airborne=airborne)
    flight = fly(goto(config=GotoConfig()), vehicle)
    assert flight.outcome.code is OutcomeCode.TAKEOFF_NOT_ALLOWED
    assert vehicle.requests == []


def test_with_leave_to_take_off_a_vehicle_that_somebody_armed_is_flown() -> None:
    vehicle = PointMass(armed=True)
    flight = fly(goto(config=GotoConfig(may_take_off=True)), vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert TaskOperation.ARM not in {request.kind for request in vehicle.requests}


def test_a_vehicle_that_was_landed_meanwhile_is_not_lifted_again() -> None:
    vehicle = PointMass(position=(0.0, 0.0, 3.0), armed=True, airborne=True, in_control=True)
    task = goto(config=GotoConfig())
    task.start(vehicle.observe(), vehicle.now)
    task.step(vehicle.observe(), vehicle.now)
    vehicle.airborne, vehicle.in_control = False, False
    task.resume_control(vehicle.now)  # a station had paused it, and resumes it
    answer = task.step(vehicle.observe(), vehicle.now)
    assert isinstance(answer, Outcome)
    assert answer.code is OutcomeCode.TAKEOFF_NOT_ALLOWED


@pytest.mark.parametrize(
    ("kind", "code"),
    [
        (TaskOperation.TAKE_CONTROL, OutcomeCode.MODE_REFUSED),
        (TaskOperation.ARM, OutcomeCode.ARMING_REFUSED),
        (TaskOperation.TAKE_OFF, OutcomeCode.TAKEOFF_REFUSED),
    ],
)
@pytest.mark.parametrize(
    ("state", "words"),
    [
        (OperationStatus.REFUSED, "was rejected: Arm: need 3D fix."),
        (OperationStatus.TIMED_OUT, "timed out: Arm: need 3D fix."),
        (OperationStatus.CANCELLED, "was abandoned: Arm: need 3D fix."),
    ],
)
def test_a_rejection_ends_the_goal_with_the_vehicles_reason(
    kind: TaskOperation, code: OutcomeCode, state: OperationStatus, words: str
) -> None:
    vehicle = PointMass(results={kind: state}, reason="Arm: need 3D fix")
    flight = fly(goto(), vehicle)
    assert flight.outcome.code is code
    assert words in flight.outcome.message
    assert flight.setpoints == []
    assert vehicle.armed is False  # nobody leaves propellers turning on the ground
    # After anything but a clear refusal to arm, the motors may start in a moment.
    unclear = kind is not TaskOperation.TAKE_CONTROL and (
        state is not OperationStatus.REFUSED or kind is TaskOperation.TAKE_OFF
    )
    assert (vehicle.requests[-1].kind is TaskOperation.DISARM) is unclear


def test_a_rejection_without_a_reason_says_so() -> None:
    vehicle = PointMass(results={TaskOperation.ARM: OperationStatus.REFUSED})
    assert "gave no reason" in fly(goto(), vehicle).outcome.message


def test_a_link_lost_while_arming_is_called_that() -> None:
    vehicle = PointMass(results={TaskOperation.ARM: OperationStatus.LINK_LOST})
    assert fly(goto(), vehicle).outcome.code is OutcomeCode.LINK_LOST


@pytest.mark.parametrize(
    ("kind", "code"),
    [
        (TaskOperation.TAKE_CONTROL, OutcomeCode.MODE_REFUSED),
        (TaskOperation.ARM, OutcomeCode.ARMING_REFUSED),
        (TaskOperation.TAKE_OFF, OutcomeCode.TAKEOFF_REFUSED),
    ],
)
def test_an_operation_that_never_reports_does_not_hang(
    kind: TaskOperation, code: OutcomeCode
) -> None:
    vehicle = PointMass(delays={kind: 1e9})
    flight = fly(goto(), vehicle)
    assert flight.outcome.code is code
    assert "timed out" in flight.outcome.message


def test_a_takeoff_that_sticks_in_the_air_is_left_hovering() -> None:
    vehicle = PointMass()

    def stick(_: float) -> None:
        if vehicle.airborne:
            vehicle.delays[TaskOperation.TAKE_OFF] = 1e9

    flight = fly(goto(), vehicle, stick)
    assert flight.outcome.code is OutcomeCode.TAKEOFF_REFUSED
    assert vehicle.armed
    assert TaskOperation.DISARM not in [request.kind for request in vehicle.requests]


# --- cancelling ----------------------------------------------------------------------


def test_cancel_before_the_first_step() -> None:
    vehicle, task = PointMass(), goto()
    task.start(vehicle.observe(), vehicle.now)
    task.cancel(vehicle.now)
    outcome = task.step(vehicle.observe(), vehicle.now)
    assert isinstance(outcome, Outcome)
    assert outcome.code is OutcomeCode.CANCELED


def test_cancel_while_preparing_ends_at_once() -> None:
    vehicle, task = PointMass(), goto()
    flight = fly(task, vehicle, cancel_in(task, Phase.PREPARING, 0.1))
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert len(flight.steps) <= 4
    assert [request.kind for request in vehicle.requests] == [TaskOperation.TAKE_CONTROL]


@pytest.mark.parametrize("delay", [0.0, 0.2])
def test_cancel_while_arming_disarms(delay: float) -> None:
    vehicle, task = PointMass(delays={TaskOperation.ARM: 0.5}), goto()
    flight = fly(task, vehicle, cancel_in(task, Phase.ARMING, delay))
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert "disarmed" in flight.outcome.message
    assert vehicle.requests[-1].kind is TaskOperation.DISARM
    assert not vehicle.armed
    assert flight.setpoints == []


def test_cancel_before_lift_off_disarms() -> None:
    vehicle, task = PointMass(delays={TaskOperation.TAKE_OFF: 3.0}), goto()
    flight = fly(task, vehicle, cancel_in(task, Phase.TAKING_OFF, 1.0))
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert not vehicle.armed
    assert vehicle.position[2] == 0.0
    assert flight.setpoints == []


def test_cancel_before_lift_off_leaves_a_vehicle_armed_that_somebody_else_armed() -> None:
    vehicle = PointMass(delays={TaskOperation.TAKE_OFF: 3.0})
    vehicle.armed = True
    task = goto()
    flight = fly(task, vehicle, cancel_in(task, Phase.TAKING_OFF, 1.0))
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert vehicle.armed
    asked = [request.kind for request in vehicle.requests]
    assert asked[-1] is TaskOperation.HOLD
    assert TaskOperation.DISARM not in asked
    assert flight.setpoints == []


def test_a_disarm_that_is_rejected_is_admitted() -> None:
    vehicle = PointMass(
        delays={TaskOperation.TAKE_OFF: 3.0},
        results={TaskOperation.DISARM: OperationStatus.REFUSED},
        reason="not landed",
    )
    task = goto()
    flight = fly(task, vehicle, cancel_in(task, Phase.TAKING_OFF, 1.0))
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert "to disarm was rejected: not landed." in flight.outcome.message
    assert "may still be armed" in flight.outcome.message


def test_cancel_while_climbing_stops_in_the_air() -> None:
    vehicle, task = PointMass(), goto((10.0, 5.0, 8.0))
    flight = fly(task, vehicle, cancel_in(task, Phase.TAKING_OFF, 2.0))
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert "has stopped" in flight.outcome.message
    assert vehicle.armed
    assert vehicle.speed < CONFIG.stop_speed_m_s
    assert 0.5 < vehicle.position[2] < 2.5
    assert flight.setpoints


def test_cancel_after_a_take_off_waits_for_the_autopilot_to_end_the_climb() -> None:
    """A PX4 calls its take-off over while it still rises, in a mode of its own."""
    vehicle, task = PointMass(delays={TaskOperation.TAKE_CONTROL: 30.0}), goto()
    rising_m_s = 0.6

    def climb_on(_: float) -> None:
        nonlocal rising_m_s
        if task.phase is Phase.TAKING_OFF:
            vehicle.in_control = False
        elif vehicle.airborne:
            rising_m_s = max(0.0, rising_m_s - 0.01)
            vehicle.velocity = (0.0, 0.0, rising_m_s)
            task.cancel(vehicle.now)

    flight = fly(task, vehicle, climb_on)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert "has stopped" in flight.outcome.message
    assert not flight.setpoints
    assert vehicle.speed < CONFIG.stop_speed_m_s


def test_a_vehicle_that_lifts_off_instead_of_disarming_is_stopped_in_the_air() -> None:
    vehicle = PointMass(delays={TaskOperation.TAKE_OFF: 3.0, TaskOperation.DISARM: 5.0})
    task = goto()
    cancel = cancel_in(task, Phase.TAKING_OFF, 1.0)

    def lift_off(elapsed_s: float) -> None:
        cancel(elapsed_s)
        if task.phase is Phase.DISARMING and not vehicle.airborne:
            vehicle.airborne = True
            vehicle.position, vehicle.velocity = (0.0, 0.0, 0.6), (0.0, 0.0, 1.0)

    flight = fly(task, vehicle, lift_off)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert "has stopped" in flight.outcome.message
    assert vehicle.armed


@pytest.mark.parametrize("after_s", [0.0, 1.0, 2.0, 3.0])
def test_cancel_in_flight_brakes_without_a_jump(after_s: float) -> None:
    vehicle, task = hovering(), goto((60.0, 20.0, 12.0))
    flight = fly(task, vehicle, cancel_in(task, Phase.NAVIGATING, after_s))
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert vehicle.speed < CONFIG.stop_speed_m_s
    assert_setpoints_are_smooth(flight, CONFIG.limits)
    # Nothing goes further than from the greatest speed.
    stopped = flight.setpoints[-1][1].setpoint.position_enu_m
    assert distance(stopped, vehicle.position) < 0.5


def test_cancel_while_settling() -> None:
    vehicle, task = hovering(), goto()
    flight = fly(task, vehicle, cancel_in(task, Phase.SETTLING, 0.2))
    assert flight.outcome.code is OutcomeCode.CANCELED


def test_a_vehicle_that_does_not_stop_ends_the_cancel_with_its_speed() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 2.5))
    cancel = cancel_in(task, Phase.NAVIGATING, 3.0)

    def run_away(elapsed_s: float) -> None:
        cancel(elapsed_s)
        if task.phase is Phase.STOPPING:
            vehicle.obeys = False
            vehicle.velocity = (3.0, 0.0, 0.0)

    flight = fly(task, vehicle, run_away)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert "had not stopped after 10 s; it moves at 2." in flight.outcome.message


def test_a_cancel_waits_for_the_setpoint_to_stop_too() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 2.5))
    cancel = cancel_in(task, Phase.NAVIGATING, 3.0)

    def freeze(elapsed_s: float) -> None:
        cancel(elapsed_s)
        if elapsed_s > 2.9:
            vehicle.obeys, vehicle.velocity = False, (0.0, 0.0, 0.0)

    flight = fly(task, vehicle, freeze)
    assert flight.outcome.code is OutcomeCode.CANCELED
    last = flight.setpoints[-1][1].setpoint
    assert norm(last.velocity_enu_m_s) < CONFIG.stop_speed_m_s


def test_a_cancel_without_a_position_ends_with_an_unknown_speed() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 2.5))
    cancel = cancel_in(task, Phase.NAVIGATING, 2.0)

    def blind(elapsed_s: float) -> None:
        cancel(elapsed_s)
        vehicle.position_known = task.phase is not Phase.STOPPING

    flight = fly(task, vehicle, blind)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert "unknown speed" in flight.outcome.message


def test_cancelling_twice_is_cancelling_once() -> None:
    vehicle, task = hovering(), goto()
    flight = fly(task, vehicle, lambda t: task.cancel(t) if t > 1.0 else None)
    assert flight.outcome.code is OutcomeCode.CANCELED


# --- what the vehicle does by itself ---------------------------------------------------


@pytest.mark.parametrize("phase", [Phase.NAVIGATING, Phase.SETTLING, Phase.STOPPING])
@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"armed": False}, OutcomeCode.DISARMED),
        ({"in_control": False}, OutcomeCode.PILOT_OVERRIDE),
    ],
)
def test_a_vehicle_that_is_taken_away_ends_the_goal_at_once(
    phase: Phase, change: dict[str, object], code: OutcomeCode
) -> None:
    vehicle, task = hovering(), goto()
    cancel = cancel_in(task, Phase.NAVIGATING, 1.0)

    def take_away(elapsed_s: float) -> None:
        if phase is Phase.STOPPING:
            cancel(elapsed_s)
        if task.phase is phase:
            for name, value in change.items():
                setattr(vehicle, name, value)

    flight = fly(task, vehicle, take_away)
    assert flight.outcome.code is code
    for _, observation, answer in flight.steps:
        if not observation.armed or not observation.in_control:
            assert isinstance(answer, Outcome)


def test_a_vehicle_that_is_disarmed_before_lift_off() -> None:
    vehicle, task = PointMass(delays={TaskOperation.TAKE_OFF: 3.0}), goto()

    def disarm(_: float) -> None:
        if task.phase is Phase.TAKING_OFF:
            vehicle.armed = False

    flight = fly(task, vehicle, disarm)
    assert flight.outcome.code is OutcomeCode.DISARMED


def test_a_vehicle_that_lands_is_not_moved_and_ends_the_goal() -> None:
    vehicle, task = hovering(), goto((50.0, 0.0, 2.5))

    def land(elapsed_s: float) -> None:
        vehicle.airborne = elapsed_s < 3.0

    flight = fly(task, vehicle, land)
    assert flight.outcome.code is OutcomeCode.LANDED
    landed = [answer for _, seen, answer in flight.steps if seen.airborne is False]
    # A PX4 takes a second without setpoints for a failsafe.
    assert all(isinstance(answer, Fly) and _stands(answer) for answer in landed[:-1])
    assert_still_on_the_ground(flight)


def test_a_landed_state_that_flaps_does_not_end_the_goal() -> None:
    vehicle, task = hovering(), goto()

    def flap(elapsed_s: float) -> None:
        vehicle.airborne = not 2.0 < elapsed_s < 2.3

    flight = fly(task, vehicle, flap)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert_still_on_the_ground(flight)


def test_a_short_loss_of_position_holds_and_continues() -> None:
    vehicle, task = hovering(), goto((30.0, 0.0, 2.5))
    phases: set[Phase] = set()

    def lose(elapsed_s: float) -> None:
        phases.add(task.phase)
        vehicle.position_age_s = elapsed_s - 2.0 if 2.0 < elapsed_s < 3.5 else 0.0

    flight = fly(task, vehicle, lose)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert Phase.HOLDING in phases
    assert_setpoints_are_smooth(flight, CONFIG.limits)


@pytest.mark.parametrize("how", ["none", "old", "no yaw"])
def test_a_long_loss_of_position_ends_the_goal(how: str) -> None:
    vehicle, task = hovering(), goto((30.0, 0.0, 2.5))

    def lose(elapsed_s: float) -> None:
        if elapsed_s <= 2.0:
            return
        if how == "none":
            vehicle.position_known = False
        elif how == "old":
            vehicle.position_age_s = elapsed_s - 2.0
        else:
            vehicle.yaw = math.nan

    flight = fly(task, vehicle, lose)
    assert flight.outcome.code is OutcomeCode.NO_POSITION
    assert flight.outcome.final_error_m is None
    # The last setpoints brake the vehicle where its last position led.
    assert norm(flight.setpoints[-1][1].setpoint.velocity_enu_m_s) < 4.0


def test_no_position_at_the_beginning_waits_and_gives_up() -> None:
    vehicle = hovering(position_known=False)
    flight = fly(goto(), vehicle)
    assert flight.outcome.code is OutcomeCode.NO_POSITION
    assert flight.setpoints == []
    assert isinstance(flight.steps[0][2], Wait)


def test_after_a_gap_the_flight_restarts_where_the_vehicle_is() -> None:
    vehicle, task = hovering(), goto((40.0, 0.0, 2.5))
    blown = (12.0, 6.0, 2.5)

    def drop_out(elapsed_s: float) -> None:
        vehicle.connected = not 3.0 < elapsed_s < 6.0
        if not vehicle.connected:
            vehicle.position, vehicle.velocity = blown, (0.0, 0.0, 0.0)

    flight = fly(task, vehicle, drop_out)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    after = next(f for t, f in flight.setpoints if t > 105.9)
    assert distance(after.setpoint.position_enu_m, blown) < 0.05


def test_a_gap_while_settling_is_flown_again() -> None:
    vehicle, task = hovering(), goto()
    begun: list[float] = []

    def drop_out(elapsed_s: float) -> None:
        if task.phase is Phase.SETTLING and not begun:
            begun.append(elapsed_s)
            vehicle.position = (0.0, 0.0, 2.5)
        vehicle.connected = not begun or elapsed_s > begun[0] + 2.0

    flight = fly(task, vehicle, drop_out)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert flight.outcome.final_error_m is not None
    assert flight.outcome.final_error_m < CONFIG.arrival_radius_m


def test_a_gap_while_braking_brakes_where_the_vehicle_is() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 2.5))
    cancel = cancel_in(task, Phase.NAVIGATING, 3.0)

    def drop_out(elapsed_s: float) -> None:
        cancel(elapsed_s)
        vehicle.connected = not 3.2 < elapsed_s < 6.0
        if not vehicle.connected:
            vehicle.position, vehicle.velocity = (50.0, 3.0, 2.5), (0.0, 0.0, 0.0)

    flight = fly(task, vehicle, drop_out)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert distance(flight.setpoints[-1][1].setpoint.position_enu_m, (50.0, 3.0, 2.5)) < 3.0


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_target_that_is_not_a_number_never_becomes_a_setpoint(bad: float) -> None:
    flight = fly(goto((bad, 0.0, 2.5)), hovering())
    assert flight.outcome.code is OutcomeCode.INTERNAL_ERROR
    assert "NaN or infinite" in flight.outcome.message
    assert flight.setpoints == []


# --- the carrot ------------------------------------------------------------------------


def test_the_setpoint_waits_for_a_slow_vehicle() -> None:
    vehicle = hovering(speed_max_m_s=2.0)
    flight = fly(goto((40.0, 0.0, 2.5)), vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    for _, observation, answer in flight.steps:
        if isinstance(answer, Fly) and observation.position_enu_m is not None:
            lag_m = distance(answer.setpoint.position_enu_m, observation.position_enu_m)
            assert lag_m < CONFIG.tracking_error_max_m + CONFIG.tracking_lag_s * 5.0 + 1.0
    assert_setpoints_are_smooth(flight, CONFIG.limits)


def test_the_velocity_of_a_waiting_setpoint_is_its_true_derivative() -> None:
    vehicle = hovering(speed_max_m_s=2.0)
    flight = fly(goto((40.0, 10.0, 6.5)), vehicle)
    waited = False
    for (t0, first), (t1, second) in pairwise(flight.setpoints):
        a, b = first.setpoint, second.setpoint
        for k in range(3):
            moved = (b.position_enu_m[k] - a.position_enu_m[k]) / (t1 - t0)
            mean = 0.5 * (a.velocity_enu_m_s[k] + b.velocity_enu_m_s[k])
            assert moved == pytest.approx(mean, abs=0.01)
        waited = waited or 1.5 < norm(a.velocity_enu_m_s) < 2.5
    assert waited


def test_the_estimate_learns_that_the_vehicle_is_slow() -> None:
    vehicle, task = hovering(speed_max_m_s=2.0), goto((60.0, 0.0, 2.5))
    estimates: list[tuple[float, float]] = []

    def note(elapsed_s: float) -> None:
        progress = task.progress(vehicle.observe(), vehicle.now)
        estimates.append((elapsed_s, progress.time_remaining_s))

    flight = fly(task, vehicle, note)
    total_s = flight.steps[-1][0] - 100.0
    elapsed_s, left_s = estimates[len(estimates) // 2]
    assert left_s == pytest.approx(total_s - elapsed_s, rel=0.35)


def test_a_vehicle_that_stands_in_the_wind_ends_in_timeout_with_numbers() -> None:
    vehicle = hovering(speed_max_m_s=2.0, wind=(-6.0, 0.0, 0.0))
    flight = fly(goto((40.0, 0.0, 2.5)), vehicle)
    assert flight.outcome.code is OutcomeCode.TIMEOUT
    assert "made no progress within 20 s" in flight.outcome.message
    assert "m from the target" in flight.outcome.message


def test_a_vehicle_that_does_not_settle_ends_in_timeout_with_numbers() -> None:
    vehicle, task = hovering(), goto()

    def pull(_: float) -> None:
        if task.phase is Phase.SETTLING:
            vehicle.wind = (1.5, 0.0, 0.0)

    flight = fly(task, vehicle, pull)
    assert flight.outcome.code is OutcomeCode.TIMEOUT
    error_m = flight.outcome.final_error_m
    assert error_m is not None
    assert error_m > CONFIG.arrival_radius_m
    assert f"{error_m:.2f} m from the target" in flight.outcome.message


def assert_setpoints_are_smooth(flight: Flight, limits: Limits) -> None:
    """Between consecutive setpoints neither position nor velocity jumps."""
    a_max = 1.5 * math.hypot(limits.acceleration_horizontal_m_s2, limits.acceleration_vertical_m_s2)
    for (t0, first), (t1, second) in pairwise(flight.setpoints):
        dt = t1 - t0
        a, b = first.setpoint, second.setpoint
        assert distance(a.velocity_enu_m_s, b.velocity_enu_m_s) <= a_max * dt + 1e-6
        speed = max(norm(a.velocity_enu_m_s), norm(b.velocity_enu_m_s))
        assert distance(a.position_enu_m, b.position_enu_m) <= (speed + a_max * dt) * dt + 1e-6


# --- replacing ---------------------------------------------------------------------------


@pytest.mark.parametrize("after_s", [0.5, 2.0, 4.0, 5.5])
@pytest.mark.parametrize("target", [(-20.0, 10.0, 6.0), (40.0, -10.0, 2.5), (3.0, 1.0, 4.0)])
def test_a_replaced_goal_goes_over_without_a_jump_or_a_gap(
    after_s: float, target: tuple[float, float, float]
) -> None:
    vehicle, first = hovering(), goto((30.0, 0.0, 8.0))
    flight = Flight()
    first.start(vehicle.observe(), vehicle.now)
    sent_s = vehicle.now
    while vehicle.now < 100.0 + after_s:
        answer = first.step(vehicle.observe(), vehicle.now)
        assert isinstance(answer, Fly)
        flight.steps.append((vehicle.now, vehicle.observe(), answer))
        sent_s = vehicle.now
        vehicle.obey(answer)
        vehicle.advance(0.05)
    second = fly_to(
        GotoGoal(target),
        FlightTerms(CONFIG, Handover(first.commanded, first.commanded_yaw_enu_rad, sent_s)),
    )
    flight.steps += fly(second, vehicle).steps
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert_setpoints_are_smooth(flight, CONFIG.limits)
    times = [t for t, _ in flight.setpoints]
    assert max(b - a for a, b in pairwise(times)) < 0.051


def test_a_predecessor_far_from_the_vehicle_is_no_start() -> None:
    vehicle = hovering()
    far = KinematicState((30.0, 0.0, 2.5), (3.0, 0.0, 0.0))
    flight = fly(fly_to(GotoGoal(TARGET), FlightTerms(CONFIG, Handover(far, 0.0))), vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert distance(flight.setpoints[0][1].setpoint.position_enu_m, (0.0, 0.0, 2.5)) < 0.01


def test_a_predecessor_in_the_air_is_no_start_on_the_ground() -> None:
    vehicle = PointMass()
    earlier = KinematicState((2.0, 0.0, 2.5), (3.0, 0.0, 0.0))
    flight = fly(fly_to(GotoGoal(TARGET), FlightTerms(CONFIG, Handover(earlier, 0.0))), vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    start = flight.setpoints[0][1].setpoint.position_enu_m
    assert distance(start, (0.0, 0.0, 2.0)) < 0.2


def test_a_new_goal_on_the_way_up_waits_for_the_takeoff() -> None:
    vehicle, first = PointMass(), goto()
    first.start(vehicle.observe(), vehicle.now)
    while vehicle.position[2] < 1.0:
        vehicle.obey(_intent(first, vehicle))
        vehicle.advance(0.05)
    flight = fly(goto((-5.0, 0.0, 4.0)), vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert_still_on_the_ground(flight)
    kinds = [request.kind for request in vehicle.requests]
    assert kinds.count(TaskOperation.TAKE_OFF) == 1


def test_a_new_goal_that_is_cancelled_on_the_way_up_stops_there() -> None:
    vehicle, first = PointMass(), goto()
    first.start(vehicle.observe(), vehicle.now)
    while vehicle.position[2] < 1.0:
        vehicle.obey(_intent(first, vehicle))
        vehicle.advance(0.05)
    second = goto((-5.0, 0.0, 4.0))
    second.cancel(vehicle.now)
    flight = fly(second, vehicle)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert vehicle.speed < CONFIG.stop_speed_m_s
    assert vehicle.position[2] < 2.4


def test_a_new_goal_while_the_old_one_disarms_arms_again() -> None:
    vehicle, first = PointMass(delays={TaskOperation.TAKE_OFF: 5.0}), goto()
    first.start(vehicle.observe(), vehicle.now)
    while first.phase is not Phase.DISARMING:
        if first.phase is Phase.TAKING_OFF:
            first.cancel(vehicle.now)
        vehicle.obey(_intent(first, vehicle))
        vehicle.advance(0.05)
    flight = fly(goto(), vehicle)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert [request.kind for request in vehicle.requests][-3:] == [
        TaskOperation.DISARM,
        TaskOperation.ARM,
        TaskOperation.TAKE_OFF,
    ]


def test_a_successor_cancelled_before_its_first_step_still_brakes() -> None:
    vehicle, first = hovering(), goto((60.0, 0.0, 2.5))
    first.start(vehicle.observe(), vehicle.now)
    while vehicle.now < 103.0:
        vehicle.obey(_intent(first, vehicle))
        vehicle.advance(0.05)
    sent = Handover(first.commanded, first.commanded_yaw_enu_rad)
    second = fly_to(GotoGoal((0.0, 0.0, 2.5)), FlightTerms(CONFIG, sent))
    second.cancel(vehicle.now)
    flight = fly(second, vehicle)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert vehicle.speed < CONFIG.stop_speed_m_s


def _intent(task: SetpointFlight, vehicle: PointMass) -> Fly | Perform | Wait:
    answer = task.step(vehicle.observe(), vehicle.now)
    assert not isinstance(answer, Outcome)
    return answer


# --- progress ------------------------------------------------------------------------------


def test_the_estimate_falls_and_is_right_half_way() -> None:
    vehicle, task = hovering(), goto((80.0, 20.0, 12.0))
    estimates: list[tuple[float, float, float]] = []

    def note(elapsed_s: float) -> None:
        progress = task.progress(vehicle.observe(), vehicle.now)
        estimates.append((elapsed_s, progress.time_remaining_s, progress.distance_remaining_m))

    flight = fly(task, vehicle, note)
    total_s = flight.steps[-1][0] - 100.0
    for (_, t0, d0), (_, t1, d1) in pairwise(estimates):
        assert t1 <= t0 + 0.05
        assert d1 <= d0 + 0.05
    elapsed_s, left_s, _ = estimates[len(estimates) // 2]
    assert left_s == pytest.approx(total_s - elapsed_s, rel=0.1)
    assert estimates[0][1] == pytest.approx(total_s, rel=0.1)


def test_the_estimate_from_the_ground_counts_the_phases_ahead() -> None:
    vehicle, task = PointMass(delays={TaskOperation.ARM: 3.0, TaskOperation.TAKE_OFF: 2.0}), goto()
    task.start(vehicle.observe(), vehicle.now)
    first = task.progress(vehicle.observe(), vehicle.now)
    flight = fly(task, vehicle)
    assert first.status is Status.PREPARING
    assert first.time_remaining_s == pytest.approx(flight.steps[-1][0] - 100.0, rel=0.15)
    assert first.distance_remaining_m == pytest.approx(2.0 + math.hypot(10.0, 5.0), rel=1e-3)


def test_progress_after_the_end_is_nothing_left() -> None:
    vehicle, task = hovering(), goto()
    fly(task, vehicle)
    progress = task.progress(vehicle.observe(), vehicle.now)
    assert (progress.distance_remaining_m, progress.time_remaining_s) == (0.0, 0.0)


# --- settings -------------------------------------------------


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("arrival_radius_m", 0.0),
        ("arrival_dwell_s", -1.0),
        ("cancel_timeout_s", math.nan),
        ("tracking_error_max_m", math.inf),
        ("takeoff_height_min_m", 9.0),
    ],
)
def test_settings_that_make_no_sense_are_named(name: str, value: float) -> None:
    with pytest.raises(GotoConfigError, match=name):
        GotoConfig(**{name: value})  # type: ignore[arg-type]


# --- a position that is in doubt -----------------------------------------------------


def doubtful_from(
    vehicle: PointMass, from_s: float, to_s: float, jump_s: float = math.inf
) -> Callable[[float], None]:
    """Return what brings the position into doubt for a time, and lets the estimate jump."""

    def each_step(elapsed_s: float) -> None:
        vehicle.position_doubt = "it says so" if from_s <= elapsed_s < to_s else ""
        if elapsed_s >= jump_s:
            vehicle.believed_off = (0.0, 20.0, 0.0)

    return each_step


def test_a_position_in_doubt_is_held_by_the_velocity_however_long_and_then_it_continues() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 2.5))
    statuses = []
    doubt = doubtful_from(vehicle, 4.0, 34.0)

    def watch(elapsed_s: float) -> None:
        doubt(elapsed_s)
        statuses.append(task.progress(vehicle.observe(), vehicle.now).status)

    flight = fly(task, vehicle, watch)
    assert flight.outcome.code is OutcomeCode.SUCCESS
    assert Status.HOLDING in statuses
    begun_s = flight.steps[0][0]
    held = [(t - begun_s, answer) for t, answer in flight.setpoints if answer.by_velocity]
    assert held[0][0] == pytest.approx(4.0, abs=0.1)
    assert held[-1][0] == pytest.approx(34.0, abs=0.1)
    assert norm(held[-1][1].setpoint.velocity_enu_m_s) == 0.0


def test_an_estimate_that_jumps_while_it_is_in_doubt_moves_nothing() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 2.5))
    each_step = doubtful_from(vehicle, 4.0, 1e9, jump_s=14.0)
    stood: list[tuple[float, float, float]] = []

    def watch(elapsed_s: float) -> None:
        each_step(elapsed_s)
        if elapsed_s >= 13.0 and not stood:
            stood.append(vehicle.position)
        if elapsed_s >= 30.0:
            task.cancel(elapsed_s)

    flight = fly(task, vehicle, watch)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert distance(vehicle.position, stood[0]) < 0.3


def test_a_brake_that_began_in_doubt_ends_by_the_velocity() -> None:
    """Positions sent to the vehicle are past once it was held without them."""
    vehicle, task = hovering(), goto((60.0, 0.0, 2.5))
    each_step = doubtful_from(vehicle, 4.0, 8.0, jump_s=7.0)

    def watch(elapsed_s: float) -> None:
        each_step(elapsed_s)
        if elapsed_s >= 7.5:
            task.cancel(elapsed_s)

    flight = fly(task, vehicle, watch)
    assert flight.outcome.code is OutcomeCode.CANCELED
    assert all(answer.by_velocity for _, answer in flight.setpoints[-10:])
    assert vehicle.speed < CONFIG.stop_speed_m_s


def test_a_pause_outlasts_a_doubt() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 2.5))
    doubt = doubtful_from(vehicle, 4.0, 8.0)

    def watch(elapsed_s: float) -> None:
        doubt(elapsed_s)
        if 5.0 <= elapsed_s < 5.1:
            task.pause(elapsed_s)
        if 9.0 <= elapsed_s < 10.0:
            assert task.phase is Phase.PAUSED
        elif elapsed_s >= 10.0:
            task.unpause(elapsed_s)

    assert fly(task, vehicle, watch).outcome.code is OutcomeCode.SUCCESS


def test_a_position_that_is_lost_while_it_is_in_doubt_ends_the_flight() -> None:
    vehicle, task = hovering(), goto((60.0, 0.0, 2.5))
    doubt = doubtful_from(vehicle, 4.0, 1e9)

    def watch(elapsed_s: float) -> None:
        doubt(elapsed_s)
        vehicle.position_known = elapsed_s < 20.0

    flight = fly(task, vehicle, watch)
    assert flight.outcome.code is OutcomeCode.NO_POSITION
    assert flight.steps[-1][0] - flight.steps[0][0] == pytest.approx(
        20.0 + CONFIG.position_timeout_s, abs=0.3
    )
