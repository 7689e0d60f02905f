"""Goals end where the vehicle's own firmware would have gone, in the map as on the earth.

The reference is the vehicle itself: what DO_REPOSITION does with the same place, and the ground
truth of the simulation. It lays each firmware's local frame over the earth as that one does, by
formulas of its own, which `tests/replay/test_recorded_projections.py` holds to real recordings.
"""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import GeoPoint, LocalFrame, PlanItem, VehicleConfig
from navigation_bridge.goals.requests import AltitudeReference, WaypointRequest, WaypointsRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


FIRMWARES = ("ardupilot", "px4")
ALTITUDE_M = 488.0
UP_M = 12.0
NAN = math.nan


def standing_at(
    autopilot: str,
    latitude_deg: float,
    start_ne_m: tuple[float, float] = (0.0, 0.0),
    vehicle: str = "copter",
    **parameters: Any,
) -> SimulatedFlight:
    """A vehicle on the ground, so far from the origin of its local frame, not yet ready."""
    home = GeoPoint(latitude_deg, 8.545594, ALTITUDE_M)
    config = VehicleConfig(vehicle=vehicle, autopilot=autopilot, ready_after_s=1.0, home=home)
    flight = SimulatedFlight(simulated=config, volume_radius_m=10_000.0, **parameters)
    physics = flight.simulation.vehicles[0]._physics
    north_m, east_m = start_ne_m
    physics.body = physics.body._replace(north_m=north_m, east_m=east_m)
    return flight


def frame_of(flight: SimulatedFlight) -> LocalFrame:
    return flight.simulation.vehicles[0].frame


def place_of(flight: SimulatedFlight, east_m: float, north_m: float) -> tuple[int, int]:
    """The place, in 1e7 degrees, that the firmware has at a position of its local frame."""
    place = frame_of(flight).to_geodetic(north_m, east_m, 0.0)
    return round(place.latitude_deg * 1e7), round(place.longitude_deg * 1e7)


def truth_en_m(flight: SimulatedFlight) -> tuple[float, float]:
    (east_m, north_m, _), _ = flight.truth()
    return east_m, north_m


# The cases that were found on the real firmwares


@pytest.mark.night_but_first
@pytest.mark.parametrize(
    ("autopilot", "latitude_deg", "target"),
    [
        ("ardupilot", 47.4, (400.0, 0.0, 15.0)),
        ("ardupilot", 1.3, (0.0, 200.0, 15.0)),
        ("px4", 47.4, (490.0, 0.0, 15.0)),
    ],
)
def test_a_vehicle_that_stands_at_its_target_has_arrived(
    autopilot: str, latitude_deg: float, target: tuple[float, float, float]
) -> None:
    """All parameters are the defaults."""
    flight = standing_at(autopilot, latitude_deg).ready()
    end = flight.run_to_end(flight.send(*target), 300.0)
    assert end.code.value == "SUCCESS", end.message
    assert math.dist(truth_en_m(flight), target[:2]) < 0.5
    assert end.pose is not None
    assert math.dist(end.pose.position_enu_m[:2], truth_en_m(flight)) < 0.3


@pytest.mark.parametrize(
    ("autopilot", "latitude_deg", "east_m", "north_m"),
    [("ardupilot", 1.3, 0.0, 300.0), ("ardupilot", 47.4, 300.0, 0.0), ("px4", 47.4, 300.0, 0.0)],
)
def test_a_geodetic_goal_ends_at_its_place(
    autopilot: str, latitude_deg: float, east_m: float, north_m: float
) -> None:
    flight = standing_at(autopilot, latitude_deg).ready()
    latitude_e7, longitude_e7 = place_of(flight, east_m, north_m)
    request = flight.request(
        latitude_e7 / 1e7, longitude_e7 / 1e7, ALTITUDE_M + 15.0, frame="wgs84"
    )
    end = flight.run_to_end(flight.start(request), 300.0)
    assert end.code.value == "SUCCESS", end.message
    assert math.dist(truth_en_m(flight), (east_m, north_m)) < 0.5


# Everywhere


def _reposition(flight: SimulatedFlight, latitude_e7: int, longitude_e7: int) -> None:
    """Ask as a ground station does, which the bridge has no part in."""
    # PX4 counts from the sea whatever the frame says, ArduPilot takes heights above home.
    is_px4 = flight.simulation.vehicles[0].config.autopilot == "px4"
    frame, altitude_m = (0, ALTITUDE_M + UP_M) if is_px4 else (6, UP_M)
    message = mav.MAVLink_command_int_message(
        1, 1, frame, 192, 0, 0, -1.0, 1.0, 0.0, NAN, latitude_e7, longitude_e7, altitude_m
    )
    flight.simulation.link.write(message.pack(mav.MAVLink(None, srcSystem=255, srcComponent=190)))


