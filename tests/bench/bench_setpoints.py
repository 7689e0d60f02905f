"""The interval between setpoints, while the server plans around obstacles and when it does not.

One server, one simulated copter, a relay between them that stamps each setpoint. The server knows
1,000 posts; others only the scanner sees, and some move, so that it replans again and again. The
copter flies legs in turns: through the wood with avoidance, and beside the wood, along an aisle
without anything, with avoid_obstacles false. So both have the same server, map and scans, at nearly
the same time. Each leg is cut into windows of 40 setpoints; the longest interval of each counts.
Two legs of each kind, of 25 s or more, make the 20 windows.
"""

from __future__ import annotations

import json
import math
import os
import random
import tempfile
import time
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import yaml

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from navigation_core.geometry import Vector3
from tests.bench.limits import LATE_S, READY_S
from tests.bench.rows import row
from tests.bench.stamping_relay import Relay

PERIOD_MS = 50.0
LONGEST_MS, LATE_MS = 75.0, 60.0
REPLANS_MIN = 3
WINDOWS, SHORT_WINDOWS = 20, 1
WINDOW_S, SHORT_WINDOW_S = 2.0, 1.0
LEG_MAX_S = 600.0
"""An idle machine needs 30 s"""
LEGS_MAX = 12
SPEED_M_S = 4.0
KNOWN, FAR, UNKNOWN, MOVING = 200, 800, 60, 5
_SHORT_ENDS = ("SUCCESS", "SERVER_LATE")
"""The short form runs on a machine that others keep busy, too"""
_SEED = 5
_RADIUS_M, _HEIGHT_M = 0.3, 40.0
# From middle to middle: between any two posts there is room for the vehicle and its clearance.
_SPACING_M = 2.0 * (_RADIUS_M + 1.5) + 0.4
# The wood, east and north, and the far wood behind it; start and goal are outside.
_EAST_M, _NORTH_M = (6.0, 94.0), (-45.0, 45.0)
_FAR_NORTH_M, _FAR_SPACING_M = (50.0, 150.0), 2.0
_AISLE_NORTH_M = -55.0
_SENSOR = {"reach_m": 10.0, "noise_m": 0.03}
_WOOD_M: tuple[Vector3, Vector3] = ((0.0, 0.0, 3.0), (100.0, 0.0, 3.0))
_AISLE_M: tuple[Vector3, Vector3] = ((100.0, _AISLE_NORTH_M, 3.0), (0.0, _AISLE_NORTH_M, 3.0))
_SHORT_WOOD_M: tuple[Vector3, Vector3] = ((0.0, 0.0, 3.0), (4.5, 0.0, 3.0))
_SHORT_AISLE_M: tuple[Vector3, Vector3] = ((4.5, -8.0, 3.0), (0.0, -8.0, 3.0))

_Place = tuple[float, float]
_Stamps = np.ndarray[Any, np.dtype[np.float64]]


