"""Simulated MAVLink autopilots: seeded, deterministic, faster than real time."""

from mavlink_sitl.config import ConfigurationError, VehicleConfig
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.links.faults import LinkFaults
from mavlink_sitl.links.simulated_link import SimulatedLink
from mavlink_sitl.simulation import Simulation
from mavlink_sitl.truth import Estimate, Truth
from mavlink_sitl.vehicles.vehicle import SimulatedVehicle
from mavlink_sitl.world.loader import WorldError, load_world, parse_world
from mavlink_sitl.world.model import World

__all__ = [
    "ConfigurationError",
    "Estimate",
    "GeoPoint",
    "LinkFaults",
    "SimulatedLink",
    "SimulatedVehicle",
    "Simulation",
    "Truth",
    "VehicleConfig",
    "World",
    "WorldError",
    "load_world",
    "parse_world",
]
