"""Services on the fence and the rally points that the autopilot stores."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from rclpy.callback_groups import ReentrantCallbackGroup

from custom_interfaces.msg import FenceArea
from custom_interfaces.srv import GetFence, GetRallyPoints, SetFence, SetRallyPoints
from drone_navigation.message_forms.storage_messages import REFERENCES, area_message, rally_message
from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.waiting import STOPPED, Waiting
from mavlink_vehicle.mission_items import MissionType
from navigation_bridge.storage.geographic import (
    GeoArea,
    GeoFence,
    RallyPoint,
    fence_problem,
    rally_problem,
)
from navigation_bridge.storage.storage_requests import ListAnswer, StorageRequests, TakeList

# The transfer ends by itself before (ListOperation).
_TIMEOUT_S = 120.0
_TIMEOUT_PER_ITEM_S = 1.0

ListResponse: TypeAlias = (
    GetFence.Response | GetRallyPoints.Response | SetFence.Response | SetRallyPoints.Response
)
Request = Callable[[StorageRequests, TakeList, float], object]


class ListServers:
    """Offers ``~/get_fence``, ``~/set_fence``, ``~/get_rally_points``, ``~/set_rally_points``.

    A callback waits in its own thread of the executor. The bridge works on one list at a time and
    rejects others at once, so that there is one such thread.
    """

    def __init__(self, access: BridgeAccess) -> None:
        """Offer the services."""
        self._bridge, self._driver, self._clock = access.bridge, access.driver, access.clock
        self._closed = access.is_closed
        group = ReentrantCallbackGroup()
        for kind, name, callback in (
            (GetFence, "get_fence", self._get_fence),
            (SetFence, "set_fence", self._set_fence),
            (GetRallyPoints, "get_rally_points", self._get_rally_points),
            (SetRallyPoints, "set_rally_points", self._set_rally_points),
        ):
            access.node.create_service(kind, f"~/{name}", callback, callback_group=group)

    # --- executor threads --------------------------------------------------------------

    def _get_fence(
        self, _request: GetFence.Request, response: GetFence.Response
    ) -> GetFence.Response:
        answer = self._ask(
            lambda requests, take, now: requests.read_list(MissionType.FENCE, take, now), response
        )
        if answer.fence is not None:
            response.areas = [area_message(area) for area in answer.fence.areas]
            for area in response.areas:
                area.stored, area.in_force = True, answer.in_force
            response.return_point = list(answer.fence.return_point_deg or ())
        return response

    def _get_rally_points(
        self, _request: GetRallyPoints.Request, response: GetRallyPoints.Response
    ) -> GetRallyPoints.Response:
        answer = self._ask(
            lambda requests, take, now: requests.read_list(MissionType.RALLY, take, now), response
        )
        response.points = [rally_message(point) for point in answer.points]
        return response

    def _set_fence(
        self, request: SetFence.Request, response: SetFence.Response
    ) -> SetFence.Response:
        try:
            fence = fence_of(request)
        except ValueError as error:
            response.message = str(error)
            return response
        self._ask(
            lambda requests, take, now: requests.write_fence(fence, take, now),
            response,
            len(request.areas),
        )
        return response

    def _set_rally_points(
        self, request: SetRallyPoints.Request, response: SetRallyPoints.Response
    ) -> SetRallyPoints.Response:
        try:
            points = rally_of(request)
        except ValueError as error:
            response.message = str(error)
            return response
        self._ask(
            lambda requests, take, now: requests.write_rally(points, take, now),
            response,
            len(points),
        )
        return response

    def _ask(self, request: Request, response: ListResponse, items: int = 0) -> ListAnswer:
        waiting: Waiting[ListAnswer] = Waiting()
        self._driver.post(
            lambda: request(self._bridge.feature(StorageRequests), waiting.take, self._clock.now())
        )
        timeout_s = _TIMEOUT_S + _TIMEOUT_PER_ITEM_S * items
        answer = waiting.wait(timeout_s, self._closed)
        if answer is None:
            text = STOPPED if self._closed() else f"No answer within {timeout_s:g} s."
            answer = ListAnswer(False, f"{text} What the autopilot stores now is unknown.")
        response.success, response.message = answer.success, answer.message
        return answer


def fence_of(request: SetFence.Request) -> GeoFence:
    """Return the fence of a SetFence request.

    Raises:
        ValueError: why it is not sent, a sentence.
    """
    areas = tuple(_area(area, number) for number, area in enumerate(request.areas, start=1))
    place = tuple(request.return_point)
    if len(place) not in (0, 2):
        raise ValueError("return_point is not a latitude and a longitude.")
    fence = GeoFence(areas, (place[0], place[1]) if place else None)
    problem = fence_problem(fence)
    if problem is not None:
        raise ValueError(problem)
    return fence


def _area(message: FenceArea, number: int) -> GeoArea:
    if len(message.latitudes) != len(message.longitudes):
        raise ValueError(
            f"Area {number}: {len(message.latitudes)} latitudes and {len(message.longitudes)} "
            "longitudes."
        )
    if not message.latitudes and message.points:
        raise ValueError(
            f"Area {number}: give latitudes and longitudes; points in map are not read."
        )
    if message.shape not in (FenceArea.POLYGON, FenceArea.CIRCLE):
        raise ValueError(f"Area {number}: shape {message.shape} is neither POLYGON nor CIRCLE.")
    return GeoArea(
        tuple(zip(message.latitudes, message.longitudes, strict=True)),
        message.radius if message.shape == FenceArea.CIRCLE else None,
        message.inclusion,
    )


def rally_of(request: SetRallyPoints.Request) -> tuple[RallyPoint, ...]:
    """Return the rally points of a SetRallyPoints request.

    Raises:
        ValueError: why they are not sent, a sentence.
    """
    points = []
    for number, point in enumerate(request.points, start=1):
        reference = REFERENCES.get(point.altitude_reference)
        if reference is None:
            raise ValueError(
                f"Rally point {number}: altitude_reference {point.altitude_reference} is unknown."
            )
        points.append(RallyPoint((point.latitude, point.longitude), point.altitude, reference))
    problem = rally_problem(points)
    if problem is not None:
        raise ValueError(problem)
    return tuple(points)
