"""Missions among boxes, as in the UAV Testing Competition: `python -m tests.explore.boxes`.

A test file of that competition names a `.plan` file and up to a few boxes beside the way, and is
flown several times with each firmware. The server knows none of the boxes; a scanner sees them. A
touch is a hard failure; less than 1.5 m to the middle of the vehicle is a soft one. Without a file,
layouts are drawn by the same rules: boxes of 2 to 20 m and higher than the flight, which do not
overlap, across and beside a way of 50 m, with a path left. Every third has something that moves.

Rules of the files, as seen in those that are public: `x` is north and `y` east of home, the
middle of a box; `l` and `w` are its sizes along these, before it is turned by `r` degrees from
north to east; all stand on the ground.
"""

from __future__ import annotations

import argparse
import itertools
import math
import multiprocessing
import random
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import yaml

from mavlink_sitl import (
    DEFAULT_HOME,
    GeoPoint,
    MoverPath,
    Obstacle,
    RangeSensor,
    VehicleConfig,
    World,
)
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.positions.frames import equidistant_at
from navigation_bridge.goals.requests import LandRequest, WaypointRequest, WaypointsRequest
from navigation_bridge.plan_files.items import PlanError
from navigation_bridge.plan_files.qgroundcontrol import plan_document, plan_items
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.planning.planner import NoPath, PlanLimits, plan
from tests.support.flights.simulated_flight import SimulatedFlight

FIRMWARES = ("ardupilot", "px4")
TOUCH_M, SAFE_M = 0.5, 1.5
"""From the middle of the vehicle: its radius, and the competition's safe distance"""
SPEEDS_M_S, REACHES_M = (3.0, 5.0, 8.0), (8.0, 15.0)
HEIGHT_M = 10.0
TIMEOUT_S = 900.0
_MARGIN_M = 1.5
"""Beyond the radius: what is planned keeps 2 m, which leaves 0.5 m for wind and braking"""
_NORTH_M, _EAST_M, _SIZE_M = (-40.0, 30.0), (10.0, 40.0), (2.0, 20.0)
_WAYS_M = ((0.0, 52.0), (0.0, 48.0), (-6.0, 50.0))


class BoxesError(ValueError):
    """A test file cannot be flown; the text says why."""


@dataclass(frozen=True)
class Layout:
    """A mission among obstacles, flown once with each firmware and seed.

    Attributes:
        name: of the layout.
        way_ned_m: places that are flown to, the last one to land there; metres from home.
        obstacles: what is in the world.
        speed_m_s: highest speed.
        reach_m: of the scanner.
        home: where it starts.
    """

    name: str
    way_ned_m: tuple[tuple[float, float, float], ...]
    obstacles: tuple[Obstacle, ...]
    speed_m_s: float = 5.0
    reach_m: float = 15.0
    home: GeoPoint = DEFAULT_HOME


@dataclass(frozen=True)
class Flown:
    """One flight.

    Attributes:
        layout: its name.
        firmware: of the vehicle.
        seed: of the simulation.
        code: of the goal that ended last; "" if it did not end.
        nearest_m: least distance of the vehicle's middle to what is in the world.
        nearest: its name.
        moves: whether that moves.
        touched: whether the simulator says that it flew into something.
        flown_s: how long it took.
    """

    layout: str
    firmware: str
    seed: int
    code: str
    nearest_m: float
    nearest: str
    moves: bool
    touched: bool
    flown_s: float

    @property
    def verdict(self) -> str:
        """Hard, soft, or the code of the end."""
        if self.touched or self.nearest_m < TOUCH_M:
            return "hard failure"
        return "soft failure" if self.nearest_m < SAFE_M else self.code or "no end"


def read_layout(path: Path, speed_m_s: float, reach_m: float) -> Layout:
    """Read a test file and the plan that it names, beside it or in a folder above.

    Raises:
        BoxesError: it cannot be read, or something is missing.
    """
    try:
        content = yaml.safe_load(path.read_text("utf-8"))
        named = Path(str(content["drone"]["mission_file"]))
        boxes = content.get("simulation", {}).get("obstacles") or []
        obstacles = tuple(_box(number, box) for number, box in enumerate(boxes, 1))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise BoxesError(f"{path}: {error}") from error
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise BoxesError(f"{path}: it is not a test with a mission_file: {error!r}") from error
    for folder in path.resolve().parents:
        for plan_file in (folder / named, folder / named.name):
            if plan_file.is_file():
                home, way = _way(plan_file)
                return Layout(path.stem, way, obstacles, speed_m_s, reach_m, home)
    raise BoxesError(f"{path}: there is no {named} beside it or above.")


