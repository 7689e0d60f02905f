"""Flights of several vehicles compared, each in its own map."""

from __future__ import annotations

from typing import Any

import pytest

from drone_navigation.console.rehearsing.joint_rehearsal import JointRehearsal, RehearsedVehicle
from navigation_core.tasks.traffic.volumes import Separation

SEPARATION = Separation(horizontal_m=5.0, vertical_m=3.0, parked_m=2.0)
EAST_M = 30.0
LATITUDE_DEG, LONGITUDE_DEG = -35.3632621, 149.1652374
# One degree of longitude there is 90.8 km long.
STEP_DEG = EAST_M / 90_780.0


def vehicle(number: int, **changes: Any) -> RehearsedVehicle:
    """Return a copter that is parked at its home, 30 m east of the one before."""
    home = {
        "latitude": LATITUDE_DEG, "longitude": LONGITUDE_DEG + number * STEP_DEG, "altitude": 584.0,
        "at": [0.0, 0.0, 0.0],
    }  # fmt: skip
    values: dict[str, Any] = {
        "home": home,
        "position_enu_m": [0.0, 0.0, 0.0],
        "parked": True,
        "flies": False,
    }
    return RehearsedVehicle(autopilot="ArduCopter", **(values | changes))


def flown(*points: tuple[float, float, float], seconds: float = 10.0) -> dict[str, Any]:
    times_s = [number * seconds for number in range(len(points))]
    rehearsal = {"accepted": True, "path_enu_m": [list(p) for p in points], "times_s": times_s}
    return {"rehearsal": rehearsal, "lacks": ()}


def joint(
    ordered: tuple[str, ...], is_separated: bool | None = True, **vehicles: RehearsedVehicle
) -> JointRehearsal:
    named = {f"/{name}": each for name, each in vehicles.items()}
    return JointRehearsal(ordered, named, SEPARATION, is_separated)


def test_flights_that_meet_on_the_earth_are_found_although_each_has_its_own_map() -> None:
    made = joint(("/a", "/b"), a=vehicle(0), b=vehicle(1))
    assert not made.take("/a", flown((0.0, 0.0, 0.0), (0.0, 0.0, 5.0), (15.0, 0.0, 5.0)))
    # Results of a lost link are no answers.
    assert not made.take("/a", {"lost": {}})
    assert made.take("/b", flown((0.0, 0.0, 0.0), (0.0, 0.0, 5.0), (-13.0, 0.0, 5.0)))
    result = made.result()
    (meeting,) = result["meetings"]
    assert meeting["vehicles"] == ("/a", "/b")
    assert meeting["is_too_near"]
    assert meeting["distance_m"] == pytest.approx(2.0, abs=0.3)
    # Each position is in its own vehicle's map.
    assert meeting["positions_m"][0] == pytest.approx((15.0, 0.0, 5.0), abs=0.2)
    assert meeting["positions_m"][1] == pytest.approx((-13.0, 0.0, 5.0), abs=0.2)
    assert result["lacks"] == []


def test_one_without_a_route_stays_where_it_is() -> None:
    made = joint(("/a",), a=vehicle(0), b=vehicle(1, parked=False, position_enu_m=[0.0, 0.0, 5.0]))
    assert made.take("/a", flown((0.0, 0.0, 5.0), (30.0, 0.0, 5.0)))
    (meeting,) = made.result()["meetings"]
    assert meeting["is_too_near"]
    assert meeting["distance_m"] == pytest.approx(0.0, abs=0.3)


def test_one_that_is_rejected_stays_and_two_without_routes_are_not_compared() -> None:
    made = joint(("/a",), a=vehicle(0), b=vehicle(1), c=vehicle(2))
    assert made.take("/a", {"rehearsal": {"accepted": False, "code": "BUSY"}, "lacks": ()})
    pairs = [meeting["vehicles"] for meeting in made.result()["meetings"]]
    assert pairs == [("/a", "/b"), ("/a", "/c")]


def test_what_is_not_known_is_not_considered_and_named() -> None:
    made = joint(
        ("/a", "/b"), None, a=vehicle(0), b=vehicle(1), c=vehicle(2, flies=True),
        d=vehicle(3, position_enu_m=None), e=vehicle(4, home=None),
    )  # fmt: skip
    assert not made.take("/b", {"error": "It took longer than 10 s."})
    assert made.take("/a", flown((0.0, 0.0, 0.0), (0.0, 0.0, 5.0)))
    result = made.result()
    assert result["meetings"] == []
    assert result["vehicles"]["/b"] == {"error": "It took longer than 10 s."}
    assert result["lacks"] == [
        "the server's separation, which it has not reported",
        "b, whose flight is unknown",
        "c, which flies another goal",
        "d, whose flight is unknown",
        "e, whose home is unknown",
    ]
