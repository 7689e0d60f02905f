"""Modules that server and client load to start, and that a server loads beside the flight."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from tests.support.processes import HANGS_AFTER_S

ROOT = Path(__file__).resolve().parents[3]

# Each takes a share of the start that only some runs need, or needs it not before a flight.
HEAVY = {"jsonschema", "matplotlib", "mcap", "pandas", "pyarrow", "rich", "serial", "shapely"}
SCIPY = {"scipy.ndimage", "scipy.sparse", "scipy.spatial"}

LOADED = """
import json, sys
{}
print(json.dumps([name for name in sys.modules]))
"""


def loaded_after(statements: str) -> set[str]:
    """Return the modules that a new process has loaded after some statements."""
    command = [sys.executable, "-c", LOADED.format(statements)]
    done = subprocess.run(
        command, cwd=ROOT, check=True, capture_output=True, text=True, timeout=HANGS_AFTER_S
    )
    return set(json.loads(done.stdout))


def test_server_starts_without_what_only_some_runs_need() -> None:
    loaded = loaded_after("import drone_navigation.navigation_server")
    assert "navigation_core.planning.planner" in loaded  # so nothing below it comes later
    assert not loaded & (HEAVY | SCIPY)


def test_client_reads_its_command_line_without_ros_and_sends_a_goal_without_the_codec() -> None:
    loaded = loaded_after("import drone_navigation.navigation_client")
    assert "drone_navigation.client.options" in loaded
    assert not loaded & {*HEAVY, "mavlink_vehicle.codec", "numpy", "rclpy"}
    loaded = loaded_after("import drone_navigation.client.session")
    assert not loaded & {*HEAVY - {"rich"}, *SCIPY, "mavlink_vehicle.codec", "rich.progress"}


def test_a_program_starts_no_thread_of_numpys_for_each_processor() -> None:
    script = """
import sys; sys.argv[0] = "navigation_client"
import os, drone_navigation.navigation_client, numpy
print(len(os.listdir("/proc/self/task")), os.environ["OPENBLAS_NUM_THREADS"])
"""
    variables = {name: value for name, value in os.environ.items() if "BLAS" not in name}
    for more, said in (({}, ["1", "1"]), ({"OPENBLAS_NUM_THREADS": "2"}, "2")):
        done = subprocess.run(
            [sys.executable, "-c", script], env={**variables, **more}, check=True,
            capture_output=True, text=True, timeout=HANGS_AFTER_S,
        )  # fmt: skip
        assert done.stdout.split()[-len(said) :] == list(said)


def test_search_thread_loads_beforehand_all_that_searches_use() -> None:
    warm_up = """
from navigation_bridge.search_thread import SearchThread
import navigation_core.tasks.flying.goto
import tests.support.worlds.random_worlds
searches = SearchThread()
searches.warm_up()
searches.begin(lambda is_wanted: None)
searches._pool.shutdown()
"""
    flown = """
from navigation_core.planning.planner import PlanLimits, plan
from tests.support.worlds.random_worlds import CLEARANCE_M, random_world
for seed in range(6):
    world = random_world(seed, 60, top_m=20.0)
    limits = PlanLimits(CLEARANCE_M, (1.0, 30.0))
    plan(world.start_enu_m, world.goal_enu_m, world.obstacles, limits)
"""
    warmed, used = loaded_after(warm_up), loaded_after(warm_up + flown)
    assert warmed >= SCIPY
    assert used - warmed == set()


def test_a_way_around_a_few_others_needs_no_scipy() -> None:
    planned = """
import numpy as np
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.planning.planner import Path, PlanLimits, plan
others = Obstacles(posts=np.array([[12.0, 1.0, 2.0, 0.0, 30.0], [20.0, -1.0, 2.0, 0.0, 30.0]]))
found = plan((0.0, 0.0, 5.0), (40.0, 0.0, 5.0), others, PlanLimits(3.0, (2.0, 30.0)))
assert isinstance(found, Path) and len(found.points_enu_m) > 2, found
"""
    assert not loaded_after(planned) & SCIPY


def test_tracking_what_moves_needs_no_scipy_which_may_still_be_loading() -> None:
    tracked = """
import numpy as np
from navigation_core.mapping.obstacle_map import ObstacleMap, RayScan
seen, bearings = ObstacleMap(), np.arange(72) * np.pi / 36.0
rays = np.stack([np.cos(bearings), np.sin(bearings), 0.0 * bearings], axis=1)
for k in range(30):
    ranges_m = np.full(72, 30.0)
    ranges_m[:3] = 12.0 - 0.15 * k
    seen.integrate(RayScan((0.0, 0.0, 3.0), rays, ranges_m, 0.2, 40.0, np.pi / 72.0), 0.0, 0.1 * k)
assert seen.moving
"""
    assert not loaded_after(tracked) & SCIPY