def _box(number: int, box: dict[str, Any]) -> Obstacle:
    size, position = box["size"], box["position"]
    return Obstacle(
        f"box {number}",
        (float(position["x"]), float(position["y"])),
        size_m=(float(size["l"]), float(size["w"])),
        yaw_rad=math.radians(float(position.get("r", position.get("angle", 0.0)))),
        top_m=float(position.get("z", 0.0)) + float(size["h"]),
    )


def _way(path: Path) -> tuple[GeoPoint, tuple[tuple[float, float, float], ...]]:
    """Return home, and the places of a plan: north, east, down of it, metres."""
    try:
        document = plan_document(path.read_text("utf-8"))
        items, _, _ = plan_items(document)
    except (OSError, UnicodeDecodeError, PlanError) as error:
        raise BoxesError(f"{path}: {error}") from error
    try:
        mission: Any = document["mission"]
        latitude, longitude, altitude = map(float, mission["plannedHomePosition"])
    except (KeyError, TypeError, ValueError) as error:
        raise BoxesError(f"{path}: it has no plannedHomePosition of three numbers.") from error
    home = (latitude, longitude, altitude)
    projection, height_m, way = equidistant_at(home[0]), HEIGHT_M, []
    for item in items:
        latitude, longitude, above_m = item.params[4:7]
        if item.command == mavlink.MAV_CMD_NAV_TAKEOFF:
            height_m = above_m
        elif item.command in (mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_LAND):
            is_landing = item.command == mavlink.MAV_CMD_NAV_LAND
            north, east = projection.to_local(latitude, longitude, home)
            way.append((north, east, -height_m if is_landing else -above_m))
    if not way:
        raise BoxesError(f"{path}: it has no place to fly to.")
    return GeoPoint(*home), tuple(way)


# --- layouts by the rules ------------------------------------------------------------------------


