"""Known obstacles from YAML: what they mean, and what is said about bad files."""

from __future__ import annotations

import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml

from mavlink_vehicle.state.telemetry import Origin
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.configuration.known_obstacles import (
    FILE,
    KnownObstacles,
    ObstaclesError,
    parse_obstacles,
    read_obstacles,
)
from navigation_bridge.configuration.make_config import ConfigurationError, make_config
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.mapping.obstacles import Box, Cylinder, KnownObstacle, Obstacles

ROOT = Path(__file__).resolve().parents[3]
FILES = sorted((ROOT / "bridge_config/obstacles").glob("*.yaml"))


def placed(text: str) -> tuple[KnownObstacle, ...]:
    return parse_obstacles(text, "file.yaml").placed(lambda _: (math.nan, math.nan, math.nan))


def one(item: str, frame: str = "map") -> KnownObstacle:
    (obstacle,) = placed(f"{{frame: {frame}, obstacles: [{item}]}}")
    return obstacle


def refusal(text: str) -> str:
    with pytest.raises(ObstaclesError) as caught:
        parse_obstacles(text, "file.yaml")
    sentence = str(caught.value)
    assert sentence.startswith("file.yaml")
    assert sentence.endswith((".", "?"))
    assert "\n" not in sentence
    return sentence


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_the_examples_match_the_schema_and_can_be_placed(path: Path) -> None:
    jsonschema.validate(yaml.safe_load(path.read_text("utf-8")), FILE.schema)
    assert len(Obstacles.of(read_obstacles(path).placed(lambda place: place))) >= 3


def test_a_cylinder_stands_east_and_north_of_the_origin() -> None:
    obstacle = one("{kind: cylinder, name: oak, at_m: [12, 3], radius_m: 0.5, height_m: 8}")
    assert obstacle == Cylinder("oak", (12.0, 3.0), 0.5, 0.0, 8.0)


def test_a_box_is_turned_counter_clockwise_from_east() -> None:
    obstacle = one(
        "{kind: box, at_m: [1, 2], size_m: [6, 2], yaw_deg: 90, bottom_m: 3, height_m: 2}"
    )
    assert obstacle == Box("box 1", (1.0, 2.0), (6.0, 2.0), math.pi / 2, 3.0, 5.0)
    clearance = Obstacles.of((obstacle,)).clearance_m(np.array([[1.0, 6.0, 4.0], [5.0, 2.0, 4.0]]))
    assert clearance == pytest.approx([1.0, 3.0])


def test_a_wall_connects_two_points() -> None:
    obstacle = one("{kind: wall, from_m: [0, 10], to_m: [10, 20], height_m: 4, thickness_m: 0.5}")
    assert isinstance(obstacle, Box)
    assert obstacle.size_m == pytest.approx((math.sqrt(200.0), 0.5))
    clearance = Obstacles.of((obstacle,)).clearance_m(
        np.array([[0.0, 10.0, 1.0], [10.0, 20.0, 1.0]])
    )
    assert clearance == pytest.approx([0.0, 0.0])


def test_geodetic_positions_are_placed_in_the_map_by_its_origin() -> None:
    frame = MapFrame()
    frame.update(VehicleState(origin=Origin(0.0, -35.0, 149.0, 584.0)))
    known = parse_obstacles(
        "{frame: wgs84, obstacles: [{kind: cylinder, at_deg: [-35.0001, 149.0002], radius_m: 1, "
        "height_m: 5}]}",
        "file.yaml",
    )
    assert known.needs_origin
    (obstacle,) = known.placed(frame.enu)
    # A ten-thousandth of a degree is 11.1 m of latitude, and less of longitude by its cosine.
    assert obstacle.centre_enu_m[0] == pytest.approx(22.2 * math.cos(math.radians(35.0)), abs=0.1)
    assert obstacle.centre_enu_m[1] == pytest.approx(-11.1, abs=0.1)
    assert (obstacle.bottom_m, obstacle.top_m) == (0.0, 5.0)


def test_no_obstacles_are_fine() -> None:
    assert parse_obstacles("obstacles: []", "file.yaml") == KnownObstacles()


