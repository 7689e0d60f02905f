"""Obstacles of the server's topic as costs, and paths as Nav2's messages."""

from __future__ import annotations

import itertools
import math

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from drone_navigation.nav2.maps import FREE, INSCRIBED, LETHAL, costs, obstacles_of, path
from drone_navigation.server.publishing.obstacle_markers import obstacle_markers
from navigation_core.mapping.obstacle_shapes import Box, Cylinder
from navigation_core.mapping.obstacles import Obstacles

KNOWN = Obstacles.of(
    (
        Cylinder("mast", (6.0, 2.0), 0.5, top_m=12.0),
        Box("shed", (-4.0, -3.0), (4.0, 2.0), yaw_enu_rad=0.4, top_m=3.0),
    )
)
SENSED = Obstacles(np.array([[3.0, 8.0, 0.25, 2.0, 6.0], [3.5, 8.0, 0.25, 2.0, 6.0]]))
RADII_M = (0.5, 2.0)


def shown() -> Obstacles:
    return obstacles_of(obstacle_markers(KNOWN, SENSED, 0.0, 20.0, Marker().header.stamp))


def test_markers_show_the_obstacles_that_they_were_made_of() -> None:
    found = shown()
    points = np.random.default_rng(1).uniform((-10.0, -10.0, 0.0), (10.0, 10.0, 5.0), (500, 3))
    true_m = KNOWN.joined(SENSED).clearance_m(points)
    assert np.abs(found.clearance_m(points) - true_m).max() < 0.05
    assert len(obstacles_of(None)) == 0


def test_costs_fall_from_an_obstacle_outwards_and_count_at_the_vehicle_s_height() -> None:
    found = costs(shown(), (0.3, -0.2, 4.0), (40.0, 0.5), RADII_M)
    assert found.values.shape == (80, 80)

    def cost(east_m: float, north_m: float) -> int:
        column = int((east_m - found.corner_m[0]) / found.cell_m)
        row = int((north_m - found.corner_m[1]) / found.cell_m)
        return int(found.values[row, column])

    assert cost(6.0, 2.0) == LETHAL
    assert cost(6.9, 2.1) == INSCRIBED
    outwards = [cost(6.2 + step, 2.2) for step in np.arange(0.0, 4.0, 0.5)]
    assert all(a >= b for a, b in itertools.pairwise(outwards))
    assert outwards[-1] == FREE
    assert cost(3.2, 8.0) == LETHAL
    assert cost(-4.0, -3.0) == FREE  # the shed ends below
    assert cost(12.0, -12.0) == FREE


def test_without_obstacles_all_is_free() -> None:
    found = costs(obstacles_of(None), (1000.0, -2000.0, 4.0), (20.0, 0.25), RADII_M)
    assert found.values.shape == (80, 80)
    assert not found.values.any()


def test_a_path_has_a_pose_each_half_metre_that_faces_along_it() -> None:
    corners = ((0.0, 0.0, 3.0), (4.0, 0.0, 3.0), (4.0, 3.0, 5.0))
    poses = [pose.pose for pose in path(corners, Header(frame_id="map")).poses]
    places = [(p.position.x, p.position.y, p.position.z) for p in poses]
    assert places[0] == corners[0]
    assert places[-1] == corners[-1]
    assert corners[1] in places
    assert len(set(places)) == len(places)
    gaps = [math.dist(a, b) for a, b in itertools.pairwise(places)]
    assert max(gaps) <= 0.5 + 1e-9
    assert poses[0].orientation.w == 1.0
    assert poses[-1].orientation.z == math.sin(math.pi / 4.0)
