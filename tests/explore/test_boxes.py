"""Missions among boxes: files of a competition, and layouts by its rules."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.explore import boxes

_HOME = (47.3977, 8.5456, 488.0)
_NORTH_DEG, _EAST_DEG = 10.0 / 111_200.0, 50.0 / 75_460.0


def written(folder: Path, **changes: Any) -> Path:
    """Write a test file in a folder, with its plan beside the folder; return it."""

    def item(number: int, command: int, north: float, east: float, height_m: float) -> Any:
        place = [_HOME[0] + north, _HOME[1] + east, height_m]
        return {
            "type": "SimpleItem", "command": command, "frame": 3, "autoContinue": True,
            "doJumpId": number, "params": [0, 0, 0, None, *place],
        }  # fmt: skip

    items = [item(1, 22, 0.0, 0.0, 12.0), item(2, 16, _NORTH_DEG, 0.0, 11.0),
             item(3, 21, _NORTH_DEG, _EAST_DEG, 0.0)]  # fmt: skip
    plan = {
        "fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "rallyPoints": {"points": [], "version": 2},
        "mission": {
            "version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5,
            "plannedHomePosition": _HOME, "items": items,
        },
    }  # fmt: skip
    (folder / "mission.plan").write_text(json.dumps(plan))
    box = {"size": {"l": 12, "w": 3, "h": 20}, "position": {"x": 1, "y": 20, "z": 0, "r": 90}}
    test = {"drone": {"mission_file": "somewhere/mission.plan"}, "simulation": {"obstacles": [box]}}
    path = folder / "tests" / "first.yaml"
    path.parent.mkdir()
    path.write_text(yaml.safe_dump(test | changes))
    return path


def test_a_file_is_read_with_its_plan(tmp_path: Path) -> None:
    layout = boxes.read_layout(written(tmp_path), 5.0, 15.0)
    (north_1, east_1, down_1), (north_2, east_2, down_2) = layout.way_ned_m
    assert (north_1, east_1, down_1) == pytest.approx((10.0, 0.0, -11.0), abs=0.1)
    # The landing is flown to at the height of the take-off.
    assert (north_2, east_2, down_2) == pytest.approx((10.0, 50.0, -12.0), abs=0.2)
    (box,) = layout.obstacles
    assert (box.at_m, box.size_m, box.top_m) == ((1.0, 20.0), (12.0, 3.0), 20.0)
    assert box.yaw_rad == pytest.approx(math.pi / 2.0)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"drone": {}}, "not a test with a mission_file"),
        ({"drone": {"mission_file": "none.plan"}}, "there is no none.plan beside it or above"),
        ({"simulation": {"obstacles": [{"size": {"l": 1}}]}}, "KeyError"),
    ],
)
def test_a_file_that_cannot_be_flown_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changes: dict[str, Any], said: str
) -> None:
    assert boxes.main([str(written(tmp_path, **changes))]) == 2
    assert said in capsys.readouterr().err
    assert boxes.main([str(tmp_path / "absent.yaml")]) == 2


@pytest.mark.parametrize("home", [[1.0, 2.0], [1.0, 2.0, "high"], None])
def test_a_plan_without_a_home_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], home: object
) -> None:
    test = written(tmp_path)
    plan = json.loads((tmp_path / "mission.plan").read_text())
    plan["mission"]["plannedHomePosition"] = home
    (tmp_path / "mission.plan").write_text(json.dumps(plan))
    assert boxes.main([str(test)]) == 2
    assert "no plannedHomePosition of three numbers" in capsys.readouterr().err


def test_layouts_keep_the_rules() -> None:
    for seed in range(40):
        layout = boxes.drawn(seed)
        assert layout == boxes.drawn(seed)
        standing = [box for box in layout.obstacles if box.path is None]
        assert 2 <= len(standing) <= 4
        assert (len(standing) < len(layout.obstacles)) is (seed % 3 == 2)
        outlines = [boxes._outline(box) for box in standing]
        assert not any(a.intersects(b) for a, b in itertools.combinations(outlines, 2))
        assert all(box.top_m > boxes.HEIGHT_M for box in standing)


@pytest.mark.night
@pytest.mark.parametrize("seed", [0, 1, 3])
def test_a_layout_is_flown_without_coming_too_near(seed: int) -> None:
    flown = boxes.fly(boxes.drawn(seed), boxes.FIRMWARES[seed % 2], seed)
    assert flown.verdict == "SUCCESS"
    assert flown.nearest_m >= boxes.SAFE_M


@pytest.mark.wide
def test_a_brake_does_not_end_in_the_way_of_what_is_not_yet_seen_to_move() -> None:
    # It was hit: the soft brake for the box behind ended where the mover then came to.
    layout = replace(boxes.drawn(41), speed_m_s=8.0, reach_m=15.0)
    flown = boxes.fly(layout, "px4", 41)
    assert flown.verdict == "SUCCESS"
    assert flown.nearest_m >= boxes.SAFE_M
