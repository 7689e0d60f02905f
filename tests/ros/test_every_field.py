"""Each field of each goal, service and topic at its limits and beyond, by the real server over DDS.

The fields come from the definitions of the interfaces: what is added to one is tested by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from importlib import import_module
from typing import Any

import pytest
from geometry_msgs.msg import Point
from rclpy.action import ActionClient
from rclpy.action.graph import get_action_server_names_and_types_by_node

from custom_interfaces.action import (
    Follow,
    FollowVelocity,
    Land,
    LoadVehicleParameters,
    NavigateWaypoints,
    Orbit,
    ReturnToLaunch,
    Takeoff,
)
from custom_interfaces.msg import (
    Corners,
    FenceArea,
    GoalRejected,
    RallyPoint,
    VehicleParameter,
    Waypoint,
    WaypointAct,
)
from custom_interfaces.srv import (
    ComputeSurvey,
    GetVehicleParameters,
    SetFence,
    SetRallyPoints,
)
from drone_navigation.qos import LATCHED_QOS
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_core.outcomes import OutcomeCode
from tests.support.ros.field_values import message_type, variations
from tests.support.ros.ros_flight import Flight, navigate_goal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("every_field")]

_ANSWER_S = 30.0
_WAYPOINT = Waypoint(position=Point(x=5.0, z=3.0), acts=[WaypointAct()])
GOALS = (
    navigate_goal(5.0, 0.0, 3.0),
    NavigateWaypoints.Goal(waypoints=[_WAYPOINT]),
    Orbit.Goal(radius=5.0, height=3.0, laps=1.0),
    Follow.Goal(pose_topic="/target", max_duration=5.0),
    FollowVelocity.Goal(max_speed=1.0),
    Takeoff.Goal(height=3.0),
    Land.Goal(),
    ReturnToLaunch.Goal(),
)
_CORNERS = [Point(x=0.0, y=0.0), Point(x=30.0, y=0.0), Point(x=30.0, y=30.0)]
REQUESTS = {
    SetFence: SetFence.Request(areas=[FenceArea()]),
    SetRallyPoints: SetRallyPoints.Request(points=[RallyPoint()]),
    GetVehicleParameters: GetVehicleParameters.Request(names=["RTL_ALT"]),
    ComputeSurvey: ComputeSurvey.Request(
        boundary=_CORNERS, holes=[Corners()], height=10.0, spacing=5.0
    ),
    LoadVehicleParameters: LoadVehicleParameters.Goal(parameters=[VehicleParameter()]),
}
_OF_ROS = ("parameter", "get_type_description", "logger_levels", "change_state", "get_state")


@pytest.fixture(scope="module")
def fielded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    """A vehicle that nobody may arm: a goal that is accepted all the same would be a defect."""
    flight = Flight(tmp_path_factory.mktemp("fields"), arming="never")
    yield flight
    flight.close()


def answers(flight: Flight) -> bool:
    """Whether the server still runs and answers, and has had no error of its own."""
    assert flight.server is not None
    assert OutcomeCode.INTERNAL_ERROR.value not in flight.server.text
    assert "Traceback" not in flight.server.text, flight.server.text[-3000:]
    return flight.call("hold").message != "" and not flight.is_armed


@pytest.mark.parametrize("goal", GOALS, ids=lambda goal: type(goal).__qualname__.split("_")[0])
def test_each_field_of_a_goal_is_rejected_with_a_code_and_a_sentence(
    fielded: Flight, goal: Any
) -> None:
    heard: list[GoalRejected] = []
    topic = f"{SERVER_NODE_NAME}/goal_rejected"
    fielded.subscribe(GoalRejected, topic, heard.append, LATCHED_QOS)
    for path, value, changed in variations(goal):
        heard.clear()
        record = fielded.send(changed)
        assert not record.accepted, (path, value)
        fielded.wait(lambda: bool(heard), _ANSWER_S, f"a reason for {path} = {str(value)[:40]}")
        assert heard[-1].error_code != 0, path
        assert heard[-1].code in OutcomeCode.__members__, path
        assert heard[-1].message.endswith("."), (path, heard[-1].message)
    assert answers(fielded)


def offered(flight: Flight) -> list[tuple[str, Any]]:
    """Return the names and types of the server's own services."""
    name = SERVER_NODE_NAME.strip("/")
    found = flight.node.get_service_names_and_types_by_node(name, "/")
    return [
        (service, message_type(kinds[0]))
        for service, kinds in found
        if "/_action/" not in service and not any(part in service for part in _OF_ROS)
    ]


def test_each_field_of_a_service_is_answered(fielded: Flight) -> None:
    services = offered(fielded)
    assert len(services) > 10
    for service, kind in services:
        client = fielded.node.create_client(kind, service)
        assert client.wait_for_service(timeout_sec=_ANSWER_S)
        for path, value, changed in variations(REQUESTS.get(kind, kind.Request())):
            future = client.call_async(changed)
            what = f"an answer to {service} with {path} = {str(value)[:40]}"
            fielded.wait(future.done, _ANSWER_S, what)
            response = future.result()
            if not getattr(response, "success", True):
                assert response.message, what
        fielded.node.destroy_client(client)
    assert answers(fielded)


def test_each_field_of_a_goal_beside_flight_comes_to_an_end(fielded: Flight) -> None:
    flown = {type(goal) for goal in GOALS}
    name = SERVER_NODE_NAME.strip("/")
    for action, kinds in get_action_server_names_and_types_by_node(fielded.node, name, "/"):
        package, _, own = kinds[0].split("/")
        kind = getattr(import_module(f"{package}.action"), own)
        if kind.Goal in flown:
            continue
        client = ActionClient(fielded.node, kind, action)
        assert client.wait_for_server(timeout_sec=_ANSWER_S)
        for path, value, changed in variations(REQUESTS.get(kind, kind.Goal())):
            what = f"{action} with {path} = {str(value)[:40]}"
            sent = client.send_goal_async(changed)
            fielded.wait(sent.done, _ANSWER_S, f"an answer to {what}")
            if sent.result().accepted:
                sent.result().cancel_goal_async()
                ended = sent.result().get_result_async()
                fielded.wait(ended.done, _ANSWER_S, f"an end of {what}")
                assert ended.result().result.message, what
        client.destroy()
    assert answers(fielded)


def is_heard(publisher: Any) -> bool:
    """Whether the server has found a publisher."""
    return bool(publisher.get_subscription_count())


def test_no_field_of_a_topic_harms_the_server(fielded: Flight) -> None:
    name = SERVER_NODE_NAME.strip("/")
    topics = [
        (topic, message_type(kinds[0]))
        for topic, kinds in fielded.node.get_subscriber_names_and_types_by_node(name, "/")
        if topic not in ("/parameter_events", "/clock", "/rosout")
    ]
    assert topics
    for topic, kind in topics:
        publisher = fielded.advertise(kind, topic, 10)
        fielded.wait(partial(is_heard, publisher), _ANSWER_S, topic)
        for _, _, changed in variations(kind()):
            publisher.publish(changed)
            fielded.spin_for(0.0)
        fielded.node.destroy_publisher(publisher)
        assert answers(fielded), topic
