"""Latched topics of what is around the vehicle: fence, flight volume, mission, rally points."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from typing import TypeVar

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point

from custom_interfaces.msg import Fence, FenceArea, StoredItem, StoredItems
from drone_navigation.qos import LATCHED_QOS
from drone_navigation.server.publishing.publishing_node import Advertiser, TopicPublisher
from mavlink_vehicle.mission_items import has_place
from navigation_bridge.bridge import Bridge
from navigation_bridge.scene import SceneArea, SceneFence, SceneItem
from navigation_core.safety.fences import CircleArea

ValueT = TypeVar("ValueT")


class SceneTopics:
    """Publishes each on change; used by the driver thread only."""

    def __init__(self, node: Advertiser, bridge: Bridge, frame: str) -> None:
        """Advertise the topics.

        Args:
            node: who publishes.
            bridge: of the vehicle that is published.
            frame: name of the map frame.
        """
        self._bridge = bridge
        self._frame = frame
        create = node.create_publisher
        self._fence = create(Fence, "~/fence", LATCHED_QOS)
        self._volume = create(Fence, "~/flight_volume", LATCHED_QOS)
        self._mission = create(StoredItems, "~/mission", LATCHED_QOS)
        self._rally = create(StoredItems, "~/rally_points", LATCHED_QOS)
        self._seen: dict[TopicPublisher, object] = {}
        self._placed: dict[str, tuple[object, tuple[SceneItem, ...] | None]] = {}

    def update(self, stamp: Time) -> None:
        """Publish what has changed; called once per second."""
        bridge, vehicle = self._bridge, self._bridge.vehicle
        state = vehicle.state
        self._tell(self._fence, bridge.scene.fence(), fence_message, stamp)
        self._tell(self._volume, bridge.scene.volume(), fence_message, stamp)
        current = -1
        if vehicle.stored_lists.mission and state.mission is not None:
            current = state.mission.current
        scene = bridge.scene
        mission = self._kept("mission", (vehicle.stored_lists.mission, *scene.place), scene.mission)
        rally = self._kept(
            "rally", (vehicle.stored_lists.rally_points, *scene.place), scene.rally_points
        )
        self._tell(self._mission, (mission, current), items_message, stamp)
        self._tell(self._rally, (rally, -1), items_message, stamp)

    def _kept(
        self, name: str, key: object, place: Callable[[], tuple[SceneItem, ...] | None]
    ) -> tuple[SceneItem, ...] | None:
        """Place items again only when they, the map or home are others."""
        before, items = self._placed.get(name, (None, None))
        if before != key:
            items = place()
            self._placed[name] = (key, items)
        return items

    def _tell(
        self,
        publisher: TopicPublisher,
        value: ValueT,
        make: Callable[[ValueT], Fence | StoredItems],
        stamp: Time,
    ) -> None:
        if publisher in self._seen and self._seen[publisher] == value:
            return
        self._seen[publisher] = value
        message = make(value)
        message.header.stamp, message.header.frame_id = stamp, self._frame
        publisher.publish(message)


def fence_message(fence: SceneFence | None) -> Fence:
    """Return a fence, or the flight volume, without header."""
    message = Fence(altitude_min=math.nan, altitude_max=math.nan)
    if fence is None:
        return message
    message.known = True
    message.id = _identity(fence)
    message.areas = [_area(area) for area in fence.areas]
    message.one_suffices = fence.one_suffices
    message.altitude_min, message.altitude_max = fence.altitude_min_m, fence.altitude_max_m
    return message


def _area(shown: SceneArea) -> FenceArea:
    area = shown.area
    message = FenceArea(inclusion=area.inclusion)
    message.stored, message.in_force = shown.stored, shown.in_force
    if isinstance(area, CircleArea):
        message.shape, message.radius = FenceArea.CIRCLE, area.radius_m
        points: Sequence[tuple[float, float]] = (area.centre_enu_m,)
    else:
        message.shape, points = FenceArea.POLYGON, area.corners_enu_m
    message.points = [Point(x=x, y=y) for x, y in points]
    message.latitudes = [latitude_deg for latitude_deg, _ in shown.corners_deg]
    message.longitudes = [longitude_deg for _, longitude_deg in shown.corners_deg]
    return message


def items_message(listed: tuple[tuple[SceneItem, ...] | None, int]) -> StoredItems:
    """Return a list of items and the number of the current one, without header."""
    items, current = listed
    message = StoredItems(current=current)
    if items is not None:
        message.known = True
        message.id = _identity([placed.item for placed in items])
        message.items = [_item(placed) for placed in items]
    return message


def _item(placed: SceneItem) -> StoredItem:
    item = placed.item
    message = StoredItem(number=placed.number, command=item.command, frame=item.frame)
    message.params = list(item.params)
    unit = 1e7 if has_place(item) else 1.0
    message.latitude, message.longitude = item.x / unit, item.y / unit
    message.altitude = item.z
    message.position = Point(**dict(zip("xyz", placed.position_enu_m, strict=True)))
    return message


def _identity(content: object) -> int:
    """Return a number that is another one for another content, the same in every process."""
    return zlib.crc32(repr(content).encode("ascii"))
