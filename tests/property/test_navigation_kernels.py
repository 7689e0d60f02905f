"""The compiled kernels against the same in NumPy, over random obstacles, lines and worlds."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import navigation_kernels
from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_kernels import SearchEnd
from tests.support.processes import HANGS_AFTER_S
from tests.support.worlds import numpy_lines, numpy_paths
from tests.support.worlds.random_worlds import CLEARANCE_M, random_world

ROOT = Path(__file__).resolve().parents[2]
KERNELS = ROOT / "src/navigation_kernels"
SANITIZED = "-fsanitize=address,undefined"

coordinates = st.floats(-20.0, 20.0, allow_nan=False).map(lambda value: round(value, 3))
sizes = st.one_of(st.just(0.0), st.floats(0.0, 8.0).map(lambda value: round(value, 3)))
ends = st.one_of(coordinates, st.sampled_from([-math.inf, math.inf]))
# With its top below its bottom, a larger clearance would find less: no obstacle is so.
heights = st.tuples(ends, ends).map(sorted)
posts = st.tuples(st.tuples(coordinates, coordinates, sizes), heights).map(lambda p: (*p[0], *p[1]))
boxes = st.tuples(
    st.tuples(coordinates, coordinates, sizes, sizes, st.floats(-7.0, 7.0)), heights
).map(lambda b: (*b[0], *b[1]))
lines = st.tuples(*[coordinates] * 6)


def table(rows: list[tuple[float, ...]], columns: int) -> Array:
    return np.array(rows, dtype=np.float64).reshape(-1, columns)


@settings(max_examples=300)
@given(
    st.lists(posts, max_size=8),
    st.lists(boxes, max_size=5),
    st.lists(lines, max_size=8),
    st.floats(0.1, 6.0).map(lambda value: round(value, 2)),
)
def test_lines_meet_the_obstacles_that_they_meet_in_numpy(
    some_posts: list[tuple[float, ...]],
    some_boxes: list[tuple[float, ...]],
    some_lines: list[tuple[float, ...]],
    clearance_m: float,
) -> None:
    obstacles = Obstacles(table(some_posts, 5), table(some_boxes, 7))
    starts, stops = np.split(table(some_lines, 6), 2, axis=1)
    found = obstacles.hits(starts, stops, clearance_m)
    # Where both calculations round otherwise, a line may meet an obstacle by one of them only.
    surely, perhaps = (
        set(zip(*numpy_lines.hits(obstacles, starts, stops, clearance_m + more), strict=True))
        for more in (-1e-9, 1e-9)
    )
    assert surely <= set(zip(*found, strict=True)) <= perhaps
    clear = obstacles.are_clear(starts, stops, clearance_m)
    assert set(np.flatnonzero(~clear)) == set(found[0])


def test_more_hits_than_expected_are_all_returned() -> None:
    obstacles = Obstacles(np.tile([0.0, 0.0, 1.0, -np.inf, np.inf], (40, 1)))
    starts = np.tile([-5.0, 0.0, 0.0], (50, 1))
    rows, met = obstacles.hits(starts, -starts, 1.0)
    np.testing.assert_array_equal(rows, np.repeat(np.arange(50), 40))
    np.testing.assert_array_equal(met, np.tile(np.arange(40), 50))


@pytest.mark.parametrize("column", range(6))
def test_a_line_with_a_coordinate_that_is_not_a_number_is_not_clear(column: int) -> None:
    post = [[9.0, 9.0, 1.0, -np.inf, 8.0]]
    obstacles = Obstacles(np.array(post), np.array([[9.0, 9.0, 1.0, 2.0, 0.3, -np.inf, 8.0]]))
    line = np.array([[0.0, 9.0, 500.0, 20.0, 9.0, 500.0]])
    assert obstacles.are_clear(line[:, :3], line[:, 3:], 1.0).all()
    line[0, column] = np.nan
    assert not obstacles.are_clear(line[:, :3], line[:, 3:], 1.0).any()
    assert len(obstacles.hits(line[:, :3], line[:, 3:], 1.0)[0]) == len(obstacles)


def with_boxes(obstacles: Obstacles, seed: int) -> Obstacles:
    """Make every third post a wall or a house of about its size."""
    rng = np.random.default_rng(seed)
    thirds = np.arange(len(obstacles.posts)) % 3 == 0
    chosen = obstacles.posts[thirds]
    made = np.zeros((len(chosen), 7))
    made[:, :2], made[:, 5:] = chosen[:, :2], chosen[:, 3:]
    made[:, 2] = 0.7 * chosen[:, 2]
    made[:, 3] = 0.7 * chosen[:, 2] * rng.integers(0, 2, len(chosen))
    made[:, 4] = rng.uniform(-3.0, 3.0, len(chosen))
    return Obstacles(obstacles.posts[~thirds], made)


def length_m(path: Array) -> float:
    return float(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())


@pytest.mark.wide_but_first
@pytest.mark.parametrize("first", range(0, 60, 3))
@pytest.mark.parametrize("walls", [True, False])
def test_the_shortest_path_is_as_long_as_in_numpy(first: int, walls: bool) -> None:
    compared = 0
    for seed in range(first, first + 3):
        world = random_world(seed, 60)
        obstacles = with_boxes(world.obstacles, seed) if walls else world.obstacles
        start, goal = np.array(world.start_enu_m), np.array(world.goal_enu_m)
        try:
            expected = numpy_paths.tangent_path(start, goal, obstacles, CLEARANCE_M)
        except numpy_paths.TooManyObstaclesError:
            continue
        given_ = obstacles.posts, obstacles.boxes, start[:2], goal[:2], CLEARANCE_M
        answer, points, _ = navigation_kernels.tangent_path(*given_)
        assert (answer is SearchEnd.FOUND) == (expected is not None)
        compared += 1
        if expected is None:
            continue
        assert length_m(points) == pytest.approx(length_m(expected), abs=1e-6)
        space = np.column_stack([points, np.full(len(points), start[2])])
        assert numpy_lines.are_clear(obstacles, space[:-1], space[1:], CLEARANCE_M).all()
        # One that is not shorter is not wanted.
        longest_m = length_m(points) - 1e-6
        none = navigation_kernels.tangent_path(*given_, longest_m)
        assert none[0] is SearchEnd.NONE
        assert not len(none[1])
    assert compared


@pytest.mark.parametrize("looks_max", [0, 1_000, 100_000])
def test_the_work_of_a_search_is_bounded(looks_max: int) -> None:
    """One step of a search looks at each pair of its corners and obstacles at most once."""
    world = random_world(1, 1000)
    obstacles = world.obstacles
    start, goal = np.array(world.start_enu_m[:2]), np.array(world.goal_enu_m[:2])
    answer, points, looks = navigation_kernels.tangent_path(
        obstacles.posts, obstacles.boxes, start, goal, CLEARANCE_M, math.inf, looks_max
    )
    assert answer is SearchEnd.TOO_MUCH_WORK
    assert not len(points)
    assert looks_max <= looks <= looks_max + 16 * len(obstacles)


def test_a_table_of_another_shape_is_one_sentence() -> None:
    lines_ = np.zeros((2, 3))
    with pytest.raises(
        ValueError, match=r"rows of 5 numbers are needed, and the shape is \(2, 3\)"
    ):
        navigation_kernels.are_clear(lines_, np.empty((0, 7)), lines_, lines_, 1.0)
    with pytest.raises(ValueError, match="there are 2 starts and 1 ends of lines"):
        navigation_kernels.hits(np.empty((0, 5)), np.empty((0, 7)), lines_, lines_[:1], 1.0)


@pytest.mark.night
@pytest.mark.wide
def test_no_memory_is_misused_and_nothing_is_undefined(tmp_path: Path) -> None:
    """The tests above, with a library that ends the process at the first misuse."""
    package = tmp_path / "navigation_kernels"
    package.mkdir()
    (package / "__init__.py").symlink_to(KERNELS / "navigation_kernels/__init__.py")
    flags = ["-std=c++17", "-O1", "-g", "-fPIC", "-shared", SANITIZED, "-fno-sanitize-recover=all"]
    sources = sorted(map(str, KERNELS.glob("kernels/*.cpp")))
    library = str(package / "libnavigation_kernels.so")
    subprocess.run(["c++", *flags, *sources, "-o", library], check=True, timeout=HANGS_AFTER_S)
    found = ["c++", "-print-file-name=libasan.so"]
    asan = subprocess.run(found, capture_output=True, text=True, check=True, timeout=HANGS_AFTER_S)
    environment = {
        **os.environ,
        "PYTHONPATH": f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}",
        "LD_PRELOAD": asan.stdout.strip(),
        # The interpreter itself frees little at its end.
        "ASAN_OPTIONS": "detect_leaks=0",
    }
    again = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__]
    again += ["-k", "not misused", "-m", "not wide"]
    done = subprocess.run(
        again,
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=HANGS_AFTER_S,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert " passed" in done.stdout
