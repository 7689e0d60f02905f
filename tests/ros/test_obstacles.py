"""Obstacles through real DDS: sensors of ROS in, markers and diagnostics out."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import OccupancyGrid
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from custom_interfaces.msg import VehicleStatus
from drone_navigation.qos import LATCHED_QOS
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight, navigate_goal

pytestmark = pytest.mark.xdist_group("ros_actions")

ROOT = Path(__file__).resolve().parents[2]
PARAMETERS = {
    "scan_topic": "/scan",
    "points_topic": "/points",
    "obstacles_file": str(ROOT / "bridge_config/obstacles/yard.yaml"),
    "sensor_pose": "'0 0 0.3 0 0 90'",
}


@pytest.fixture(scope="module")
def seeing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    """A server that hears a scanner and a camera, and knows what stands in the yard."""
    given = [word for pair in PARAMETERS.items() for word in ("-p", "{}:={}".format(*pair))]
    flight = Flight(tmp_path_factory.mktemp("obstacles"), "--ros-args", *given, "--")
    yield flight
    flight.close()


@pytest.fixture
def arrays(seeing: Flight) -> list[MarkerArray]:
    heard: list[MarkerArray] = []
    seeing.subscribe(MarkerArray, f"{SERVER_NODE_NAME}/obstacles", heard.append, LATCHED_QOS)
    seeing.wait(lambda: bool(heard), 10.0, "the markers that a late subscriber gets")
    return heard


def sensed(arrays: list[MarkerArray]) -> list[tuple[float, float]]:
    """Return where the last markers show something sensed, east and north."""
    return [
        (point.x, point.y)
        for marker in arrays[-1].markers
        if marker.ns == "sensed"
        for point in marker.points
    ]


def is_seen(arrays: list[MarkerArray], east: float, north: float) -> bool:
    return any(math.dist(place, (east, north)) < 0.5 for place in sensed(arrays))


def publish_until(
    flight: Flight,
    publisher: Any,
    message: Any,
    arrays: list[MarkerArray],
    place: tuple[float, float],
) -> None:
    """Publish again and again, as sensors do, until a place is shown."""

    def shown() -> bool:
        publisher.publish(message)
        return is_seen(arrays, *place)

    flight.wait(shown, 15.0, f"a marker at {place}")


def test_what_is_known_is_shown_from_the_start(arrays: list[MarkerArray]) -> None:
    first, *rest = arrays[-1].markers
    assert first.action == Marker.DELETEALL
    known = [marker for marker in rest if marker.ns == "known"]
    assert [marker.type for marker in known] == [Marker.CYLINDER] + [Marker.CUBE] * 4
    assert [marker.text for marker in known] == ["mast", "north wall", "east wall", "shed", "load"]
    mast = known[0].pose.position
    assert (mast.x, mast.y, mast.z) == pytest.approx((6.0, 12.0, 6.0))
    assert known[0].header.frame_id == "map"


def test_a_scan_is_turned_with_the_vehicle_and_its_sensor(
    seeing: Flight, arrays: list[MarkerArray]
) -> None:
    # The copter looks north, the sensor to its left: its first ray looks west.
    scan = LaserScan(
        angle_min=0.0, angle_increment=math.pi / 2, range_min=0.1, range_max=30.0,
        ranges=[3.0, math.inf, math.inf, math.nan],
    )  # fmt: skip
    scan.header.frame_id = "laser"
    publisher = seeing.advertise(LaserScan, "/scan", qos_profile_sensor_data)
    publish_until(seeing, publisher, scan, arrays, (-3.0, 0.0))
    # It moves away, and its place is free again.
    scan.ranges = [5.0, math.inf, math.inf, math.nan]
    publish_until(seeing, publisher, scan, arrays, (-5.0, 0.0))

    def gone() -> bool:
        publisher.publish(scan)
        return not is_seen(arrays, -3.0, 0.0)

    seeing.wait(gone, 15.0, "the end of what has moved away")
    assert is_seen(arrays, -5.0, 0.0)


def test_the_client_avoids_obstacles_by_default_and_is_warned_at_once_without(
    seeing: Flight,
) -> None:
    # The mast of the yard is in the middle.
    command = ["python", "-m", "drone_navigation.navigation_client", "--goal", "12", "24", "3"]
    command += ["--cancel-after", "0.3", "--plain"]
    default = Process("client", command, seeing.environment)
    assert default.wait(60.0) == 4, default.text
    assert "Obstacles are avoided" in default.text
    assert "straight legs" not in default.text
    straight = Process("client", [*command, "--straight"], seeing.environment)
    assert straight.wait(60.0) == 4, straight.text
    accepted, warned, ended = (
        next(i for i, line in enumerate(straight.lines) if words in line)
        for words in ("accepted", "straight legs hit known ones: 'mast'", "CANCELED: ")
    )
    assert accepted < ended
    assert warned < ended


def test_a_warning_about_the_active_goal_stands_in_the_status(seeing: Flight) -> None:
    statuses: list[VehicleStatus] = []
    goal = navigate_goal(12.0, 24.0, 3.0)
    goal.avoid_obstacles = False
    record = seeing.send(goal)
    # For those who come later than the event of the acceptance.
    topic = f"{SERVER_NODE_NAME}/vehicle_status"
    seeing.subscribe(VehicleStatus, topic, statuses.append, LATCHED_QOS)

    def noted() -> bool:
        return bool(statuses) and any("'mast'" in note for note in statuses[-1].goal_notes)

    seeing.wait(noted, 10.0, "a note on the mast")
    seeing.cancel(record)
    assert "CANCELED" in seeing.wait_for_result(record).message
    seeing.wait(lambda: not statuses[-1].goal_notes, 10.0, "a status without a goal")


def test_the_sensor_is_in_the_tree_where_its_parameter_puts_it(seeing: Flight) -> None:
    still: dict[str, Any] = {}

    def take(message: TFMessage) -> None:
        still.update({one.child_frame_id: one for one in message.transforms})

    scan = LaserScan(angle_increment=0.1, range_max=30.0, ranges=[math.inf])
    scan.header.frame_id = "laser"
    publisher = seeing.advertise(LaserScan, "/scan", qos_profile_sensor_data)
    seeing.subscribe(TFMessage, "/tf_static", take, LATCHED_QOS)

    def there() -> bool:
        publisher.publish(scan)
        return "laser" in still

    seeing.wait(there, 10.0, "the frame of the sensor")
    mounted = still["laser"]
    assert mounted.header.frame_id == "base_link"
    assert mounted.transform.translation.z == 0.3
    turn = mounted.transform.rotation
    assert (turn.z, turn.w) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))


def test_the_grid_has_the_known_obstacles_at_the_height_of_the_vehicle(seeing: Flight) -> None:
    grids: list[OccupancyGrid] = []
    seeing.subscribe(OccupancyGrid, f"{SERVER_NODE_NAME}/obstacle_grid", grids.append, LATCHED_QOS)
    seeing.wait(lambda: bool(grids), 10.0, "a grid")
    info = grids[-1].info
    east, north = (
        int((at - start) / info.resolution)
        for at, start in ((6.0, info.origin.position.x), (12.0, info.origin.position.y))
    )
    assert grids[-1].header.frame_id == "map"
    assert grids[-1].data[north * info.width + east] == 100  # the mast
    assert grids[-1].data.count(-1) > 0.9 * info.width * info.height


def test_a_cloud_in_the_map_frame_is_taken_as_it_is(
    seeing: Flight, arrays: list[MarkerArray]
) -> None:
    cloud = PointCloud2(height=1, width=2, point_step=16, row_step=32, is_bigendian=True)
    cloud.header.frame_id = "map"
    cloud.fields = [
        PointField(name=name, offset=4 * i + 4, datatype=PointField.FLOAT32, count=1)
        for i, name in enumerate("xyz")
    ]
    rows = [(0.0, 9.0, -4.0, 2.0), (0.0, math.nan, 0.0, 0.0)]
    cloud.data = b"".join(struct.pack(">4f", *row) for row in rows)
    publisher = seeing.advertise(PointCloud2, "/points", qos_profile_sensor_data)
    publish_until(seeing, publisher, cloud, arrays, (9.0, -4.0))


def test_a_message_that_makes_no_sense_is_reported_and_harms_nothing(seeing: Flight) -> None:
    publisher = seeing.advertise(LaserScan, "/scan", qos_profile_sensor_data)
    assert seeing.server is not None
    server = seeing.server

    def told() -> bool:
        publisher.publish(LaserScan(ranges=[1.0]))
        return "Ignored: a LaserScan with angles" in server.text

    seeing.wait(told, 10.0, "a word about the scan")


def test_the_diagnostics_tell_what_is_heard(seeing: Flight) -> None:
    heard: list[DiagnosticArray] = []
    seeing.subscribe(DiagnosticArray, "/diagnostics", heard.append, 10)

    def status() -> DiagnosticStatus | None:
        found = [s for s in heard[-1].status if "obstacle" in s.name] if heard else []
        return found[0] if found else None

    # The scanner and the camera of the tests above send no more.
    seeing.wait(
        lambda: (s := status()) is not None and s.level == DiagnosticStatus.STALE,
        15.0,
        "sensors that are silent",
    )
    final = status()
    assert final is not None
    values = {item.key: item.value for item in final.values}
    assert values["known obstacles"] == "5"
    assert "LaserScan age" in values
    assert "PointCloud2 age" in values
    assert "silent" in final.message
