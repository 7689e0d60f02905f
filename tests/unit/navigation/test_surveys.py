"""Requests of surveys: their numbers, frames, cameras, and what is rejected."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from mavlink_vehicle.positions.frames import equidistant_at
from navigation_bridge.goals.requests import ActKind, AltitudeReference
from navigation_bridge.goals.surveys import Camera, SurveyRequest, SurveyRoute, compute_survey
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.surveys.terrain import TerrainGrid

FIELD = SurveyRequest(
    ((0.0, 0.0), (60.0, 0.0), (60.0, 40.0), (0.0, 40.0)), height_m=20.0, spacing_m=8.0
)
CAMERA = Camera(0.0132, 0.0088, 0.0088, 0.7, 0.8)


def hill(height_m: float) -> TerrainGrid:
    """Return a hill in the middle of the field, 10 m apart from (-10, -10) to (70, 50)."""
    east, north = np.meshgrid(np.linspace(-40.0, 40.0, 9), np.linspace(-30.0, 30.0, 7))
    heights_m = height_m * np.exp(-(east**2 + north**2) / 20.0**2)
    return TerrainGrid((-10.0, -10.0), 10.0, 9, heights_m.ravel())


def route_of(request: SurveyRequest) -> SurveyRoute:
    route = compute_survey(request)
    assert isinstance(route, SurveyRoute), route
    return route


def test_a_field_is_surveyed_by_lines_of_one_height() -> None:
    route = route_of(FIELD)
    assert len(route.waypoints) == 10
    assert {waypoint.position[2] for waypoint in route.waypoints} == {20.0}
    assert route.length_m == pytest.approx(5 * 60.0 + 4 * 8.0)
    assert (route.area_m2, route.photos) == (pytest.approx(2400.0), 0)
    # At 5 m/s, with 2.5 s of each leg's two ramps.
    assert route.duration_s == pytest.approx(5 * (60.0 / 5.0 + 2.5) + 4 * 2.0 * 2.0)
    assert not any(waypoint.acts for waypoint in route.waypoints)


def test_a_camera_sets_the_spacing_and_is_triggered_along_the_lines_only() -> None:
    route = route_of(replace(FIELD, spacing_m=0.0, camera=CAMERA, angle_enu_rad=0.0))
    # 30 m are seen across and 20 m along; the lines are spread evenly.
    assert route.spacing_m == pytest.approx(40.0 / 5.0)
    acts = [waypoint.acts for waypoint in route.waypoints]
    assert [act.kind for each in acts for act in each] == [ActKind.TRIGGER_DISTANCE] * 10
    assert [act.distance_m for each in acts for act in each] == pytest.approx([4.0, 0.0] * 5)
    assert route.photos == 5 * 16


@pytest.mark.parametrize("latitude_deg", [0.0, 47.4, -68.0])
def test_geodetic_corners_give_geodetic_waypoints(latitude_deg: float) -> None:
    projection, origin = equidistant_at(latitude_deg), (latitude_deg, 179.9999, 0.0)
    boundary = tuple(
        projection.to_geodetic(north_m, east_m, origin) for east_m, north_m in FIELD.boundary
    )
    route = route_of(replace(FIELD, boundary=boundary, altitude_reference=AltitudeReference.HOME))
    assert route.length_m == pytest.approx(332.0, abs=0.01)
    first = route.waypoints[0]
    assert first.altitude_reference is AltitudeReference.HOME
    north_m, east_m = projection.to_local(first.position[0], first.position[1], origin)
    assert (east_m, north_m) == pytest.approx((0.0, 4.0), abs=0.01)


@pytest.mark.parametrize(
    ("change", "code", "reason"),
    [
        ({"boundary": ()}, OutcomeCode.INVALID_NUMBER, "no corners"),
        ({"spacing_m": 0.0}, OutcomeCode.INVALID_NUMBER, "neither a spacing nor a camera"),
        ({"spacing_m": math.nan}, OutcomeCode.INVALID_NUMBER, "Spacing is nan"),
        ({"spacing_m": 0.05}, OutcomeCode.INVALID_NUMBER, "0.1 to 10000 m"),
        ({"overrun_m": -1.0}, OutcomeCode.INVALID_NUMBER, "overrun"),
        ({"angle_enu_rad": math.inf}, OutcomeCode.INVALID_NUMBER, "angle"),
        ({"height_m": math.inf}, OutcomeCode.INVALID_NUMBER, "height"),
        ({"speed_m_s": 0.0}, OutcomeCode.INVALID_NUMBER, "speed"),
        ({"entry": (math.nan, 0.0)}, OutcomeCode.INVALID_NUMBER, "entry"),
        ({"camera": replace(CAMERA, side_overlap=1.0)}, OutcomeCode.INVALID_NUMBER, "overlaps"),
        ({"camera": replace(CAMERA, focal_length_m=0.0)}, OutcomeCode.INVALID_NUMBER, "focal"),
        ({"camera": CAMERA, "height_m": 0.0}, OutcomeCode.INVALID_NUMBER, "above the ground"),
        ({"terrain": hill(1.0), "height_m": 1.9}, OutcomeCode.INVALID_NUMBER, "at least 2 m"),
        (
            {"terrain": hill(1.0), "altitude_reference": AltitudeReference.HOME},
            OutcomeCode.UNKNOWN_FRAME,
            "map frame",
        ),
        ({"terrain": hill(math.nan)}, OutcomeCode.INVALID_WAYPOINTS, "unknown at"),
        ({"terrain": hill(1.0), "overrun_m": 20.0}, OutcomeCode.INVALID_WAYPOINTS, "not cover"),
        ({"holes": ((),)}, OutcomeCode.INVALID_WAYPOINTS, "Hole 1"),
        ({"boundary": FIELD.boundary[:2]}, OutcomeCode.INVALID_WAYPOINTS, "give three"),
        (
            {"boundary": ((91.0, 0.0),), "altitude_reference": AltitudeReference.HOME},
            OutcomeCode.INVALID_NUMBER,
            "is no place",
        ),
    ],
)
def test_what_is_no_survey_is_rejected(
    change: dict[str, object], code: OutcomeCode, reason: str
) -> None:
    rejection = compute_survey(replace(FIELD, **change))  # type: ignore[arg-type]
    assert isinstance(rejection, Rejection)
    assert rejection.code is code
    assert reason in rejection.message


def test_waypoints_follow_the_terrain_and_length_counts_climbs() -> None:
    request = replace(FIELD, spacing_m=0.0, camera=CAMERA, angle_enu_rad=0.0)
    level, route = route_of(request), route_of(replace(request, terrain=hill(20.0)))
    places = np.array([waypoint.position for waypoint in route.waypoints])
    middle = places[np.argmin(np.hypot(places[:, 0] - 30.0, places[:, 1] - 20.0))]
    assert middle == pytest.approx([30.0, 20.0, 40.0])
    assert route.length_m == pytest.approx(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
    assert level.length_m + 5.0 < route.length_m < 1.3 * level.length_m
    assert level.duration_s < route.duration_s < 1.3 * level.duration_s
    assert route.photos == level.photos
    acts = [act.distance_m for waypoint in route.waypoints for act in waypoint.acts]
    assert acts == pytest.approx([4.0, 0.0] * 5)


def test_flat_terrain_raises_the_survey_and_adds_nothing() -> None:
    level, route = route_of(FIELD), route_of(replace(FIELD, terrain=hill(0.0)))
    assert route == level


def test_a_path_over_terrain_that_is_too_steep_for_its_speed_names_a_speed_that_is_not() -> None:
    request = replace(FIELD, terrain=hill(20.0), climb_m_s=1.5, descent_m_s=1.0)
    rejection = compute_survey(request)
    assert isinstance(rejection, Rejection)
    assert rejection.code is OutcomeCode.INVALID_WAYPOINTS
    found = re.search(r"limits are 1.5 and 1 m/s; .* at most (\d.*) m/s", rejection.message)
    assert found is not None, rejection.message
    speed_m_s = float(found[1])
    route_of(replace(request, speed_m_s=speed_m_s))
    assert isinstance(compute_survey(replace(request, speed_m_s=speed_m_s + 0.02)), Rejection)


def test_terrain_that_takes_too_many_waypoints_is_rejected() -> None:
    rough = TerrainGrid((-10.0, -10.0), 1.0, 81, np.tile([0.0, 9.0, 0.0], 81 * 27)[: 81 * 61])
    rejection = compute_survey(replace(FIELD, spacing_m=1.0, terrain=rough))
    assert isinstance(rejection, Rejection)
    assert rejection.code is OutcomeCode.INVALID_WAYPOINTS
    assert "more than 1000 waypoints" in rejection.message
