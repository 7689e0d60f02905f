"""A home that is not where the vehicle stands: above, below, far away, moved in flight.

Heights of goals count from the ground, which is where the vehicle stands. The truth is that of the
simulator, whose ground is at 0 m.
"""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, make, mavlink
from navigation_bridge.goals.requests import (
    AltitudeReference,
    LandRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


STATION = Codec(255, 190)
FIRMWARES = ("ardupilot", "px4")
# Home from where the vehicle stands: north, east and up, m.
HOMES = {
    "above": (0.0, 0.0, 20.0),
    "below": (0.0, 0.0, -20.0),
    "far and above": (900.0, -400.0, 60.0),
}


def put_home(flight: SimulatedFlight, north_m: float, east_m: float, up_m: float) -> None:
    """Have a ground station set home, and wait until the server has heard of it."""
    frame = flight.simulation.vehicles[0].firmware.navigator.frame
    there = frame.to_geodetic(north_m, east_m, -up_m)
    message = make(
        "COMMAND_INT",
        target_system=1,
        target_component=1,
        frame=mavlink.MAV_FRAME_GLOBAL,
        command=mavlink.MAV_CMD_DO_SET_HOME,
        x=round(there.latitude_deg * 1e7),
        y=round(there.longitude_deg * 1e7),
        z=there.altitude_amsl_m,
    )
    flight.simulation.link.write(STATION.encode(message))
    home = flight.vehicle.state.home
    flight.run_until(lambda: flight.vehicle.state.home is not home)
    flight.run_for(3.0)


def standing(firmware: str, kind: str = "copter") -> SimulatedFlight:
    simulated = VehicleConfig(autopilot=firmware, vehicle=kind, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=simulated, volume_radius_m=2000.0).ready()
    flight.run_for(2.0)
    return flight


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("place", HOMES)
def test_a_take_off_counts_from_where_the_vehicle_stands(firmware: str, place: str) -> None:
    flight = standing(firmware)
    put_home(flight, *HOMES[place])
    goal_id = flight.start(TakeoffRequest(5.0))
    end = flight.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert flight.truth()[0][2] == pytest.approx(5.0, abs=0.6)
    heights = [item.height_m for item in flight.feedback(goal_id) if item.height_m is not None]
    assert heights[-1] == pytest.approx(5.0, abs=0.6)
    assert max(heights) < 6.0
    end = flight.run_to_end(flight.start(LandRequest()))
    assert end.code.value == "SUCCESS", end.message


@pytest.mark.night_but_first
@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("place", HOMES)
def test_a_flight_and_a_route_take_off_from_where_the_vehicle_stands(
    firmware: str, place: str
) -> None:
    flight = standing(firmware)
    put_home(flight, *HOMES[place])
    highest_m = 0.0

    def watch(_: object) -> None:
        nonlocal highest_m
        highest_m = max(highest_m, flight.truth()[0][2])

    flight.on_output = watch
    assert flight.run_to_end(flight.send(8.0, 0.0, 4.0)).code.value == "SUCCESS"
    assert flight.truth()[0][2] == pytest.approx(4.0, abs=0.6)
    assert flight.run_to_end(flight.start(LandRequest())).code.value == "SUCCESS"
    corners = ((8.0, 8.0, 4.0), (0.0, 0.0, 4.0))
    route = WaypointsRequest(tuple(WaypointRequest(corner) for corner in corners))
    end = flight.run_to_end(flight.start(route))
    assert end.code.value == "SUCCESS", end.message
    assert flight.truth()[0][2] == pytest.approx(4.0, abs=0.6)
    assert highest_m < 5.5


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_mission_takes_off_from_where_the_vehicle_stands(firmware: str) -> None:
    flight = standing(firmware)
    put_home(flight, *HOMES["below"])
    corners = ((8.0, 8.0, 6.0), (0.0, 0.0, 6.0))
    route = WaypointsRequest(tuple(WaypointRequest(corner) for corner in corners), by_mission=True)
    end = flight.run_to_end(flight.start(route))
    assert end.code.value == "SUCCESS", end.message
    assert flight.truth()[0][2] == pytest.approx(6.0, abs=0.8)


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("up_m", [20.0, -20.0])
def test_a_home_that_is_moved_during_a_take_off_changes_nothing(firmware: str, up_m: float) -> None:
    flight = standing(firmware)
    goal_id = flight.start(TakeoffRequest(8.0))
    flight.run_until(lambda: flight.truth()[0][2] > 2.0)
    put_home(flight, 30.0, 0.0, up_m)
    flight.run_until(lambda: bool(flight.ends(goal_id)))
    (end,) = flight.ends(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert flight.truth()[0][2] == pytest.approx(8.0, abs=0.6)
    assert flight.run_to_end(flight.send(5.0, 0.0, 6.0)).code.value == "SUCCESS"
    assert flight.truth()[0][2] == pytest.approx(6.0, abs=0.6)


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_route_above_home_is_flown_above_home(firmware: str) -> None:
    flight = standing(firmware)
    put_home(flight, *HOMES["above"])
    there = flight.simulation.vehicles[0].firmware.navigator.frame.to_geodetic(20.0, 0.0, 0.0)
    position = (there.latitude_deg, there.longitude_deg, -12.0)
    place = WaypointRequest(position, AltitudeReference.HOME)
    end = flight.run_to_end(flight.start(WaypointsRequest((place,))))
    assert end.code.value == "SUCCESS", end.message
    assert flight.truth()[0][2] == pytest.approx(8.0, abs=0.6)


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("up_m", [60.0, -60.0])
def test_a_plane_takes_off_from_where_it_stands(firmware: str, up_m: float) -> None:
    flight = standing(firmware, "plane")
    put_home(flight, 0.0, 0.0, up_m)
    end = flight.run_to_end(flight.start(TakeoffRequest(50.0)), 200.0)
    assert end.code.value == "SUCCESS", end.message
    assert flight.truth()[0][2] == pytest.approx(50.0, abs=12.0)
