"""A flight in real time that shows whether this computer is fast enough.

``python -m flight_rehearsal.computer_trial`` reads one JSON object: `vehicles`, for each one the
parameters of its server, and `seconds`. It writes a line of JSON with `left_s` now and then, at the
end one with `trial`, or with `error`. It ends when its input does.

The server's own driver, router, bridges and search thread fly; there is no ROS. The simulated
copters are on links in memory, which let simulated time pass when the driver looks at them: their
share of the processor delays the server as well, so that a computer is rather better than this.
"""

from __future__ import annotations

import json
import math
import os
import random
import resource
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import TextIO, TypeVar

import numpy as np

from flight_rehearsal.trial import Trial
from mavlink_sitl import (
    MoverPath,
    Obstacle,
    RangeSensor,
    Simulation,
    Underway,
    VehicleConfig,
    World,
)
from mavlink_vehicle.codec import Codec
from mavlink_vehicle.errors import VehicleError
from mavlink_vehicle.io.clock import Clock, MonotonicClock
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.links.link import ONLY_PEER, Peer
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.io.this_computer import ComputerReader
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge, Front
from navigation_bridge.configuration.known_obstacles import CylinderEntry, KnownObstacles
from navigation_bridge.configuration.make_config import (
    ConfigurationError,
    ServerConfig,
    make_config,
)
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.fleet import FleetApplication, Member
from navigation_bridge.goals.goal import GoalFinished
from navigation_bridge.goals.requests import NavigateRequest
from navigation_bridge.names import FRAME_MAP
from navigation_bridge.search_thread import SearchThread
from navigation_core.searches import IsWanted, Search

__all__ = ["COSTLY", "TrialError", "fly"]

ResultT = TypeVar("ResultT")
Values = Mapping[str, ParameterValue]

COSTLY = (
    "setpoint_rate_hz",
    "feedback_rate_hz",
    "position_rate_hz",
    "obstacle_map_size_m",
    "obstacle_cell_m",
)
"""Parameters that decide how much there is to do; others could forbid the flight."""
READY_TIMEOUT_S = 20.0
_LOAD_TIMEOUT_S = 30.0
_LOOK_S = 0.05
_REPORT_S = 2.0
_SETPOINT_NUMBERS = frozenset({84, 86})
"""SET_POSITION_TARGET_LOCAL_NED and SET_POSITION_TARGET_GLOBAL_INT"""
_CATCH_UP_TICKS = 5
_TICK_S = 0.01

# A wood of 100 m between start and goal: posts that the server knows, others that only the scanner
# sees, and some that move across, so that it plans again and again.
_SEED = 5
_KNOWN, _UNKNOWN, _MOVING = 200, 60, 5
_EAST_M, _NORTH_M = (6.0, 94.0), (-45.0, 45.0)
_RADIUS_M, _HEIGHT_M = 0.3, 40.0
_SPACING_M = 4.0
"""From middle to middle: a default vehicle and its clearance fit between any two"""
_SCANNER = RangeSensor(reach_m=10.0, noise_m=0.03)
_GOAL_ENU_M, _UP_M, _SPEED_M_S = (100.0, 0.0, 3.0), 3.0, 4.0


class TrialError(Exception):
    """The trial could not be flown; the text says why, for people."""


class _TimedBridge(Bridge):
    """A bridge that knows when its present turn was due.

    Attributes:
        due_s: the time; None in a turn that only receives or begins a goal.
    """

    due_s: float | None = None

    def next_deadline(self) -> float | None:
        """Begin a turn: the driver asks for this first."""
        self.due_s = None
        return super().next_deadline()

    def handle_timer(self, now: float) -> None:
        """Do what is due, and note since when."""
        self.due_s = super().next_deadline()
        super().handle_timer(now)


class _SimulatorLink:
    """A link to a simulated vehicle, whose time passes in `poll`."""

    description = "memory"
    note = None
    is_open = True

    def __init__(self, simulation: Simulation, bridge: _TimedBridge, clock: Clock) -> None:
        self._simulation, self._bridge, self._clock = simulation, bridge, clock
        self._began_s = clock.now()
        self.late_s = 0.0
        self.setpoints_late_s: list[float] = []

    @property
    def peers(self) -> tuple[Peer, ...]:
        """There is one."""
        return ONLY_PEER

    def filenos(self) -> tuple[int, ...]:
        """There is none; `poll` says when something comes."""
        return ()

    def poll(self, now: float) -> float:
        """Let simulated time pass, a few ticks at once at most."""
        passed_s = now - self._began_s
        simulation = self._simulation
        self.late_s = max(self.late_s, passed_s - simulation.time_s - _TICK_S)
        until_s = min(passed_s, simulation.time_s + _CATCH_UP_TICKS * _TICK_S)
        simulation.run_to_us(math.floor(until_s / _TICK_S) * round(_TICK_S * 1e6))
        return self._began_s + simulation.time_s + _TICK_S

    def receive(self) -> list[tuple[bytes, Peer]]:
        """Return what the vehicle has sent."""
        return [(data, None) for data in self._simulation.link.read_datagrams()]

    def send(self, data: bytes, peer: Peer = None) -> bool:
        """Send to the vehicle, and note how late setpoints are."""
        due_s = self._bridge.due_s
        if due_s is not None and int.from_bytes(data[7:10], "little") in _SETPOINT_NUMBERS:
            self.setpoints_late_s.append(max(self._clock.now() - due_s, 0.0))
        self._simulation.link.write(data)
        return True

    def close(self) -> None:
        """Nothing is open."""


