"""Photos, and the point at which a gimbal looks, for pages. One thread only."""

from __future__ import annotations

import uuid

from std_srvs.srv import Trigger
from unique_identifier_msgs.msg import UUID

from custom_interfaces.action import PointGimbal
from drone_navigation.console.messages import PagePhoto, PagePoint
from drone_navigation.console.requests import POINT_SERVICES, Answer, VehicleRequests
from navigation_bridge.names import FRAME_MAP

__all__ = ["ask_payload"]


def ask_payload(requests: VehicleRequests, asked: PagePhoto | PagePoint, answer: Answer) -> None:
    """Take a photo, or point the gimbal; the page is told whether the vehicle did it."""
    if requests.is_silent(answer):
        return
    if isinstance(asked, PagePhoto):
        _take_photo(requests, answer)
    else:
        _point(requests, asked, answer)


def _take_photo(requests: VehicleRequests, answer: Answer) -> None:
    def take(done: Trigger.Response) -> None:
        answer(done.success, _sentence(done.success, done.message))

    def late() -> None:
        answer(False, "The server did not answer the request for a photo.")

    if not requests.ask(Trigger, "trigger_camera", Trigger.Request(), take, late=late):
        answer(False, "The server of this vehicle does not take photos.")


def _point(requests: VehicleRequests, asked: PagePoint, answer: Answer) -> None:
    goal = PointGimbal.Goal(mode=PointGimbal.Goal.POINT)
    goal.target.header.frame_id = FRAME_MAP
    place = goal.target.point
    place.x, place.y, place.z = asked.east_m, asked.north_m, asked.up_m
    goal_id = UUID(uuid=list(uuid.uuid4().bytes))
    (send, kind), (result, result_kind) = POINT_SERVICES.items()

    def end(done: PointGimbal.Impl.GetResultService.Response) -> None:
        found = done.result
        answer(found.success, _sentence(found.success, found.message))

    def late() -> None:
        answer(False, "The server did not answer how the gimbal points.")

    def take(done: PointGimbal.Impl.SendGoalService.Response) -> None:
        request = result_kind.Request(goal_id=goal_id)
        if not done.accepted:
            answer(False, "The server does not point the gimbal now.")
        elif not requests.ask(result_kind, result, request, end, late=late):
            late()

    request = kind.Request(goal_id=goal_id, goal=goal)
    if not requests.ask(kind, send, request, take, late=late):
        answer(False, "The server of this vehicle does not point gimbals.")


def _sentence(success: bool, message: str) -> str:
    """Return what the page shows; the code of a success is not of use."""
    return message.partition(": ")[2] if success else message
