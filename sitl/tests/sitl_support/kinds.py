"""Rovers, boats and planes under way, for tests of what is common to them."""

from __future__ import annotations

from mavlink_sitl import Simulation, VehicleConfig, Wind, World
from sitl_support.ground_station import ACCEPTED, GroundStation

ROVER_MANUAL, HOLD, ROVER_AUTO, ROVER_RTL, SMART_RTL, ROVER_GUIDED = 0, 4, 10, 11, 12, 15
FBWA, PLANE_AUTO, PLANE_RTL, LOITER, TAKEOFF, PLANE_GUIDED = 5, 10, 11, 12, 13, 15


def kind(
    vehicle: str,
    parameters: dict[str, float] | None = None,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> GroundStation:
    """One that knows its position, disarmed, nose to the North."""
    config = VehicleConfig(
        vehicle=vehicle, ready_after_s=1.0, heading_deg=0.0, parameters=parameters or {}
    )
    station = GroundStation(Simulation([config], seed=1, world=World(wind=Wind(wind)))).ready()
    station.run(1.0)
    return station


def starting(vehicle: str, ready_after_s: float, seconds: float) -> tuple[int, int, int]:
    """Return a starting vehicle's mode, base mode and system status after some seconds."""
    station = GroundStation(
        Simulation([VehicleConfig(vehicle=vehicle, ready_after_s=ready_after_s)])
    )
    station.run(seconds)
    beat = station.last("HEARTBEAT")
    return beat.custom_mode, beat.base_mode, beat.system_status


def rover(parameters: dict[str, float] | None = None, vehicle: str = "rover") -> GroundStation:
    """A rover or boat in GUIDED, armed."""
    station = kind(vehicle, parameters)
    assert station.mode(ROVER_GUIDED) == ACCEPTED
    assert station.arm() == ACCEPTED
    return station


def plane(
    parameters: dict[str, float] | None = None, wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> GroundStation:
    """A plane in GUIDED, round a point 50 m up and about 300 m North."""
    station = kind("plane", parameters, wind)
    assert station.mode(TAKEOFF) == ACCEPTED
    assert station.arm() == ACCEPTED
    station.run(20.0)
    assert station.mode(PLANE_GUIDED) == ACCEPTED
    return station


def mode_of(station: GroundStation) -> int:
    return int(station.last("HEARTBEAT").custom_mode)
