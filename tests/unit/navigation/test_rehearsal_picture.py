"""Pictures of rehearsed flights: what is drawn, and where it comes from."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from drone_navigation.agents.rehearsed_scenes import scene_of
from flight_reports.pictures import scene as looks
from flight_reports.planned_flight import PlannedArea, PlannedFlight
from flight_reports.rehearsal_plot import plot_planned
from navigation_core.mapping.obstacles import Cylinder, Obstacles

PATH = tuple((float(east), 0.0, 5.0) for east in range(20))
EMPTY = PlannedFlight("a flight", PATH, (), Obstacles(), (), ())
POST = Obstacles.of((Cylinder("post", (10.0, 4.0), 2.0),))
BOX = PlannedArea(True, ((-2.0, -3.0), (22.0, -3.0), (22.0, 3.0), (-2.0, 3.0)))


def count(flight: PlannedFlight, picture: Path, colour: str) -> int:
    """Return how many points of the picture have a colour, nearly."""
    plot_planned(flight, picture)
    with Image.open(picture) as opened:
        points = np.asarray(opened.convert("RGB"), dtype=int)
    wanted = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)])
    return int((np.abs(points - wanted).max(axis=-1) < 12).sum())


@pytest.mark.parametrize(
    ("change", "colour"),
    [
        ({"obstacles": POST}, looks.OBSTACLE),
        ({"targets_enu_m": ((19.0, 0.0, 5.0),)}, looks.GOAL),
        ({"areas": (BOX,)}, looks.GOAL),
        ({"areas": (PlannedArea(False, ((10.0, 0.0),), 3.0),)}, looks.GOAL),
        ({"heights_m": (3.0,)}, looks.GOAL),
    ],
)
def test_the_picture_shows(change: dict[str, Any], colour: str, tmp_path: Path) -> None:
    picture = tmp_path / "flight.png"
    before = count(EMPTY, picture, colour)
    assert count(dataclasses.replace(EMPTY, **change), picture, colour) > before + 50


def test_bounds_far_away_do_not_make_the_flight_small(tmp_path: Path) -> None:
    picture = tmp_path / "flight.png"
    near = count(EMPTY, picture, looks.TRACK)
    wide = PlannedArea(True, ((0.0, 0.0),), 1000.0)
    far = dataclasses.replace(EMPTY, areas=(wide,), heights_m=(-50.0, 120.0))
    assert count(far, picture, looks.TRACK) == pytest.approx(near, rel=0.1)


def test_a_scene_has_what_is_in_force_with_heights_above_home() -> None:
    circle = {"inclusion": True, "in_force": True, "radius": 50.0, "points": [[1.0, 2.0]]}
    values: dict[str, Any] = {
        "fence": {"areas": [circle, {**circle, "in_force": False}], "low": None, "high": 30.0},
        "flight_volume": {"areas": [{**circle, "radius": 80.0}], "low": 1.0, "high": None},
        "home": {"at": [0.0, 0.0, 2.0]},
        "obstacles": {
            "posts": [[1.0, 2.0, 3.0, 0.0, 9.0]],
            "seen": [[4.0, 5.0, 0.1, 0.0, 9.0]],
            "boxes": [[1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 9.0]],
        },
    }
    rehearsal = {"path_enu_m": [[0.0, 0.0, 5.0], [9.0, 0.0, 5.0]]}
    scene = scene_of("a flight", rehearsal, [(9.0, 0.0, 5.0)], values.get)
    assert [area.radius_m for area in scene.areas] == [50.0, 80.0]
    assert sorted(scene.heights_m) == [3.0, 32.0]
    assert scene.obstacles.posts[:, 0].tolist() == [1.0, 4.0]
    assert scene.obstacles.boxes.shape == (1, 7)
    unknown = scene_of("a flight", rehearsal, [], dict[str, Any]().get)
    assert not unknown.areas
    assert not len(unknown.obstacles)
