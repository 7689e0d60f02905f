"""Fence and rally points of `.plan` files, and of those of Mission Planner and MAVProxy."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from navigation_bridge.goals.requests import AltitudeReference
from navigation_bridge.plan_files.items import PlanError
from navigation_bridge.storage.geographic import GeoArea, GeoFence, RallyPoint
from navigation_bridge.storage.point_files import FenceFile, RallyFile, read_fence, read_rally

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
    assert read_fence(path) == FenceFile(GeoFence(areas, (47.002, 8.002)))
    assert read_rally(path) == RallyFile((RallyPoint((47.003, 8.003), 25.0),))


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
        read_fence(plan(tmp_path, geoFence=fence))
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
        read_rally(plan(tmp_path, rallyPoints=rally))
    assert part in str(caught.value)


def test_a_file_that_is_no_plan(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match="No such file"):
        read_fence(tmp_path / "none.plan")
    path = tmp_path / "my.plan"
    path.write_text("[1, 2]")
    with pytest.raises(PlanError, match="not a QGroundControl plan"):
        read_rally(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(PlanError, match="not a text file"):
        read_rally(path)


# --- text files of ground stations ----------------------------------------------------------


def text_file(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def lines(*places: tuple[float, float]) -> str:
    return "".join(f"{latitude:f}\t{longitude:f}\n" for latitude, longitude in places)


RETURN = (47.002, 8.002)
SQUARE = ((47.0, 8.0), (47.0, 8.01), (47.01, 8.01), (47.01, 8.0))


@pytest.mark.parametrize(
    ("name", "text", "return_point"),
    [
        ("my.fen", "#saved by a planner\n" + lines(RETURN, *SQUARE, SQUARE[0]), RETURN),
        ("my.fen", lines(SQUARE[0], *SQUARE, SQUARE[0]), SQUARE[0]),
        ("fence.txt", lines(RETURN, *SQUARE, SQUARE[0]).replace("\t", " "), RETURN),
        ("my.poly", "#saved by a planner\r\n" + lines(*SQUARE, SQUARE[0]), None),
        ("my.poly", lines(*SQUARE), None),
        ("area.txt", lines(*SQUARE, SQUARE[0]), None),
    ],
)
def test_a_fence_of_lines_has_its_return_point_first_and_is_closed(
    tmp_path: Path, name: str, text: str, return_point: tuple[float, float] | None
) -> None:
    file = read_fence(text_file(tmp_path, name, text))
    assert file.fence == GeoFence((GeoArea(SQUARE),), return_point)
    assert bool(file.notes) == name.endswith(".poly")


def row(number: int, command: int, first: float, place: tuple[float, ...], frame: int = 0) -> str:
    altitude = place[2] if len(place) == 3 else 0
    return f"{number} 0 {frame} {command} {first:g} 0 0 0 {place[0]} {place[1]} {altitude} 0"


def wpl(*rows: str) -> str:
    return "\n".join(["QGC WPL 110", *("\t".join(line.split()) for line in rows)]) + "\n"


HOME = "0 1 0 16 0 0 0 0 47.0 8.0 400 1"
TRIANGLE = SQUARE[:3]


@pytest.mark.parametrize("home", [(), (HOME,), (HOME.replace("0 16 0", "3 16 0"),)])
def test_a_fence_of_a_waypoint_file(tmp_path: Path, home: tuple[str, ...]) -> None:
    items = [
        (5000, 0.0, RETURN),
        *((5001, 4.0, place) for place in SQUARE),
        *((5002, 3.0, place) for place in TRIANGLE),
        (5003, 30.0, RETURN),
        (5004, 12.5, RETURN),
    ]
    rows = [row(number, *item) for number, item in enumerate(items, start=len(home))]
    file = read_fence(text_file(tmp_path, "fence.waypoints", wpl(*home, *rows)))
    areas = (
        GeoArea(SQUARE),
        GeoArea(TRIANGLE, None, inclusion=False),
        GeoArea((RETURN,), 30.0),
        GeoArea((RETURN,), 12.5, inclusion=False),
    )
    assert file == FenceFile(GeoFence(areas, RETURN))


@pytest.mark.parametrize("home", [(), (HOME,)])
def test_rally_points_of_a_waypoint_file(tmp_path: Path, home: tuple[str, ...]) -> None:
    rows = [row(5, 5100, 0.0, (47.1, 8.1, 30.0), 3), row(6, 5100, 0.0, (47.2, 8.2, 500.0), 0)]
    file = read_rally(text_file(tmp_path, "rally.txt", wpl(*home, *rows)))
    assert file.points == (
        RallyPoint((47.1, 8.1), 30.0),
        RallyPoint((47.2, 8.2), 500.0, AltitudeReference.AMSL),
    )


def test_rally_points_of_lines(tmp_path: Path) -> None:
    text = "#saved\nRALLY 47.1\t8.1\t30.0\t40.0\t0.0\t0\nRALLY\t47.2\t8.2\t25\t0\t0\t0\n"
    file = read_rally(text_file(tmp_path, "my.ral", text))
    assert file.points == (RallyPoint((47.1, 8.1), 30.0), RallyPoint((47.2, 8.2), 25.0))
    note = "Break altitudes and landing directions of 1 rally points are left out."
    assert file.notes == (note,)


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("a.fen", "", "it contains no fence"),
        ("a.fen", lines(*SQUARE, SQUARE[0]), "its polygon is not closed"),
        ("a.txt", lines(RETURN, *SQUARE), "its polygon is not closed"),
        ("a.fen", lines(RETURN, *SQUARE[:2], SQUARE[0]), "its polygon is not closed"),
        ("a.fen", "47.1 8.1 3\n", "line 1: 3 columns; a latitude and a longitude"),
        ("a.fen", "47,1 8,1\n", "line 1: the latitude, '47,1', is not a number; write a decimal"),
        ("a.fen", "<kml>\n", "line 1: 1 columns; a latitude and a longitude"),
        ("a.fen", lines((95.0, 8.0), *SQUARE, SQUARE[0]), "Return point: latitude 95"),
        ("a.poly", lines(SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]), "Area 1: its edges from"),
        ("a.fen", "RALLY 47 8 30 0 0 0\n", "line 1: 7 columns"),
        ("a.txt", wpl(HOME), "it contains no fence items"),
        ("a.txt", wpl(HOME, row(1, 16, 0, SQUARE[0])), "line 3: NAV_WAYPOINT is not part of a fen"),
        ("a.txt", wpl(row(0, 5100, 0, SQUARE[0])), "is not part of a fence list; the command ra"),
        ("a.txt", wpl(*(row(i, 5001, 4, SQUARE[i]) for i in range(3))), "line 2: the polygon has"),
        ("a.txt", wpl(row(0, 5001, 3, SQUARE[0]), row(1, 5001, 3, SQUARE[1]),
                      row(2, 5001, 4, SQUARE[2])), "line 4: it is not a corner of the polygon of"),
        ("a.txt", wpl(row(0, 5001, 2.5, SQUARE[0])), "line 2: the polygon has 2.5 corners"),
        ("a.txt", wpl(row(0, 5001, math.nan, SQUARE[0])), "line 2: the polygon has nan corners"),
        ("a.txt", wpl(row(0, 5003, -1, SQUARE[0])), "Area 1: radius -1 m"),
        ("a.txt", wpl(row(0, 5003, math.nan, SQUARE[0])), "Area 1: radius nan m"),
        ("a.txt", wpl(row(0, 5003, 9, SQUARE[0], 1)), "line 2: MAV_FRAME 1 is not supported"),
        ("a.txt", wpl(row(0, 5003, 9, (math.nan, 8.0))), "line 2: it has no position"),
        ("a.txt", wpl(*(row(i, 5000, 0, SQUARE[i]) for i in range(2))), "line 3: a second return"),
        ("a.txt", wpl(row(0, 5000, 0, SQUARE[0])), "A return point alone is not a fence"),
    ],
)  # fmt: skip
def test_a_fence_file_that_is_rejected(tmp_path: Path, name: str, text: str, sentence: str) -> None:
    path = text_file(tmp_path, name, text)
    with pytest.raises(PlanError, match=r"^[^\n]*$") as caught:
        read_fence(path)
    assert str(path) in str(caught.value)
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "it contains no rally points"),
        ("47.1 8.1\n", "line 1: it is not RALLY with six numbers"),
        ("RALLY 47.1 8.1 30 0 0\n", "line 1: it is not RALLY with six numbers"),
        ("RALLY 47.1 8.1 x 0 0 0\n", "line 1: number 3, 'x', is not a number"),
        ("RALLY 47.1 8.1 nan 0 0 0\n", "Rally point 1: altitude nan m"),
        ("RALLY 47.1 8.1 30 0 0 2\n", "line 1: the flags of a rally point, 2, cannot be sent"),
        (wpl(HOME, row(1, 5001, 3, SQUARE[0])), "is not part of a rally list; the command fence"),
    ],
)
def test_a_rally_file_that_is_rejected(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(PlanError, match=r"^[^\n]*$") as caught:
        read_rally(text_file(tmp_path, "a.ral", text))
    assert sentence in str(caught.value)
