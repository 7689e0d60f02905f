"""Sensors, files and fences become obstacles in the map frame."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.ranges import RangesMeasured
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig
from navigation_bridge.configuration.known_obstacles import KnownObstacles, parse_obstacles
from navigation_bridge.configuration.sensor_poses import SensorPose, SensorPoseError, carrier_at
from navigation_bridge.configuration.settings import ObstacleConfig
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed, SensorPoints, SensorScan
from navigation_bridge.obstacles.standing_obstacles import fence_walls
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.safety.fences import CircleArea, Fence, PolygonArea
from navigation_core.safety.target_checks import FlightVolume
from tests.support.messages.autopilot_messages import AutopilotMessages

UNKNOWN = 65535
HEIGHT_M = 10.0
NORTHWARDS, EASTWARDS = 0.0, math.pi / 2


class Flight:
    """A vehicle that hangs 10 m above the map origin and sees what it is told to."""

    def __init__(
        self,
        config: ObstacleConfig | None = None,
        vehicle_type: int = mavlink.MAV_TYPE_QUADROTOR,
        place: bool = True,
    ) -> None:
        self.autopilot = AutopilotMessages()
        self.vehicle = Vehicle(VehicleConfig(message_rates_hz={}))
        self.map_frame = MapFrame()
        self.feed = ObstacleFeed(self.vehicle, self.map_frame, config or ObstacleConfig())
        self.now = 10.0
        self.vehicle.start(self.now)
        self.feed.start(self.now)
        self.say(self.autopilot.heartbeat(vehicle_type=vehicle_type))
        if place:
            self.place()

    def say(self, *messages: mavlink.MAVLink_message) -> None:
        for message in messages:
            self.vehicle.receive(message, self.now)
            self.map_frame.update(self.vehicle.state)
            while (event := self.vehicle.next_event()) is not None:
                if isinstance(event, RangesMeasured):
                    self.feed.take_ranges(event, self.now)

    def place(
        self,
        yaw: float = NORTHWARDS,
        roll: float = 0.0,
        pitch: float = 0.0,
        velocity_ned_m_s: Vector3 = (0.0, 0.0, 0.0),
        yaw_rate_rad_s: float = 0.0,
        height_m: float = HEIGHT_M,
    ) -> None:
        """Tell where it is, from now on."""
        north, east, down = velocity_ned_m_s
        say = self.autopilot
        boot_ms = round(self.now * 1e3)
        self.say(
            say("GPS_GLOBAL_ORIGIN", latitude=473977420, longitude=85455940, altitude=488000),
            say("LOCAL_POSITION_NED", time_boot_ms=boot_ms, z=-height_m),
            say(
                "ATTITUDE", time_boot_ms=boot_ms, roll=roll, pitch=pitch, yaw=yaw,
                yawspeed=yaw_rate_rad_s,
            ),
            say(
                "GLOBAL_POSITION_INT", time_boot_ms=boot_ms, lat=473977420, lon=85455940,
                alt=488000 + round(1e3 * height_m), relative_alt=round(1e3 * height_m),
                vx=round(100 * north), vy=round(100 * east), vz=round(100 * down), hdg=0,
            ),
        )  # fmt: skip

    def scan(self, ahead_m: float, times: int = 10, sector: int = 0, **fields: object) -> None:
        """See something in one sector of 5 degrees, clear of the others, some times."""
        distances = [2001] * 72
        distances[sector] = round(ahead_m * 100)
        given: dict[str, object] = {
            "increment": 5, "min_distance": 20, "max_distance": 2000, "distances": distances,
            "frame": mavlink.MAV_FRAME_BODY_FRD,
        }  # fmt: skip
        for _ in range(times):
            self.now += 0.1
            self.place_again()
            self.say(self.autopilot("OBSTACLE_DISTANCE", **{**given, **fields}))

    def place_again(self) -> None:
        """Let the next readings be of now; a test that moves the vehicle does this itself."""
        self.place()

    def beam(self, distance_m: float, times: int = 10, **fields: object) -> None:
        given: dict[str, object] = {"min_distance": 20, "max_distance": 2000}
        for _ in range(times):
            self.now += 0.1
            self.place_again()
            cm = round(distance_m * 100)
            self.say(self.autopilot("DISTANCE_SENSOR", current_distance=cm, **{**given, **fields}))

    def away_m(self, east: float, north: float, up: float = HEIGHT_M) -> float:
        """How far a place is from the nearest obstacle."""
        return float(self.feed.obstacles.clearance_m(np.array([[east, north, up]]))[0])

    def sees(self, east: float, north: float, up: float = HEIGHT_M) -> bool:
        return self.away_m(east, north, up) < 0.5


class TurnedFlight(Flight):
    """The same, but it keeps the attitude and speed that it is given."""

    def __init__(self, **pose: object) -> None:
        self.pose = pose
        super().__init__()

    def place_again(self) -> None:
        self.place(**self.pose)  # type: ignore[arg-type]


class TestScansOfTheVehicle:
    def test_what_is_ahead_is_north_of_a_vehicle_that_looks_north(self) -> None:
        flight = Flight()
        flight.scan(8.0)
        assert flight.sees(0.0, 8.0)
        assert not flight.sees(8.0, 0.0)

    def test_it_is_east_of_one_that_looks_east(self) -> None:
        flight = TurnedFlight(yaw=EASTWARDS)
        flight.scan(8.0)
        assert flight.sees(8.0, 0.0)
        assert not flight.sees(0.0, 8.0)

    def test_sectors_go_clockwise(self) -> None:
        flight = Flight()
        flight.scan(8.0, sector=18)
        assert flight.sees(8.0, 0.0)

    def test_a_scan_aligned_with_north_does_not_turn_with_the_vehicle(self) -> None:
        flight = TurnedFlight(yaw=EASTWARDS)
        flight.scan(8.0, frame=mavlink.MAV_FRAME_GLOBAL)
        assert flight.sees(0.0, 8.0)

    def test_a_scan_of_a_tilted_body_looks_down_where_its_nose_points(self) -> None:
        flight = TurnedFlight(pitch=math.radians(-30.0))
        flight.scan(10.0)
        assert flight.sees(0.0, 10.0 * math.cos(math.radians(30.0)))
        level = TurnedFlight(pitch=math.radians(-30.0))
        level.scan(10.0, frame=mavlink.MAV_FRAME_LOCAL_FRD)
        assert level.sees(0.0, 10.0)

    def test_the_ground_that_a_tilted_scanner_sees_is_no_obstacle(self) -> None:
        flight = TurnedFlight(pitch=math.radians(-30.0))
        flight.scan(HEIGHT_M / math.sin(math.radians(30.0)))
        assert len(flight.feed.obstacles) == 0

    def test_the_pose_is_that_of_the_moment_of_the_reading(self) -> None:
        flight = Flight()
        for _ in range(10):
            flight.now += 1.0
            # Since it told its pose it has flown 2 m and turned by 0.4 rad.
            flight.place(velocity_ned_m_s=(0.0, 5.0, 0.0), yaw_rate_rad_s=1.0)
            flight.now += 0.4
            cm = [800] + [UNKNOWN] * 71
            flight.say(
                flight.autopilot(
                    "OBSTACLE_DISTANCE", increment=5, min_distance=20, max_distance=2000,
                    distances=cm, frame=mavlink.MAV_FRAME_BODY_FRD,
                )
            )  # fmt: skip
        assert flight.sees(2.0 + 8.0 * math.sin(0.4), 8.0 * math.cos(0.4))

    def test_nothing_is_taken_while_the_pose_is_not_known(self) -> None:
        flight = Flight(place=False)
        flight.now += 1.0
        flight.say(
            flight.autopilot(
                "DISTANCE_SENSOR", current_distance=500, min_distance=20, max_distance=2000
            )
        )
        assert len(flight.feed.obstacles) == 0
        assert flight.feed.has_sensor
        assert flight.feed.age_s(flight.now + 1.0) == pytest.approx(1.0)

    def test_nothing_is_taken_while_the_pose_is_stale(self) -> None:
        flight = Flight()
        flight.beam(20.0, times=1)
        flight.now += 0.6
        flight.say(
            flight.autopilot(
                "DISTANCE_SENSOR", current_distance=500, min_distance=20, max_distance=2000
            )
        )
        assert len(flight.feed.obstacles) == 0
        assert flight.feed.age_s(flight.now) == pytest.approx(0.6)

    def test_what_is_seen_no_more_goes_away(self) -> None:
        flight = Flight()
        flight.scan(8.0)
        flight.scan(20.01, times=60)
        assert not flight.sees(0.0, 8.0)

    def test_the_same_object_comes_until_something_is_new(self) -> None:
        flight = Flight()
        flight.scan(8.0)
        assert flight.feed.obstacles is flight.feed.obstacles

    def test_an_origin_that_moves_takes_the_map_with_it(self) -> None:
        flight = Flight()
        flight.scan(8.0)
        flight.say(
            flight.autopilot(
                "GPS_GLOBAL_ORIGIN", latitude=473987420, longitude=85455940, altitude=488000
            )
        )
        flight.say(flight.autopilot("DISTANCE_SENSOR", max_distance=2000, current_distance=2000))
        assert len(flight.feed.obstacles) == 0


class TestBeams:
    def test_a_beam_shows_what_it_looks_at(self) -> None:
        flight = Flight()
        flight.beam(6.0, orientation=mavlink.MAV_SENSOR_ROTATION_YAW_270)
        assert flight.sees(-6.0, 0.0)

    @pytest.mark.parametrize(
        "orientation", [mavlink.MAV_SENSOR_ROTATION_PITCH_270, mavlink.MAV_SENSOR_ROTATION_PITCH_90]
    )
    def test_one_that_looks_down_or_up_is_no_obstacle_sensor(self, orientation: int) -> None:
        flight = Flight()
        flight.beam(6.0, orientation=orientation)
        assert len(flight.feed.obstacles) == 0
        assert not flight.feed.has_sensor

    def test_a_beam_beside_a_scan_adds_nothing(self) -> None:
        flight = Flight()
        flight.scan(15.0)
        flight.beam(6.0, times=3)
        assert not flight.sees(0.0, 6.0)

    def test_when_the_scan_is_silent_the_beam_counts_again(self) -> None:
        flight = Flight()
        flight.scan(15.0)
        flight.now += 2.1
        flight.beam(6.0)
        assert flight.sees(0.0, 6.0)


class TestAges:
    def test_without_a_sensor_the_data_is_never_old(self) -> None:
        flight = Flight()
        assert flight.feed.age_s(flight.now + 100.0) == 0.0

    def test_once_one_was_heard_its_silence_counts(self) -> None:
        flight = Flight()
        flight.scan(8.0)
        assert flight.feed.age_s(flight.now) == 0.0
        assert flight.feed.age_s(flight.now + 3.0) == pytest.approx(3.0)

    def test_the_most_silent_kind_counts(self) -> None:
        flight = Flight()
        flight.scan(8.0)
        flight.now += 1.0
        flight.beam(6.0, times=1)
        assert flight.feed.age_s(flight.now) == pytest.approx(1.1)
        assert set(flight.feed.ages_s(flight.now)) == {"OBSTACLE_DISTANCE", "DISTANCE_SENSOR"}

    def test_a_beam_without_a_reading_is_a_sensor_that_is_alive(self) -> None:
        flight = Flight()
        flight.beam(6.0, times=1, signal_quality=1)
        assert flight.feed.has_sensor
        assert len(flight.feed.obstacles) == 0

    def test_what_is_configured_counts_from_the_start(self) -> None:
        flight = Flight(ObstacleConfig(scan_topic="/scan"))
        assert flight.feed.has_sensor
        assert flight.feed.age_s(15.0) == pytest.approx(5.0)


def ahead(range_m: float, in_map: bool = False) -> SensorScan:
    """A scan of one ray along x."""
    return SensorScan(
        in_map, np.array([[1.0, 0.0, 0.0]]), np.array([range_m]), 0.1, 20.0, math.radians(0.5)
    )


class TestScansAndCloudsOfRos:
    def take_scan(self, flight: Flight, scan: SensorScan) -> None:
        for _ in range(10):
            flight.now += 0.1
            flight.place_again()
            flight.feed.take_scan(scan, flight.now)

    def take_points(self, flight: Flight, cloud: SensorPoints) -> None:
        for _ in range(10):
            flight.now += 0.1
            flight.place_again()
            flight.feed.take_points(cloud, flight.now)

    def test_a_scanner_at_base_link_looks_where_the_nose_points(self) -> None:
        flight = TurnedFlight(yaw=EASTWARDS)
        self.take_scan(flight, ahead(7.0))
        assert flight.sees(7.0, 0.0)

    def test_a_mounted_scanner_is_moved_and_turned(self) -> None:
        pose = SensorPose.parse("0.5 0.2 0 0 0 90")  # looks left
        flight = Flight(ObstacleConfig(sensor_pose=pose))
        self.take_scan(flight, ahead(7.0))
        assert flight.sees(-7.2, 0.5)

    def test_a_scanner_that_is_too_fast_is_thinned_out(self) -> None:
        flight = Flight()
        flight.feed.take_scan(ahead(7.0), flight.now)
        for _ in range(10):
            flight.feed.take_scan(ahead(9.0), flight.now + 0.05)
        assert not flight.sees(0.0, 9.0)

    def test_a_scan_in_the_map_frame_is_taken_as_it_is(self) -> None:
        flight = TurnedFlight(yaw=2.0)
        self.take_scan(flight, ahead(7.0, in_map=True))
        assert flight.sees(7.0, 0.0, 0.0)

    def test_points_are_in_the_axes_of_the_sensor_or_of_the_map(self) -> None:
        points = np.array([[5.0, 1.0, 0.0]])
        flight = Flight()
        self.take_points(flight, SensorPoints(False, points))
        assert flight.sees(-1.0, 5.0)
        flight = Flight()
        self.take_points(flight, SensorPoints(True, points + np.array([0.0, 0.0, HEIGHT_M])))
        assert flight.sees(5.0, 1.0)

    def test_a_point_below_says_nothing_about_the_height_of_the_vehicle(self) -> None:
        flight = Flight()
        self.take_points(flight, SensorPoints(False, np.array([[5.0, 0.0, -6.0]])))
        assert flight.sees(0.0, 5.0, 4.0)
        assert flight.away_m(0.0, 5.0) > 3.0

    def test_a_rover_sees_what_stands_on_the_ground_at_whatever_height_its_gps_puts_it(
        self,
    ) -> None:
        mounted = ObstacleConfig(sensor_pose=SensorPose.parse("0 0 0.4 0 0 0"))
        flight = Flight(mounted, vehicle_type=mavlink.MAV_TYPE_GROUND_ROVER)
        cloud = np.array([[5.0, 0.0, 0.1], [8.0, 0.0, -0.4], [0.0, 6.0, 4.0]])
        self.take_points(flight, SensorPoints(False, cloud))
        assert flight.sees(0.0, 5.0, -3.0)
        assert flight.sees(0.0, 5.0, 30.0)
        assert not flight.sees(0.0, 8.0, 0.0)  # the ground
        assert not flight.sees(-6.0, 0.0, 0.0)  # overhead


class TestKnownObstacles:
    @staticmethod
    def known(items: str, frame: str = "map") -> ObstacleConfig:
        text = f"{{frame: {frame}, obstacles: [{items}]}}"
        return ObstacleConfig(known=parse_obstacles(text, "known.yaml"))

    def test_they_are_there_from_the_start_and_have_their_names(self) -> None:
        flight = Flight(
            self.known("{kind: cylinder, name: mast, at_m: [4, 3], radius_m: 1, height_m: 20}"),
            place=False,
        )
        assert flight.away_m(0.0, 0.0) == pytest.approx(4.0)
        (mast,) = flight.feed.standing.known_by_name
        assert mast.name == "mast"

    def test_geodetic_ones_come_with_the_origin(self) -> None:
        place = "{kind: cylinder, at_deg: [47.3978420, 8.5455940], radius_m: 1, height_m: 20}"
        flight = Flight(self.known(place, "wgs84"), place=False)
        assert len(flight.feed.obstacles) == 0
        flight.place()
        assert flight.sees(0.0, 11.1)

    def test_other_ones_are_taken_when_the_parameters_change(self) -> None:
        flight = Flight(self.known("{kind: cylinder, at_m: [4, 3], radius_m: 1, height_m: 20}"))
        flight.feed.configure(ObstacleConfig(known=KnownObstacles()))
        assert len(flight.feed.obstacles) == 0

    def test_for_a_rover_they_have_no_end_but_what_hangs_high_is_not_there(self) -> None:
        flight = Flight(
            self.known(
                "{kind: cylinder, at_m: [4, 3], radius_m: 1, height_m: 2}, "
                "{kind: cylinder, at_m: [40, 0], radius_m: 1, bottom_m: 5, height_m: 2}"
            ),
            vehicle_type=mavlink.MAV_TYPE_GROUND_ROVER,
        )
        assert flight.away_m(0.0, 0.0, 30.0) == pytest.approx(4.0)
        assert flight.away_m(40.0, 0.0, 0.0) > 30.0


def clearance(fence: Fence, east: float, north: float, shift_m: float = 0.0) -> float:
    walls = Obstacles.of(fence_walls(fence, shift_m))
    return float(walls.clearance_m(np.array([[east, north, 5.0]]))[0])


SQUARE = ((-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (-20.0, 20.0))


class TestTheFence:
    def test_the_sides_of_a_polygon_are_walls_in_either_order(self) -> None:
        for corners in (SQUARE, SQUARE[::-1]):
            fence = Fence(areas=(PolygonArea(corners),))
            assert clearance(fence, 15.0, 0.0) == pytest.approx(5.0)
            assert clearance(fence, 15.0, 0.0, shift_m=0.5) == pytest.approx(5.5)
            assert clearance(fence, 19.9, 19.9, shift_m=0.5) == pytest.approx(0.6)

    def test_an_exclusion_is_kept_clear_of_from_outside(self) -> None:
        fence = Fence(areas=(PolygonArea(SQUARE, inclusion=False),))
        assert clearance(fence, 25.0, 0.0, shift_m=0.5) == pytest.approx(5.5)
        hole = Fence(areas=(CircleArea((0.0, 0.0), 5.0, inclusion=False),))
        assert clearance(hole, 10.0, 0.0) == pytest.approx(5.0)
        assert clearance(hole, 1.0, 0.0) == 0.0

    @pytest.mark.parametrize("radius_m", [0.05, 5.0, 50.0, 300.0])
    def test_a_circle_is_a_polygon_that_touches_it(self, radius_m: float) -> None:
        fence = Fence(areas=(CircleArea((3.0, 0.0), radius_m),))
        for degrees in range(0, 360, 7):
            angle = math.radians(degrees)
            place = 3.0 + 0.8 * radius_m * math.cos(angle), 0.8 * radius_m * math.sin(angle)
            away_m = 0.2 * radius_m
            assert away_m - 1e-6 <= clearance(fence, *place, shift_m=0.0) <= away_m + 0.25
            assert clearance(fence, *place, shift_m=0.5) >= away_m + 0.5 - 1e-6

    def test_at_a_corner_that_points_inwards_nothing_sticks_out(self) -> None:
        # An L: what is east of 10 and north of 10 is outside.
        corners = ((-10, -10), (40, -10), (40, 10), (10, 10), (10, 40), (-10, 40))
        fence = Fence(areas=(PolygonArea(tuple((float(x), float(y)) for x, y in corners)),))
        for east, north in ((9.0, 9.0), (11.0, 9.0), (9.0, 11.0), (9.0, 9.5), (-9.0, -9.0)):
            inside_m = min(
                math.hypot(max(10.0 - east, 0.0), max(10.0 - north, 0.0)),
                east + 10.0, north + 10.0, 40.0 - east, 40.0 - north,
            )  # fmt: skip
            assert clearance(fence, east, north, shift_m=0.5) >= inside_m + 0.5 - 1e-6

    def test_between_two_areas_of_which_one_is_enough_there_is_no_wall(self) -> None:
        other = tuple((x + 30.0, y) for x, y in SQUARE)
        fence = Fence(alternatives=(PolygonArea(SQUARE), PolygonArea(other)))
        assert clearance(fence, 20.0, 0.0) == pytest.approx(20.0)
        assert clearance(fence, 45.0, 0.0) == pytest.approx(5.0)

    def test_paths_may_come_as_near_to_it_as_targets(self) -> None:
        flight = Flight(ObstacleConfig(vehicle_radius_m=0.5, margin_m=1.5))
        standing, fence = flight.feed.standing, Fence(areas=(PolygonArea(SQUARE),))
        standing.bound(fence, 1.0, FlightVolume(15.0, 0.0, 100.0), (16.0, 0.0))
        assert flight.away_m(19.0, 0.0) == pytest.approx(2.0, abs=0.02)
        assert flight.away_m(19.0, 0.0) >= 2.0
        standing.bound(None, 1.0, FlightVolume(15.0, 0.0, 100.0), (14.0, 0.0))
        assert flight.away_m(15.0, 0.0) == pytest.approx(2.0, abs=0.3)
        assert flight.away_m(15.0, 0.0) >= 2.0

    def test_walls_that_are_far_away_are_left_out(self) -> None:
        flight, volume = Flight(), FlightVolume(500.0, 0.0, 100.0)
        flight.feed.standing.bound(None, 1.0, volume, (0.0, 0.0))
        assert len(flight.feed.obstacles) == 0
        flight.feed.standing.bound(None, 1.0, volume, (450.0, 0.0))
        assert flight.away_m(450.0, 0.0) == pytest.approx(51.5, abs=0.3)
        before = flight.feed.obstacles
        flight.feed.standing.bound(None, 1.0, volume, (452.0, 0.0))
        assert flight.feed.obstacles is before

    def test_who_is_outside_may_come_back_in(self) -> None:
        flight = Flight()
        fence = Fence(areas=(PolygonArea(SQUARE),))
        flight.feed.standing.bound(fence, 1.0, FlightVolume(25.0, 0.0, 100.0), (30.0, 0.0))
        assert len(flight.feed.obstacles) == 0


class TestSensorPose:
    def test_nothing_is_base_link(self) -> None:
        assert SensorPose.parse(" ") == SensorPose()

    def test_pitch_turns_the_sensor_down_and_yaw_to_the_left(self) -> None:
        forward = np.array([1.0, 0.0, 0.0])
        down = SensorPose.parse("0 0 0 0 90 0").to_body() @ forward
        assert down == pytest.approx([0.0, 0.0, -1.0])
        left = SensorPose.parse("0 0 0 0 0 90").to_body() @ forward
        assert left == pytest.approx([0.0, 1.0, 0.0])
        upside_down = SensorPose.parse("0 0 0 180 0 0").to_body() @ np.array([0.0, 1.0, 0.0])
        assert upside_down == pytest.approx([0.0, -1.0, 0.0])

    @pytest.mark.parametrize("text", ["1 2 3", "a b c d e f", "0 0 0 0 0 nan", "1 2 3 4 5 6 7"])
    def test_anything_else_is_rejected(self, text: str) -> None:
        with pytest.raises(SensorPoseError, match="give six numbers"):
            SensorPose.parse(text)

    def test_the_attitude_moves_on_by_its_rates(self) -> None:
        flight = Flight()
        flight.place(roll=0.1, pitch=0.2, yaw=0.3, yaw_rate_rad_s=0.5)
        later = carrier_at(flight.vehicle.state, flight.map_frame, False, flight.now + 0.2)
        assert later is not None
        # The reference: the body's rate about its own down axis, in small steps.
        at_first = carrier_at(flight.vehicle.state, flight.map_frame, False, flight.now)
        assert at_first is not None
        angle = 0.5 * 0.2
        about_down = np.array(
            [
                [math.cos(angle), -math.sin(angle), 0.0],
                [math.sin(angle), math.cos(angle), 0.0],
                [0.0, 0.0, 1.0],
            ]
        )
        assert later.from_body == pytest.approx(at_first.from_body @ about_down, abs=2e-3)


u8, u16, real = st.integers(0, 255), st.integers(0, 65535), st.floats(width=32)


class TestAnything:
    """With any sensor message the feed continues; a wrong one must not end a goal."""

    flight = Flight()

    def go_on(self) -> None:
        self.flight.now += 0.1
        self.flight.place()

    @given(
        distances=st.lists(u16, min_size=72, max_size=72),
        fields=st.fixed_dictionaries(
            {
                "increment": u8, "min_distance": u16, "max_distance": u16, "increment_f": real,
                "angle_offset": real, "frame": st.sampled_from([0, 12, 20]) | u8,
            }
        ),
    )  # fmt: skip
    def test_of_the_vehicle(self, distances: list[int], fields: dict[str, object]) -> None:
        self.go_on()
        self.flight.say(self.flight.autopilot("OBSTACLE_DISTANCE", distances=distances, **fields))
        assert np.isfinite(self.flight.feed.obstacles.posts[:, :3]).all()

    @given(
        ranges=st.lists(st.floats(), max_size=40),
        angle=st.floats(-1e9, 1e9),
        step=st.floats(-10.0, 10.0),
        half=st.floats(0.0, 10.0),
        in_map=st.booleans(),
    )
    def test_of_a_scanner(
        self, ranges: list[float], angle: float, step: float, half: float, in_map: bool
    ) -> None:
        self.go_on()
        angles = angle + step * np.arange(len(ranges))
        rays = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(ranges))])
        scan = SensorScan(in_map, rays, np.array(ranges), 0.1, 30.0, half)
        self.flight.feed.take_scan(scan, self.flight.now)
        assert np.isfinite(self.flight.feed.obstacles.posts[:, :3]).all()

    @given(
        points=st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 3), max_size=20), in_map=st.booleans()
    )
    def test_of_a_cloud(self, points: list[tuple[float, float, float]], in_map: bool) -> None:
        self.go_on()
        cloud = SensorPoints(in_map, np.array(points, dtype=np.float64).reshape(-1, 3))
        self.flight.feed.take_points(cloud, self.flight.now)
        assert np.isfinite(self.flight.feed.obstacles.posts[:, :3]).all()
