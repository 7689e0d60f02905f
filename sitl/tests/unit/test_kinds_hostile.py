"""Extreme values in everything that rovers, boats and planes read: they stay sane."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.mavlink.messages.telemetry import BUILDERS
from sitl_support.ground_station import ACCEPTED, POSITION, VELOCITY, GroundStation
from sitl_support.missions import item, upload, waypoint

pytestmark = pytest.mark.wide

KINDS = ["rover", "boat", "plane"]
EXTREMES = [0.0, -1.0, 1e-30, 1e9, -1e9, 3.4e38, -3.4e38]


def moving(kind: str) -> GroundStation:
    """A vehicle under way by itself."""
    config = VehicleConfig(vehicle=kind, ready_after_s=1.0)
    station = GroundStation(Simulation([config], seed=1)).ready()
    station.run(0.5)
    station.mode(13 if kind == "plane" else 15)
    assert station.arm() == ACCEPTED
    if kind == "plane":
        station.run(15.0)
        station.mode(15)
    else:
        station.setpoint(POSITION, (30.0, 10.0, 0.0))
        station.run(2.0)
    return station


def check(station: GroundStation, furthest_m: float = 5000.0) -> None:
    """Every message can be made, and the vehicle is where a vehicle can be."""
    snapshot = station.vehicle.snapshot()
    for build in BUILDERS[station.vehicle.config.vehicle].values():
        build(snapshot)
    values = [*station.position, *station.velocity]
    assert all(math.isfinite(value) for value in values)
    assert math.hypot(*station.velocity) < 80.0
    assert math.hypot(*station.position) < furthest_m


@pytest.mark.parametrize("kind", KINDS)
def test_extreme_parameters_do_no_harm(kind: str) -> None:
    station = moving(kind)
    vehicle = station.vehicle
    for name in vehicle.parameters.table.acting:
        if name.startswith(("SIM_", "SYSID", "BATT_", "FS_")):
            continue  # they end the flight, rightly, or belong to all kinds
        before = vehicle.parameters[name]
        for value in EXTREMES:
            station.send(mav.MAVLink_param_set_message(1, 1, name.encode(), value, 9))
            station.run(0.2, step_s=0.2)
            if kind != "plane":
                station.setpoint(POSITION, (30.0, 10.0, 0.0))
            station.run(0.2, step_s=0.2)
            check(station)
        vehicle.parameters.set(name, before)


@pytest.mark.parametrize("kind", KINDS)
def test_extreme_setpoints_do_no_harm(kind: str) -> None:
    station = moving(kind)
    for value in [*EXTREMES, math.nan, math.inf]:
        for frame in (1, 7, 8, 9, 12, 200):
            for mask in (POSITION, VELOCITY, 0, 0x5C7, 0x9C7, 0x9FF, 0x5FF, 0xFFF):
                triple = (value, value, value)
                station.setpoint(mask, triple, triple, (0.0, 0.0, 0.0), value, value, frame)
            station.run(0.1, step_s=0.1)
        check(station)


@pytest.mark.parametrize("kind", KINDS)
def test_extreme_commands_do_no_harm(kind: str) -> None:
    station = moving(kind)
    for value in [*EXTREMES, math.nan, math.inf]:
        for command in (16, 19, 20, 21, 22, 176, 178, 179, 192, 193, 300, 400, 410, 511, 512):
            params = (value,) * 7
            assert station.command(command, *params) in (0, 1, 2, 3, 4)
            number = round(max(min(value, 2**31 - 1), -(2**31))) if math.isfinite(value) else 0
            result = station.command_int(
                command, 6, value, 1.0, value, value, x=number, y=number, z=value
            )
            assert result in (0, 1, 2, 3, 4)
        station.run(0.2, step_s=0.2)
        check(station)


MISSION_PARAMETERS = (
    "LAND_DISARMDELAY", "LAND_FLARE_ALT", "LAND_FLARE_SEC", "MIN_GROUNDSPEED", "NAVL1_DAMPING",
    "NAVL1_PERIOD", "TECS_LAND_ARSPD", "TECS_LAND_SINK", "WP_LOITER_RAD", "WP_RADIUS",
)  # fmt: skip


@pytest.mark.night
@pytest.mark.parametrize("stage", ["waypoint", "loiter", "landing"])
def test_extreme_parameters_do_no_harm_in_a_planes_mission(stage: str) -> None:
    station = moving("plane")
    items = {
        "waypoint": [waypoint(3000, 0, 60)],
        "loiter": [item(mav.MAV_CMD_NAV_LOITER_TURNS, 300, 0, 60, (9, 0, 80))],
        "landing": [item(mav.MAV_CMD_NAV_LAND, 3000, 0, 0)],
    }[stage]
    assert upload(station, [waypoint(0, 0), *items]) == 0
    assert station.mode(10) == ACCEPTED
    vehicle = station.vehicle
    for name in MISSION_PARAMETERS:
        before = vehicle.parameters[name]
        for value in EXTREMES:
            station.send(mav.MAVLink_param_set_message(1, 1, name.encode(), value, 9))
            station.run(0.4, step_s=0.2)
            check(station)
        vehicle.parameters.set(name, before)


@pytest.mark.parametrize("value", [-3.4e38, 3.4e38, 1e-38, -1.0])
def test_extreme_items_do_no_harm_to_a_plane(value: float) -> None:
    station = moving("plane")
    for command in (16, 17, 18, 19, 31, 21, 22, 93, 178):
        extreme = item(command, 300, 0, value, (value, value, value, value))
        upload(station, [waypoint(0, 0), extreme, waypoint(500, 0, 60)])
        assert station.mode(10) == ACCEPTED
        station.run(3.0, step_s=0.2)
        check(station)
        assert station.mode(15) == ACCEPTED, "the next one begins in the air, too"