class _Searches:
    """The server's search thread, with a stopwatch."""

    def __init__(self) -> None:
        self.thread = SearchThread()
        self.took_s: list[float] = []

    @property
    def lead_s(self) -> float:
        """That of the thread."""
        return self.thread.lead_s

    def begin(self, work: Callable[[IsWanted], ResultT]) -> Search[ResultT]:
        """Begin a search."""

        def timed(is_wanted: IsWanted) -> ResultT:
            began_s = time.monotonic()
            try:
                return work(is_wanted)
            finally:
                self.took_s.append(time.monotonic() - began_s)

        return self.thread.begin(timed)


class _Front(Front):
    """Drops what a node would publish, but for the end of the goal."""

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        self.ended = ""

    def put_out(self) -> None:
        while (output := self._bridge.next_output(recorded=False)) is not None:
            if isinstance(output, GoalFinished):
                self.ended = output.code.value

    def update(self, now: float) -> None:
        self.put_out()


def fly(
    vehicles: Sequence[Values], seconds: float, report: Callable[[float], None] = lambda _: None
) -> Trial:
    """Fly one simulated copter for each server through a wood, in real time.

    Args:
        vehicles: the parameters of each vehicle's server; those of `COSTLY` are used.
        seconds: how long.
        report: takes the seconds that are left, now and then.

    Raises:
        TrialError: the vehicles did not get ready, or rejected the goal.
    """
    places = _wood()
    try:
        configs = [_server_config(values, number, places) for number, values in enumerate(vehicles)]
    except ConfigurationError as error:
        raise TrialError(str(error)) from error
    clock, searches = MonotonicClock(), _Searches()
    searches.thread.warm_up()
    loaded = searches.thread.begin(lambda _: True)
    _wait(lambda: loaded.result() is True, _LOAD_TIMEOUT_S, "SciPy was not loaded")
    bridges = [_TimedBridge(Vehicle(own.vehicle), own.bridge, searches) for own in configs]
    links = [
        _SimulatorLink(_simulation(number, places), bridge, clock)
        for number, bridge in enumerate(bridges)
    ]
    fronts = [_Front(bridge) for bridge in bridges]
    for bridge, front in zip(bridges, fronts, strict=True):
        bridge.front = front
    members = [Member("", number, bridge) for number, bridge in enumerate(bridges, 1)]
    fleet = FleetApplication(members, clock)
    router = Router(links, lambda: Codec(1, 191), vehicles=len(links))
    driver = Driver(fleet, router, clock)
    fleet.attach(driver)
    driver.start()
    try:
        _wait(
            lambda: driver.call(lambda: all(bridge.pose is not None for bridge in bridges)),
            READY_TIMEOUT_S,
            "the simulated vehicles did not get ready",
        )
        for link in links:
            link.late_s = 0.0
        for number, (member, bridge) in enumerate(zip(members, bridges, strict=True), 1):
            member.call(partial(_begin, bridge, number, clock))
        reader, began_s, used_s = ComputerReader(), clock.now(), time.process_time()
        _let_fly(seconds, clock, report)
        flown_s, used_s = clock.now() - began_s, time.process_time() - used_s
        busy_cores = sum(reader.read().core_loads)
        ended = driver.call(lambda: next((front.ended for front in fronts if front.ended), ""))
    except VehicleError as error:
        raise TrialError(str(error)) from error
    finally:
        driver.stop()
        searches.thread.close()
    # The first one waits for its path, and nothing is late by that.
    late_ms = 1e3 * np.array([late_s for link in links for late_s in link.setpoints_late_s[1:]])
    if not len(late_ms):
        raise TrialError("no setpoints were sent")
    took_ms = 1e3 * np.array(searches.took_s or [0.0])
    return Trial(
        seconds=flown_s,
        vehicles=len(links),
        setpoint_rate_hz=1.0 / configs[0].bridge.setpoint_period_s,
        setpoints=len(late_ms),
        late_p50_ms=float(np.percentile(late_ms, 50.0)),
        late_p99_ms=float(np.percentile(late_ms, 99.0)),
        late_worst_ms=float(late_ms.max()),
        plans=len(searches.took_s),
        plan_p50_ms=float(np.percentile(took_ms, 50.0)),
        plan_worst_ms=float(took_ms.max()),
        simulator_late_s=max(link.late_s for link in links),
        processor_share=used_s / flown_s,
        others_cores=max(busy_cores - used_s / flown_s, 0.0),
        memory_bytes=1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
        ended=ended,
    )


