"""The targets of a plane, and when it has passed or circled them."""

from __future__ import annotations

import math

import pytest

from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Outcome, Perform, Wait
from navigation_core.tasks.observation import (
    Observation,
    OperationReport,
    OperationStatus,
    TaskOperation,
    VehicleMode,
)
from navigation_core.tasks.watching.plane import FlyPlane
from navigation_core.tasks.watching.plane_route import Circling, PlaneRoute
from navigation_core.tasks.waypoint import Route, RouteError, RouteWaypoint
from tests.support.models.vehicle_traits import PLANE

ACHIEVED, PENDING, REFUSED = (
    OperationStatus.ACHIEVED, OperationStatus.PENDING, OperationStatus.REFUSED,
)  # fmt: skip
Place = tuple[float, float, float]


def waypoint(
    place: Place, hold_time_s: float = 0.0, speed_m_s: float | None = None
) -> RouteWaypoint:
    return RouteWaypoint(place, 0.5, hold_time_s, max_speed_m_s=speed_m_s)


def seen(
    place: Place,
    report: tuple[TaskOperation, OperationStatus] | None = None,
    armed: bool = True,
    airborne: bool = True,
    in_control: bool = True,
) -> Observation:
    operation = None if report is None else OperationReport(*report, reason="no")
    return Observation(
        0.0, place, (15.0, 0.0, 0.0), 0.0, armed, in_control, airborne, 0.0, 0.0, True, operation,
        mode=VehicleMode.CONTROL,
    )  # fmt: skip


def task(*waypoints: RouteWaypoint, may_arm: bool = True) -> FlyPlane:
    return FlyPlane(Route(waypoints), GotoConfig(may_arm=may_arm), PLANE, 40.0)


def test_on_the_ground_it_arms_takes_off_and_only_then_goes_to_the_place() -> None:
    plane, target = task(waypoint((300.0, 0.0, 60.0))), (300.0, 0.0, 60.0)
    ground: Place = (0.0, 0.0, 0.0)
    asked = []
    report, armed, airborne = None, False, False
    for now in range(8):
        answer = plane.step(seen(ground, report, armed, airborne), float(now))
        assert not isinstance(answer, Outcome)
        if not isinstance(answer, Perform):
            break
        asked.append((answer.kind, answer.height_m, answer.target_enu_m))
        report = (answer.kind, ACHIEVED)
        armed, airborne = True, answer.kind is not TaskOperation.ARM
    kinds = list(dict.fromkeys(asked))
    assert kinds == [
        (TaskOperation.ARM, None, None),
        (TaskOperation.TAKE_OFF, 40.0, None),
        (TaskOperation.REPOSITION, None, target),
    ]


def test_a_plane_on_the_ground_stays_there_without_leave_to_take_off() -> None:
    plane = task(waypoint((300.0, 0.0, 60.0)), may_arm=False)
    end = plane.step(seen((0.0, 0.0, 0.0), airborne=False), 0.0)
    assert isinstance(end, Outcome)
    assert end.code.value == "TAKEOFF_NOT_ALLOWED"


def armed_on_the_ground() -> FlyPlane:
    """Return a plane's task that has armed it, and asks for the take-off."""
    plane, ground = task(waypoint((300.0, 0.0, 60.0))), (0.0, 0.0, 0.0)
    plane.step(seen(ground, armed=False, airborne=False), 0.0)
    asks = plane.step(seen(ground, (TaskOperation.ARM, ACHIEVED), airborne=False), 0.1)
    assert isinstance(asks, Perform)
    assert asks.kind is TaskOperation.TAKE_OFF
    return plane


def test_a_plane_that_does_not_take_off_after_it_was_armed_is_disarmed() -> None:
    plane, ground = armed_on_the_ground(), (0.0, 0.0, 0.0)
    asks = plane.step(seen(ground, (TaskOperation.TAKE_OFF, REFUSED), airborne=False), 0.2)
    assert isinstance(asks, Perform)
    assert asks.kind is TaskOperation.DISARM
    disarmed = seen(ground, (TaskOperation.DISARM, ACHIEVED), armed=False, airborne=False)
    end = plane.step(disarmed, 0.3)
    assert isinstance(end, Outcome)
    assert end.code.value == "TAKEOFF_REFUSED"
    assert end.message.endswith("The vehicle is disarmed.")