def drawn(seed: int) -> Layout:
    """Return a layout by the rules, with a path through it."""
    rng = random.Random(f"boxes {seed}")
    while True:
        north_m, east_m = rng.choice(_WAYS_M)
        way = ((north_m, east_m, -HEIGHT_M),)
        boxes = _drawn_boxes(rng, north_m / east_m)
        standing = tuple(boxes)
        if _has_path(way, standing):
            break
    obstacles = (*standing, _mover(rng, standing)) if seed % 3 == 2 else standing
    speed_m_s, reach_m = SPEEDS_M_S[seed // 3 % 3], REACHES_M[seed // 9 % 2]
    return Layout(f"layout {seed}", way, obstacles, speed_m_s, reach_m)


def _drawn_boxes(rng: random.Random, slope: float) -> list[Obstacle]:
    """Return two to four boxes that do not overlap, the first across the way."""
    boxes: list[Obstacle] = []
    count = rng.randint(2, 4)
    while len(boxes) < count:
        size = (rng.uniform(*_SIZE_M), rng.uniform(*_SIZE_M))
        east_m = rng.uniform(*_EAST_M)
        # The first ones are on the way, or end just beside it; this finds the most elsewhere.
        aside_m = rng.gauss(0.0, 4.0 if not boxes else 14.0)
        at = (slope * east_m + aside_m, east_m)
        box = Obstacle(
            f"box {len(boxes) + 1}", at, size_m=size, top_m=rng.uniform(12.0, 25.0),
            yaw_rad=math.radians(rng.uniform(0.0, 90.0) if rng.random() < 0.5 else 0.0),
        )  # fmt: skip
        outline = _outline(box)
        low_n, low_e, high_n, high_e = outline.bounds
        fits = low_n >= _NORTH_M[0] and high_n <= _NORTH_M[1]
        fits = fits and low_e >= _EAST_M[0] and high_e <= _EAST_M[1]
        if fits and not any(outline.intersects(_outline(other)) for other in boxes):
            boxes.append(box)
    return boxes


def _outline(box: Obstacle) -> shapely.Polygon:
    """Return a box from above: north, east."""
    north, east = 0.5 * box.size_m[0], 0.5 * box.size_m[1]
    cosine, sine = math.cos(box.yaw_rad), math.sin(box.yaw_rad)
    corners = ((north, east), (north, -east), (-north, -east), (-north, east))
    return shapely.Polygon(
        [(box.at_m[0] + n * cosine - e * sine, box.at_m[1] + n * sine + e * cosine)
         for n, e in corners]
    )  # fmt: skip


def _mover(rng: random.Random, standing: Sequence[Obstacle]) -> Obstacle:
    """Return something that goes to and fro across the way, behind a box where there is room."""
    east_m = rng.choice([_outline(box).bounds[3] for box in standing]) + rng.uniform(2.0, 5.0)
    ends = ((-rng.uniform(8.0, 15.0), east_m), (rng.uniform(8.0, 15.0), east_m))
    path = MoverPath(ends, rng.uniform(0.5, 1.5))
    return Obstacle("mover", ends[0], radius_m=rng.uniform(0.3, 1.0), top_m=20.0, path=path)


def _has_path(way: Sequence[tuple[float, float, float]], boxes: Iterable[Obstacle]) -> bool:
    """Whether a path at the height of the flight keeps what is asked for, with all known."""
    table = np.array(
        [(box.at_m[1], box.at_m[0], 0.5 * box.size_m[0], 0.5 * box.size_m[1],
          0.5 * math.pi - box.yaw_rad, 0.0, box.top_m) for box in boxes]
    )  # fmt: skip
    places = [(0.0, 0.0, HEIGHT_M), *((east, north, -down) for north, east, down in way)]
    known, limits = Obstacles(boxes=table), PlanLimits(TOUCH_M + _MARGIN_M)
    return not any(
        isinstance(plan(a, b, known, limits), NoPath) for a, b in itertools.pairwise(places)
    )


# --- flights -------------------------------------------------------------------------------------


def fly(layout: Layout, firmware: str, seed: int) -> Flown:
    """Take off, fly the way around what the scanner sees, and land."""
    world = World(obstacles=layout.obstacles, range_sensor=RangeSensor(reach_m=layout.reach_m))
    vehicle = VehicleConfig(autopilot=firmware, ready_after_s=1.0, home=layout.home)
    height_m = -layout.way_ned_m[0][2]
    flight = SimulatedFlight(
        seed, vehicle, world, takeoff_height_m=height_m, obstacle_margin_m=_MARGIN_M,
        obstacle_map_size_m=200.0, volume_altitude_max_m=height_m + 1.0,
    ).ready()  # fmt: skip
    flight.run_for(1.0)
    begun_s, code = flight.now, ""
    waypoints = tuple(
        WaypointRequest((east, north, -down)) for north, east, down in layout.way_ned_m
    )
    route = WaypointsRequest(waypoints, max_speed_m_s=layout.speed_m_s, avoid_obstacles=True)
    for request in (route, LandRequest()):
        goal_id = flight.start(request)
        while not flight.ends(goal_id) and flight.now - begun_s < TIMEOUT_S:
            flight.run_for(0.5)
        code = flight.ends(goal_id)[0].code.value if flight.ends(goal_id) else ""
        if code != "SUCCESS":
            break
    nearest = flight.ground_truth.nearest
    return Flown(
        layout.name, firmware, seed, code,
        math.inf if nearest is None else nearest.distance_m,
        "" if nearest is None else nearest.obstacle,
        nearest is not None and nearest.moves,
        flight.ground_truth.collided, flight.now - begun_s,
    )  # fmt: skip


def _show(flown: Flown) -> None:
    near = f"{flown.nearest_m:.2f} m from {flown.nearest}" if flown.nearest else "near nothing"
    print(
        f"{flown.layout}, {flown.firmware}, seed {flown.seed}: {flown.verdict}; "
        f"{near}, {flown.flown_s:.0f} s, {flown.code or 'no end'}",
        flush=True,
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.explore.boxes", description=__doc__.splitlines()[0]
    )
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="test files (YAML)")
    parser.add_argument("--times", type=int, default=5, help="flights of each file (default: 5)")
    parser.add_argument("--speed", type=float, default=5.0, help="m/s, for files (default: 5)")
    parser.add_argument("--reach", type=float, default=15.0, help="of the scanner, m (default: 15)")
    parser.add_argument("--layouts", type=int, default=200, metavar="N", help="without a file")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="the first layout")
    parser.add_argument("--workers", type=int, default=2, help="processes (default: 2)")
    return parser


def main(args: Sequence[str] | None = None) -> int:
    """Fly files or layouts; return 1 for a touch, or too many soft failures or lost goals."""
    options = _parser().parse_args(args)
    try:
        layouts = [read_layout(path, options.speed, options.reach) for path in options.files]
    except BoxesError as error:
        print(error, file=sys.stderr)
        return 2
    seeds = range(1, options.times + 1)
    flights = list(itertools.product(layouts, FIRMWARES, seeds))
    if not layouts:
        numbers = range(options.first, options.first + options.layouts)
        flights = [(drawn(number), FIRMWARES[number % 2], number) for number in numbers]
    counts: Counter[str] = Counter()
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.workers, mp_context=context) as pool:
        for flown in pool.map(fly, *zip(*flights, strict=True)):
            counts[flown.verdict] += 1
            if flown.verdict != "SUCCESS" or layouts:
                _show(flown)
    count = sum(counts.values())
    print(f"{count} flights: " + ", ".join(f"{n} {what}" for what, n in counts.most_common()))
    soft, arrived = counts["soft failure"], counts["SUCCESS"] + counts["soft failure"]
    met = not counts["hard failure"] and soft <= 0.01 * count and arrived >= 0.98 * count
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
