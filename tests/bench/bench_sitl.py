"""Speed and size of the simulated autopilots, and their growth with the number of vehicles.

Each measurement is a process of its own, so that memory and caches are its own. ArduPilot's
copter has the usual streams, PX4's has those that it sends unasked; of many, each has
HEARTBEAT at 1 Hz and four streams at 4 Hz. All fly. The reference of a speed is pymavlink
doing nothing but packing the same messages, in the same process right after. Times are
processor time of one core. The real ArduCopter simulator was seen to reach 105 x with all of
a core.
"""

from __future__ import annotations

import itertools
import json
import math
import random
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib as mpl
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, Truth, VehicleConfig
from tests.bench.limits import run_module
from tests.bench.rows import row
from tests.support.messages.random_messages import CLASSES, STRANGE_FLOATS, random_message

ROOT = Path(__file__).resolve().parents[2]
PLOT, SHORT_PLOT = ROOT / "out" / "sitl_growth.png", ROOT / "out" / "sitl_growth_short.png"
ARDUPILOT_GOAL, PX4_GOAL, MANY_GOAL, MEMORY_GOAL_MB = 300.0, 150.0, 1.0, 200.0
LOCKSTEP_GOAL = 300.0
LONG_TICK_S, USUAL_TICK_S = 0.05, 0.01
FUZZ_GOAL = 0.2
"""Of pymavlink's parser alone, which acts on nothing"""
COUNTS, SHORT_COUNTS = (1, 2, 5, 10, 30, 100, 300, 1000), (1, 2)
USUAL_STREAMS = (1, 24, 30, 32, 33, 36, 65, 74, 147, 193, 245)
FOUR_STREAMS = (1, 30, 33, 147)
STREAMS = {"usual": USUAL_STREAMS, "four": FOUR_STREAMS, "own": ()}
RATE_HZ = 4.0
WINDOW_S = 0.1
FUZZ_FRAMES, SHORT_FUZZ_FRAMES = 1_000_000, 10_000
PARSED_FRAMES = 100_000
ROUNDS, SHORT_ROUNDS = 5, 1
_PACKED_FOR_S = 0.1
"""For at least so long, as some systems count processor time in steps of 10 ms"""
PACKING = "pymavlink packing the same messages"
_CPU_ONE_S, _CPU_EACH_MORE_S = 100.0, 1.0


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """One of each firmware, a thousand, what lies between, and a million hostile frames."""
    run = partial(_in_a_process, short=short)
    counts = SHORT_COUNTS if short else COUNTS
    title = "Simulated ArduPilot copter with usual streams"
    yield _speed(title, run("ardupilot", 1, "usual"), ARDUPILOT_GOAL)
    lockstep = run("ardupilot", 1, "lockstep")
    yield row(
        f"A test that reads the truth at each tick of {LONG_TICK_S:g} s, times real time",
        (lockstep["speed"], "x"),
        (f"ticks of {USUAL_TICK_S:g} s", lockstep["reference"]),
        f">= {LOCKSTEP_GOAL:g} x",
    )
    yield _speed("Simulated PX4 copter with its own streams", run("px4", 1, "own"), PX4_GOAL)
    found = {count: run("ardupilot", count, "four") for count in counts}
    _plot(found, SHORT_PLOT if short else PLOT)
    alone, many, most = found[1], found[counts[-1]], f"{COUNTS[-1]:,}"
    each_ms, alone_ms = 1e3 / many["speed"] / counts[-1], 1e3 / alone["speed"]
    yield _speed(f"{most} copters with four streams at 4 Hz", many, MANY_GOAL)
    yield row(
        f"Memory of {most} copters",
        (many["memory_mb"], "MB"),
        ("one copter", alone["memory_mb"]),
        f"< {MEMORY_GOAL_MB:g} MB",
    )
    yield row(
        f"Processor time of each of {most} copters per simulated second",
        (each_ms, "ms"),
        ("one copter alone", alone_ms),
        "< 1 x",
    )
    rate, parsed = _fuzz(SHORT_FUZZ_FRAMES if short else FUZZ_FRAMES)
    yield row(
        f"Hostile frames per second into a copter that answers after {FUZZ_FRAMES:,}",
        (rate, "1/s"),
        ("pymavlink parsing the same", parsed),
        f">= {FUZZ_GOAL:g} x",
    )


