"""Vehicles of several kinds in one simulation; boats; many of one kind."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig, Wind, World
from mavlink_sitl.array_ops import ArrayOps, Ops
from mavlink_sitl.autopilot.control import drive_controller, glide_controller
from mavlink_sitl.command_line.options import parse
from mavlink_sitl.config import ConfigurationError
from mavlink_sitl.dynamics import at_rest, boat, plane, rover
from sitl_support.ground_station import ACCEPTED, POSITION, VELOCITY, GroundStation

GUIDED = {"copter": 4, "rover": 15, "boat": 15, "plane": 15}
KINDS = ["rover", "copter", "boat", "plane", "rover"]


def together() -> list[GroundStation]:
    """One ground station for each of five vehicles of four kinds."""
    configs = [VehicleConfig(vehicle=kind, ready_after_s=1.0, heading_deg=0.0) for kind in KINDS]
    simulation = Simulation(configs, seed=3)
    stations = [GroundStation(simulation, index) for index in range(len(KINDS))]
    simulation.run_for(4.0)
    for station in stations:
        station.read()
    return stations


def test_each_kind_says_what_it_is() -> None:
    types = [station.last("HEARTBEAT").type for station in together()]
    assert types == [10, 2, 11, 1, 10]


@pytest.mark.night
def test_each_goes_where_commanded_and_the_truth_is_in_the_order_of_the_list() -> None:
    stations = together()
    simulation = stations[0].simulation
    for place in (0, 2, 4):
        kind, station = KINDS[place], stations[place]
        system = place + 1
        station.command(mav.MAV_CMD_DO_SET_MODE, 1, GUIDED[kind], system=system)
        station.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, system=system)
        station.send(
            mav.MAVLink_set_position_target_local_ned_message(
                0, system, 1, 1, POSITION, 10.0 + place, 0.0, 0.0, *[0.0] * 8
            )
        )
    simulation.run_for(25.0)
    north = simulation.truth.position_ned_m[:, 0]
    assert north[0] == pytest.approx(10.0, abs=1.0)
    assert north[2] == pytest.approx(12.0, abs=2.5)
    assert north[4] == pytest.approx(14.0, abs=1.0)
    assert np.abs(simulation.truth.position_ned_m[[1, 3]]).max() < 0.2


def test_the_same_seed_gives_the_same_bytes_for_all_kinds() -> None:
    logs = []
    for _ in range(2):
        log = io.BytesIO()
        configs = [VehicleConfig(vehicle=kind, ready_after_s=1.0) for kind in KINDS]
        simulation = Simulation(configs, seed=5, tlog=log)
        stations = [GroundStation(simulation, index) for index in range(len(KINDS))]
        simulation.run_for(3.0)
        for place, station in enumerate(stations):
            station.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 32, 1e5, system=place + 1)
        simulation.run_for(5.0)
        logs.append(log.getvalue())
    assert logs[0] == logs[1]


def test_a_kind_that_does_not_exist_is_rejected_with_a_sentence() -> None:
    with pytest.raises(ConfigurationError, match="submarine with px4 is not supported"):
        VehicleConfig(vehicle="submarine", autopilot="px4")


# Boats.


def boat_in(wind: tuple[float, float, float]) -> GroundStation:
    config = VehicleConfig(vehicle="boat", ready_after_s=1.0, heading_deg=0.0)
    station = GroundStation(Simulation([config], seed=1, world=World(wind=Wind(wind)))).ready()
    station.run(1.0)
    assert station.mode(15) == ACCEPTED
    assert station.arm() == ACCEPTED
    return station


def test_a_boat_is_a_surface_boat_that_drifts_with_the_wind() -> None:
    station = boat_in((0.0, 8.0, 0.0))
    assert station.last("HEARTBEAT").type == mav.MAV_TYPE_SURFACE_BOAT
    station.mode(4)
    station.run(30.0)
    assert station.position[1] > 5.0


def test_a_boat_slides_outwards_in_a_turn() -> None:
    station = boat_in((0.0, 0.0, 0.0))
    station.setpoint(POSITION, (40.0, 0.0, 0.0))
    station.run(8.0)
    station.setpoint(POSITION, (40.0, 60.0, 0.0))
    most = 0.0
    for _ in range(100):
        station.run(0.1)
        heading = float(station.simulation.truth.yaw_rad[0])
        v_n, v_e, _ = station.velocity
        most = min(most, v_e * math.cos(heading) - v_n * math.sin(heading))
    assert most < -0.3, "turning right it slides to the left"


def test_a_boat_keeps_its_place_against_the_wind_where_it_has_arrived() -> None:
    station = boat_in((4.0, 4.0, 0.0))
    station.setpoint(POSITION, (20.0, 10.0, 0.0))
    station.run(30.0)
    far = []
    for _ in range(60):
        station.run(1.0)
        far.append(math.dist(station.position[:2], (20.0, 10.0)))
    assert max(far) < 5.0


@pytest.mark.parametrize("speed_m_s", [1.5, 3.0])
def test_a_boat_keeps_the_commanded_speed(speed_m_s: float) -> None:
    station = boat_in((0.0, 0.0, 0.0))
    speeds = []
    for _ in range(200):
        station.setpoint(VELOCITY, (0.0, 0.0, 0.0), (speed_m_s, 0.0, 0.0))
        station.run(0.1)
        speeds.append(math.hypot(*station.velocity[:2]))
    assert max(speeds) < 1.15 * speed_m_s
    assert speeds[-1] == pytest.approx(speed_m_s, rel=0.05)


def test_a_boat_answers_more_slowly_than_a_car() -> None:
    speeds = {}
    for kind in ("rover", "boat"):
        config = VehicleConfig(vehicle=kind, ready_after_s=1.0, heading_deg=0.0)
        station = GroundStation(Simulation([config], seed=1)).ready()
        station.run(1.0)
        station.mode(15)
        station.arm()
        station.setpoint(POSITION, (40.0, 0.0, 0.0))
        station.run(2.5)
        speeds[kind] = station.velocity[0]
    assert speeds["boat"] < speeds["rover"]


# One arithmetic for one and for many.


def test_models_give_the_same_for_one_and_for_many() -> None:
    one, many = Ops(), ArrayOps(3)
    for o in (one, many):
        assert o.sin(o.full(0.5)) == pytest.approx(math.sin(0.5))

    def drive(o: Ops) -> list[list[float]]:
        state = at_rest(rover.GroundState, o.full(0.3), o)
        sea = at_rest(rover.GroundState, o.full(0.3), o)
        air = at_rest(plane.PlaneState, o.full(0.3), o)
        wind = (o.full(1.0), o.full(-2.0), o.full(0.0))
        ground = o.full(0.0)
        for tick in range(800):
            steering = o.full(math.sin(tick * 0.01))
            command = rover.GroundCommand(o.full(0.3), steering)
            state = rover.step(state, command, ground, 0.01, rover.RoverModel(), o)
            sea = boat.step(sea, command, wind, ground, 0.01, boat.BoatModel(), o)
            asked = plane.PlaneCommand(0.5 * steering, o.full(5.0), o.full(1.0))
            air = plane.step(air, asked, wind, ground, 0.01, plane.PlaneModel(), o)
        return [o.unpack(lane)[:1] for body in (state, sea, air) for lane in body[:9]]

    for alone, among in zip(drive(one), drive(many), strict=True):
        assert alone[0] == pytest.approx(among[0], abs=1e-9)


def test_controllers_stop_what_is_not_commanded_to_move() -> None:
    o = Ops()
    _, throttle, steering = drive_controller.step(
        drive_controller.initial(o),
        drive_controller.DriveTargets(*[0.0] * 11),
        drive_controller.DriveBody(3.0, 0.0, 0.0),
        0.01,
        drive_controller.DriveGains(),
        o,
    )
    assert (throttle, steering) == (0.0, 0.0)
    _, bank, climb, push = glide_controller.step(
        glide_controller.initial(o),
        glide_controller.GlideTargets(*[0.0] * 8),
        20.0,
        0.01,
        glide_controller.GlideGains(),
        o,
    )
    assert (bank, climb, push) == (0.0, 0.0, 0.0)


def test_many_rovers_do_the_same_as_one() -> None:
    def north(count: int) -> float:
        configs = [VehicleConfig(vehicle="rover", ready_after_s=1.0) for _ in range(count)]
        simulation = Simulation(configs, seed=1)
        stations = [GroundStation(simulation, index) for index in range(count)]
        simulation.run_for(4.0)
        for place, station in enumerate(stations):
            station.command(mav.MAV_CMD_DO_SET_MODE, 1, 15, system=place + 1)
            station.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1, system=place + 1)
            station.send(
                mav.MAVLink_set_position_target_local_ned_message(
                    0, place + 1, 1, 1, POSITION, 12.0, 3.0, 0.0, *[0.0] * 8
                )
            )
        simulation.run_for(12.0)
        return float(simulation.truth.position_ned_m[0, 0])

    assert north(1) == pytest.approx(north(4), abs=1e-6)


@pytest.mark.parametrize("kind", ["copter", "rover", "boat", "plane"])
def test_the_command_line_takes_each_kind(kind: str) -> None:
    _, config = parse(["--vehicle", kind])
    assert config.vehicle == kind
