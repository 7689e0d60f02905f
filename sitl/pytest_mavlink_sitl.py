"""Fixtures for tests of programs that talk to an autopilot (pytest finds them by itself).

A module of its own beside the package, and nothing is imported before a fixture is used: it
adds no option, marker or hook, and costs nothing in a session that doesn't ask for it.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

if TYPE_CHECKING:
    from mavlink_sitl import Simulation

__all__ = ["SitlOnUdp", "simulator_process"]

READY_LIMIT_S = 60.0
"""Simulated seconds until a vehicle must know its position"""
STOP_LIMIT_S = 10.0


@pytest.fixture
def sitl_seed() -> int:
    """Seed of all simulations of a test; override it in a conftest or a test module."""
    return 1


@pytest.fixture
def sitl_world() -> Any:
    """World of all simulations of a test, a `World` or a path; override it. A plain here."""
    return None


@pytest.fixture
def sitl_tick_s() -> float:
    """Tick of all simulations of a test, s; 0.05 is twice as fast and less exact. Override it."""
    return 0.01


@pytest.fixture
def sitl_simulation(
    sitl_seed: int, sitl_world: Any, sitl_tick_s: float
) -> Callable[..., Simulation]:
    """Makes simulations: `sitl_simulation(vehicles=..., world=..., seed=...)`.

    The arguments are those of `mavlink_sitl.Simulation`; seed, world and tick have the fixtures
    `sitl_seed`, `sitl_world` and `sitl_tick_s` for defaults. The vehicles have just been switched
    on.
    """
    from mavlink_sitl import Simulation  # noqa: PLC0415 not before somebody asks for it

    def make(**arguments: Any) -> Simulation:
        defaults = {"seed": sitl_seed, "world": sitl_world, "tick_s": sitl_tick_s}
        return Simulation(**{**defaults, **arguments})

    return make


def _ready(make: Callable[..., Simulation], **settings: Any) -> Simulation:
    from mavlink_sitl import VehicleConfig  # noqa: PLC0415

    simulation = make(vehicles=[VehicleConfig(**settings)])
    firmware = simulation.vehicles[0].firmware
    known = simulation.run_until(lambda: firmware.estimator.position_ok, READY_LIMIT_S)
    assert known, "the simulated vehicle has no position"
    simulation.run_for(1.0)
    simulation.link.read()
    return simulation


@pytest.fixture
def sitl_copter(sitl_simulation: Callable[..., Simulation]) -> Simulation:
    """A copter with ArduPilot that stands on the ground and may be armed."""
    return _ready(sitl_simulation)


@pytest.fixture
def sitl_px4_copter(sitl_simulation: Callable[..., Simulation]) -> Simulation:
    """The same with PX4."""
    return _ready(sitl_simulation, autopilot="px4")


@pytest.fixture
def sitl_rover(sitl_simulation: Callable[..., Simulation]) -> Simulation:
    """A rover with ArduPilot."""
    return _ready(sitl_simulation, vehicle="rover")


@pytest.fixture
def sitl_boat(sitl_simulation: Callable[..., Simulation]) -> Simulation:
    """A boat with ArduPilot."""
    return _ready(sitl_simulation, vehicle="boat")


@pytest.fixture
def sitl_plane(sitl_simulation: Callable[..., Simulation]) -> Simulation:
    """A plane with ArduPilot."""
    return _ready(sitl_simulation, vehicle="plane")


def _free_udp_port() -> int:
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def simulator_process(*options: str) -> Iterator[int]:
    """Run the program, for a client that wants a vehicle in another process and in real time.

    Args:
        options: of `mavlink-sitl`, without its link.

    Yields:
        The UDP port of 127.0.0.1 that it sends to, where the client is to listen.
    """
    port = _free_udp_port()
    link = f"udpout:127.0.0.1:{port}"
    process = subprocess.Popen(
        [sys.executable, "-m", "mavlink_sitl", "--link", link, *options],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        stdout=subprocess.DEVNULL,
    )
    try:
        yield port
    finally:
        process.kill()
        process.wait()


class SitlOnUdp(NamedTuple):
    """A copter that sends to a UDP port in real time, times a factor.

    Attributes:
        simulation: it; only look at it, since it moves in a thread of its own.
        port: of 127.0.0.1, where the program under test is to listen.
    """

    simulation: Simulation
    port: int


@pytest.fixture
def sitl_udp_copter(sitl_copter: Simulation) -> Iterator[SitlOnUdp]:
    """For programs that want a socket: `sitl_copter`, sending to a free UDP port, 10 x."""
    from mavlink_sitl.links.addresses import parse_address  # noqa: PLC0415
    from mavlink_sitl.wall_clock_link import Runner  # noqa: PLC0415

    port = _free_udp_port()
    address = parse_address(f"udpout://127.0.0.1:{port}")
    runner = Runner(sitl_copter, [address], 10.0, lambda: None)
    thread = threading.Thread(target=runner.run, name="mavlink_sitl", daemon=True)
    thread.start()
    try:
        yield SitlOnUdp(sitl_copter, port)
    finally:
        runner.stop()
        thread.join(STOP_LIMIT_S)
        assert not thread.is_alive(), "the simulated vehicle does not stop"
        runner.close()