@dataclass
class _Legs:
    """The legs of one kind: when each was flown, replans, and the server's processor time."""

    times_s: list[tuple[float, float]] = field(default_factory=list)
    replans: int = 0
    used_s: float = 0.0

    def windows(self, stamps_s: _Stamps, window_s: float) -> list[_Stamps]:
        """Return the intervals between setpoints of each window, ms."""
        windows = []
        for begun_s, ended_s in self.times_s:
            within_s = stamps_s[(stamps_s >= begun_s) & (stamps_s <= ended_s)]
            edges_s = np.arange(within_s[0], within_s[-1], window_s)[1:]
            # Each part begins with the stamp that ends the one before: no interval is lost.
            parts = np.split(within_s, np.searchsorted(within_s, edges_s))
            for before_s, part_s in pairwise([parts[0][:1], *parts]):
                windows.append(1e3 * np.diff(np.concatenate([before_s[-1:], part_s])))
        return [window for window in windows if len(window) > 1]

    @property
    def core_share(self) -> float:
        """Of the server, in these legs."""
        return self.used_s / sum(ended_s - begun_s for begun_s, ended_s in self.times_s)


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Fly both kinds of legs in turns until there are enough windows of each."""
    avoiding, straight, stamps_s = _flown(short)
    window_s = SHORT_WINDOW_S if short else WINDOW_S
    count = SHORT_WINDOWS if short else WINDOWS
    ours, others = (legs.windows(stamps_s, window_s)[:count] for legs in (avoiding, straight))
    if min(len(ours), len(others)) < count:
        raise RuntimeError(f"Only {len(ours)} and {len(others)} of {count} windows were flown.")
    name, reference = "Interval of setpoints among 1,000 obstacles", "without avoidance"
    ours_ms, others_ms = np.concatenate(ours), np.concatenate(others)
    longest_ms, other_longest_ms = float(ours_ms.max()), float(others_ms.max())
    typical_ms, other_typical_ms = (
        float(np.median([window.max() for window in windows])) for windows in (ours, others)
    )
    late_ms, other_late_ms = (float(np.percentile(ms, 99.0)) for ms in (ours_ms, others_ms))
    return [
        row(
            f"{name}, longest",
            (longest_ms, "ms"),
            (reference, other_longest_ms),
            f"<= {LONGEST_MS:g} ms, or 1 x",
            longest_ms <= max(LONGEST_MS, other_longest_ms),
        ),
        row(
            f"{name}, longest of a window, median",
            (typical_ms, "ms"),
            (reference, other_typical_ms),
            f"<= {LONGEST_MS:g} ms",
        ),
        row(
            f"{name}, 99th percentile",
            (late_ms, "ms"),
            (reference, other_late_ms),
            f"<= {LATE_MS:g} ms",
        ),
        row(
            f"{name}, median",
            (float(np.median(ours_ms)), "ms"),
            (reference, float(np.median(others_ms))),
            f"{PERIOD_MS:g} ms, within 5 %",
            abs(float(np.median(ours_ms)) - PERIOD_MS) < 0.05 * PERIOD_MS,
        ),
        row(
            "Replans in a leg through the wood, most",
            (avoiding.replans, "1"),
            (reference, straight.replans),
            f">= {REPLANS_MIN}",
        ),
        row(
            "Processor time of the server among 1,000 obstacles",
            (1e3 * avoiding.core_share, "ms/s"),
            (reference, 1e3 * straight.core_share),
            "< 500 ms/s",
        ),
    ]


# --- the wood ----------------------------------------------------------------------------


def _wood() -> tuple[list[_Place], list[_Place]]:
    """Return the places of known and of unknown posts, east and north of the start."""
    chance = random.Random(_SEED)
    near = _places(chance, KNOWN + UNKNOWN, _NORTH_M, _SPACING_M)
    # The first ones found the most room; the unknown ones are to be everywhere.
    chance.shuffle(near)
    return near[:KNOWN] + _places(chance, FAR, _FAR_NORTH_M, _FAR_SPACING_M), near[KNOWN:]


def _places(
    chance: random.Random, count: int, north_m: tuple[float, float], spacing_m: float
) -> list[_Place]:
    places: list[_Place] = []
    while len(places) < count:
        place = (chance.uniform(*_EAST_M), chance.uniform(*north_m))
        if all(math.dist(place, other) >= spacing_m for other in places):
            places.append(place)
    return places


def _post(number: int, at_m: list[float]) -> dict[str, Any]:
    return {
        "kind": "cylinder",
        "name": f"post {number}",
        "at_m": at_m,
        "radius_m": _RADIUS_M,
        "height_m": _HEIGHT_M,
    }


def _world(places: list[_Place]) -> dict[str, Any]:
    """Return the simulator's world."""
    obstacles = [_post(number, [north, east]) for number, (east, north) in enumerate(places)]
    for number in range(MOVING):
        east = _EAST_M[0] + (number + 1) * (_EAST_M[1] - _EAST_M[0]) / (MOVING + 1)
        ends = [[-10.0, east], [10.0, east]]
        path = {"points_m": ends, "speed_m_s": 0.3 + 0.02 * number, "at_the_end": "turn_round"}
        obstacles.append(
            {"kind": "cylinder", "name": f"walker {number}", "radius_m": 0.5,
             "height_m": _HEIGHT_M, "path": path}
        )  # fmt: skip
    return {"name": "bench", "obstacles": obstacles, "range_sensor": _SENSOR}


def _known(places: list[_Place]) -> dict[str, Any]:
    """Return the server's file of obstacles."""
    posts = [_post(number, [east, north]) for number, (east, north) in enumerate(places)]
    return {"frame": "map", "obstacles": posts}


