"""Worlds: files, rays, wind, ground, collisions, and readings of the range sensors."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import (
    LinkFaults,
    Simulation,
    VehicleConfig,
    World,
    WorldError,
    load_world,
    parse_world,
)
from mavlink_sitl.command_line.options import make_parser
from mavlink_sitl.world import range_finder
from mavlink_sitl.world.loader import schema
from mavlink_sitl.world.model import (
    GpsQuality,
    Ground,
    MoverPath,
    Obstacle,
    RangeSensor,
    Wind,
    wind_from,
)
from mavlink_sitl.world.shapes import Shapes, cast_on_ground, ground_height_m
from sitl_support.ground_station import (
    ACCEPTED,
    FAILED,
    GUIDED,
    POSITION,
    GroundStation,
    Message,
)

pytestmark = pytest.mark.wide

WORLDS = sorted((Path(__file__).parents[2] / "worlds").glob("*.yaml"))
WALL = Obstacle("wall", (10.0, 0.0), size_m=(1.0, 20.0), top_m=8.0)
EXACT = RangeSensor(noise_m=0.0)


def station_in(world: World, height_m: float = 5.0, **settings: float) -> GroundStation:
    """A copter that hovers in a world, nose to the North."""
    config = VehicleConfig(ready_after_s=1.0, heading_deg=0.0, parameters=settings)
    station = GroundStation(Simulation([config], seed=3, world=world))
    return station.ready().take_off(height_m)


# Files.


@pytest.mark.parametrize("path", WORLDS, ids=lambda path: path.stem)
def test_every_example_world_is_valid_and_can_be_lived_in(path: Path) -> None:
    jsonschema.validate(yaml.safe_load(path.read_text(encoding="utf-8")), schema())
    world = load_world(path)
    simulation = Simulation([VehicleConfig()], world=world)
    simulation.run_for(3.0)
    assert simulation.truth.on_ground.all()
    assert not simulation.truth.collided.any()


def test_the_examples_show_every_kind_of_obstacle() -> None:
    worlds = [load_world(path) for path in WORLDS]
    obstacles = list(itertools.chain.from_iterable(world.obstacles for world in worlds))
    assert any(o.radius_m for o in obstacles)
    assert any(o.size_m[0] for o in obstacles)
    assert any(o.path for o in obstacles)
    assert any(world.wind.gust_m_s for world in worlds)
    assert any(world.ground.heights_m for world in worlds)
    assert any(world.gps.dropouts_per_hour for world in worlds)


def test_the_schema_is_itself_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(schema())


BAD = {
    "wind: {speed: 3}": "w:1: wind.speed: is unknown",
    "wind:\n  speed_m_s: fast": "w:2: wind.speed_m_s: 'fast' is not of type 'number'",
    "gps:\n  noise_m: .nan": "w:2: gps.noise_m: must be a finite number",
    "wind: [1": "w:1: ",
    "name: a\nname: b": "w:2: 'name' is given twice",
    "[]": "w:1: [] is not of type 'object'",
    "obstacles:\n- {kind: tree, height_m: 3}": "w:2: obstacles[0].kind: 'tree' is not one of",
    "obstacles:\n- kind: cylinder\n  at_m: [0, 0]": "w:2: obstacles[0]: 'height_m' is a required",
    "obstacles:\n- {kind: box, height_m: 1, at_m: [1, 1]}": "w:2: obstacles[0]: a box needs size_m",
    "obstacles:\n- kind: wall\n  height_m: 1\n  radius_m: 3\n  from_m: [0, 0]\n  to_m: [1, 0]": (
        "w:4: obstacles[0].radius_m: does not apply to a wall"
    ),
    "obstacles:\n- {kind: cylinder, radius_m: 1, height_m: 1}": (
        "w:2: obstacles[0]: a cylinder needs either at_m or path"
    ),
    "obstacles:\n- {kind: wall, from_m: [1, 1], to_m: [1, 1], height_m: 1}": (
        "w:2: obstacles[0].to_m: is the same as from_m"
    ),
    "ground:\n  grid:\n    corner_m: [0, 0]\n    spacing_m: 1\n    heights_m:\n    - [1, 2]\n"
    "    - [1, 2, 3]": "w:7: ground.grid.heights_m[1]: has 3 heights where the first row has 2",
    "obstacles:\n- kind: box\n  size_m: [1, 1]\n  height_m: 1\n  path:\n    speed_m_s: 1\n"
    "    points_m: [[1, 1], [1, 1]]": "w:7: obstacles[0].path.points_m: are all the same position",
    "a: &a [*a]": "w:1: ",
    "\t- x": "w:1: ",
}


@pytest.mark.parametrize("text", BAD, ids=[str(i) for i in range(len(BAD))])
def test_a_bad_world_gives_one_sentence_with_line_and_key(text: str) -> None:
    with pytest.raises(WorldError) as caught:
        parse_world(text, "w")
    message = str(caught.value)
    assert message.startswith(BAD[text]), message
    assert "\n" not in message


def test_a_missing_world_is_said_by_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        make_parser().parse_args(["--world", "nowhere.yaml"])
    assert caught.value.code == 2
    assert "cannot read the world nowhere.yaml" in capsys.readouterr().err


def test_an_empty_file_is_a_plain() -> None:
    world = parse_world("")
    assert not world.obstacles
    assert world.range_sensor is None


# Rays.


REACH_M = 30.0


def march(shapes: Shapes, ground: Ground, origin: np.ndarray, ray: np.ndarray) -> float:
    """The same as a ray cast, by walking."""
    along = np.arange(0.0, REACH_M, 0.02)
    places = origin + along[:, None] * ray
    inside = (shapes.gaps(places) <= 0.0) & (shapes.heights_apart(places[:, 2]) <= 0.0)
    under = -ground_height_m(ground, places[:, 0], places[:, 1]) <= places[:, 2]
    met = inside.any(axis=1) | under
    return float(along[met.argmax()]) if met.any() else math.inf


FLAT = Ground(-1.0)
HILLS = Ground(0.0, (-15.0, -15.0), 10.0, ((0, 1, 3, 0), (2, 5, 1, 0), (0, 0, 4, 4), (1, 0, 2, 8)))


@pytest.mark.parametrize("ground", [FLAT, HILLS], ids=["flat", "hills"])
@pytest.mark.parametrize("level", [True, False], ids=["level", "slanted"])
def test_rays_agree_with_walking_along_them(ground: Ground, level: bool) -> None:
    rng = np.random.default_rng(5)
    obstacles = [
        Obstacle(
            f"o{i}",
            tuple(rng.uniform(-15, 15, 2)),
            radius_m=float(rng.uniform(0.3, 3)) if i % 2 else 0.0,
            size_m=tuple(rng.uniform(0.5, 6, 2)),
            yaw_rad=float(rng.uniform(-4, 4)),
            bottom_m=float(rng.uniform(0, 3)),
            top_m=float(rng.uniform(4, 9)),
        )
        for i in range(8)
    ]
    shapes = Shapes(tuple(obstacles))
    origins = np.column_stack([rng.uniform(-15, 15, (12, 2)), rng.uniform(-10, 0, 12)])
    rays = rng.normal(size=(12, 9, 3)) * (1.0, 1.0, 0.0 if level else 0.5)
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    cast = np.minimum(
        shapes.cast(origins, rays, REACH_M), cast_on_ground(ground, origins, rays, REACH_M)
    )
    met = 0
    for row, origin in enumerate(origins):
        for column in range(9):
            walked = march(shapes, ground, origin, rays[row, column])
            found = cast[row, column] if cast[row, column] < REACH_M - 0.1 else math.inf
            assert found == pytest.approx(walked, abs=0.04) or found > REACH_M - 1.0
            met += math.isfinite(walked)
    assert met > 10


def test_a_ray_straight_down_or_up_meets_what_is_there() -> None:
    roof = Obstacle("roof", (0.0, 0.0), radius_m=2.0, bottom_m=3.0, top_m=4.0)
    deck = Obstacle("deck", (0.0, 0.0), size_m=(4.0, 4.0), bottom_m=8.0, top_m=9.0)
    shapes = Shapes((roof, deck))
    origins = np.array([[0.5, 0.5, -6.0], [9.0, 0.0, -6.0]])
    vertical = np.array([[[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]] * 2)
    assert shapes.cast(origins, vertical, 40.0).tolist() == [[2.0, 2.0], [math.inf, math.inf]]
    assert cast_on_ground(Ground(), origins, vertical, 40.0)[:, 0].tolist() == [6.0, 6.0]


def test_ground_between_the_points_of_a_grid() -> None:
    ground = Ground(1.0, (0.0, 0.0), 10.0, ((0.0, 0.0), (10.0, 20.0)))
    north, east = np.array([0.0, 10.0, 10.0, 5.0, 99.0]), np.array([0.0, 0.0, 10.0, 5.0, -99.0])
    assert ground_height_m(ground, north, east).tolist() == [1.0, 11.0, 21.0, 8.5, 11.0]


def test_a_path_goes_back_and_forth_or_round() -> None:
    corners = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0))
    forth, around = MoverPath(corners, 1.0, True), MoverPath(corners, 1.0, False)
    assert forth.at(15.0) == around.at(15.0) == (10.0, 5.0)
    assert forth.at(25.0) == pytest.approx((10.0, 5.0))
    assert around.at(20.0 + math.sqrt(50.0)) == pytest.approx((5.0, 5.0))
    assert forth.at(45.0) == pytest.approx(forth.at(5.0))


# Sensors.


def test_obstacle_distance_sees_a_wall_in_72_sectors() -> None:
    station = station_in(World(obstacles=(WALL,), range_sensor=EXACT))
    station.run(1.0)
    seen = station.last("OBSTACLE_DISTANCE")
    assert len(seen.distances) == 72
    assert (seen.increment, seen.min_distance, seen.max_distance) == (5, 10, 4000)
    north = station.position[0]
    for sector in (0, 5, 67):
        expected = (9.5 - north) / math.cos(math.radians(5 * sector))
        assert seen.distances[sector] / 100.0 == pytest.approx(expected, abs=0.3)
    assert set(seen.distances[15:58]) == {4001}


def test_obstacle_distance_turns_with_the_nose() -> None:
    world = World(obstacles=(WALL,), range_sensor=EXACT)
    simulation = Simulation([VehicleConfig(heading_deg=90.0)], world=world)
    reading = simulation.vehicles[0].measure_ranges()
    assert reading is not None
    assert reading.sectors_m[54] == pytest.approx(9.5)
    assert math.isinf(reading.sectors_m[0])


def test_the_scanner_leans_with_the_vehicle() -> None:
    """Flying North the nose is down: what is ahead is the ground, and behind it sees the sky."""
    low_wall = Obstacle("low wall", (-15.0, 0.0), size_m=(1.0, 60.0), top_m=5.5)
    world = World(obstacles=(low_wall,), range_sensor=EXACT)
    station = station_in(world, WPNAV_SPEED=1500.0)
    vehicle = station.vehicle
    seen = vehicle.measure_ranges()
    assert seen is not None
    assert seen.sectors_m[36] == pytest.approx(14.5 + station.position[0], abs=0.2)
    assert math.isinf(seen.sectors_m[0])
    station.setpoint(POSITION, (200.0, 0.0, -5.0))
    station.run(1.5)
    motion, seen = vehicle.truth(), vehicle.measure_ranges()
    assert seen is not None
    assert motion.pitch_rad < math.radians(-10.0)
    height = range_finder.MOUNT_M * math.cos(motion.pitch_rad) - motion.down_m
    assert seen.sectors_m[0] == pytest.approx(height / -math.sin(motion.pitch_rad), rel=1e-3)
    assert math.isinf(seen.sectors_m[36])
    assert math.isinf(seen.sectors_m[18]), "level abeam"
    assert seen.down_m == pytest.approx(-motion.down_m / math.cos(motion.pitch_rad), rel=1e-2)


@pytest.mark.parametrize("kind", ["rover", "boat"])
def test_who_drives_sees_what_stands_around_and_no_hill(kind: str) -> None:
    hill = Ground(0.0, (2.0, -50.0), 10.0, ((0.0, 0.0), (4.0, 4.0)))
    world = World(ground=hill, obstacles=(WALL,), range_sensor=EXACT)
    config = VehicleConfig(vehicle=kind, heading_deg=0.0)
    seen = Simulation([config], world=world).vehicles[0].measure_ranges()
    assert seen is not None
    assert seen.sectors_m[0] == pytest.approx(9.5)
    assert seen.sectors_m[36] == math.inf
    assert seen.down_m == pytest.approx(0.0, abs=1e-3)


def test_a_sector_reports_the_nearest_of_what_is_in_it() -> None:
    """A post that stands between the middles of two sectors is not lost."""
    bearing = math.radians(7.0)
    place = (12.0 * math.cos(bearing), 12.0 * math.sin(bearing))
    world = World(obstacles=(Obstacle("post", place, radius_m=0.1),), range_sensor=EXACT)
    seen = Simulation([VehicleConfig(heading_deg=0.0)], world=world).vehicles[0].measure_ranges()
    assert seen is not None
    assert seen.sectors_m[1] == pytest.approx(11.9)
    assert sum(map(math.isfinite, seen.sectors_m)) == 1


def test_a_moving_obstacle_is_seen_where_it_is() -> None:
    path = MoverPath(((20.0, 0.0), (4.0, 0.0)), 2.0)
    lorry = Obstacle("lorry", (20.0, 0.0), radius_m=1.0, path=path)
    world = World(obstacles=(lorry,), range_sensor=EXACT)
    simulation = Simulation([VehicleConfig(heading_deg=0.0)], world=world)
    for _ in range(30):
        simulation.run_for(0.5)
        seen = simulation.vehicles[0].measure_ranges()
        assert seen is not None
        assert seen.sectors_m[0] == pytest.approx(path.at(simulation.time_s)[0] - 1.0)


def test_what_a_scanner_sees_comes_unasked_ten_times_a_second() -> None:
    """Also after a reboot. PX4 sends it to a ground station once a second."""
    world = World(obstacles=(WALL,), range_sensor=EXACT)
    rates = {"ardupilot": [10], "px4": [1, 10]}
    for autopilot, links in rates.items():
        roles = ("gcs", "onboard")[: len(links)]
        config = VehicleConfig(autopilot=autopilot, links=roles, ready_after_s=1.0)
        simulation = Simulation([config], world=world)
        for start in ("first", "second"):
            _scans(simulation, 10.0)
            assert _scans(simulation, 4.0) == [4 * rate for rate in links], (autopilot, start)
            simulation.vehicles[0].power_cycle()


def _scans(simulation: Simulation, seconds: float) -> list[int]:
    """How many OBSTACLE_DISTANCE come over each of the links."""
    simulation.run_for(seconds)
    heard = [mav.MAVLink(None).parse_buffer(link.read()) for link in simulation.vehicles[0].links]
    return [sum(m.get_type() == "OBSTACLE_DISTANCE" for m in messages) for messages in heard]


def test_above_a_wall_nothing_is_seen_around_and_its_top_below() -> None:
    roof = Obstacle("roof", (0.0, 0.0), radius_m=3.0, top_m=0.0, bottom_m=-1.0)
    world = World(obstacles=(WALL, roof), range_sensor=EXACT)
    station = station_in(world, 10.0)
    assert station.interval(132, 5.0) == ACCEPTED
    station.run(1.0)
    beams = {m.orientation: m for m in station.messages("DISTANCE_SENSOR")}
    assert beams[25].current_distance / 100.0 == pytest.approx(-station.position[2], abs=0.2)
    assert beams[0].current_distance == 4000
    assert beams[0].signal_quality == 1


def test_a_vehicle_without_the_sensor_sends_nothing() -> None:
    station = station_in(World())
    assert station.vehicle.measure_ranges() is None
    station.interval(132, 5.0)
    station.run(2.0)
    assert not station.messages("OBSTACLE_DISTANCE") + station.messages("DISTANCE_SENSOR")


def test_range_noise_is_seeded() -> None:
    def readings(seed: int) -> list[tuple[float, ...]]:
        simulation = Simulation(
            seed=seed, world=World(obstacles=(WALL,), range_sensor=RangeSensor())
        )
        found = []
        for _ in range(3):
            simulation.run_for(0.1)
            reading = simulation.vehicles[0].measure_ranges()
            assert reading is not None
            found.append(reading.sectors_m)
        return found

    assert readings(1) == readings(1)
    assert readings(1) != readings(2)
    assert len(set(readings(1))) == 3


@pytest.mark.night
def test_gps_noise_of_the_world() -> None:
    """The estimate wanders as far from the truth as the world says."""
    simulation = Simulation(
        [VehicleConfig(ready_after_s=0.5)] * 40, world=World(gps=GpsQuality(noise_m=0.6))
    )
    simulation.run_for(60.0)
    stations = [GroundStation(simulation, i) for i in range(40)]
    errors = []
    for station in stations:
        station.vehicle.link.read()
        message = _local_position(station)
        north, east, _ = station.position
        errors += [message.x - north, message.y - east]
    assert 0.4 < np.std(errors) < 0.8


def _local_position(station: GroundStation) -> Message:
    answers = station.send(_request(station.vehicle.system_id, 32))
    return next(m for m in answers if m.get_type() == "LOCAL_POSITION_NED")


def _request(system: int, message_id: int) -> Message:
    return mav.MAVLink_command_long_message(system, 1, 512, 0, message_id, 0, 0, 0, 0, 0, 0)


def test_gps_drops_out_by_chance_and_comes_back() -> None:
    world = World(gps=GpsQuality(dropouts_per_hour=360.0, dropout_s=2.0))
    station = GroundStation(Simulation([VehicleConfig(ready_after_s=1.0)], seed=1, world=world))
    station.ready()
    station.interval(24, 5.0)
    station.run(60.0)
    changes = station.changes("GPS_RAW_INT", "fix_type")
    assert changes.count(1) >= 2
    assert changes.count(6) >= 2


# Wind.


def test_wind_with_gusts_pushes_a_hovering_copter_about() -> None:
    calm = station_in(World())
    windy = station_in(World(wind=Wind((0.0, 6.0, 0.0), gust_m_s=2.0)))
    spread = []
    for station in (calm, windy):
        places = []
        for _ in range(100):
            station.run(0.2)
            places.append(station.position)
        spread.append(float(np.ptp(np.array(places)[:, 1])))
    assert spread[1] > 3.0 * spread[0]


def test_gusts_are_as_strong_as_the_world_says_and_seeded() -> None:
    def winds(seed: int, count: int = 60) -> np.ndarray:
        simulation = Simulation(seed=seed, world=World(wind=wind_from(5.0, 180.0, gust_m_s=1.5)))
        found = []
        for _ in range(count):
            simulation.run_for(0.5)
            found.append(simulation.vehicles[0].wind_ned_m_s)
        return np.array(found)

    first = winds(1, 600)
    assert first[:, 0].mean() == pytest.approx(5.0, abs=0.5)
    assert first[:, 0].std() == pytest.approx(1.5, rel=0.25)
    assert np.array_equal(first[:60], winds(1))
    assert not np.array_equal(first[:60], winds(2))


def test_another_vehicle_changes_nothing_for_the_first() -> None:
    world = load_world(WORLDS[0])
    alone = Simulation([VehicleConfig()], seed=4, world=world)
    both = Simulation([VehicleConfig()] * 2, seed=4, world=world)
    for simulation in (alone, both):
        simulation.run_for(5.0)
    assert alone.vehicles[0].wind_ned_m_s == pytest.approx(both.vehicles[0].wind_ned_m_s, abs=1e-9)
    assert alone.vehicles[0].measure_ranges() == both.vehicles[0].measure_ranges()


# Ground and collisions.


def test_the_true_clearance_is_to_the_nearest_surface_in_space() -> None:
    path = MoverPath(((0.0, -9.0), (0.0, 9.0)), 1.0)
    ball = Obstacle("ball", (0.0, -9.0), radius_m=1.0, bottom_m=6.0, top_m=7.0, path=path)
    simulation = Simulation([VehicleConfig()], world=World(obstacles=(WALL, ball)))
    vehicle = simulation.vehicles[0]
    assert vehicle.clearance() == (pytest.approx(9.5), "wall", False)
    simulation.run_for(5.0)
    assert vehicle.clearance() == (pytest.approx(math.hypot(3.0, 6.0)), "ball", True)
    assert math.isinf(Simulation().vehicles[0].clearance().distance_m)


def test_a_copter_lands_on_a_hill_and_on_a_roof() -> None:
    hill = Ground(0.0, (5.0, -50.0), 5.0, ((0.0,) * 21, (2.0,) * 21))
    station = station_in(World(ground=hill), 8.0)
    station.setpoint(POSITION, (12.0, 0.0, -8.0))
    station.run(10.0)
    station.mode(9)
    station.run_until(lambda: not station.vehicle.firmware.armed, 90.0)
    assert station.position[2] == pytest.approx(-2.0, abs=0.01)
    roof = Obstacle("roof", (12.0, 0.0), size_m=(8.0, 8.0), top_m=4.0)
    station = station_in(World(obstacles=(roof,)), 8.0)
    station.setpoint(POSITION, (12.0, 0.0, -8.0))
    station.run(10.0)
    station.mode(9)
    station.run_until(lambda: not station.vehicle.firmware.armed, 90.0)
    assert station.position[2] == pytest.approx(-4.0, abs=0.01)
    assert not station.simulation.truth.collided[0]


def test_a_collision_ends_the_flight_and_says_so() -> None:
    station = station_in(World(obstacles=(WALL,)))
    station.setpoint(POSITION, (30.0, 0.0, -5.0))
    station.run_until(lambda: bool(station.simulation.truth.collided[0]), 20.0)
    station.run(4.0)
    assert any(text.startswith("Crash: hit wall at ") for text in station.texts())
    assert station.last("HEARTBEAT").base_mode & 128 == 0
    # Its body may be in the wall by the way of one step at full speed.
    assert station.position[0] < 9.6, "it does not go through"
    assert station.simulation.truth.on_ground[0]
    assert station.mode(GUIDED) == ACCEPTED
    assert station.arm() == FAILED
    assert station.command(400, 1, 21196) == FAILED, "not by force either"
    assert "Arm: Crashed into wall" in station.texts()


def test_a_moving_obstacle_hits_a_copter_that_stays() -> None:
    lorry = Obstacle(
        "lorry",
        (0.0, -40.0),
        size_m=(3.0, 6.0),
        top_m=8.0,
        path=MoverPath(((0.0, -40.0), (0.0, 80.0)), 1.5),
    )
    station = station_in(World(obstacles=(lorry,)))
    assert not station.simulation.truth.collided[0]
    station.run_until(lambda: bool(station.simulation.truth.collided[0]), 60.0)
    assert -3.5 < -40.0 + 1.5 * station.simulation.time_s < -2.5


@pytest.mark.parametrize("speed", [2.0, 18.0])
def test_no_vehicle_is_fast_enough_to_slip_through(speed: float) -> None:
    pole = Obstacle("pole", (60.0, 0.0), radius_m=0.05, top_m=20.0)
    station = station_in(World(obstacles=(pole,)), WPNAV_SPEED=100.0 * speed)
    station.setpoint(POSITION, (150.0, 0.0, -5.0))
    station.run_until(lambda: bool(station.simulation.truth.collided[0]), 60.0)
    assert 59.0 < station.position[0] < 60.0


@pytest.mark.parametrize("kind", ["copter", "rover", "boat", "plane"])
def test_every_kind_of_vehicle_lives_in_a_world(kind: str) -> None:
    """It stands on the ground, feels, sees, and is hit."""
    lorry = Obstacle(
        "lorry",
        (0.0, -20.0),
        size_m=(3.0, 4.0),
        top_m=3.0,
        path=MoverPath(((0.0, -20.0), (0.0, 80.0)), 4.0),
    )
    world = World(obstacles=(WALL, lorry), range_sensor=EXACT, wind=wind_from(3.0, 90.0))
    config = VehicleConfig(vehicle=kind, heading_deg=0.0, ready_after_s=1.0)
    simulation = Simulation([config], seed=1, world=world)
    simulation.run_for(2.0)
    reading = simulation.vehicles[0].measure_ranges()
    assert reading is not None
    assert reading.sectors_m[0] == pytest.approx(9.5, abs=0.5)
    assert not simulation.truth.collided[0]
    simulation.run_for(4.0)
    assert simulation.truth.collided[0]
    assert not simulation.vehicles[0].firmware.armed


def test_a_world_and_failures_are_deterministic_however_time_is_cut() -> None:
    """The same seed and inputs give byte-identical traffic, with several vehicles."""

    def flight(step_s: float) -> bytes:
        world = load_world(WORLDS[0])
        simulation = Simulation([VehicleConfig(ready_after_s=1.0)] * 3, seed=9, world=world)
        stations = [GroundStation(simulation, index) for index in range(3)]
        heard = b""
        for second in range(12):
            for station in stations:
                own = station.vehicle.system_id
                for message_id in (32, 132, 168, 330) if second == 2 else ():
                    command = [own, 1, 511, 0, message_id, 1e5, 0, 0, 0, 0, 0]
                    station.vehicle.link.write(
                        station.pack(mav.MAVLink_command_long_message(*command))
                    )
            if second == 5:
                simulation.vehicles[1].lose_gps()
                simulation.vehicles[2].link.set_faults(LinkFaults(loss=0.2, corrupt=0.2))
            for _ in range(round(1.0 / step_s)):
                simulation.run_for(step_s)
            heard += b"".join(vehicle.link.read() for vehicle in simulation.vehicles)
        return heard

    whole = flight(1.0)
    assert len(whole) > 20_000
    assert flight(0.01) == whole
    assert flight(0.025) == whole