@pytest.mark.parametrize(
    ("item", "words"),
    [
        (
            "{kind: ball, at_m: [0, 0]}",
            "obstacles[0].kind is 'ball'; it must be one of cylinder, box, wall",
        ),
        ("{at_m: [0, 0]}", "obstacles[0].kind is missing; give one of cylinder, box, wall"),
        ("5", "obstacles[0] must be an object, not 5"),
        ("{kind: cylinder, at_m: [0, 0], height_m: 3}", "[0] (cylinder): radius_m is missing"),
        ("{kind: cylinder, radius_m: 1, height_m: 3}", "at_m is missing; a cylinder needs it"),
        ("{kind: wall, from_m: [0, 0], height_m: 3}", "to_m is missing; a wall needs it"),
        (
            "{kind: wall, from_m: [1, 1], to_m: [1, 1], height_m: 3}",
            "start and end are the same point",
        ),
        (
            "{kind: cylinder, at_m: [0, 0], radius_m: -1, height_m: 3}",
            "radius_m is -1; it must be gr",
        ),
        (
            "{kind: cylinder, at_m: [0, 0], radius_m: .nan, height_m: 3}",
            "radius_m is nan; it must be",
        ),
        (
            "{kind: cylinder, at_m: [.nan, 0], radius_m: 1, height_m: 3}",
            "at_m[0] is nan; it must be",
        ),
        (
            "{kind: cylinder, at_m: [0], radius_m: 1, height_m: 3}",
            "at_m must be a list of 2, not [0]",
        ),
        (
            "{kind: cylinder, at_m: [0, 0], radius_m: 1, height_m: 3, colour: red}",
            "colour is unknown",
        ),
        (
            "{kind: cylinder, name: oak, at_m: [0, 0], radus_m: 1, height_m: 3}",
            "obstacles[0] (oak): radus_m is unknown; did you mean 'radius_m'?",
        ),
        ("{kind: cylinder, at_deg: [0, 0], radius_m: 1, height_m: 3}", "at_deg does not fit frame"),
        (
            "{kind: cylinder, at_m: [0, 0], radius_m: yes, height_m: 3}",
            "radius_m must be a number, not True",
        ),
    ],
)
def test_each_error_names_its_position_in_the_file(item: str, words: str) -> None:
    assert words in refusal(f"obstacles: [{item}]")


def test_a_latitude_beyond_the_pole_is_rejected() -> None:
    text = (
        "{frame: wgs84, obstacles: [{kind: wall, from_deg: [91, 0], to_deg: [0, 0], height_m: 1}]}"
    )
    assert "from_deg[0] is 91; it must be between -90 and 90" in refusal(text)


@pytest.mark.parametrize(
    "text", ["", "[]", "5", "obstacles: 3", "{obstacles: [], frames: map}", "{frame: moon}", "a: ["]
)
def test_a_file_that_is_not_an_obstacle_file_is_rejected(text: str) -> None:
    refusal(text)


def test_values_that_are_huge_or_repeat_each_other_give_a_short_sentence() -> None:
    digits = f"{{kind: cylinder, at_m: [0, 0], radius_m: 0x{'f' * 9000}, height_m: 1}}"
    assert "radius_m is a number with too many digits; it" in refusal(f"obstacles: [{digits}]")
    levels = "".join(f"l{i}: &l{i} [{', '.join([f'*l{i - 1}'] * 9)}]\n" for i in range(1, 9))
    assert len(refusal(f"l0: &l0 [x]\n{levels}obstacles: *l8\n")) < 300
    assert len(refusal(f"obstacles: [{{kind: {'x' * 1000}}}]")) < 300


def test_a_duplicate_key_is_rejected_with_its_line() -> None:
    assert "file.yaml:2: duplicate key 'frame'" in refusal("frame: map\nframe: wgs84\n")


def test_a_missing_obstacle_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ObstaclesError, match=r"nowhere\.yaml: No such file or directory\."):
        read_obstacles(tmp_path / "nowhere.yaml")


def test_the_parameter_names_the_file_and_an_invalid_one_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "obstacles.yaml"
    path.write_text("obstacles: [{kind: ball}]", encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"obstacles_file.*kind is 'ball'"):
        make_config({"obstacles_file": str(path)})
    path.write_text("obstacles: []", encoding="utf-8")
    assert make_config({"obstacles_file": str(path)}).bridge.obstacles.known == KnownObstacles()
