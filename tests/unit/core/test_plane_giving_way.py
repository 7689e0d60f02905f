"""A plane gives way: where it is sent, what it does if it cannot, and how that ends."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from navigation_core.mapping.obstacle_shapes import Cylinder
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.safety.fences import CircleArea, Fence
from navigation_core.safety.speed_at_bounds import Bounds
from navigation_core.safety.target_checks import FlightVolume
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from navigation_core.tasks.intents import Intent, Outcome, Perform, Wait
from navigation_core.tasks.observation import (
    Observation,
    OperationReport,
    OperationStatus,
    TaskOperation,
    VehicleMode,
)
from navigation_core.tasks.progress import Status
from navigation_core.tasks.steering.plane_course import CourseTerms, FlyPlaneCourse
from navigation_core.tasks.traffic.intruders import Intruder
from navigation_core.tasks.traffic.reservations import TrafficReservations
from navigation_core.tasks.traffic.traffic_view import TrafficFrame, TrafficView
from navigation_core.tasks.traffic.volumes import Volume
from navigation_core.tasks.watching.plane import FlyPlane
from navigation_core.tasks.waypoint import Route, RouteWaypoint
from tests.support.models.vehicle_traits import PLANE

GOAL = (1000.0, 0.0, 60.0)
HEAD_ON = Intruder(np.array([500.0, 0.0, 60.0]), np.array([-20.0, 0.0, 0.0]), 0.0, 0.0, 0.0)
Place = tuple[float, float, float]


def view(intruder: Intruder = HEAD_ON, **fields: Any) -> TrafficView:
    """Return traffic with one intruder."""
    picture = TrafficReservations()
    entry = picture.entry("X")
    entry.intruder, entry.moves = intruder, True
    values: dict[str, Any] = {"heights_m": (5.0, 120.0), "timeout_s": 30.0, **fields}
    return TrafficView(picture, "a", TrafficFrame.level(), **values)


def seen(
    traffic: TrafficView | None,
    status: OperationStatus | None = None,
    place: Place = (0.0, 0.0, 60.0),
    **fields: Any,
) -> Observation:
    """Return a plane that flies east."""
    report = None if status is None else OperationReport(TaskOperation.REPOSITION, status, "no")
    observed = Observation(
        0.0, place, (15.0, 0.0, 0.0), 0.0, True, True, True, 0.0, 0.0, True, report,
        mode=VehicleMode.CONTROL, traffic=traffic,
    )  # fmt: skip
    return replace(observed, **fields)


def task() -> FlyPlane:
    return FlyPlane(Route((RouteWaypoint(GOAL, 0.5, 0.0),)), GotoConfig(may_arm=True), PLANE, 40.0)


def sent_to(answer: Intent | Outcome) -> Place:
    assert isinstance(answer, Perform)
    assert answer.kind is TaskOperation.REPOSITION
    assert answer.target_enu_m is not None
    return answer.target_enu_m


def test_it_is_sent_elsewhere_for_an_intruder_and_back_behind_it() -> None:
    plane, traffic = task(), view()
    place = sent_to(plane.step(seen(traffic), 0.0))
    assert place != GOAL
    progress = plane.progress(seen(traffic), 0.0)
    assert progress.status is Status.WAITING_FOR_TRAFFIC
    assert progress.blocked == "Waits for X, which would come too near."
    assert plane.step(seen(traffic, OperationStatus.ACHIEVED), 0.1) == Wait()
    traffic.reservations.forget("X")
    assert sent_to(plane.step(seen(traffic, OperationStatus.ACHIEVED), 0.6)) == GOAL
    assert plane.progress(seen(traffic), 0.6).status is Status.NAVIGATING


def test_another_height_is_preferred_to_another_place() -> None:
    x, y, z = sent_to(task().step(seen(view()), 0.0))
    assert (x, y) == GOAL[:2]
    assert abs(z - 60.0) >= 3.0


def test_it_is_sent_aside_where_the_heights_are_too_few() -> None:
    x, y, z = sent_to(task().step(seen(view(heights_m=(55.0, 75.0))), 0.0))
    assert (x, y) != GOAL[:2]
    assert 55.0 <= z <= 67.0


@pytest.mark.parametrize("climb_m_s", [0.0, -2.0, 2.0])
def test_it_is_never_sent_lower_than_it_may_circle(climb_m_s: float) -> None:
    low = (0.0, 0.0, 22.0)
    intruder = replace(
        HEAD_ON,
        position_m=np.array([500.0, 0.0, 22.0 - 14.0 * climb_m_s]),
        velocity_m_s=np.array([-20.0, 0.0, climb_m_s]),
    )
    assert sent_to(task().step(seen(view(intruder), place=low), 0.0))[2] >= 20.0


def test_it_is_not_sent_where_an_obstacle_or_the_fence_is() -> None:
    traffic = view(heights_m=(55.0, 75.0))
    first = sent_to(task().step(seen(traffic), 0.0))
    tower = Obstacles.of((Cylinder("tower", first[:2], 60.0),))
    zone = Fence((CircleArea(first[:2], 60.0, inclusion=False),))
    for observation in (seen(traffic, obstacles=tower), seen(traffic, fence=zone)):
        other = sent_to(task().step(observation, 0.0))
        assert other != GOAL
        # Its circle does not cross the one that is closed.
        assert math.dist(other[:2], first[:2]) > 120.0


def test_it_is_not_sent_where_another_vehicle_is() -> None:
    traffic = view()
    first = sent_to(task().step(seen(traffic), 0.0))
    others = Volume.along(np.array([[60.0, 0.0, first[2]]]), 5.0, 5.0)
    traffic.reservations.stand("b", others, 0.0)
    assert sent_to(task().step(seen(traffic), 0.0)) != first


def test_a_rejected_evasion_does_not_end_the_goal() -> None:
    plane, traffic = task(), view()
    sent_to(plane.step(seen(traffic), 0.0))
    assert plane.step(seen(traffic, OperationStatus.REFUSED), 0.1) == Wait()
    assert sent_to(plane.step(seen(traffic), 0.2)) == GOAL
    assert plane.progress(seen(traffic), 0.2).status is Status.WAITING_FOR_TRAFFIC
    assert plane.step(seen(traffic, OperationStatus.ACHIEVED), 0.3) == Wait()


def test_one_that_cannot_give_way_continues_and_reports_that() -> None:
    near = replace(HEAD_ON, position_m=np.array([40.0, 0.0, 60.0]))
    plane, traffic = task(), view(near, reach_m=1.0)
    assert sent_to(plane.step(seen(traffic), 0.0)) == GOAL
    said = plane.progress(seen(traffic), 0.0).blocked
    assert said == "Waits for X, which may come nearer than the separation, whatever is flown."


def test_a_goal_ends_that_an_intruder_keeps_from_its_target() -> None:
    plane = task()
    answer: Intent | Outcome = Wait()
    for step in range(400):
        now = 0.1 * step
        traffic = view(replace(HEAD_ON, time_s=now))
        answer = plane.step(seen(traffic, OperationStatus.ACHIEVED), now)
        if isinstance(answer, Outcome):
            break
    assert isinstance(answer, Outcome)
    assert answer.code.value == "TRAFFIC"
    assert "X" in answer.message
    assert now == pytest.approx(30.0, abs=2.0)


def test_a_cancel_circles_clear_of_the_intruder_and_says_so() -> None:
    plane, traffic = task(), view()
    plane.step(seen(traffic), 0.0)
    plane.cancel(0.1)
    sent_to(plane.step(seen(traffic, OperationStatus.PENDING), 0.1))
    end = plane.step(seen(traffic, OperationStatus.ACHIEVED), 0.2)
    assert isinstance(end, Outcome)
    assert end.code.value == "CANCELED"
    assert "elsewhere" in end.message


def test_an_intruder_that_stays_away_changes_nothing() -> None:
    away = replace(HEAD_ON, position_m=np.array([500.0, 300.0, 60.0]))
    plane = task()
    assert sent_to(plane.step(seen(view(away)), 0.0)) == GOAL
    assert plane.progress(seen(view(away)), 0.0).status is Status.NAVIGATING


def test_a_plane_that_circles_to_the_left_is_expected_there() -> None:
    # It is on its circle, and about to turn towards the one or the other side.
    here = (GOAL[0], GOAL[1] - 60.0, 60.0)
    left = Intruder(np.array([1130.0, 60.0, 60.0]), np.array([-7.0, -7.0, 0.0]), 0.0, 0.0, 0.0)
    for circles_left in (True, False):
        traits = replace(PLANE, circles_left=circles_left)
        route = Route((RouteWaypoint(GOAL, 0.5, 0.0),))
        plane = FlyPlane(route, GotoConfig(may_arm=True), traits, 40.0)
        place = sent_to(plane.step(seen(view(left), place=here), 0.0))
        assert (place != GOAL) is circles_left


def test_one_that_follows_a_course_gives_way_and_is_sent_on_behind_it() -> None:
    traits = replace(PLANE, airspeed_min_m_s=10.0, airspeed_max_m_s=25.0)
    bounds = Bounds(FlightVolume(9000.0, 25.0, 120.0), 2.0)
    near = replace(HEAD_ON, position_m=np.array([260.0, 0.0, 60.0]))
    plane, traffic = (
        FlyPlaneCourse(CourseTerms(GotoConfig(), traits, bounds, 0.5, 20.0)),
        view(near),
    )
    east = (0.0, 0.0, 60.0)

    def at(now: float, status: OperationStatus | None = None) -> Observation:
        told = VelocityCommand(now, VelocityFrame.MAP, (15.0, 0.0, 0.0))
        return seen(traffic, status, place=(15.0 * now, 0.0, 60.0), command=told)

    plane.start(at(0.0), 0.0)
    x, y, z = sent_to(plane.step(at(0.0), 0.0))
    assert (x, y, z) != (x, *east[1:])
    assert plane.progress(at(0.0), 0.0).status is Status.WAITING_FOR_TRAFFIC
    asks = plane.step(at(0.1, OperationStatus.ACHIEVED), 0.1)
    assert isinstance(asks, Perform)
    assert (asks.kind, asks.speed_m_s) == (TaskOperation.CHANGE_SPEED, 15.0)
    traffic.reservations.forget("X")
    ahead = sent_to(plane.step(at(1.5, OperationStatus.ACHIEVED), 1.5))
    assert ahead[1:] == pytest.approx(east[1:])
    assert plane.progress(at(1.5), 1.5).status is Status.NAVIGATING
