"""The simulation: owns simulated time and steps all vehicles at a fixed rate.

No sockets, no threads, no clock. A program under test reads and writes a vehicle's `link`,
and time passes when `run_for` or `run_until` says so:

    simulation = Simulation([VehicleConfig()], seed=1)
    simulation.run_for(3.0)
    simulation.link.write(frame)
    answer = simulation.link.read()

A tick is 10 ms by default: controllers and bodies move at every tick, the firmware
acts every 50 ms. Written bytes are processed at once, at the simulated time of the write. The
same seed and the same writes at the same simulated times give the same bytes, however the time in
between is cut into runs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.config import ConfigurationError, VehicleConfig
from mavlink_sitl.encounters import Encounters
from mavlink_sitl.environment import Environment
from mavlink_sitl.exchange import Sighting
from mavlink_sitl.links.simulated_link import SimulatedLink
from mavlink_sitl.physics.copter_pipeline import DT_S
from mavlink_sitl.physics.fleets import make_fleets
from mavlink_sitl.truth import FleetState, Truth
from mavlink_sitl.vehicles.vehicle import SimulatedVehicle
from mavlink_sitl.world.loader import load_world
from mavlink_sitl.world.lookout import Lookout
from mavlink_sitl.world.model import World

__all__ = ["SimulatedLink", "SimulatedVehicle", "Simulation", "Truth", "VehicleConfig"]

TICK_US = round(DT_S * 1e6)
ACTION_PERIOD_US = 50_000
SENSOR_US = 200_000
EPOCH_US = 1_767_225_600_000_000
"""Simulated time 0 in logs and GPS time: 1 January 2026, UTC"""


class Simulation:
    """Vehicles and the time they live in.

    Args:
        vehicles: which; one ArduCopter when not given.
        seed: for all random numbers.
        tlog: where to record all traffic, both directions.
        world: what is around them, or the path of a world's file; a plain when not given.
        tick_s: 0.01, or up to 0.05 to save time where the motion need not be exact; a whole part of
            0.05.
        collisions: whether vehicles hit each other, instead of passing through each other.

    Raises:
        ConfigurationError: the vehicles do not go together, or there is no such tick.
        WorldError: the world's file is no world.

    Attributes:
        vehicles: the vehicles, with their links.
    """

    def __init__(
        self,
        vehicles: Sequence[VehicleConfig] | None = None,
        seed: int = 0,
        tlog: BinaryIO | None = None,
        world: World | str | Path | None = None,
        tick_s: float = DT_S,
        collisions: bool = False,
    ) -> None:
        configs = [VehicleConfig()] if vehicles is None else list(vehicles)
        if not configs:
            raise ConfigurationError("a simulation needs at least one vehicle")
        ids = [config.system_id or place % 255 + 1 for place, config in enumerate(configs)]
        packs = {config.battery for config in configs}
        if len(packs) > 1:
            raise ConfigurationError("all vehicles must have the same battery model")
        self._tick_us = round(tick_s * 1e6)
        if not self._tick_us > 0 or ACTION_PERIOD_US % self._tick_us:
            raise ConfigurationError(f"the tick must be a whole part of 0.05 s, not {tick_s} s")
        self._action_ticks = ACTION_PERIOD_US // self._tick_us
        self._sensor_ticks = SENSOR_US // self._tick_us
        self._now_us = 0
        self._tick = 0
        world = World() if world is None else world
        self.world = world if isinstance(world, World) else load_world(world)
        fleets = make_fleets(configs, seed, tick_s)
        fleet_of_row = {row: fleet for fleet in fleets for row in fleet.rows}
        self.vehicles = [
            SimulatedVehicle(i, config, ids[i], fleet_of_row[i], seed, tlog, EPOCH_US)
            for i, config in enumerate(configs)
        ]
        frames = [vehicle.frame for vehicle in self.vehicles]
        self._kinds = [
            (rows, physics, Environment(self.world, physics, rows, frames, seed))
            for rows, physics in fleets
        ]
        """Of each kind of vehicle the rows, the bodies and the world around them"""
        self._encounters = Encounters([(rows, own) for rows, _, own in self._kinds], tick_s)
        self._collisions = collisions
        for rows, _, environment in self._kinds:
            for row in rows:
                self.vehicles[row].enter(environment)
        self._lookouts = self._make_lookouts(seed)

    @property
    def time_s(self) -> float:
        """Simulated time since the start."""
        return self._now_us / 1e6

    @property
    def time_us(self) -> int:
        """The same in microseconds."""
        return self._now_us

    @property
    def link(self) -> SimulatedLink:
        """The first vehicle's link."""
        return self.vehicles[0].link

    @property
    def truth(self) -> Truth:
        """The true state of the vehicles now: a snapshot, which does not change with time."""
        fleets = [
            FleetState(rows, physics.body, physics.o.unpack, environment.collided)
            for rows, physics, environment in self._kinds
        ]
        return Truth(fleets, [vehicle.offset_ned_m for vehicle in self.vehicles])

    def run_for(self, seconds: float) -> None:
        """Let simulated time pass.

        Raises:
            ValueError: the time is negative or not a number.
        """
        if not seconds >= 0.0 or math.isinf(seconds):
            raise ValueError(f"time cannot advance by {seconds} s")
        self.run_to_us(self._now_us + round(seconds * 1e6))

    def run_until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Let time pass tick by tick until something holds.

        Args:
            condition: looked at after every tick, and before the first.
            timeout_s: how much simulated time it may take.

        Returns:
            Whether it held in time.
        """
        limit_us = self._now_us + round(timeout_s * 1e6)
        while not condition():
            if self._now_us >= limit_us:
                return False
            next_us = (self._tick + 1) * self._tick_us
            self.run_to_us(next_us if next_us < limit_us else limit_us)  # noqa: FURB136 - faster
        return True

    def run_to_us(self, time_us: int) -> None:
        """Let time pass until a moment in microseconds; a past one changes nothing."""
        while (self._tick + 1) * self._tick_us <= time_us:
            self._tick += 1
            self._now_us = self._tick * self._tick_us
            self._step()
        self._now_us = max(time_us, self._now_us)
        for vehicle in self.vehicles:
            vehicle.now_us = self._now_us

    def _step(self) -> None:
        tick, now_us = self._tick, self._now_us
        acts = tick % self._action_ticks == 0
        for _, physics, _ in self._kinds:
            physics.step()
            if tick % self._sensor_ticks == 0:
                physics.step_sensors(now_us / 1e6)
            if acts:
                physics.step_batteries(1e-6 * ACTION_PERIOD_US)
        if self._collisions:
            self._meet()
        for rows, _, environment in self._kinds:
            if not environment.still:
                self._step_world(rows, environment)
        self._look(now_us)
        if tick % self._sensor_ticks == 0:
            self._step_receivers()
        for vehicle in self.vehicles:
            if acts or vehicle.wake_us <= now_us:
                vehicle.tick(now_us, acts)

    @property
    def positions_ned_m(self) -> NDArray[np.float64]:
        """The true positions of all vehicles in one frame, that of the world, shape (N, 3)."""
        return self._encounters.positions()

    def sightings(self, vehicle: int = 0) -> list[Sighting]:
        """The sightings of the mark by a vehicle's camera since the last call."""
        lookout = self._lookouts.get(vehicle)
        return [] if lookout is None else lookout.results(self._now_us)

    def _look(self, now_us: int) -> None:
        for lookout in self._lookouts.values():
            lookout.step(now_us)

    def _make_lookouts(self, seed: int) -> dict[int, Lookout]:
        mark, camera = self.world.mark, self.world.camera
        if mark is None:
            return {}
        return {
            row: Lookout(mark, camera, f"camera:{seed}:{row}", partial(environment.pose, lane))
            for rows, _, environment in self._kinds
            for lane, row in enumerate(rows)
        }

    def _meet(self) -> None:
        for meeting in self._encounters.step(self._tick):
            vehicle, other = self.vehicles[meeting.row], self.vehicles[meeting.other]
            rows, _, environment = next(one for one in self._kinds if meeting.row in one[0])
            environment.wreck(rows.index(meeting.row))
            vehicle.now_us = self._now_us
            vehicle.crash(f"vehicle {other.system_id}", meeting.speed_m_s)

    def _step_world(self, rows: Sequence[int], environment: Environment) -> None:
        for hit in environment.step(self._tick):
            vehicle = self.vehicles[rows[hit.lane]]
            vehicle.now_us = self._now_us
            vehicle.crash(hit.obstacle, hit.speed_m_s)

    def _step_receivers(self) -> None:
        for rows, _, environment in self._kinds:
            for lane, fix in environment.gps_changes(self.time_s):
                vehicle = self.vehicles[rows[lane]]
                vehicle.now_us = self._now_us
                vehicle.receive_gps(fix)
