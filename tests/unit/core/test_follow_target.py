"""The task that follows a target, with a vehicle that follows its setpoints at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from navigation_core.geometry import Vector3, distance, norm
from navigation_core.limits import Limits
from navigation_core.mapping.obstacles import Cylinder, Obstacles
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import FlightVolume
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.inputs.tracked_target import TargetFilter, TargetSample
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig, FlightTerms
from navigation_core.tasks.progress import FollowState, Status
from navigation_core.tasks.steering.follow_target import FollowTarget
from navigation_core.tasks.steering.steersman import VelocityTerms
from navigation_core.tasks.steering.target_guide import FollowTerms, YawRule
from navigation_core.tasks.traits import COPTER, Traits
from tests.support.models.steered_vehicle import PERIOD_S, SteeredVehicle

pytestmark = pytest.mark.wide_but_first

LIMITS = Limits(speed_horizontal_m_s=8.0, speed_up_m_s=2.0, speed_down_m_s=1.5)
CONFIG = GotoConfig(limits=LIMITS)
VOLUME = FlightVolume(radius_max_m=100.0, altitude_min_m=0.5, altitude_max_m=30.0)
ROVER = Traits(name="rover", flies=False, acceleration_m_s2=1.0, braking_m_s2=1.0)
BEHIND = FollowTerms((-6.0, 0.0, 4.0), turns=True, least_distance_m=3.0)

Motion = Callable[[float], Vector3]


class Chase(SteeredVehicle):
    """A vehicle, and the target that it follows."""

    def __init__(
        self,
        terms: FollowTerms = BEHIND,
        motion: Motion = lambda _: (20.0, 0.0, 0.0),
        traits: Traits = COPTER,
        avoidance: AvoidanceConfig | None = None,
        **seen: object,
    ) -> None:
        flight = FlightTerms(CONFIG, traits=traits, avoidance=avoidance)
        super().__init__(FollowTarget(VelocityTerms(flight, VOLUME), terms), traits, CONFIG, **seen)
        self.motion = motion
        self.filter = TargetFilter()
        self.is_seen = True
        self.nearest_m = math.inf
        self.fastest_m_s = 0.0

    @property
    def target(self) -> Vector3:
        return self.motion(self.now - 100.0)

    def run(self, seconds: float) -> None:
        """Continue for a while; the target is measured at 10 Hz."""
        for number in range(round(seconds / PERIOD_S)):
            if self.is_seen and number % 2 == 0:
                self.filter.take(TargetSample(self.now, self.target), self.place, self.now)
            self.seen = replace(self.seen, followed=self.filter.tracked)
            if isinstance(self.step(), Outcome):
                return
            self.nearest_m = min(self.nearest_m, distance(self.place, self.target))
            self.fastest_m_s = max(self.fastest_m_s, norm(self.velocity))

    @property
    def shown_target_enu_m(self) -> Vector3 | None:
        follow = self.task.progress(self.seen, self.now).follow
        assert follow is not None
        return follow.position_enu_m

    @property
    def state(self) -> FollowState:
        follow = self.task.progress(self.seen, self.now).follow
        assert follow is not None
        return follow.state

    def error_m(self, offset_m: Vector3) -> float:
        """Return the distance to a place beside the target."""
        place = tuple(a + b for a, b in zip(self.target, offset_m, strict=True))
        return math.dist(self.place, place)


def east(speed_m_s: float, start: Vector3 = (20.0, 0.0, 0.0)) -> Motion:
    """A motion to the east at a constant speed."""
    return lambda passed_s: (start[0] + speed_m_s * passed_s, start[1], start[2])


def test_a_place_behind_a_moving_target_is_kept() -> None:
    chase = Chase(motion=east(5.0, (-60.0, 0.0, 0.0)), position_enu_m=(-70.0, 0.0, 5.0))
    assert chase.state is FollowState.ACQUIRING
    assert chase.shown_target_enu_m is None
    chase.run(15.0)
    assert chase.state is FollowState.FOLLOWING
    assert chase.status is Status.NAVIGATING
    assert chase.error_m((-6.0, 0.0, 4.0)) < 0.3
    assert chase.shown_target_enu_m == pytest.approx(chase.target, abs=0.3)
    assert chase.nearest_m > 3.0
    assert chase.fastest_m_s < 8.0
    assert chase.seen.yaw_enu_rad == pytest.approx(0.0, abs=0.05)


def test_the_vehicle_stands_beside_a_target_that_stands() -> None:
    chase = Chase(replace(BEHIND, offset_m=(0.0, 6.0, 5.0), turns=False))
    chase.run(20.0)
    assert chase.error_m((0.0, 6.0, 5.0)) < 0.1
    assert norm(chase.velocity) < 0.05
    assert chase.seen.yaw_enu_rad == pytest.approx(-math.pi / 2.0, abs=0.1)


def test_the_place_on_the_far_side_is_reached_around_the_target() -> None:
    terms = FollowTerms((6.0, 0.0, 1.0), turns=False, least_distance_m=4.0)
    chase = Chase(terms, lambda _: (15.0, 0.0, 9.0))
    chase.run(30.0)
    assert chase.error_m((6.0, 0.0, 1.0)) < 0.2
    assert chase.nearest_m > 4.0


def test_a_target_that_comes_makes_the_vehicle_back_off() -> None:
    terms = FollowTerms((10.0, 0.0, 5.0), turns=False, least_distance_m=5.0)
    chase = Chase(terms, lambda passed_s: (10.0 + max(40.0 - 3.0 * passed_s, -30.0), 0.0, 9.0))
    chase.run(20.0)
    assert chase.nearest_m > 5.0
    chase.run(20.0)
    assert chase.state is FollowState.FOLLOWING
    assert chase.nearest_m > 5.0


def test_the_vehicle_backs_off_to_the_bound_of_the_volume_and_holds() -> None:
    terms = FollowTerms((-20.0, 0.0, 0.0), turns=False, least_distance_m=10.0)
    chase = Chase(terms, lambda passed_s: (-60.0 - 2.0 * passed_s, 0.0, 10.0))
    chase.seen = replace(chase.seen, position_enu_m=(-85.0, 0.0, 10.0))
    chase.run(15.0)
    assert -99.5 < chase.place[0] < -98.0
    assert norm(chase.velocity) < 0.1


def test_a_target_that_jumps_makes_nobody_race() -> None:
    motion = lambda passed_s: (20.0 if passed_s < 5.0 else 90.0, 0.0, 0.0)  # noqa: E731
    chase = Chase(motion=motion)
    chase.run(5.0)
    chase.run(1.0)
    assert chase.filter.tracked.rejected == 9
    assert "moves at" in chase.filter.tracked.fault
    chase.run(25.0)
    assert chase.fastest_m_s < 8.0
    assert chase.error_m((-6.0, 0.0, 4.0)) < 0.5


def test_a_lost_target_is_waited_for_and_then_ends_the_goal() -> None:
    chase = Chase(replace(BEHIND, lost_timeout_s=5.0), east(3.0, (0.0, 0.0, 0.0)))
    chase.run(4.0)
    chase.is_seen = False
    chase.run(4.0)
    assert chase.state is FollowState.LOST
    assert chase.status is Status.HOLDING
    assert norm(chase.velocity) < 0.1
    chase.is_seen = True
    chase.run(2.0)
    assert chase.state is FollowState.FOLLOWING
    chase.is_seen = False
    chase.run(20.0)
    assert chase.outcome().code is OutcomeCode.TARGET_LOST
    assert "has come for 5 s" in chase.outcome().message


def test_a_target_that_was_never_measured_ends_the_goal_where_the_vehicle_is() -> None:
    chase = Chase(replace(BEHIND, lost_timeout_s=5.0))
    chase.is_seen = False
    start = chase.place
    chase.run(10.0)
    assert chase.outcome().code is OutcomeCode.TARGET_LOST
    assert chase.outcome().message.startswith("No usable sample of the target came within 5 s.")
    assert chase.place == pytest.approx(start, abs=0.05)


def test_a_paused_goal_waits_for_no_target() -> None:
    chase = Chase(replace(BEHIND, lost_timeout_s=5.0))
    chase.run(3.0)
    chase.task.pause(chase.now)
    chase.is_seen = False
    chase.run(20.0)
    assert chase.status is Status.PAUSED
    chase.task.unpause(chase.now)
    chase.run(4.0)
    assert chase.status is Status.HOLDING


def test_the_duration_is_a_success_unless_the_target_is_lost() -> None:
    chase = Chase(replace(BEHIND, max_duration_s=5.0))
    chase.run(10.0)
    assert chase.outcome().code is OutcomeCode.SUCCESS
    assert "followed for 5 s" in chase.outcome().message
    chase = Chase(replace(BEHIND, max_duration_s=5.0))
    chase.run(3.0)
    chase.is_seen = False
    chase.run(20.0)
    assert chase.outcome().code is OutcomeCode.TARGET_LOST


def test_obstacles_are_avoided_on_a_path_around_them() -> None:
    wall = [Cylinder(f"post {y}", (x, y), 1.0) for x, y in ((15.0, -3.0), (15.0, 0.0), (15.0, 3.0))]
    chase = Chase(
        FollowTerms((-5.0, 0.0, 0.0), turns=False, least_distance_m=2.0),
        east(1.0, (12.0, 0.0, 10.0)),
        avoidance=AvoidanceConfig(heights_m=(1.0, 29.0)),
        obstacles=Obstacles.of(tuple(wall)),
    )
    nearest_m = math.inf
    for _ in range(400):
        chase.run(0.1)
        cell = min(math.dist(chase.place[:2], one.centre_enu_m) - 1.0 for one in wall)
        nearest_m = min(nearest_m, cell)
    assert nearest_m > 0.7
    assert chase.error_m((-5.0, 0.0, 0.0)) < 0.5
    assert chase.task.progress(chase.seen, chase.now).replans > 0


def test_a_place_inside_an_obstacle_is_waited_for() -> None:
    chase = Chase(
        FollowTerms((-6.0, 0.0, 0.0), turns=False, least_distance_m=2.0),
        lambda _: (20.0, 0.0, 10.0),
        avoidance=AvoidanceConfig(heights_m=(1.0, 29.0)),
        obstacles=Obstacles.of((Cylinder("post", (14.0, 0.0), 1.0),)),
    )
    chase.run(5.0)
    progress = chase.task.progress(chase.seen, chase.now)
    assert progress.status is Status.BLOCKED
    assert "inside an obstacle" in progress.blocked
    assert norm(chase.velocity) < 0.05


def test_a_rover_follows_over_ground_and_stops_for_a_target_that_comes() -> None:
    terms = FollowTerms((-6.0, 0.0, 4.0), turns=True, least_distance_m=3.0)
    chase = Chase(terms, east(1.5, (8.0, 0.0, 0.0)), ROVER)
    chase.run(20.0)
    assert math.dist(chase.place[:2], (chase.target[0] - 6.0, 0.0)) < 0.6
    before, start = chase.place, chase.target[0]
    began = chase.now
    chase.motion = lambda _: (start - 2.0 * (chase.now - began), 0.0, 0.0)
    chase.run(2.0)
    assert chase.place[0] > before[0] - 0.3
    assert norm(chase.velocity) < 0.1


@pytest.mark.parametrize(
    ("yaw", "course_rad"), [(YawRule.TANGENT, math.pi / 2.0), (YawRule.KEEP, 1.0)]
)
def test_the_yaw_is_as_asked(yaw: YawRule, course_rad: float) -> None:
    terms = replace(BEHIND, yaw=yaw)
    chase = Chase(terms, lambda passed_s: (20.0, 3.0 * passed_s - 30.0, 0.0), yaw_enu_rad=1.0)
    chase.run(12.0)
    assert chase.seen.yaw_enu_rad == pytest.approx(course_rad, abs=0.1)
