"""The interval between setpoints, while the server plans around obstacles and when it does not.

Real server, real simulated copter, a relay between them that stamps each setpoint. The copter
flies through a wood: 200 posts that the server knows, others that only the scanner sees, and
some that move across its path, so that it replans again and again. Reference: the same flight
with avoid_obstacles false, through the same wood with nothing on the straight line.
"""

from __future__ import annotations

import json
import math
import os
import random
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import yaml

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from navigation_core.geometry import Vector3
from tests.bench.limits import READY_S
from tests.bench.rows import row
from tests.bench.stamping_relay import Relay

PERIOD_MS = 50.0
LONGEST_MS, LATE_MS = 2.0 * PERIOD_MS, 1.5 * PERIOD_MS
REPLANS_MIN = 3
FLIGHT_MAX_S = 600.0
"""An idle machine needs 50 s"""
GOAL_ENU_M, SHORT_GOAL_ENU_M = (100.0, 0.0, 3.0), (8.0, 0.0, 3.0)
SPEED_M_S = 4.0
KNOWN, UNKNOWN, MOVING = 200, 60, 5
_ENDS = ("SUCCESS",)
_SHORT_ENDS = ("SUCCESS", "SERVER_LATE")
"""The short form runs on a machine that others keep busy, too"""
_SEED = 5
_RADIUS_M, _HEIGHT_M = 0.3, 40.0
# From middle to middle: between any two posts there is room for the vehicle and its clearance.
_SPACING_M = 2.0 * (_RADIUS_M + 1.5) + 0.4
# The wood, east and north; start and goal are outside.
_EAST_M, _NORTH_M = (6.0, 94.0), (-45.0, 45.0)
_AISLE_M = 4.0
_SENSOR = {"reach_m": 10.0, "noise_m": 0.03}

_Place = tuple[float, float]


@dataclass(frozen=True)
class _Flown:
    """One flight: intervals between setpoints (ms), replans, and the server's use of a core."""

    intervals_ms: np.ndarray[Any, np.dtype[np.float64]]
    replans: int
    core_share: float

    @property
    def longest_ms(self) -> float:
        return float(self.intervals_ms.max())

    @property
    def late_ms(self) -> float:
        return float(np.percentile(self.intervals_ms, 99.0))

    @property
    def median_ms(self) -> float:
        return float(np.median(self.intervals_ms))


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Fly with avoid_obstacles, and without."""
    goal_enu_m = SHORT_GOAL_ENU_M if short else GOAL_ENU_M
    ends = _SHORT_ENDS if short else _ENDS
    avoiding, straight = (_flown(goal_enu_m, avoid, ends) for avoid in (True, False))
    name = "Interval of setpoints while planning around obstacles"
    share, reference = avoiding.core_share, "avoid_obstacles false"
    return [
        row(
            f"{name}, longest",
            (avoiding.longest_ms, "ms"),
            (reference, straight.longest_ms),
            f"< {LONGEST_MS:g} ms, or 1 x",
            # Where even a server that plans nothing is late, the machine has been busy.
            avoiding.longest_ms < max(LONGEST_MS, straight.longest_ms),
        ),
        row(
            f"{name}, 99th percentile",
            (avoiding.late_ms, "ms"),
            (reference, straight.late_ms),
            f"< {LATE_MS:g} ms",
        ),
        row(
            f"{name}, median",
            (avoiding.median_ms, "ms"),
            (reference, straight.median_ms),
            f"{PERIOD_MS:g} ms, within 5 %",
            abs(avoiding.median_ms - PERIOD_MS) < 0.05 * PERIOD_MS,
        ),
        row(
            "Replans in that flight",
            (float(avoiding.replans), "1"),
            (reference, float(straight.replans)),
            f">= {REPLANS_MIN}",
            avoiding.replans >= REPLANS_MIN,
        ),
        row(
            "Processor time of the server in that flight",
            (1e3 * share, "ms/s"),
            (reference, 1e3 * straight.core_share),
            "< 500 ms/s",
            share < 0.5,
        ),
    ]


# --- the wood ----------------------------------------------------------------------------


def _wood() -> tuple[list[_Place], list[_Place]]:
    """Return the places of known and of unknown posts, east and north of the start."""
    chance = random.Random(_SEED)
    places: list[_Place] = []
    while len(places) < KNOWN + UNKNOWN:
        place = (chance.uniform(*_EAST_M), chance.uniform(*_NORTH_M))
        if all(math.dist(place, other) >= _SPACING_M for other in places):
            places.append(place)
    # The first ones found the most room; the unknown ones are to be everywhere.
    chance.shuffle(places)
    return places[:KNOWN], places[KNOWN:]


def _world(places: list[_Place], aisle_m: float) -> dict[str, Any]:
    """Return the simulator's world, with nothing within a distance of the straight line."""
    obstacles: list[dict[str, Any]] = [
        {"kind": "cylinder", "name": f"post {number}", "at_m": [north, east],
         "radius_m": _RADIUS_M, "height_m": _HEIGHT_M}
        for number, (east, north) in enumerate(places)
        if abs(north) >= aisle_m
    ]  # fmt: skip
    for number in range(MOVING):
        east = _EAST_M[0] + (number + 1) * (_EAST_M[1] - _EAST_M[0]) / (MOVING + 1)
        ends = [[aisle_m or -10.0, east], [10.0 + aisle_m, east]]
        path = {"points_m": ends, "speed_m_s": 0.3 + 0.02 * number, "at_the_end": "turn_round"}
        obstacles.append(
            {"kind": "cylinder", "name": f"walker {number}", "radius_m": 0.5,
             "height_m": _HEIGHT_M, "path": path}
        )  # fmt: skip
    return {"name": "bench", "obstacles": obstacles, "range_sensor": _SENSOR}