def check_agreement(
    autopilot: str, latitude_deg: float, bearing_rad: float, distance_m: float
) -> None:
    """Send a vehicle to one place in three ways; it must not matter which."""
    north_m, east_m = distance_m * math.cos(bearing_rad), distance_m * math.sin(bearing_rad)
    flight = standing_at(
        autopilot,
        latitude_deg,
        (north_m - 6.0, east_m - 8.0),
        battery_policy="ignore",
        arrival_radius_m=0.08,
        arrival_dwell_s=3.0,
    ).ready()
    latitude_e7, longitude_e7 = place_of(flight, east_m, north_m)
    place = (latitude_e7 / 1e7, longitude_e7 / 1e7, ALTITUDE_M + UP_M)
    found = []
    for request in (
        flight.request(east_m, north_m, UP_M),
        flight.request(*place, frame="wgs84"),
    ):
        goal_id = flight.start(request)
        flight.run_until(lambda goal_id=goal_id: bool(flight.ends(goal_id)))  # type: ignore[misc]
        (end,) = flight.ends(goal_id)
        assert end.code.value == "SUCCESS", end.message
        found.append(truth_en_m(flight))
    flight.run_for(1.0)
    _reposition(flight, latitude_e7, longitude_e7)
    flight.run_for(12.0)
    by_vehicle = truth_en_m(flight)
    for name, by_goal in zip(("map", "wgs84"), found, strict=True):
        assert math.dist(by_goal, by_vehicle) < 0.1, name


@pytest.mark.parametrize("autopilot", FIRMWARES)
@pytest.mark.parametrize(
    ("latitude_deg", "bearing_rad", "distance_m"),
    [
        (85.0, 0.8, 5000.0),
        (-85.0, 4.0, 5000.0),
        (47.4, math.pi / 2, 5000.0),
        (1.3, 0.0, 300.0),
        (0.0, 0.0, 5000.0),
    ],
)
def test_goals_agree_with_a_reposition(
    autopilot: str, latitude_deg: float, bearing_rad: float, distance_m: float
) -> None:
    check_agreement(autopilot, latitude_deg, bearing_rad, distance_m)


@pytest.mark.night_but_first
@pytest.mark.parametrize("autopilot", FIRMWARES)
@given(
    latitude_deg=st.floats(-85.0, 85.0),
    bearing_rad=st.floats(0.0, math.tau),
    distance_m=st.floats(0.0, 5000.0),
)
@settings(max_examples=5, phases=[Phase.generate])
def test_goals_agree_with_a_reposition_anywhere(
    autopilot: str, latitude_deg: float, bearing_rad: float, distance_m: float
) -> None:
    check_agreement(autopilot, latitude_deg, bearing_rad, distance_m)


# Other messages in degrees


@pytest.mark.parametrize("vehicle", ["copter", "rover", "plane"])
@pytest.mark.parametrize("autopilot", FIRMWARES)
def test_a_mission_has_its_waypoints_where_the_map_has_them(autopilot: str, vehicle: str) -> None:
    flight = standing_at(autopilot, 47.4, vehicle=vehicle).ready()
    up_m = {"copter": 10.0, "rover": 0.0, "plane": 50.0}[vehicle]
    targets = [(450.0, 20.0), (450.0, 480.0)]
    route = tuple(WaypointRequest((east, north, up_m)) for east, north in targets)
    flight.start(WaypointsRequest(route, by_mission=True))
    plans = flight.simulation.vehicles[0].plans

    def stored() -> list[tuple[float, float]]:
        items = [i for i in plans.mission.items if i.command == mav.MAV_CMD_NAV_WAYPOINT]
        places = [GeoPoint(item.x / 1e7, item.y / 1e7, 0.0) for item in items]
        found = [frame_of(flight).to_local(place) for place in places]
        return [(east_m, north_m) for north_m, east_m, _ in found if 400.0 < east_m < 500.0]

    flight.run_until(lambda: len(stored()) == len(targets), 60.0)
    for target, place in zip(targets, stored(), strict=True):
        assert math.dist(target, place) < 0.02


@pytest.mark.parametrize("autopilot", FIRMWARES)
def test_a_fence_stands_where_the_vehicle_has_it(autopilot: str) -> None:
    """Its eastern side is 500 m away, where the ellipsoid is 1.5 m off."""
    flight = standing_at(autopilot, 47.4, fence_margin_m=0.0)
    vehicle = flight.simulation.vehicles[0]
    for name, value in (("FENCE_ENABLE", 1.0), ("FENCE_TYPE", 4.0), ("GF_ACTION", 2.0)):
        if name in vehicle.parameters:
            vehicle.parameters.set(name, value)
    corners = [(-50.0, -50.0), (500.0, -50.0), (500.0, 50.0), (-50.0, 50.0)]
    vertex = mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
    places = [place_of(flight, east, north) for east, north in corners]
    vehicle.plans.fence.replace(
        [PlanItem(vertex, 0, (4.0, 0.0, 0.0, 0.0), *place) for place in places]
    )
    flight.ready()
    flight.run_until(lambda: flight.vehicle.stored_lists.fence is not None, 30.0)
    inside = flight.check(flight.request(499.9, 0.0, 5.0))
    assert inside is None, inside
    outside = flight.check(flight.request(500.1, 0.0, 5.0))
    assert outside is not None
    assert outside.code is OutcomeCode.OUTSIDE_FENCE


@pytest.mark.night_but_first
@pytest.mark.parametrize("autopilot", FIRMWARES)
def test_a_geodetic_waypoint_is_flown_through(autopilot: str) -> None:
    flight = standing_at(autopilot, 47.4, arrival_radius_m=0.1).ready()
    latitude_e7, longitude_e7 = place_of(flight, 250.0, 0.0)
    waypoint = WaypointRequest(
        (latitude_e7 / 1e7, longitude_e7 / 1e7, 10.0), AltitudeReference.HOME, 0.1, 1.0
    )
    end = flight.run_to_end(flight.start(WaypointsRequest((waypoint,))), 300.0)
    assert end.code.value == "SUCCESS", end.message
    assert math.dist(truth_en_m(flight), (250.0, 0.0)) < 0.3