def _speed(name: str, found: dict[str, float], goal: float) -> dict[str, Any]:
    value, reference = (found["speed"], "x"), (PACKING, found["packing_speed"])
    title = f"{name}, times real time"
    return row(title, value, reference, f">= {goal:g} x")


def _in_a_process(autopilot: str, count: int, streams: str, short: bool) -> dict[str, float]:
    """The best of a few rounds: what disturbs only makes it slower."""
    words = [autopilot, str(count), streams, *(["short"] if short else [])]
    return run_module("tests.bench.bench_sitl", words, _CPU_ONE_S + _CPU_EACH_MORE_S * count)


def fly(autopilot: str, count: int, streams: str, short: bool) -> dict[str, float]:
    """Speed and memory of a number of copters in this process, and pymavlink's speed."""
    rounds = SHORT_ROUNDS if short else ROUNDS
    simulation = Simulation([VehicleConfig(autopilot=autopilot) for _ in range(count)], seed=1)
    simulation.run_for(10.0 if autopilot == "px4" else 4.0)
    for vehicle in simulation.vehicles:
        for command, *params in _orders(autopilot, STREAMS[streams]):
            values = [*params, *[0.0] * (7 - len(params))]
            message = mav.MAVLink_command_long_message(vehicle.system_id, 1, command, 0, *values)
            vehicle.link.write(bytes(message.pack(mav.MAVLink(None, 255, 190))))
        vehicle.link.read()
    _pass(simulation, 5.0)
    seconds = min(max(300.0 / count, 1.0), 30.0)
    speeds, sent = [], []
    for _ in range(rounds):
        begin_s = time.process_time()
        sent = _pass(simulation, seconds)
        speeds.append(seconds / (time.process_time() - begin_s))
        if len(sent) < count * seconds * (1.0 + 4 * RATE_HZ) * 0.9:
            raise RuntimeError(f"only {len(sent)} frames of {count} copters in {seconds} s")
    if not (simulation.truth.position_ned_m[:, 2] < -1.0).all():
        raise RuntimeError("not all copters fly")
    memory_mb = _peak_memory_mb()
    packing = seconds / min(_packing_s(sent) for _ in range(rounds))
    return {"speed": max(speeds), "packing_speed": packing, "memory_mb": memory_mb}


def fly_in_lockstep(short: bool) -> dict[str, float]:
    """Speed of a test that reads the truth at each tick, with long and with usual ticks."""
    count = SHORT_ROUNDS if short else 2 * ROUNDS
    rounds = [(_lockstep(LONG_TICK_S), _lockstep(USUAL_TICK_S)) for _ in range(count)]
    speed, reference = map(max, zip(*rounds, strict=True))
    return {"speed": speed, "reference": reference, "memory_mb": _peak_memory_mb()}


def _lockstep(tick_s: float) -> float:
    """10 m up, 40 m north, and down; returns simulated seconds per second of the processor."""
    simulation = Simulation(seed=1, tick_s=tick_s)
    simulation.run_for(3.0)
    ground = mav.MAVLink(simulation.link, srcSystem=255, srcComponent=190)
    from_s, begin_s = simulation.time_s, time.process_time()
    for command, *params in _orders("ardupilot", ()):
        ground.command_long_send(1, 1, int(command), 0, *params, *[0.0] * (7 - len(params)))
    _wait(simulation, lambda truth: truth.position_ned_m[0, 2] < -9.5)
    target = (40.0, 0.0, -10.0, *[0.0] * 8)
    ground.set_position_target_local_ned_send(0, 1, 1, mav.MAV_FRAME_LOCAL_NED, 0xDF8, *target)
    _wait(simulation, lambda truth: truth.position_ned_m[0, 0] > 39.0)
    ground.command_long_send(1, 1, mav.MAV_CMD_NAV_LAND, 0, *[0.0] * 7)
    _wait(simulation, lambda truth: truth.on_ground[0])
    return (simulation.time_s - from_s) / (time.process_time() - begin_s)


def _wait(simulation: Simulation, condition: Callable[[Truth], Any]) -> None:
    if not simulation.run_until(lambda: bool(condition(simulation.truth)), 60.0):
        raise RuntimeError("the copter of the test does not fly")


