"""Simulated MAVLink autopilots: seeded, deterministic, faster than real time.

All that is here, `pytest_mavlink_sitl` and the module `geodesy` are public; everything else may
change.
"""

from mavlink_sitl.autopilot.parameters import UnknownParameterError
from mavlink_sitl.autopilot.plans.plans import PlanItem, PlanType
from mavlink_sitl.config import DEFAULT_HOME, ConfigurationError, Underway, VehicleConfig
from mavlink_sitl.dynamics.battery import BatteryModel
from mavlink_sitl.exchange import FurtherBattery, Severity, Sighting
from mavlink_sitl.geodesy import GeoPoint, LocalFrame
from mavlink_sitl.links.faults import LinkFaults
from mavlink_sitl.links.simulated_link import SimulatedLink
from mavlink_sitl.simulation import Simulation
from mavlink_sitl.truth import Truth
from mavlink_sitl.vehicles.vehicle import SimulatedVehicle
from mavlink_sitl.world.loader import WorldError, load_world, parse_world
from mavlink_sitl.world.model import (
    GpsQuality,
    Mark,
    MarkCamera,
    MoverPath,
    Obstacle,
    RangeSensor,
    Wind,
    World,
)
from mavlink_sitl.world.shapes import Shapes

__all__ = [
    "DEFAULT_HOME",
    "BatteryModel",
    "ConfigurationError",
    "FurtherBattery",
    "GeoPoint",
    "GpsQuality",
    "LinkFaults",
    "LocalFrame",
    "Mark",
    "MarkCamera",
    "MoverPath",
    "Obstacle",
    "PlanItem",
    "PlanType",
    "RangeSensor",
    "Severity",
    "Shapes",
    "Sighting",
    "SimulatedLink",
    "SimulatedVehicle",
    "Simulation",
    "Truth",
    "Underway",
    "UnknownParameterError",
    "VehicleConfig",
    "Wind",
    "World",
    "WorldError",
    "load_world",
    "parse_world",
]
