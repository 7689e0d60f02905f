"""`LaserScan` and `PointCloud2` as they come, and obstacles as markers."""

from __future__ import annotations

import array
import math
import struct
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
from visualization_msgs.msg import Marker, MarkerArray

from drone_navigation.server.publishing.obstacle_markers import (
    KNOWN,
    SENSED,
    ObstacleMarkers,
    obstacle_markers,
)
from drone_navigation.server.subscribing.sensor_topics import Newest
from navigation_bridge.obstacles.sensor_messages import (
    POINTS_MAX,
    SensorMessageError,
    points_of,
    scan_of,
)
from navigation_core.mapping.obstacles import NOTHING, Box, Cylinder, Obstacles
from tests.support.flights.simulated_flight import SimulatedFlight

POINTS = [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (-7.0, 8.0, -9.0)]


def laser(ranges: list[float], **fields: object) -> LaserScan:
    given_fields: dict[str, object] = {
        "angle_min": 0.0,
        "angle_increment": math.pi / 2,
        "range_min": 0.1,
        "range_max": 30.0,
    }
    return LaserScan(ranges=ranges, **{**given_fields, **fields})


def cloud(
    points: Sequence[tuple[float, ...]],
    layout: str = "xyz",
    number: str = "f",
    big: bool = False,
    rows: int = 1,
    padding: int = 0,
) -> PointCloud2:
    """A cloud whose fields come in the order of ``layout``; "_" is a byte in between."""
    codes = {"f": PointField.FLOAT32, "d": PointField.FLOAT64, "h": PointField.INT16}
    message = PointCloud2(is_bigendian=big, height=rows, width=len(points) // rows)
    offset = 0
    for name in layout:
        if name == "_":
            offset += 1
            continue
        message.fields.append(PointField(name=name, offset=offset, datatype=codes[number], count=1))
        offset += struct.calcsize(number)
    message.point_step = offset
    message.row_step = offset * message.width + padding
    data = bytearray()
    for row in range(rows):
        for point in points[row * message.width : (row + 1) * message.width]:
            values = dict(zip("xyz", point, strict=True))
            for name in layout:
                order = ">" if big else "<"
                whole = int if number == "h" else float
                data += (
                    b"\xff"
                    if name == "_"
                    else struct.pack(order + number, whole(values.get(name, 77.0)))
                )
        data += b"\xee" * padding
    message.data = array.array("B", bytes(data))
    return message


class TestLaserScan:
    def test_rays_go_counter_clockwise_from_angle_min(self) -> None:
        scan = scan_of(laser([1.0, 2.0, 3.0], angle_min=-math.pi / 2))
        assert scan.directions == pytest.approx(
            np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), abs=1e-6
        )
        assert scan.ranges_m == pytest.approx([1.0, 2.0, 3.0])
        assert scan.half_angle_rad == pytest.approx(math.pi / 4)

    def test_infinity_is_nothing_minus_infinity_too_near_and_the_rest_no_reading(self) -> None:
        scan = scan_of(
            laser([math.inf, -math.inf, math.nan, 0.05, 31.0, 30.0], angle_increment=0.1)
        )
        assert scan.ranges_m[0] == math.inf
        assert scan.ranges_m[1] == pytest.approx(0.1)
        assert np.isnan(scan.ranges_m[2:5]).all()
        assert scan.ranges_m[5] == pytest.approx(30.0)

    def test_a_ray_that_comes_round_again_is_left_out(self) -> None:
        assert len(scan_of(laser([1.0] * 5)).ranges_m) == 4
        assert len(scan_of(laser([1.0] * 361, angle_increment=math.radians(1.0))).ranges_m) == 360

    def test_only_the_frame_map_is_that_of_the_map(self) -> None:
        message = laser([1.0])
        message.header.frame_id = "laser"
        assert not scan_of(message).in_map
        message.header.frame_id = "map"
        assert scan_of(message).in_map

    @pytest.mark.parametrize(
        "fields",
        [
            {"angle_increment": 0.0},
            {"angle_increment": math.nan},
            {"angle_min": math.inf},
            {"range_max": 0.05},
            {"range_max": math.inf},
            {"range_min": math.nan},
        ],
    )
    def test_what_makes_no_sense_is_rejected(self, fields: dict[str, float]) -> None:
        with pytest.raises(SensorMessageError, match="a LaserScan with"):
            scan_of(laser([1.0], **fields))

    def test_a_scan_without_rays_is_none(self) -> None:
        assert len(scan_of(laser([])).ranges_m) == 0