def _orders(autopilot: str, streams: tuple[int, ...]) -> list[tuple[float, ...]]:
    """Commands and parameters: streams, and up."""
    if autopilot == "px4":
        nowhere = (math.nan,) * 4
        return [(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, *nowhere), (mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)]
    return [
        *((mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / RATE_HZ) for message_id in streams),
        (mav.MAV_CMD_DO_SET_MODE, 1, 4),
        (mav.MAV_CMD_COMPONENT_ARM_DISARM, 1),
        (mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 10),
    ]


def _pass(simulation: Simulation, seconds: float) -> list[bytes]:
    """Let time pass as a program does that reads its links; returns the frames."""
    sent: list[bytes] = []
    for _ in range(round(seconds / WINDOW_S)):
        simulation.run_for(WINDOW_S)
        for vehicle in simulation.vehicles:
            sent += vehicle.link.read_datagrams()
    return sent


def _packing_s(sent: list[bytes]) -> float:
    """Processor time in which pymavlink packs the same messages again."""
    reader, writer = mav.MAVLink(None), mav.MAVLink(None, 1, 1)
    messages = [reader.decode(bytearray(frame)) for frame in sent]
    begin_s, spent_s, times = time.process_time(), 0.0, 0
    while spent_s < _PACKED_FOR_S:
        for message in messages:
            message.pack(writer)
        times += 1
        spent_s = time.process_time() - begin_s
    return spent_s / times


def _peak_memory_mb() -> float:
    status = Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return float(line.split()[1]) / 1024.0


def _hostile_frames(seed: int) -> Iterator[bytes]:
    """Yield without end: messages of any content, of which two of three are cut or bent."""
    rng = random.Random(seed)
    kinds = [kind for kind in CLASSES if kind.id != mav.MAVLINK_MSG_ID_SETUP_SIGNING]
    sender = mav.MAVLink(None, srcSystem=255)
    for number in itertools.count():
        message = random_message(rng.choice(kinds), number, STRANGE_FLOATS)
        frame = bytearray(message.pack(sender))
        if number % 3 == 1:
            frame = frame[: rng.randrange(len(frame))]
        elif number % 3:
            frame[rng.randrange(len(frame))] = rng.randrange(256)
        yield bytes(frame)


def _fuzz(count: int) -> tuple[float, float]:
    """Hostile frames per second into a copter that answers after them, and into pymavlink."""
    simulation = Simulation([VehicleConfig(ready_after_s=1.0)], seed=1)
    simulation.run_for(3.0)
    spent_s = 0.0
    hostile = itertools.islice(_hostile_frames(1), count)
    while batch := list(itertools.islice(hostile, 100)):
        begin_s = time.process_time()
        for frame in batch:
            simulation.link.write(frame)
        simulation.run_for(0.01)
        simulation.link.read()
        spent_s += time.process_time() - begin_s
    simulation.link.silent = simulation.link.mute = False
    simulation.link.set_faults(None)
    simulation.run_for(5.0)
    if not simulation.link.read_datagrams():
        raise RuntimeError("the copter does not answer after the hostile frames")
    return count / spent_s, _parsed_per_s(min(count, PARSED_FRAMES))


def _parsed_per_s(count: int) -> float:
    parser = mav.MAVLink(None)
    parser.robust_parsing = True
    hostile = list(itertools.islice(_hostile_frames(1), count))
    begin_s = time.process_time()
    for frame in hostile:
        parser.parse_buffer(frame)
    return count / (time.process_time() - begin_s)


def _plot(found: dict[int, dict[str, float]], file: Path) -> None:
    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415 after the choice of the backend

    counts = list(found)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    left.loglog(counts, [1e3 / found[n]["speed"] for n in counts], "o-", label="all vehicles")
    left.loglog(counts, [1e3 / found[n]["speed"] / n for n in counts], "s-", label="each")
    left.axhline(1e3, color="grey", linestyle="--", label="real time")
    left.set(xlabel="copters", ylabel="processor time per simulated second, ms")
    left.legend(loc="center right")
    right.semilogx(counts, [found[n]["memory_mb"] for n in counts], "o-")
    right.axhline(MEMORY_GOAL_MB, color="grey", linestyle="--")
    right.set(xlabel="copters", ylabel="peak memory, MB", ylim=(0.0, None))
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    kind, vehicles, what, shortly = sys.argv[1], int(sys.argv[2]), sys.argv[3], len(sys.argv) > 4
    if what == "lockstep":
        measured = fly_in_lockstep(shortly)
    else:
        measured = fly(kind, vehicles, what, shortly)
    print(json.dumps(measured))
