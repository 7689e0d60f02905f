"""How fast the simulated autopilot is, how large, and how it grows with the vehicles.

Each measurement is a process of its own, so that memory and caches are its own. One copter
has the usual streams; of many, each has HEARTBEAT at 1 Hz and four streams at 4 Hz. All fly.
The reference of the speed is what the real ArduCopter's simulator was seen to reach with all
of a core. Times are processor time of one core.
"""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import matplotlib as mpl
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from tests.support.hostile_frames import frames

ROOT = Path(__file__).resolve().parents[2]
PLOT = ROOT / "out" / "sitl_growth.png"
ARDUCOPTER_SITL = 105.0
ONE_GOAL, MANY_GOAL, MEMORY_GOAL_MB = 200.0, 1.0, 600.0
COUNTS = (1, 2, 5, 10, 30, 100, 300, 1000)
USUAL_STREAMS = (1, 24, 30, 32, 33, 36, 65, 74, 147, 193, 245)
FOUR_STREAMS = (1, 30, 33, 147)
RATE_HZ = 4.0
WINDOW_S = 0.1
FUZZ_FRAMES = 1_000_000
ROUNDS = 3


def measures() -> list[dict[str, Any]]:
    """One, a thousand, what lies between, and a million hostile frames."""
    found = {count: _in_a_process(count) for count in COUNTS}
    _plot(found)
    one, many = found[1], found[COUNTS[-1]]
    fuzzed_s = _fuzz(FUZZ_FRAMES)
    return [
        _row("Simulated copter with usual streams, times real time", one["speed"], ONE_GOAL)
        | {
            "reference": "real ArduCopter SITL",
            "reference_value": ARDUCOPTER_SITL,
            "ratio": one["speed"] / ARDUCOPTER_SITL,
        },
        _row("1,000 copters with four streams at 4 Hz, times real time", many["speed"], MANY_GOAL),
        {
            **_row("Memory of 1,000 copters", many["memory_mb"], MEMORY_GOAL_MB),
            "unit": "MB",
            "goal": f"< {MEMORY_GOAL_MB:g} MB",
            "met": many["memory_mb"] < MEMORY_GOAL_MB,
        },
        {
            **_row("Cost of each of 1,000 copters over the cost of one alone", 0.0, 0.0),
            "value": one["speed"] / many["speed"] / COUNTS[-1],
            "goal": "< 1 x",
            "met": one["speed"] / many["speed"] < COUNTS[-1],
        },
        {
            **_row("Hostile frames per second into a copter", 0.0, 0.0),
            "value": FUZZ_FRAMES / fuzzed_s,
            "unit": "1/s",
            "goal": "1,000,000 survived",
            "met": True,
        },
    ]


def _row(name: str, value: float, goal: float) -> dict[str, Any]:
    return {
        "name": name,
        "value": value,
        "unit": "x",
        "reference": "",
        "reference_value": None,
        "ratio": None,
        "goal": f">= {goal:g} x",
        "met": value >= goal,
    }


def _in_a_process(count: int) -> dict[str, float]:
    """The best of a few rounds: what disturbs only makes it slower."""
    command = [sys.executable, "-m", "tests.bench.bench_sitl", str(count)]
    done = subprocess.run(
        command, cwd=ROOT, check=True, timeout=300.0, capture_output=True, text=True
    )
    return dict(json.loads(done.stdout))


def fly(count: int) -> dict[str, float]:
    """Speed and memory of a number of copters in this process."""
    simulation = Simulation([VehicleConfig() for _ in range(count)], seed=1)
    simulation.run_for(4.0)
    out = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    for vehicle in simulation.vehicles:

        def tell(command: int, *params: float, vehicle: Any = vehicle) -> None:
            values = [*params, *[0.0] * (7 - len(params))]
            message = mav.MAVLink_command_long_message(vehicle.system_id, 1, command, 0, *values)
            vehicle.link.write(bytes(message.pack(out)))

        for message_id in USUAL_STREAMS if count == 1 else FOUR_STREAMS:
            tell(mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / RATE_HZ)
        tell(mav.MAV_CMD_DO_SET_MODE, 1, 4)
        tell(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        tell(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 10)
        vehicle.link.read()
    _pass(simulation, 2.0)
    seconds = min(max(300.0 / count, 2.0), 60.0)
    speeds = []
    for _ in range(ROUNDS):
        begin_s = time.process_time()
        frame_count = _pass(simulation, seconds)
        speeds.append(seconds / (time.process_time() - begin_s))
        if frame_count < count * seconds * (1.0 + 4 * RATE_HZ) * 0.9:
            raise RuntimeError(f"only {frame_count} frames of {count} copters in {seconds} s")
    if not (simulation.truth.position_ned_m[:, 2] < -1.0).all():
        raise RuntimeError("not all copters fly")
    return {"speed": max(speeds), "memory_mb": _peak_memory_mb()}


def _pass(simulation: Simulation, seconds: float) -> int:
    """Let time pass as a program does that reads its links; returns the number of frames."""
    count = 0
    for _ in range(round(seconds / WINDOW_S)):
        simulation.run_for(WINDOW_S)
        count += sum(len(vehicle.link.read_datagrams()) for vehicle in simulation.vehicles)
    return count


def _peak_memory_mb() -> float:
    status = Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return float(line.split()[1]) / 1024.0


def _fuzz(count: int) -> float:
    """Seconds that so many hostile frames take; fails if the vehicle does not survive them."""
    simulation = Simulation([VehicleConfig(ready_after_s=1.0)], seed=1)
    simulation.run_for(3.0)
    begin_s = time.process_time()
    for number, frame in enumerate(itertools.islice(frames(1), count)):
        simulation.link.write(frame)
        if number % 100 == 0:
            simulation.run_for(0.01)
            simulation.link.read()
    spent_s = time.process_time() - begin_s
    simulation.link.silent = simulation.link.mute = False
    simulation.link.set_faults(None)
    simulation.run_for(5.0)
    if not simulation.link.read_datagrams():
        raise RuntimeError("the vehicle has fallen silent")
    return spent_s


def _plot(found: dict[int, dict[str, float]]) -> None:
    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415 after the choice of the backend

    counts = list(found)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    left.loglog(counts, [1e3 / found[n]["speed"] for n in counts], "o-", label="all vehicles")
    left.loglog(counts, [1e3 / found[n]["speed"] / n for n in counts], "s-", label="each")
    left.axhline(1e3, color="grey", linestyle="--", label="real time")
    left.set(xlabel="copters", ylabel="processor time per simulated second, ms")
    left.legend()
    right.semilogx(counts, [found[n]["memory_mb"] for n in counts], "o-")
    right.axhline(MEMORY_GOAL_MB, color="grey", linestyle="--")
    right.set(xlabel="copters", ylabel="peak memory, MB", ylim=(0.0, None))
    PLOT.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(PLOT, dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    print(json.dumps(fly(int(sys.argv[1]))))
