"""The rest of a route that a page sent and that was interrupted."""

from __future__ import annotations

from rclpy.task import Future

from custom_interfaces.action import NavigateWaypoints
from custom_interfaces.msg import Waypoint
from drone_navigation.console.goals.interrupted_route import InterruptedRoute
from drone_navigation.console.messages import PageWaypoint

PLACES = tuple(PageWaypoint((float(i), 0.0, 5.0), 0.0) for i in range(4))
GOAL = NavigateWaypoints.Goal(waypoints=[Waypoint()] * 4, laps=2, max_speed=3.0, yaw_rate=0.5)


def ended(**result: int) -> InterruptedRoute:
    route, future = InterruptedRoute(), Future()
    route.begin(GOAL, PLACES, future)
    assert route.value() is None
    response = NavigateWaypoints.Impl.GetResultService.Response()
    response.result = NavigateWaypoints.Result(**result)
    future.set_result(response)
    return route


def test_a_route_continues_with_the_leg_on_which_it_was_interrupted() -> None:
    route = ended(next_index=5, route_id=77)
    assert route.value() == {"next": 5, "waypoints": 8}
    found = route.rest()
    assert found is not None
    goal, places = found
    assert (goal.first, goal.interrupted_id, goal.laps, goal.max_speed) == (4, 77, 2, 3.0)
    assert (len(goal.waypoints), goal.yaw_rate) == (4, 0.5)
    assert places == PLACES
    route.begin(goal, places, Future())
    assert route.value() is None
    assert route.rest() is None


def test_a_route_that_was_flown_or_never_begun_does_not_continue() -> None:
    for route in (ended(next_index=8, route_id=77), ended(), InterruptedRoute()):
        assert route.value() is None
        assert route.rest() is None
    route = ended(next_index=0, route_id=77)
    assert route.value() == {"next": 1, "waypoints": 8}
