"""The task that follows velocity commands, with a vehicle that follows its setpoints at once."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from navigation_core.geometry import Vector3, horizontal_norm, norm
from navigation_core.limits import Limits
from navigation_core.mapping.obstacles import Cylinder, Obstacles
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.fences import Fence, PolygonArea
from navigation_core.safety.target_checks import FlightVolume
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from navigation_core.tasks.intents import Fly, Handover, Outcome, Perform, Wait
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig, FlightTerms
from navigation_core.tasks.observation import (
    OperationReport,
    OperationStatus,
    TaskOperation,
    VehicleMode,
)
from navigation_core.tasks.progress import Status
from navigation_core.tasks.steering.follow_velocity import FollowVelocity
from navigation_core.tasks.steering.steersman import VelocityTerms
from navigation_core.tasks.traits import COPTER, Traits
from tests.support.models.steered_vehicle import PERIOD_S, SteeredVehicle

pytestmark = pytest.mark.wide_but_first


LIMITS = Limits(speed_horizontal_m_s=3.0, speed_up_m_s=1.5, speed_down_m_s=1.0)
CONFIG = GotoConfig(limits=LIMITS)
VOLUME = FlightVolume(radius_max_m=100.0, altitude_min_m=0.5, altitude_max_m=30.0)
STEERED = Traits(
    name="rover", flies=False, turning_radius_m=0.9, acceleration_m_s2=1.0, braking_m_s2=1.0
)
TURNED = replace(STEERED, drives_by_turn_rate=True)
FORWARD = (1.0, 0.0, 0.0)


class Steered(SteeredVehicle):
    """A vehicle that is steered by commands."""

    def __init__(
        self,
        traits: Traits = COPTER,
        avoidance: AvoidanceConfig | None = None,
        handover: Handover | None = None,
        max_speed_m_s: float | None = None,
        **seen: object,
    ) -> None:
        terms = FlightTerms(CONFIG, handover or Handover(), traits, avoidance)
        task = FollowVelocity(
            VelocityTerms(terms, VOLUME, command_timeout_s=0.5, max_speed_m_s=max_speed_m_s)
        )
        super().__init__(task, traits, CONFIG, **seen)

    def tell(
        self, linear: Vector3, rate: float = 0.0, frame: VelocityFrame = VelocityFrame.BODY
    ) -> None:
        """Give a command now."""
        self.seen = replace(self.seen, command=VelocityCommand(self.now, frame, linear, rate))

    def run(
        self,
        seconds: float,
        linear: Vector3 | None = None,
        rate: float = 0.0,
        frame: VelocityFrame = VelocityFrame.BODY,
    ) -> None:
        """Continue for a while, with a command at 10 Hz if one is given."""
        for i in range(round(seconds / PERIOD_S)):
            if linear is not None and i % 2 == 0:
                self.tell(linear, rate, frame)
            if isinstance(self.step(), Outcome):
                return


def test_it_flies_as_told_in_the_vehicles_axes() -> None:
    vehicle = Steered(yaw_enu_rad=math.radians(90.0))
    vehicle.run(3.0, (2.0, 0.0, 0.0))
    assert vehicle.velocity == pytest.approx((0.0, 2.0, 0.0), abs=0.01)
    assert vehicle.status is Status.NAVIGATING
    vehicle.run(3.0, (0.0, 1.0, 0.5))  # to the left, and up
    assert vehicle.velocity == pytest.approx((-1.0, 0.0, 0.5), abs=0.01)


def test_it_flies_as_told_in_the_map() -> None:
    vehicle = Steered(yaw_enu_rad=2.0)
    vehicle.run(3.0, (1.0, -2.0, 0.0), frame=VelocityFrame.MAP)
    assert vehicle.velocity == pytest.approx((1.0, -2.0, 0.0), abs=0.01)
    assert vehicle.seen.yaw_enu_rad == pytest.approx(2.0)


def test_it_turns_while_it_is_told_to() -> None:
    vehicle = Steered()
    vehicle.run(2.0, (0.0, 0.0, 0.0), rate=0.5)
    assert vehicle.seen.yaw_enu_rad == pytest.approx(1.0, abs=0.06)
    vehicle.run(2.0, (0.0, 0.0, 0.0), rate=0.0)
    assert vehicle.seen.yaw_enu_rad == pytest.approx(1.0, abs=0.06)
    before = vehicle.seen.yaw_enu_rad
    assert before is not None
    vehicle.run(1.0, (0.0, 0.0, 0.0), rate=-50.0)
    turned = before - vehicle.seen.yaw_enu_rad  # type: ignore[operator]
    assert turned == pytest.approx(LIMITS.yaw_rate_rad_s, abs=0.06)


@pytest.mark.parametrize(
    ("told", "limit"),
    [((50.0, 0.0, 0.0), 3.0), ((30.0, -40.0, 0.0), 3.0), ((0, 0, 9.0), 1.5), ((0, 0, -9.0), 1.0)],
)
def test_the_limits_are_kept_and_used(told: Vector3, limit: float) -> None:
    vehicle = Steered()
    fastest = 0.0
    for _ in range(80):
        vehicle.tell(told)
        vehicle.step()
        fastest = max(fastest, norm(vehicle.velocity))
    assert 0.9 * limit < fastest <= limit


def test_the_speed_of_the_goal_is_the_limit() -> None:
    vehicle = Steered(max_speed_m_s=0.8)
    vehicle.run(5.0, (3.0, 0.0, 0.0))
    assert 0.7 < norm(vehicle.velocity) <= 0.8


def test_acceleration_stays_within_the_limits() -> None:
    vehicle = Steered()
    before = vehicle.velocity
    for i in range(200):
        vehicle.tell((3.0, 0.0, 0.0) if (i // 40) % 2 else (-3.0, 1.0, 0.0))
        vehicle.step()
        change = tuple(a - b for a, b in zip(vehicle.velocity, before, strict=True))
        assert math.hypot(*change) <= 1.1 * LIMITS.acceleration_horizontal_m_s2 * PERIOD_S
        before = vehicle.velocity


@pytest.mark.parametrize("traits", [COPTER, STEERED, TURNED], ids=["copter", "steered", "turned"])
def test_silence_stops_it_and_it_continues_with_the_next_command(traits: Traits) -> None:
    vehicle = Steered(traits)
    vehicle.run(4.0, (2.0, 0.0, 0.0))
    assert horizontal_norm(vehicle.velocity) > 1.5
    vehicle.run(0.45)  # within the timeout
    assert horizontal_norm(vehicle.velocity) > 1.5
    vehicle.run(4.0)
    assert horizontal_norm(vehicle.velocity) < 0.01
    assert vehicle.status is Status.HOLDING
    place = vehicle.place
    vehicle.run(5.0)
    assert math.dist(vehicle.place, place) < 0.02
    vehicle.run(4.0, (1.0, 0.0, 0.0))  # it drives up to its speed without passing it
    assert horizontal_norm(vehicle.velocity) > 0.9


def test_a_command_from_before_the_goal_moves_nothing() -> None:
    vehicle = Steered(command=VelocityCommand(90.0, VelocityFrame.BODY, (3.0, 0.0, 0.0)))
    vehicle.run(2.0)
    assert vehicle.place == pytest.approx((0.0, 0.0, 10.0), abs=1e-6)
    assert vehicle.status is Status.HOLDING


@pytest.mark.parametrize(
    ("last", "code"),
    [
        (None, OutcomeCode.TIMEOUT),
        ((1.0, 0.0, 0.0), OutcomeCode.TIMEOUT),
        ((0.0, 0.0, 0.0), OutcomeCode.SUCCESS),
    ],
)
def test_it_ends_when_nobody_commands_any_more(last: Vector3 | None, code: OutcomeCode) -> None:
    vehicle = Steered()
    if last is not None:
        vehicle.run(2.0, last)
    silent_s = vehicle.now
    vehicle.run(40.0)
    end = vehicle.outcome()
    assert end.code is code, end.message
    assert 20.0 < vehicle.now - silent_s < 24.0
    assert end.message.endswith("The vehicle has stopped.")


def test_a_pause_stops_it_and_commands_count_again_afterwards() -> None:
    vehicle = Steered()
    vehicle.run(2.0, (1.0, 0.0, 0.0))
    assert vehicle.task.pause(vehicle.now) is None
    vehicle.run(30.0, (1.0, 0.0, 0.0))
    assert vehicle.status is Status.PAUSED
    assert norm(vehicle.velocity) < 0.01
    vehicle.task.unpause(vehicle.now)
    vehicle.run(2.0, (1.0, 0.0, 0.0))
    assert norm(vehicle.velocity) > 0.9


def test_a_cancel_stops_it_first() -> None:
    vehicle = Steered()
    vehicle.run(3.0, (3.0, 0.0, 0.0))
    vehicle.task.cancel(vehicle.now)
    vehicle.run(0.2, (3.0, 0.0, 0.0))
    assert vehicle.status is Status.CANCELLING
    vehicle.run(6.0, (3.0, 0.0, 0.0))
    assert vehicle.outcome().code is OutcomeCode.CANCELED
    assert norm(vehicle.velocity) < 0.02


def test_it_takes_control_and_never_arms_or_takes_off() -> None:
    vehicle = Steered(in_control=False)
    assert vehicle.step() == Perform(TaskOperation.TAKE_CONTROL)
    done = OperationReport(TaskOperation.TAKE_CONTROL, OperationStatus.ACHIEVED, "")
    vehicle.seen = replace(vehicle.seen, operation=done, in_control=True)
    assert isinstance(vehicle.step(), Fly)
    for state in ({"airborne": False}, {"armed": False}):
        standing = Steered(**state)  # type: ignore[arg-type]
        standing.step()
        assert standing.outcome().code is OutcomeCode.NOT_FLYING


def test_a_mode_that_is_rejected_ends_it() -> None:
    vehicle = Steered(in_control=False)
    vehicle.step()
    refused = OperationReport(TaskOperation.TAKE_CONTROL, OperationStatus.REFUSED, "no position")
    vehicle.seen = replace(vehicle.seen, operation=refused)
    vehicle.step()
    assert vehicle.outcome().code is OutcomeCode.MODE_REFUSED
    assert "no position" in vehicle.outcome().message


def test_a_cancel_while_it_takes_control_in_the_air_makes_the_vehicle_hold() -> None:
    vehicle = Steered(in_control=False)
    vehicle.step()
    pending = OperationReport(TaskOperation.TAKE_CONTROL, OperationStatus.PENDING, "")
    vehicle.seen = replace(vehicle.seen, operation=pending)
    vehicle.task.cancel(vehicle.now)
    assert vehicle.step() == Perform(TaskOperation.HOLD)
    done = OperationReport(TaskOperation.HOLD, OperationStatus.ACHIEVED, "")
    vehicle.seen = replace(vehicle.seen, operation=done)
    vehicle.run(CONFIG.stop_dwell_s + 1.0)
    assert vehicle.outcome().code is OutcomeCode.CANCELED


@pytest.mark.parametrize(
    ("seen", "code"),
    [
        ({"armed": False}, OutcomeCode.DISARMED),
        ({"in_control": False}, OutcomeCode.PILOT_OVERRIDE),
        ({"airborne": False}, OutcomeCode.LANDED),
    ],
)
def test_what_happens_to_the_vehicle_ends_it(seen: dict[str, bool], code: OutcomeCode) -> None:
    vehicle = Steered()
    vehicle.run(2.0, FORWARD)
    vehicle.seen = replace(vehicle.seen, **seen)  # type: ignore[arg-type]
    vehicle.run(3.0, FORWARD)
    assert vehicle.outcome().code is code


def test_on_the_ground_it_stands_by_velocity() -> None:
    vehicle = Steered()
    vehicle.run(2.0, FORWARD)
    vehicle.seen = replace(vehicle.seen, airborne=False)
    answer = vehicle.step()
    assert isinstance(answer, Fly)
    assert answer.by_velocity
    assert answer.setpoint.velocity_enu_m_s == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("traits", [COPTER, STEERED], ids=["copter", "rover"])
def test_without_a_position_it_holds_by_velocity_and_ends_in_time(traits: Traits) -> None:
    vehicle = Steered(traits)
    vehicle.run(3.0, FORWARD)
    vehicle.seen = replace(vehicle.seen, position_age_s=1.5)
    vehicle.tell(FORWARD)
    answer = vehicle.step()
    assert isinstance(answer, Fly)
    assert answer.by_velocity
    assert horizontal_norm(answer.setpoint.velocity_enu_m_s) < 0.01
    assert vehicle.status is Status.HOLDING
    for _ in range(110):
        vehicle.tell(FORWARD)
        vehicle.step()
    assert vehicle.outcome().code is OutcomeCode.NO_POSITION


def test_a_position_in_doubt_holds_it_and_it_continues_from_where_it_is_then() -> None:
    vehicle = Steered()
    vehicle.run(3.0, FORWARD)
    vehicle.seen = replace(vehicle.seen, position_doubt="The position jumped.")
    vehicle.run(30.0, FORWARD)
    assert isinstance(vehicle.answer, Fly)
    assert vehicle.answer.by_velocity
    assert norm(vehicle.velocity) == 0.0
    vehicle.seen = replace(vehicle.seen, position_doubt="", position_enu_m=(40.0, 5.0, 10.0))
    vehicle.tell(FORWARD)
    answer = vehicle.step()
    assert isinstance(answer, Fly)
    assert math.dist(answer.setpoint.position_enu_m, (40.0, 5.0, 10.0)) < 0.1


@pytest.mark.parametrize("traits", [COPTER, STEERED])
def test_a_position_in_doubt_when_control_is_taken_holds_it_by_velocity(traits: Traits) -> None:
    doubt = "The GPS is 15 m from the estimated position."
    vehicle = Steered(traits, position_doubt=doubt)
    for _ in range(20):
        vehicle.tell(FORWARD)
        answer = vehicle.step()
        assert isinstance(answer, Fly)
        assert answer.by_velocity
        assert norm(answer.setpoint.velocity_enu_m_s) < 0.01


def test_a_pause_of_the_steps_does_not_make_the_reference_jump() -> None:
    vehicle = Steered()
    vehicle.run(3.0, (2.0, 0.0, 0.0))
    vehicle.now += 5.0
    vehicle.seen = replace(vehicle.seen, velocity_enu_m_s=(0.0, 0.0, 0.0))
    vehicle.tell((2.0, 0.0, 0.0))
    answer = vehicle.step()
    assert isinstance(answer, Fly)
    assert norm(answer.setpoint.velocity_enu_m_s) < 0.2


@pytest.mark.parametrize("late_s", [1.0, 5.0])
def test_a_server_that_is_late_stops_it(late_s: float) -> None:
    vehicle = Steered(late_s=late_s)
    vehicle.run(3.0, (3.0, 0.0, 0.0))
    assert norm(vehicle.velocity) == 0.0


@pytest.mark.parametrize("traits", [COPTER, STEERED, TURNED], ids=["copter", "steered", "turned"])
@pytest.mark.parametrize("turn", [0.0, 0.1, -0.4])
def test_it_stops_inside_the_fence_and_says_why(traits: Traits, turn: float) -> None:
    fence = Fence((PolygonArea(((-20, -20), (20, -20), (20, 20), (-20, 20))),))
    vehicle = Steered(traits, fence=fence)
    for _ in range(1200):
        vehicle.tell((3.0, 0.0, 0.0), turn)
        vehicle.step()
        assert fence.allows(vehicle.place[:2]), vehicle.place
    if turn == 0.0:
        assert 18.0 < vehicle.place[0] < 19.5
        assert vehicle.status is Status.BLOCKED
        assert "fence" in vehicle.task.progress(vehicle.seen, vehicle.now).blocked


def test_a_swing_along_the_fence_does_not_lead_through_it() -> None:
    fence = Fence((PolygonArea(((-20, -20), (20, -20), (20, 20), (-20, 20))),))
    vehicle = Steered(fence=fence)
    while vehicle.place[0] < 15.0:
        vehicle.run(0.1, (3.0, 0.0, 0.0), frame=VelocityFrame.MAP)
    for _ in range(200):
        vehicle.tell((0.3, 3.0, 0.0), frame=VelocityFrame.MAP)
        vehicle.step()
        assert fence.allows(vehicle.place[:2]), vehicle.place


def test_it_comes_back_from_outside_the_fence() -> None:
    fence = Fence((PolygonArea(((-20, -20), (20, -20), (20, 20), (-20, 20))),))
    vehicle = Steered(fence=fence, position_enu_m=(25.0, 0.0, 10.0))
    vehicle.run(2.0, (1.0, 0.0, 0.0))
    assert vehicle.place[0] == pytest.approx(25.0)
    vehicle.run(8.0, (-2.0, 0.0, 0.0))
    assert vehicle.place[0] < 15.0


def test_it_neither_descends_to_the_ground_nor_climbs_out_of_the_volume() -> None:
    vehicle = Steered()
    vehicle.run(30.0, (0.0, 0.0, -1.0))
    assert 0.8 < vehicle.place[2] < 1.3
    vehicle.run(60.0, (0.0, 0.0, 2.0))
    assert 29.0 < vehicle.place[2] < 29.6


AVOIDANCE = AvoidanceConfig(blocked_timeout_s=5.0)
TREE = Obstacles.of((Cylinder("tree", (12.0, 0.0), 1.0),))


@pytest.mark.parametrize("traits", [COPTER, STEERED], ids=["copter", "rover"])
@pytest.mark.parametrize("timeout_s", [0.0, 3.0])
def test_it_stops_in_front_of_an_obstacle_and_may_leave_it(
    traits: Traits, timeout_s: float
) -> None:
    vehicle = Steered(replace(traits, setpoint_timeout_s=timeout_s), AVOIDANCE, obstacles=TREE)
    vehicle.run(60.0, (3.0, 0.0, 0.0))
    clear_m = math.dist(vehicle.place[:2], (12.0, 0.0)) - 1.0
    assert AVOIDANCE.brake_clearance_m - 0.1 < clear_m < 4.5
    assert vehicle.status is Status.BLOCKED
    assert "obstacle" in vehicle.task.progress(vehicle.seen, vehicle.now).blocked
    if traits.flies:
        vehicle.run(4.0, (-1.0, 0.0, 0.0))
        assert math.dist(vehicle.place[:2], (12.0, 0.0)) - 1.0 > clear_m + 1.0


def test_without_avoidance_obstacles_do_not_matter() -> None:
    vehicle = Steered(obstacles=TREE)
    vehicle.run(10.0, (3.0, 0.0, 0.0))
    assert vehicle.place[0] > 15.0


def test_a_sensor_that_falls_silent_stops_it_and_in_the_end_ends_it() -> None:
    vehicle = Steered(avoidance=AVOIDANCE)
    vehicle.run(3.0, (2.0, 0.0, 0.0))
    vehicle.seen = replace(vehicle.seen, obstacles_age_s=3.0)
    vehicle.run(3.0, (2.0, 0.0, 0.0))
    assert norm(vehicle.velocity) < 0.01
    assert vehicle.status is Status.BLOCKED
    vehicle.run(3.0, (2.0, 0.0, 0.0))
    assert vehicle.outcome().code is OutcomeCode.NO_OBSTACLE_DATA


def test_what_is_steered_by_its_course_turns_it_and_cannot_go_backwards() -> None:
    vehicle = Steered(STEERED)
    vehicle.run(4.0, (1.0, 0.0, 0.0), rate=0.3)
    assert vehicle.seen.yaw_enu_rad == pytest.approx(0.3 * 4.0, abs=0.15)
    vehicle.run(4.0, (-1.0, 0.0, 0.0))
    assert horizontal_norm(vehicle.velocity) < 0.01
    assert vehicle.status is Status.BLOCKED
    assert "backwards" in vehicle.task.progress(vehicle.seen, vehicle.now).blocked


def test_what_is_steered_by_turn_rates_goes_backwards_and_turns_on_the_spot() -> None:
    vehicle = Steered(TURNED)
    vehicle.run(4.0, (-1.0, 0.0, 0.0), rate=0.2)
    assert isinstance(vehicle.answer, Fly)
    assert vehicle.answer.turn_rate_rad_s == 0.2
    heading = vehicle.answer.setpoint.yaw_enu_rad
    velocity = vehicle.answer.setpoint.velocity_enu_m_s
    along = velocity[0] * math.cos(heading) + velocity[1] * math.sin(heading)
    assert along == pytest.approx(-1.0, abs=0.02)
    vehicle.run(3.0, (0.0, 0.0, 0.0), rate=5.0)
    assert isinstance(vehicle.answer, Fly)
    assert vehicle.answer.turn_rate_rad_s == pytest.approx(1.0)  # the limit of its traits
    assert horizontal_norm(vehicle.velocity) < 0.01


@pytest.mark.parametrize("traits", [STEERED, TURNED], ids=["steered", "turned"])
def test_what_drives_heads_for_the_direction_of_a_velocity_in_the_map(traits: Traits) -> None:
    vehicle = Steered(traits)
    vehicle.run(6.0, (0.0, 2.0, 5.0), frame=VelocityFrame.MAP)
    assert vehicle.velocity == pytest.approx((0.0, 2.0, 0.0), abs=0.1)
    assert isinstance(vehicle.answer, Fly)
    assert vehicle.answer.turn_rate_rad_s is None


def test_a_successor_starts_from_what_was_sent() -> None:
    vehicle = Steered()
    vehicle.run(3.0, (2.0, 0.0, 0.0))
    commanded = vehicle.task.commanded
    assert commanded is not None
    assert commanded.velocity_enu_m_s == pytest.approx((2.0, 0.0, 0.0), abs=0.05)
    after = Steered(handover=Handover(commanded, vehicle.task.commanded_yaw_enu_rad, vehicle.now))
    after.seen = replace(vehicle.seen, command=None, time_s=100.0)
    answer = after.step()
    assert isinstance(answer, Fly)
    assert norm(answer.setpoint.velocity_enu_m_s) > 1.5
    after.run(5.0)
    assert norm(after.velocity) < 0.01


@pytest.mark.parametrize("by_itself", [True, False])
def test_a_successor_of_a_return_that_is_cancelled_at_once_stops_it(by_itself: bool) -> None:
    vehicle = Steered(
        handover=Handover(by_itself=by_itself),
        in_control=False,
        mode=VehicleMode.RETURN,
        velocity_enu_m_s=(3.0, 0.0, 0.0),
    )
    vehicle.task.cancel(vehicle.now)
    vehicle.step()
    if not by_itself:  # it is not this goal's: a pilot may have asked for it
        assert isinstance(vehicle.answer, Outcome)
        return
    assert vehicle.answer == Perform(TaskOperation.HOLD)
    held = OperationReport(TaskOperation.HOLD, OperationStatus.ACHIEVED, "")
    vehicle.seen = replace(vehicle.seen, operation=held, mode=VehicleMode.HOLD)
    vehicle.run(1.0)
    assert isinstance(vehicle.answer, Wait)
    vehicle.seen = replace(vehicle.seen, velocity_enu_m_s=(0.0, 0.0, 0.0))
    vehicle.run(CONFIG.stop_dwell_s + 1.0)
    assert isinstance(vehicle.answer, Outcome)
    assert vehicle.answer.code is OutcomeCode.CANCELED
