"""Surveys as they are flown and driven: the track covers the area."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.interpolate import RegularGridInterpolator

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.requests import WaypointsRequest
from navigation_bridge.goals.surveys import SurveyRequest, SurveyRoute, compute_survey
from navigation_core.surveys.terrain import TerrainGrid, tolerance_m
from tests.support.flights.simulated_flight import SimulatedFlight

BOUNDARY = ((0.0, 5.0), (40.0, 5.0), (45.0, 30.0), (5.0, 35.0))
LAKE = ((18.0, 15.0), (26.0, 15.0), (26.0, 23.0), (18.0, 23.0))


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize(
    ("vehicle", "autopilot"),
    [
        ("copter", "ardupilot"),
        pytest.param("copter", "px4", marks=pytest.mark.wide),
        pytest.param("rover", "ardupilot", marks=pytest.mark.wide),
        pytest.param("rover", "px4", marks=pytest.mark.wide),
    ],
)
def test_the_track_covers_the_area_and_leaves_the_hole(vehicle: str, autopilot: str) -> None:
    simulated = VehicleConfig(vehicle=vehicle, autopilot=autopilot, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=simulated).ready()
    # Rovers swing out at turns.
    radius_m = 0.0 if vehicle == "copter" else 2.0
    height_m = 5.0 if vehicle == "copter" else 0.0
    route = compute_survey(
        SurveyRequest(
            BOUNDARY,
            (LAKE,),
            height_m=height_m,
            spacing_m=8.0,
            entry=(0.0, 0.0),
            acceptance_radius_m=radius_m,
        )
    )
    assert isinstance(route, SurveyRoute)
    goal = flight.start(
        WaypointsRequest(route.waypoints, max_speed_m_s=4.0 if radius_m == 0.0 else 2.0)
    )
    track = []
    while not flight.ends(goal):
        flight.run_for(0.5)
        (east, north, _), _ = flight.truth()
        track.append((east, north))
    assert flight.ends(goal)[0].code.value == "SUCCESS", flight.ends(goal)[0].message
    area = shapely.difference(shapely.Polygon(BOUNDARY), shapely.Polygon(LAKE))
    seen = shapely.LineString(track).buffer(route.spacing_m / 2.0 + 0.5 + radius_m / 2.0)
    assert shapely.difference(area, seen).area < 0.01 * area.area
    assert shapely.distance(shapely.LineString(track), shapely.Polygon(LAKE)) > 1.5 - radius_m / 3.0


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", pytest.param("px4", marks=pytest.mark.wide)])
def test_a_copter_keeps_its_height_above_a_hill(autopilot: str) -> None:
    simulated = VehicleConfig(vehicle="copter", autopilot=autopilot, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=simulated).ready()
    east, north = np.linspace(-10.0, 60.0, 15), np.linspace(0.0, 40.0, 9)
    heights_m = 12.0 * np.exp(-((east - 25.0) ** 2 + (north[:, None] - 15.0) ** 2) / 15.0**2)
    ground = RegularGridInterpolator((east, north), heights_m.T)
    route = compute_survey(
        SurveyRequest(
            ((0.0, 5.0), (50.0, 5.0), (50.0, 25.0), (0.0, 25.0)),
            height_m=8.0,
            spacing_m=10.0,
            speed_m_s=2.0,
            terrain=TerrainGrid((-10.0, 0.0), 5.0, 15, heights_m.ravel()),
        )
    )
    assert isinstance(route, SurveyRoute)
    goal = flight.start(WaypointsRequest(route.waypoints, max_speed_m_s=2.0))
    begin = np.array(route.waypoints[0].position)
    above_m: list[float] = []
    while not flight.ends(goal):
        flight.run_for(0.5)
        position, _ = flight.truth()
        if above_m or np.linalg.norm(begin - position) < 1.0:
            above_m.append(position[2] - ground(position[:2]).item())
    assert flight.ends(goal)[0].code.value == "SUCCESS", flight.ends(goal)[0].message
    assert 0.5 * len(above_m) == pytest.approx(route.duration_s, rel=0.15)
    # The path's tolerance, and what a vehicle is beside its path.
    assert np.abs(np.array(above_m) - 8.0).max() < tolerance_m(8.0) + 1.0