# --- the flights -------------------------------------------------------------------------


def _flown(short: bool) -> tuple[_Legs, _Legs, _Stamps]:
    """Fly legs with avoidance and without, in turns; return both, and the times of setpoints."""
    port = free_udp_port()
    relay = Relay(port)
    environment = ros_environment(free_domain(os.getpid()))
    processes: list[Process] = []
    known, unknown = _wood()
    avoiding, straight = _Legs(), _Legs()
    wood, aisle = (_SHORT_WOOD_M, _SHORT_AISLE_M) if short else (_WOOD_M, _AISLE_M)
    with tempfile.TemporaryDirectory() as folder:
        world, file = Path(folder) / "world.yaml", Path(folder) / "known.yaml"
        world.write_text(yaml.safe_dump(_world(known + unknown)))
        file.write_text(yaml.safe_dump(_known(known)))
        try:
            server = _server(port, file, environment)
            processes.append(server)
            processes.append(_simulator(relay.port, world, environment))
            server.wait_for("Position valid", READY_S)
            usage = psutil.Process(server.pid)
            # To the height of the legs, which counts for neither kind.
            _leg(_Legs(), usage, wood[0], False, environment, short)
            for _ in range(1 if short else LEGS_MAX):
                _leg(avoiding, usage, wood[1], True, environment, short)
                _leg(_Legs(), usage, aisle[0], False, environment, short)
                _leg(straight, usage, aisle[1], False, environment, short)
                _leg(_Legs(), usage, wood[0], False, environment, short)
                flown_s = min(
                    sum(ended_s - begun_s - WINDOW_S for begun_s, ended_s in legs.times_s)
                    for legs in (avoiding, straight)
                )
                if flown_s > WINDOWS * WINDOW_S:
                    break
            stamps_s = np.array(relay.finish()["setpoints"])
        finally:
            relay.kill()
            for process in reversed(processes):
                process.stop(15.0)
    return avoiding, straight, stamps_s


def _leg(
    legs: _Legs,
    usage: psutil.Process,
    goal_enu_m: Vector3,
    avoid: bool,
    environment: dict[str, str],
    short: bool,
) -> None:
    """Fly to a place, and add the leg to those of its kind."""
    before_s = sum(usage.cpu_times()[:2])
    client = _client(goal_enu_m, avoid, environment)
    try:
        client.wait_for('"NAVIGATING"', READY_S)
        begun_s = time.monotonic()
        client.wait_for('"ended"', LEG_MAX_S)
        ended_s = time.monotonic()
        client.wait(LATE_S)
    finally:
        client.stop()
    events = [json.loads(line) for line in client.lines]
    end = next(event for event in events if event["event"] == "ended")
    if end["code"] != "SUCCESS" and not (short and end["code"] in _SHORT_ENDS):
        raise RuntimeError(f"A leg ended otherwise, nothing measured: {end['message']}")
    replans = [event.get("replans", 0) for event in events if event["event"] == "feedback"]
    legs.times_s.append((begun_s, ended_s))
    legs.replans = max([legs.replans, *replans])
    legs.used_s += sum(usage.cpu_times()[:2]) - before_s


def _server(port: int, file: Path, environment: dict[str, str]) -> Process:
    parameters = ["-p", f"obstacles_file:={file}", "-p", "volume_altitude_max_m:=20.0"]
    return Process(
        "server",
        ["python", "-m", "drone_navigation.navigation_server", "--link",
         f"udpin://127.0.0.1:{port}", "--arming", "auto", "--ros-args", *parameters],
        environment,
    )  # fmt: skip


def _simulator(port: int, world: Path, environment: dict[str, str]) -> Process:
    return Process(
        "mavlink_sitl",
        ["python", "-m", "mavlink_sitl", "--link", f"udpout://127.0.0.1:{port}",
         "--world", str(world), "--seed", str(_SEED)],
        environment,
    )  # fmt: skip


def _client(goal_enu_m: Vector3, avoid: bool, environment: dict[str, str]) -> Process:
    goal = [f"{number:g}" for number in goal_enu_m]
    return Process(
        "client",
        ["python", "-m", "drone_navigation.navigation_client", "--json", "--speed",
         f"{SPEED_M_S:g}", "--goal", *goal, "--avoid" if avoid else "--straight"],
        environment,
    )  # fmt: skip