class TestPointCloud2:
    @pytest.mark.parametrize("layout", ["xyz", "zyx", "xyzi", "_x__y_z_", "rgbxyz"])
    @pytest.mark.parametrize("number", ["f", "d", "h"])
    @pytest.mark.parametrize("big", [False, True])
    def test_any_layout_number_type_and_byte_order(
        self, layout: str, number: str, big: bool
    ) -> None:
        assert points_of(cloud(POINTS, layout, number, big)).points_m.tolist() == [
            list(point) for point in POINTS
        ]

    def test_an_organised_cloud_with_padded_rows(self) -> None:
        points = [*POINTS, (0.5, 0.5, 0.5)]
        found = points_of(cloud(points, rows=2, padding=7)).points_m
        assert found.tolist() == [list(point) for point in points]

    def test_points_that_are_not_finite_are_left_out(self) -> None:
        points = [(math.nan, 0.0, 0.0), (1.0, 2.0, 3.0), (0.0, math.inf, 0.0), (0.0, 0.0, 1e30)]
        assert points_of(cloud(points)).points_m.tolist() == [[1.0, 2.0, 3.0]]

    def test_of_a_large_cloud_a_part_is_taken(self) -> None:
        count = 3 * POINTS_MAX
        message = cloud([(1.0, 2.0, 3.0)])
        message.width, message.row_step = count, 0
        message.data = array.array("B", bytes(message.data) * count)
        assert len(points_of(message).points_m) == POINTS_MAX

    def test_an_empty_cloud_is_one_without_points(self) -> None:
        assert points_of(cloud([])).points_m.shape == (0, 3)

    @pytest.mark.parametrize(
        "spoil",
        [
            lambda cloud: setattr(cloud, "width", 1000),
            lambda cloud: cloud.fields.pop(1),
            lambda cloud: setattr(cloud.fields[2], "offset", 100),
            lambda cloud: setattr(cloud.fields[0], "datatype", 99),
            lambda cloud: setattr(cloud, "row_step", 3),
            lambda cloud: setattr(cloud, "point_step", 2**31),
        ],
        ids=["width", "fields", "offset", "datatype", "row_step", "point_step"],
    )
    def test_what_cannot_be_is_rejected(self, spoil: Callable[[PointCloud2], object]) -> None:
        message = cloud(POINTS)
        spoil(message)
        with pytest.raises(SensorMessageError, match="a PointCloud2"):
            points_of(message)

    u32 = st.integers(0, 2**32 - 1) | st.integers(0, 40)

    @given(
        width=u32, height=u32, point_step=u32, row_step=u32, offset=u32, size=st.integers(0, 200),
        datatype=st.integers(0, 255), big=st.booleans(),
    )  # fmt: skip
    def test_any_header_is_read_or_rejected(
        self, width: int, height: int, point_step: int, row_step: int, offset: int, size: int,
        datatype: int, big: bool,
    ) -> None:  # fmt: skip
        message = cloud(POINTS)
        message.width, message.height = width, height
        message.point_step, message.row_step, message.is_bigendian = point_step, row_step, big
        message.fields[1].offset, message.fields[1].datatype = offset, datatype
        message.data = array.array("B", bytes(size))
        try:
            points = points_of(message).points_m
        except SensorMessageError:
            return
        assert np.isfinite(points).all()


def test_of_items_that_arrive_too_fast_the_newest_is_used() -> None:
    posted: list[Callable[[], object]] = []
    taken: list[int] = []
    newest: Newest[int] = Newest(posted.append, taken.append)
    for item in range(1000):
        newest.put(item)
    assert len(posted) == 1
    posted.pop()()
    assert taken == [999]
    newest.put(1000)
    posted.pop()()
    assert taken == [999, 1000]


class Listened:
    """A publisher that keeps what it publishes, with a number of subscribers."""

    def __init__(self) -> None:
        self.subscribers = 0
        self.published: list[object] = []

    def publish(self, message: object) -> None:
        self.published.append(message)

    def get_subscription_count(self) -> int:
        return self.subscribers


def test_markers_are_made_only_while_somebody_gets_them() -> None:
    topic, flight = Listened(), SimulatedFlight().ready()
    flight.bridge.obstacles.assume(TestMarkers.sensed)
    markers = ObstacleMarkers(topic, flight.bridge)
    markers.update(Time, 0.0)
    assert not topic.published
    topic.subscribers = 1
    markers.update(Time, 1.0)
    (first,) = topic.published
    assert isinstance(first, MarkerArray)
    assert [marker.ns for marker in first.markers[1:]] == [SENSED, SENSED]
    markers.update(Time, 2.0)
    assert topic.published == [first], "nothing has changed"


class TestMarkers:
    known = Obstacles.of(
        (Cylinder("mast", (1.0, 2.0), 0.5, 0.0, 8.0), Box("wall", (5.0, 0.0), (4.0, 0.2), 0.3))
    )
    sensed = Obstacles(
        np.array([[3.0, 3.0, 0.2, -np.inf, np.inf], [4.0, 3.0, 0.2, -np.inf, np.inf],
                  [9.0, 9.0, 0.2, 1.0, 2.0]])
    )  # fmt: skip

    def test_the_first_deletes_those_before(self) -> None:
        markers = obstacle_markers(NOTHING, NOTHING, 0.0, 10.0, Time()).markers
        assert [marker.action for marker in markers] == [Marker.DELETEALL]

    def test_known_ones_are_markers_and_sensed_ones_lists_of_their_own(self) -> None:
        _, *markers = obstacle_markers(self.known, self.sensed, 0.0, 10.0, Time()).markers
        kinds = [(marker.ns, marker.type) for marker in markers]
        assert kinds == [
            (KNOWN, Marker.CYLINDER), (KNOWN, Marker.CUBE),
            (SENSED, Marker.CUBE_LIST), (SENSED, Marker.CUBE_LIST),
        ]  # fmt: skip
        assert all(marker.header.frame_id == "map" for marker in markers)
        assert len({marker.id for marker in markers}) == len(markers)
        assert markers[0].color != markers[2].color

    def test_what_has_no_end_is_drawn_to_the_edges_of_the_picture(self) -> None:
        _, mast, wall, endless, low = obstacle_markers(
            self.known, self.sensed, -1.0, 10.0, Time()
        ).markers
        assert (mast.pose.position.z, mast.scale.z) == pytest.approx((4.0, 8.0))
        assert (wall.pose.position.z, wall.scale.z) == pytest.approx((4.5, 11.0))
        assert endless.scale.z == pytest.approx(11.0)
        assert len(endless.points) == 2
        assert (low.points[0].z, low.scale.z) == pytest.approx((1.5, 1.0))
