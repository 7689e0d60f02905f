"""The demo, whose server is stopped and continued at random times: SIGSTOP, SIGCONT.

`python -m tests.support.ros.stopped_demo --runs 10 --autopilot px4` flies it ten times and says, of
each, how near the vehicle truly came to an obstacle. It ends with 1 if one was hit, or approached
nearer than the vehicle's radius. Whether the goals succeed is another matter: a PX4 gives OFFBOARD
up when no setpoint has come for a second, and that ends a goal.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import psutil

from drone_navigation.demo import RADIUS_M
from tests.support.processes import Process

STOPPED_S = (0.3, 2.0)
BETWEEN_S = (1.0, 8.0)
TIMEOUT_S = 240.0


@dataclass(frozen=True)
class StoppedDemo:
    """The result of one demo.

    Attributes:
        stops: how often the server was stopped.
        least_clearance_m: by the simulator's truth.
        obstacle: the nearest.
        collided: whether the vehicle flew into something.
        text: what the demo printed.
    """

    stops: int
    least_clearance_m: float
    obstacle: str
    collided: bool
    text: str

    @property
    def is_sound(self) -> bool:
        """Whether nothing was hit, or nearly."""
        return not self.collided and self.least_clearance_m >= RADIUS_M


def fly(out: Path, autopilot: str, seed: int, vehicle: str = "copter") -> StoppedDemo:
    """Run the demo, and stop its server again and again.

    Raises:
        AssertionError: the demo did not end, or its server was never found.
    """
    chance, pause = random.Random(seed), threading.Event()
    words = ["python", "-m", "drone_navigation.demo", "--out", str(out)]
    demo = Process("demo", [*words, "--vehicle", vehicle, "--autopilot", autopilot])
    stops, deadline_s = 0, time.monotonic() + TIMEOUT_S
    try:
        while demo.returncode is None:
            assert time.monotonic() < deadline_s, f"the demo did not end: {demo.text}"
            pause.wait(chance.uniform(*BETWEEN_S))
            stops += _stop_server(demo.pid, chance.uniform(*STOPPED_S), pause)
    finally:
        demo.stop()
    summary = json.loads((out / "simulator.json").read_text(encoding="utf-8"))
    (vehicle_summary,) = summary["vehicles"]
    return StoppedDemo(
        stops,
        vehicle_summary["least_clearance_m"],
        vehicle_summary["nearest_obstacle"],
        vehicle_summary["collided"],
        demo.text,
    )


def _stop_server(demo_pid: int, seconds: float, pause: threading.Event) -> int:
    """Stop the server of a demo for a while; 0 if it is not there."""
    try:
        children = psutil.Process(demo_pid).children(recursive=True)
        servers = [c for c in children if "drone_navigation.navigation_server" in c.cmdline()]
    except psutil.Error:
        return 0
    if len(servers) != 1:
        return 0
    (server,) = servers
    try:
        os.kill(server.pid, signal.SIGSTOP)
        pause.wait(seconds)
    except ProcessLookupError:
        return 0
    finally:
        if server.is_running():
            os.kill(server.pid, signal.SIGCONT)
    return 1


def main() -> int:
    """Fly it several times."""
    parser = argparse.ArgumentParser(description="Fly the demo with a server that is stopped.")
    parser.add_argument("--runs", type=int, default=10, help="number of flights (default: 10)")
    parser.add_argument("--autopilot", choices=("ardupilot", "px4"), default="ardupilot")
    parser.add_argument("--vehicle", choices=("copter", "rover"), default="copter")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first flight")
    parser.add_argument("--out", type=Path, default=Path("out/stopped"), metavar="DIR")
    options = parser.parse_args()
    sound = True
    for seed in range(options.seed, options.seed + options.runs):
        flown = fly(options.out / str(seed), options.autopilot, seed, options.vehicle)
        sound = sound and flown.is_sound
        print(
            f"{options.autopilot} {seed}: stopped {flown.stops} times, "
            f"{flown.least_clearance_m:.2f} m to '{flown.obstacle}'"
            f"{', HIT' if flown.collided else ''}",
            flush=True,
        )
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