def _known(places: list[_Place]) -> dict[str, Any]:
    """Return the server's file of obstacles."""
    return {
        "frame": "map",
        "obstacles": [
            {"kind": "cylinder", "name": f"post {number}", "at_m": [east, north],
             "radius_m": _RADIUS_M, "height_m": _HEIGHT_M}
            for number, (east, north) in enumerate(places)
        ],
    }  # fmt: skip


# --- the flights -------------------------------------------------------------------------


def _flown(goal_enu_m: Vector3, avoid: bool, ends: tuple[str, ...]) -> _Flown:
    port = free_udp_port()
    relay = Relay(port)
    environment = ros_environment(free_domain(os.getpid() + 10 * avoid))
    processes: list[Process] = []
    known, unknown = _wood()
    with tempfile.TemporaryDirectory() as folder:
        world, file = Path(folder) / "world.yaml", Path(folder) / "known.yaml"
        world.write_text(yaml.safe_dump(_world(known + unknown, 0.0 if avoid else _AISLE_M)))
        file.write_text(yaml.safe_dump(_known(known)))
        try:
            server = _server(port, file, environment)
            processes.append(server)
            processes.append(_simulator(relay.port, world, environment))
            server.wait_for("Position valid", READY_S)
            usage = psutil.Process(server.pid)
            before_s = sum(usage.cpu_times()[:2])
            client = _client(goal_enu_m, avoid, environment)
            processes.append(client)
            client.wait(FLIGHT_MAX_S)
            used_s = sum(usage.cpu_times()[:2]) - before_s
            stamps_s = np.array(relay.finish()["setpoints"])
        finally:
            relay.kill()
            for process in reversed(processes):
                process.stop(15.0)
    events = [json.loads(line) for line in client.lines]
    end = next(event for event in events if event["event"] == "ended")
    if end["code"] not in ends:
        raise RuntimeError(f"The flight ended otherwise, nothing measured: {end['message']}")
    replans = max(event.get("replans", 0) for event in events if event["event"] == "feedback")
    return _Flown(1e3 * np.diff(stamps_s), replans, used_s / end["elapsed_s"])


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