def test_a_plane_that_is_disarmed_before_its_take_off_ends_at_once() -> None:
    plane = armed_on_the_ground()
    ended = seen((0.0, 0.0, 0.0), (TaskOperation.TAKE_OFF, PENDING), armed=False, airborne=False)
    end = plane.step(ended, 0.2)
    assert isinstance(end, Outcome)
    assert end.code.value == "DISARMED"


def test_a_pause_while_it_is_sent_off_asks_for_the_place_where_it_is() -> None:
    plane = task(waypoint((300.0, 0.0, 60.0)))
    first = plane.step(seen((0.0, 0.0, 50.0)), 0.0)
    assert isinstance(first, Perform)
    assert first.target_enu_m == (300.0, 0.0, 60.0)
    plane.pause(0.1)
    second = plane.step(seen((5.0, 0.0, 12.0), (TaskOperation.REPOSITION, PENDING)), 0.1)
    assert isinstance(second, Perform)
    assert second.target_enu_m == (5.0, 0.0, 20.0), "no lower than it may circle"


def test_a_rejected_speed_does_not_end_the_flight_but_is_reported_at_its_end() -> None:
    plane = task(waypoint((300.0, 0.0, 60.0), speed_m_s=3.0))
    here: Place = (0.0, 0.0, 60.0)
    plane.step(seen(here), 0.0)
    asks = plane.step(seen(here, (TaskOperation.REPOSITION, ACHIEVED)), 0.1)
    assert isinstance(asks, Perform)
    assert (asks.kind, asks.speed_m_s) == (TaskOperation.CHANGE_SPEED, 3.0)
    assert plane.step(seen(here, (TaskOperation.CHANGE_SPEED, REFUSED)), 0.2) == Wait()
    end = plane.step(seen(here, armed=False), 0.3)
    assert isinstance(end, Outcome)
    assert end.code.value == "DISARMED"
    assert "own speed" in end.message


@pytest.mark.parametrize(
    ("observation", "code"),
    [
        (seen((0.0, 0.0, 60.0), armed=False), "DISARMED"),
        (seen((0.0, 0.0, 60.0), in_control=False), "PILOT_OVERRIDE"),
    ],
)
def test_what_takes_the_plane_away_ends_the_goal(observation: Observation, code: str) -> None:
    plane = task(waypoint((300.0, 0.0, 60.0)))
    plane.step(seen((0.0, 0.0, 60.0)), 0.0)
    assert plane.step(seen((0.0, 0.0, 60.0), (TaskOperation.REPOSITION, ACHIEVED)), 0.1) == Wait()
    end = plane.step(observation, 0.2)
    assert isinstance(end, Outcome)
    assert end.code.value == code


def test_what_comes_no_nearer_ends_in_bounded_time() -> None:
    plane, here = task(waypoint((300.0, 0.0, 60.0))), (0.0, 0.0, 60.0)
    plane.step(seen(here), 0.0)
    plane.step(seen(here, (TaskOperation.REPOSITION, ACHIEVED)), 0.1)
    answers = [plane.step(seen(here), float(now)) for now in range(1, 120)]
    end = answers[-1]
    assert isinstance(end, Outcome)
    assert end.code.value == "TIMEOUT"


def test_a_circle_of_another_radius_counts_after_half_a_round() -> None:
    circling, centre = Circling(60.0), (0.0, 0.0, 50.0)
    around = [
        circling.watch((200.0 * math.cos(angle), 200.0 * math.sin(angle), 50.0), centre)
        for angle in (step * 0.1 for step in range(40))
    ]
    assert not any(around[:31])
    assert around[-1]
    assert not circling.watch((200.0, 0.0, 80.0), centre), "not at another height"


def test_a_waypoint_is_passed_near_it_or_when_it_begins_to_be_circled() -> None:
    route = PlaneRoute(Route((waypoint((0.0, 0.0, 50.0)), waypoint((500.0, 0.0, 50.0))), 2), 60.0)
    east = (15.0, 0.0, 0.0)
    assert not route.passed((-110.0, 0.0, 50.0), east), "still coming"
    assert route.passed((0.0, 100.0, 50.0), east), "abreast of it"
    route.advance()
    assert route.current.position_enu_m == (500.0, 0.0, 50.0)
    assert not route.passed((400.0, 100.0, 50.0), (0.0, 15.0, 0.0)), "it never came up to it"
    assert route.passed((450.0, 0.0, 50.0), east)
    assert route.progress().remaining == 3


def test_a_route_of_nothing_is_a_mistake() -> None:
    with pytest.raises(RouteError):
        task()
