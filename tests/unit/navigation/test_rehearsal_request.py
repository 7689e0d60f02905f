"""Requests for rehearsals are checked and completed."""

from __future__ import annotations

import json
from typing import Any

import pytest

from flight_rehearsal.request import HomePoint, RehearsalWaypoint, RequestError, read_request

STATUS = {
    "autopilot": "ArduCopter",
    "armed": True,
    "landed": "in the air",
    "position_valid": True,
}
MOTION = {"at": [1.0, 2.0, 3.0], "yaw": 0.5, "velocity": [1.0, 0.0, 0.0], "speed": 1.0}
LEAST: dict[str, Any] = {
    "number": 1,
    "status": STATUS,
    "motion": MOTION,
    "waypoints": [[4.0, 5.0, 6.0, 7.0]],
}


def test_what_is_missing_has_a_default() -> None:
    order = read_request(json.dumps(LEAST))
    assert order.waypoints == (RehearsalWaypoint((4.0, 5.0, 6.0), 7.0),)
    assert order.position_enu_m == (1.0, 2.0, 3.0)
    assert order.velocity_enu_m_s == (1.0, 0.0, 0.0)
    assert order.flying
    assert order.armed
    assert order.battery is None
    assert order.consumption_per_s is None
    assert order.home is None
    assert order.wind_enu_m_s == (0.0, 0.0, 0.0)
    assert order.posts == order.boxes == ()


def test_all_that_is_known_counts() -> None:
    given = {
        **LEAST,
        "battery": 45,
        "consumption": 0.002,
        "home": {"latitude": 47.0, "longitude": 8.0, "altitude": 500.0, "at": [0.0, 0.0, -1.0]},
        "obstacles": {
            "posts": [[1, 2, 0.5, 0, 9]],
            "boxes": [[1, 2, 3, 4, 0.1, 0, 9]],
            "seen": [[5, 6, 0.1, 0, 2]],
            "post_names": ["mast"],
        },
        "server": {"arming": "auto"},
        "parameters": {"WPNAV_SPEED": 500.0, "RTL_ALT": None},
        "wind": [3.0, 0.0, 0.0],
        "speed": 2.0,
        "laps": 3,
        "avoid": True,
        "radius": -8.0,
    }
    order = read_request(json.dumps(given))
    assert order.battery == pytest.approx(0.45)
    assert order.consumption_per_s == pytest.approx(0.002)
    assert order.home == HomePoint(47.0, 8.0, 500.0, (0.0, 0.0, -1.0))
    assert order.posts == ((1.0, 2.0, 0.5, 0.0, 9.0),)
    assert order.sensed == ((5.0, 6.0, 0.1, 0.0, 2.0),)
    assert (order.post_names, order.box_names) == (("mast",), ())
    assert order.boxes == ((1.0, 2.0, 3.0, 4.0, 0.1, 0.0, 9.0),)
    assert order.server == {"arming": "auto"}
    assert order.parameters == {"WPNAV_SPEED": 500.0}
    assert order.wind_enu_m_s == (3.0, 0.0, 0.0)
    assert (order.speed_m_s, order.laps, order.avoid_obstacles) == (2.0, 3, True)
    assert order.radius_m == -8.0


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"motion": None}, "position is not known"),
        ({"status": {**STATUS, "position_valid": False}}, "position is not known"),
        ({"status": None}, "position is not known"),
        ({"waypoints": [[1.0]]}, "cannot be read"),
        ({"motion": {**MOTION, "at": None}}, "position is not known"),
        ({"wind": [float("nan"), 0.0, 0.0]}, r"wind\[0\] is nan; it must be a finite number"),
        ({"speed": "fast"}, "cannot be read: speed must be a number, not 'fast'"),
    ],
)
def test_what_cannot_be_flown_is_said(change: dict[str, Any], reason: str) -> None:
    with pytest.raises(RequestError, match=reason):
        read_request(json.dumps({**LEAST, **change}))


@pytest.mark.parametrize("text", ["", "[]", "7", "{", '{"status": 1, "motion": 2}'])
def test_what_is_no_order_is_rejected(text: str) -> None:
    with pytest.raises(RequestError):
        read_request(text)


@pytest.mark.parametrize(
    ("landed", "armed", "flying"),
    [
        ("on the ground", True, False),
        ("in the air", True, True),
        (None, True, True),
        (None, False, False),
    ],
)
def test_who_is_armed_and_not_on_the_ground_flies(
    landed: str | None, armed: bool, flying: bool
) -> None:
    status = {**STATUS, "landed": landed, "armed": armed}
    assert read_request(json.dumps({**LEAST, "status": status})).flying is flying
