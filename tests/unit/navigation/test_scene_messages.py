"""Fence, flight volume, mission and rally points as messages, and as a page gets them."""

from __future__ import annotations

import json
import math

import pytest

from custom_interfaces.msg import FenceArea
from drone_navigation.console import page_values
from drone_navigation.server.publishing.scene_topics import fence_message, items_message
from mavlink_vehicle.mission_items import NO_FRAME, MissionItem
from navigation_bridge.scene import SceneArea, SceneFence, SceneItem
from navigation_core.safety.fences import CircleArea, PolygonArea

SQUARE = PolygonArea(((0.0, 0.0), (9.0, 0.0), (9.0, 9.0)))
HOLE = CircleArea((3.0, 2.0), 1.5, inclusion=False)
FENCE = SceneFence(
    (
        SceneArea(SQUARE, True, True, ((-35.0, 149.0), (-35.0, 149.1), (-34.9, 149.1))),
        SceneArea(HOLE, True, False, ((-35.0, 149.05),)),
    ),
    True,
    math.nan,
    40.0,
)
NOWHERE = (math.nan, math.nan, math.nan)
ITEMS = (
    SceneItem(
        1,
        MissionItem(16, 3, (2.0, 0.0, 0.0, math.nan), -350000000, 1490000000, 12.0),
        (5.0, 6.0, 12.5),
    ),
    SceneItem(2, MissionItem(178, NO_FRAME, (1.0, 4.0, 0.0, 0.0), 7, 8, 9.0), NOWHERE),
    SceneItem(
        3, MissionItem(16, 10, (0.0,) * 4, -350000001, 1490000001, 12.0), (1.0, 2.0, math.nan)
    ),
)


def test_a_fence_is_reported_in_the_map_and_in_degrees() -> None:
    message = fence_message(FENCE)
    assert message.known
    square, hole = message.areas
    assert (square.shape, hole.shape) == (FenceArea.POLYGON, FenceArea.CIRCLE)
    assert [(point.x, point.y) for point in square.points] == list(SQUARE.corners_enu_m)
    assert list(zip(square.latitudes, square.longitudes, strict=True)) == [
        (-35.0, 149.0), (-35.0, 149.1), (-34.9, 149.1)
    ]  # fmt: skip
    assert (hole.radius, hole.inclusion, hole.stored, hole.in_force) == (1.5, False, True, False)
    assert message.one_suffices
    assert math.isnan(message.altitude_min)
    assert message.altitude_max == 40.0
    other = fence_message(SceneFence(FENCE.areas[:1], True, math.nan, 40.0))
    assert other.id != message.id == fence_message(FENCE).id


def test_an_unknown_fence_or_mission_is_not_told_as_an_empty_one() -> None:
    assert not fence_message(None).known
    assert page_values.fence(fence_message(None)) is None
    assert not items_message((None, -1)).known
    assert page_values.stored_items(items_message((None, -1))) is None
    empty = items_message(((), -1))
    assert empty.known
    assert page_values.stored_items(empty) == {"current": -1, "items": []}


def test_a_mission_is_reported_as_it_is_stored_and_where_that_is() -> None:
    message = items_message((ITEMS, 2))
    assert message.current == 2
    first, speed, terrain = message.items
    assert (first.number, first.command, first.frame) == (1, 16, 3)
    assert (first.latitude, first.longitude, first.altitude) == pytest.approx((-35.0, 149.0, 12.0))
    assert (first.position.x, first.position.y, first.position.z) == (5.0, 6.0, 12.5)
    assert list(first.params[:3]) == [2.0, 0.0, 0.0]
    assert math.isnan(first.params[3])
    assert (speed.latitude, speed.longitude, speed.altitude) == (7.0, 8.0, 9.0)
    assert math.isnan(speed.position.x)
    assert terrain.position.x == 1.0
    assert math.isnan(terrain.position.z)
    assert items_message((ITEMS, 1)).id == message.id != items_message((ITEMS[:2], 2)).id


def test_a_page_gets_only_what_json_can_express() -> None:
    fence = page_values.fence(fence_message(FENCE))
    mission = page_values.stored_items(items_message((ITEMS, 2)))
    json.dumps([fence, mission], allow_nan=False)
    assert fence is not None
    assert (fence["low"], fence["high"]) == (None, 40.0)
    assert [area["radius"] for area in fence["areas"]] == [None, 1.5]
    assert fence["areas"][0]["places"][2] == [-34.9, 149.1]
    assert mission is not None
    assert [item["at"] for item in mission["items"]] == [[5.0, 6.0, 12.5], None, [1.0, 2.0, None]]
    assert mission["items"][0]["values"] == [2.0, 0.0, 0.0, None, -35.0, 149.0, 12.0]
    assert mission["items"][0]["name"] == "NAV_WAYPOINT"
