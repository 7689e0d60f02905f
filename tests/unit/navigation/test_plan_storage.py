"""Fence and rally points of `.plan` files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from navigation_bridge.goals.plan_files import PlanError
from navigation_bridge.storage.geographic import GeoArea, GeoFence, RallyPoint
from navigation_bridge.storage.plan_storage import read_plan_fence, read_plan_rally

CORNERS = [[47.0, 8.0], [47.0, 8.01], [47.01, 8.0]]
POLYGON = {"inclusion": True, "polygon": CORNERS, "version": 1}
CIRCLE = {"circle": {"center": [47.001, 8.001], "radius": 12.5}, "inclusion": False, "version": 1}


def plan(folder: Path, **parts: Any) -> Path:
    path = folder / "my.plan"
    document = {"fileType": "Plan", "version": 1, "mission": {"items": []}, **parts}
    path.write_text(json.dumps(document))
    return path


def test_both_are_read(tmp_path: Path) -> None:
    path = plan(
        tmp_path,
        geoFence={
            "breachReturn": [47.002, 8.002, 50],
            "circles": [CIRCLE],
            "polygons": [POLYGON],
            "version": 2,
        },
        rallyPoints={"points": [[47.003, 8.003, 25]], "version": 2},
    )
    corners = tuple((a, b) for a, b in CORNERS)
    areas = (GeoArea(corners), GeoArea(((47.001, 8.001),), 12.5, False))
    assert read_plan_fence(path) == GeoFence(areas, (47.002, 8.002))
    assert read_plan_rally(path) == (RallyPoint((47.003, 8.003), 25.0),)


@pytest.mark.parametrize(
    ("fence", "part"),
    [
        ({"polygons": [], "circles": []}, "The plan has no fence."),
        ({"version": 1, "polygons": [POLYGON]}, "version 1, not 2"),
        ([], "geoFence is not an object"),
        ({"polygons": {}}, "polygons is not a list"),
        ({"polygons": [3]}, "a polygon has no corners"),
        ({"polygons": [{**POLYGON, "inclusion": None}]}, "whether it is an inclusion"),
        ({"polygons": [{**POLYGON, "polygon": CORNERS[:2]}]}, "at least 3 corners"),
        ({"polygons": [{**POLYGON, "polygon": [[1, 2, 3], *CORNERS]}]}, "not a latitude"),
        ({"polygons": [{**POLYGON, "polygon": [["a", 2], *CORNERS]}]}, "not a latitude"),
        ({"polygons": [{**POLYGON, "polygon": [[True, 2], *CORNERS]}]}, "not a latitude"),
        ({"circles": [{**CIRCLE, "circle": {"center": [1, 2], "radius": "x"}}]}, "the radius 'x'"),
        ({"circles": [{**CIRCLE, "circle": {"center": [1, 2], "radius": -3}}]}, "radius -3 m"),
        ({"circles": [{**CIRCLE, "circle": {"radius": 3}}]}, "not a latitude"),
        ({"circles": [CIRCLE], "breachReturn": [91, 0, 0]}, "latitude 91"),
    ],
)
def test_a_fence_that_is_not_sent(tmp_path: Path, fence: Any, part: str) -> None:
    with pytest.raises(PlanError, match=r"my\.plan: ") as caught:
        read_plan_fence(plan(tmp_path, geoFence=fence))
    assert part in str(caught.value)


@pytest.mark.parametrize(
    ("rally", "part"),
    [
        ({"points": []}, "The plan has no rally points."),
        ({"points": [[47.0, 8.0]]}, "no altitude"),
        ({"points": [[47.0, 8.0, 1e6]]}, "altitude 1e+06 m"),
        ({"points": "x"}, "points is not a list"),
        ({"points": [None]}, "not a latitude"),
    ],
)
def test_rally_points_that_are_not_sent(tmp_path: Path, rally: Any, part: str) -> None:
    with pytest.raises(PlanError) as caught:
        read_plan_rally(plan(tmp_path, rallyPoints=rally))
    assert part in str(caught.value)


def test_a_file_that_is_no_plan(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match="No such file"):
        read_plan_fence(tmp_path / "none.plan")
    path = tmp_path / "my.plan"
    path.write_text("[1, 2]")
    with pytest.raises(PlanError, match="not a QGroundControl plan"):
        read_plan_rally(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(PlanError, match="not a text file"):
        read_plan_rally(path)