def _begin(bridge: Bridge, number: int, clock: Clock) -> None:
    """Begin the goal; on the driver's thread."""
    now = clock.now()
    facing_travel = (0.0, 0.0, 0.0, 0.0)
    request = NavigateRequest(FRAME_MAP, _GOAL_ENU_M, facing_travel, True, _SPEED_M_S)
    rejection = bridge.goals.check(request, now)
    if rejection is not None:
        raise TrialError(f"the goal was rejected: {rejection.message}")
    bridge.goals.start(f"{number:032x}", request, now)


def _let_fly(seconds: float, clock: MonotonicClock, report: Callable[[float], None]) -> None:
    end_s = clock.now() + seconds
    while (left_s := end_s - clock.now()) > 0.0:
        report(left_s)
        threading.Event().wait(min(left_s, _REPORT_S))


def _wait(condition: Callable[[], bool], timeout_s: float, otherwise: str) -> None:
    end_s = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() >= end_s:
            raise TrialError(f"{otherwise} within {timeout_s:g} s")
        threading.Event().wait(_LOOK_S)


def _wood() -> list[tuple[float, float]]:
    """Return the places of the posts, east and north of the start; the known ones first."""
    chance = random.Random(_SEED)
    places: list[tuple[float, float]] = []
    while len(places) < _KNOWN + _UNKNOWN:
        place = (chance.uniform(*_EAST_M), chance.uniform(*_NORTH_M))
        if all(math.dist(place, other) >= _SPACING_M for other in places):
            places.append(place)
    # The first ones found the most room; the unknown ones are to be everywhere.
    chance.shuffle(places)
    return places


def _server_config(
    values: Values, number: int, places: Sequence[tuple[float, float]]
) -> ServerConfig:
    """Return the settings of one server: the costly ones as given, and the known posts."""
    costly = {name: values[name] for name in COSTLY if name in values}
    config = make_config(
        {**costly, "arming": "auto", "battery_policy": "ignore", "separation": "disabled",
         "target_system": number + 1}
    )  # fmt: skip
    posts = [
        CylinderEntry(name="", at_m=place, radius_m=_RADIUS_M, bottom_m=0.0, height_m=_HEIGHT_M)
        for place in places[:_KNOWN]
    ]
    obstacles = replace(config.bridge.obstacles, known=KnownObstacles(items=tuple(posts)))
    return replace(config, bridge=replace(config.bridge, obstacles=obstacles))


def _simulation(number: int, places: Sequence[tuple[float, float]]) -> Simulation:
    """Return a copter in the air before the wood."""
    posts = [
        Obstacle(f"post {index}", (north, east), radius_m=_RADIUS_M, top_m=_HEIGHT_M)
        for index, (east, north) in enumerate(places)
    ]
    walkers = []
    for index in range(_MOVING):
        east = _EAST_M[0] + (index + 1) * (_EAST_M[1] - _EAST_M[0]) / (_MOVING + 1)
        path = MoverPath(((-10.0, east), (10.0, east)), 0.3 + 0.02 * index)
        walkers.append(
            Obstacle(f"walker {index}", (-10.0, east), radius_m=0.5, top_m=_HEIGHT_M, path=path)
        )
    vehicle = VehicleConfig(
        system_id=number + 1, ready_after_s=0.0, underway=Underway((0.0, 0.0, -_UP_M))
    )
    world = World(name="wood", obstacles=(*posts, *walkers), range_sensor=_SCANNER)
    return Simulation([vehicle], seed=_SEED, world=world, tick_s=_TICK_S)


def _end_with(lines: TextIO) -> None:
    """End when the program that wants the result does."""
    while lines.readline():
        pass
    os._exit(1)


def main() -> int:
    """Fly the trial that the input describes."""
    asked = json.loads(sys.stdin.readline())
    threading.Thread(target=_end_with, args=(sys.stdin,), daemon=True).start()
    code = 0
    try:
        trial = fly(asked["vehicles"], asked["seconds"], lambda left_s: _write(left_s=left_s))
        _write(trial=asdict(trial))
    except TrialError as error:
        _write(error=str(error))
        code = 1
    sys.stdout.flush()
    os._exit(code)  # a search may still be under way


def _write(**values: object) -> None:
    print(json.dumps(values), flush=True)


if __name__ == "__main__":
    sys.exit(main())
