"""The task of a plane that follows velocity commands, with a plane that flies where it is sent."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from navigation_core.geometry import Vector3, horizontal_norm, wrap_angle
from navigation_core.limits import Limits
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.fences import Fence, PolygonArea
from navigation_core.safety.speed_at_bounds import Bounds, SpeedAtBounds
from navigation_core.safety.target_checks import FlightVolume
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from navigation_core.tasks.intents import Outcome, Perform
from navigation_core.tasks.observation import (
    OperationReport,
    OperationStatus,
    TaskOperation,
)
from navigation_core.tasks.progress import Status
from navigation_core.tasks.steering.plane_course import CourseTerms, FlyPlaneCourse
from navigation_core.tasks.watching.plane_route import circle_max_m
from tests.support.models.steered_vehicle import SteeredVehicle
from tests.support.models.vehicle_traits import PLANE

TRAITS = replace(
    PLANE,
    airspeed_m_s=18.0,
    airspeed_min_m_s=12.1,
    airspeed_max_m_s=25.0,
    circle_acceleration_m_s2=5.0,
)
LIMITS = Limits(speed_horizontal_m_s=18.0, speed_up_m_s=3.0, speed_down_m_s=2.0)
CONFIG = GotoConfig(limits=LIMITS, settle_timeout_s=20.0)
BOUNDS = Bounds(FlightVolume(radius_max_m=1000.0, altitude_min_m=25.0, altitude_max_m=120.0), 2.0)
WIDE = Bounds(FlightVolume(radius_max_m=9000.0, altitude_min_m=25.0, altitude_max_m=120.0), 2.0)
FENCE = Fence(
    (PolygonArea(((-400.0, -700.0), (600.0, -700.0), (600.0, 500.0), (-400.0, 800.0))),),
    altitude_max_m=100.0,
)
INSET_M = circle_max_m(TRAITS.circle_radius_m)
PERIOD_S, TIMEOUT_S = 0.1, 0.5
MAP, BODY = VelocityFrame.MAP, VelocityFrame.BODY
EAST = (18.0, 0.0, 0.0)


class Plane(SteeredVehicle):
    """A plane that turns to where it is sent, and the task that sends it."""

    def __init__(self, fence: Fence | None = None, bounds: Bounds = BOUNDS) -> None:
        self.speed_m_s, self.course_rad = 18.0, 0.0
        self.target: Vector3 | None = None
        self.sent: list[Vector3] = []
        self.speeds_m_s: list[float] = []
        task = FlyPlaneCourse(CourseTerms(CONFIG, TRAITS, bounds, TIMEOUT_S, 22.3))
        at_enu_m = (0.0, 0.0, 60.0)
        super().__init__(
            task, TRAITS, CONFIG, position_enu_m=at_enu_m, velocity_enu_m_s=EAST, fence=fence
        )

    @property
    def limited_by(self) -> str:
        return self.task.progress(self.seen, self.now).blocked

    def run(
        self,
        seconds: float,
        linear: Vector3 | None = None,
        rate: float = 0.0,
        frame: VelocityFrame = MAP,
    ) -> None:
        """Continue, with a command at 10 Hz if one is given."""
        for _ in range(round(seconds / PERIOD_S)):
            if linear is not None:
                command = VelocityCommand(self.now, frame, linear, rate)
                self.seen = replace(self.seen, command=command)
            self.answer = self.task.step(self.seen, self.now)
            self._go_where_sent()
            self._move()
            if isinstance(self.answer, Outcome):
                return

    def _go_where_sent(self) -> None:
        answer = self.answer
        if not isinstance(answer, Perform):
            return
        if answer.kind is TaskOperation.REPOSITION:
            assert answer.target_enu_m is not None
            self.target = answer.target_enu_m
            if self.sent[-1:] != [self.target]:
                self.sent.append(self.target)
        else:
            assert answer.speed_m_s is not None
            self.speeds_m_s.append(answer.speed_m_s)
            self.speed_m_s = answer.speed_m_s
        report = OperationReport(answer.kind, OperationStatus.ACHIEVED, "")
        self.seen = replace(self.seen, operation=report)

    def _move(self) -> None:
        x, y, z = self.place
        climb_m_s = 0.0
        if self.target is not None:
            bearing_rad = math.atan2(self.target[1] - y, self.target[0] - x)
            off_rad = wrap_angle(bearing_rad - self.course_rad)
            self.course_rad += min(max(off_rad, -0.3 * PERIOD_S), 0.3 * PERIOD_S)
            climb_m_s = min(max((self.target[2] - z) / 3.0, -4.0), 4.0)
        north = self.speed_m_s * math.sin(self.course_rad)
        velocity = (self.speed_m_s * math.cos(self.course_rad), north, climb_m_s)
        x, y, z = (p + v * PERIOD_S for p, v in zip((x, y, z), velocity, strict=True))
        self.now += PERIOD_S
        self.seen = replace(
            self.seen, time_s=self.now, position_enu_m=(x, y, z), velocity_enu_m_s=velocity
        )


def test_it_turns_to_the_course_that_is_commanded_and_climbs_at_the_rate() -> None:
    plane = Plane(bounds=WIDE)
    plane.run(2.0, (0.0, 18.0, 0.0))
    assert plane.status is Status.TURNING
    plane.run(10.0, (0.0, 18.0, 0.0))
    assert plane.status is Status.NAVIGATING
    assert math.degrees(plane.course_rad) == pytest.approx(90.0, abs=2.0)
    plane.run(5.0, (0.0, 18.0, 2.0))
    before_m = plane.place[2]
    plane.run(10.0, (0.0, 18.0, 2.0))
    assert plane.status is Status.CLIMBING
    assert plane.place[2] - before_m == pytest.approx(20.0, abs=2.0)
    plane.run(5.0, (0.0, 18.0, -1.0))
    before_m = plane.place[2]
    plane.run(10.0, (0.0, 18.0, -1.0))
    assert plane.status is Status.DESCENDING
    assert plane.place[2] - before_m == pytest.approx(-10.0, abs=1.0)


def test_the_speed_is_an_airspeed_that_is_asked_for_once_and_no_higher_than_the_goal_allows() -> (
    None
):
    plane = Plane()
    plane.run(3.0, (16.1, 0.0, 0.0))
    plane.run(3.0, (16.2, 0.0, 0.0))
    plane.run(3.0, (40.0, 0.0, 0.0))
    plane.run(3.0, (12.2, 0.0, 0.0))
    assert plane.speeds_m_s == [16.0, 22.3, 12.1]


def test_a_turn_rate_turns_the_course_and_its_end_keeps_it() -> None:
    plane = Plane()
    plane.run(8.0, EAST, rate=0.2, frame=BODY)
    plane.run(8.0, EAST, frame=BODY)
    assert math.degrees(plane.course_rad) == pytest.approx(math.degrees(1.6), abs=4.0)
    kept_rad = plane.course_rad
    plane.run(5.0, EAST, frame=BODY)
    assert plane.course_rad == pytest.approx(kept_rad, abs=0.02)
    assert plane.status is Status.NAVIGATING


def test_a_turn_rate_that_it_cannot_fly_leads_it_by_a_sixth_of_a_turn_at_most() -> None:
    plane = Plane()
    for _ in range(40):
        plane.run(0.5, EAST, rate=9.0, frame=BODY)
        x, y, _ = plane.place
        led_rad = math.atan2(plane.sent[-1][1] - y, plane.sent[-1][0] - x)
        assert abs(wrap_angle(led_rad - plane.course_rad)) < math.radians(85.0)


@pytest.mark.parametrize(
    ("linear", "rate", "words"),
    [
        ((-15.0, 0.0, 0.0), 0.0, "backwards"),
        ((5.0, 0.0, 0.0), 0.0, "least airspeed of this plane is 12.1 m/s"),
        ((0.0, 0.0, 2.0), 0.0, "with a speed only"),
        ((0.0, 0.0, 0.0), 0.3, "with a speed only"),
    ],
    ids=["backwards", "below the stall", "vertical", "on the spot"],
)
def test_what_a_plane_cannot_fly_has_it_circle_and_a_sentence(
    linear: Vector3, rate: float, words: str
) -> None:
    plane = Plane()
    plane.run(5.0, EAST)
    plane.run(1.0, linear, rate, BODY)
    assert plane.status is Status.BLOCKED
    assert words in plane.limited_by
    sent = len(plane.sent)
    plane.run(5.0, linear, rate, BODY)
    assert len(plane.sent) == sent
    plane.run(2.0, EAST)
    assert plane.status is not Status.BLOCKED
    assert plane.limited_by == ""


def test_without_commands_it_circles_and_the_goal_ends() -> None:
    plane = Plane()
    plane.run(5.0, EAST)
    here = plane.place
    plane.run(1.5)
    assert plane.status is Status.HOLDING
    assert math.dist(plane.sent[-1], here) < 20.0
    plane.run(30.0)
    assert isinstance(plane.answer, Outcome)
    assert plane.answer.code is OutcomeCode.TIMEOUT
    assert "circles where it was" in plane.answer.message


def test_commands_that_end_with_a_stop_end_the_goal_well() -> None:
    plane = Plane()
    plane.run(5.0, EAST)
    plane.run(1.0, (0.0, 0.0, 0.0))
    assert plane.status is Status.HOLDING
    plane.run(30.0)
    assert isinstance(plane.answer, Outcome)
    assert plane.answer.code is OutcomeCode.SUCCESS


@pytest.mark.parametrize("fence", [None, FENCE], ids=["volume", "fence"])
@pytest.mark.parametrize("seed", range(3))
def test_no_place_is_sent_whose_circle_leaves_the_bounds_whatever_is_commanded(
    fence: Fence | None, seed: int
) -> None:
    dice, plane = random.Random(seed), Plane(fence)
    for _ in range(60):
        course_rad, speed_m_s = dice.uniform(-math.pi, math.pi), dice.choice((14.0, 18.0, 22.0))
        level = (speed_m_s * math.cos(course_rad), speed_m_s * math.sin(course_rad))
        linear = (*level, dice.uniform(-5.0, 5.0)) if dice.random() < 0.8 else None
        frame = dice.choice((MAP, BODY))
        plane.run(dice.uniform(1.0, 18.0), linear, dice.uniform(-0.3, 0.3), frame)
        plane.run(0.1, EAST)  # the goal does not end
        assert not isinstance(plane.answer, Outcome)
    room = SpeedAtBounds(BOUNDS.volume, fence, 0.0, BOUNDS.fence_margin_m)
    assert len(plane.sent) > 60
    for x, y, z in plane.sent:
        assert room.room_m((x, y)) >= INSET_M - 1e-6
        assert 25.0 + 8.0 <= z <= (100.0 if fence else 120.0) - 8.0


def test_before_a_bound_it_circles_and_the_course_back_leads_away() -> None:
    plane = Plane(FENCE)
    farthest_m = 0.0
    for _ in range(600):
        plane.run(0.1, EAST)
        farthest_m = max(farthest_m, plane.place[0])
    assert plane.status is Status.BLOCKED
    assert "leads out" in plane.limited_by
    assert 600.0 - INSET_M < farthest_m < 600.0
    plane.run(15.0, (-18.0, 0.0, 0.0))
    assert plane.status is Status.NAVIGATING
    assert plane.place[0] < farthest_m - 50.0


def test_a_climb_out_of_the_bounds_is_limited_and_the_course_is_flown_on() -> None:
    plane = Plane(bounds=WIDE)
    plane.run(40.0, (18.0, 0.0, 3.0))
    assert "climb leads out" in plane.limited_by
    assert plane.status is Status.CLIMBING
    assert plane.place[2] < 113.0
    plane.run(2.0, (18.0, 0.0, -1.0))
    assert plane.limited_by == ""


def test_if_nothing_follows_it_circles_a_short_way_ahead() -> None:
    """A server that ends leaves the plane with the last place."""
    plane = Plane()
    plane.run(20.0, EAST)
    ahead_m = horizontal_norm((plane.sent[-1][0] - plane.place[0], plane.sent[-1][1], 0.0))
    assert 3.0 * TRAITS.circle_radius_m <= ahead_m <= 3.0 * TRAITS.circle_radius_m + 3.0 * 18.0


def test_a_pause_circles_where_it_is_and_a_resume_follows_again() -> None:
    plane = Plane()
    plane.run(5.0, EAST)
    plane.task.pause(plane.now)
    here = plane.place
    plane.run(5.0, EAST)
    assert plane.status is Status.PAUSED
    assert math.dist(plane.sent[-1], here) < 5.0
    plane.task.unpause(plane.now)
    plane.run(5.0, EAST)
    assert plane.status in (Status.NAVIGATING, Status.TURNING)


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        ({"armed": False}, OutcomeCode.DISARMED),
        ({"in_control": False}, OutcomeCode.PILOT_OVERRIDE),
    ],
    ids=["disarmed", "taken over"],
)
def test_what_takes_the_plane_away_ends_the_goal(
    changed: dict[str, bool], code: OutcomeCode
) -> None:
    plane = Plane()
    plane.run(5.0, EAST)
    plane.seen = replace(plane.seen, **changed)  # type: ignore[arg-type]
    plane.run(0.2, EAST)
    assert isinstance(plane.answer, Outcome)
    assert plane.answer.code is code


def test_in_doubt_about_the_position_it_circles() -> None:
    plane = Plane()
    plane.run(5.0, EAST)
    plane.seen = replace(plane.seen, position_doubt="the GPS is gone")
    plane.run(2.0, EAST)
    assert plane.status is Status.HOLDING
    sent = list(plane.sent)
    plane.run(5.0, EAST)
    assert plane.sent == sent
