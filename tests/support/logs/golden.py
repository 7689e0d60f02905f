"""Results of a replayed recording, in numbers and words that can be kept and compared."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mavlink_vehicle.codec import Codec, mavlink
from mavlink_vehicle.io.tlog import TlogReader
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.goals.goal import (
    Annotation,
    GoalFeedback,
    GoalFinished,
    GoalHappened,
    LogLine,
    Output,
    PlanChanged,
)
from navigation_bridge.recording.noted_outputs import NotedOutputs
from navigation_bridge.recording.replay import Player

MAY_DIFFER = {
    "messages": "how many messages are known depends on the dialect of the installed pymavlink",
    "unknown_messages": "the same",
}
"""Fields of a golden file that are kept for people and not compared, each with its reason."""

TOLERANCE = 0.02
"""Of numbers (s, m, V): the last digit may be rounded the other way on another machine."""

_SAMPLES = 20
_FEEDBACK_EVERY_S = 2.0


def systems_of(path: Path) -> list[int]:
    """Return the systems of the autopilots that are heard in a recording."""
    codec, found = Codec(255, 190), dict[int, None]()
    for _, packet in TlogReader(path):
        for message in codec.decode(packet):
            if (
                message.get_type() == "HEARTBEAT"
                and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
                and message.get_srcComponent() == 1
            ):
                found[message.get_srcSystem()] = None
    return sorted(found)


def golden_of(path: Path) -> dict[str, Any]:
    """Play a recording to a bridge for each vehicle in it; returns what JSON can hold."""
    told: dict[str, Any] = {}
    vehicles = {}
    for system in systems_of(path) or [0]:
        player, vehicles[str(system)] = _play(path, system)
        told = {
            "messages": player.codec.statistics.frames,
            "unknown_messages": player.codec.statistics.unknown,
            "bad_checksums": player.codec.statistics.bad_crc,
            "duration_s": round(player.now, 2),
            "clock_set_back": player.time.stepped_back,
        }
    return {**told, "vehicles": vehicles}


def _play(path: Path, system: int) -> tuple[Player, dict[str, Any]]:
    config = make_config({"target_system": system})
    bridge = Bridge(Vehicle(config.vehicle), config.bridge)
    noted = NotedOutputs(bridge)
    player = Player(TlogReader(path), bridge, Codec(1, 191))
    stamps = [time_s for time_s, _ in TlogReader(path)]
    every_s = max(stamps[-1] - stamps[0], 1.0) / _SAMPLES if stamps else math.inf
    outputs: list[list[Any]] = []
    states: list[dict[str, Any]] = []
    feedback_s = -math.inf
    while not player.ended:
        for played in player.step():
            if played.message is not None and played.is_note:
                told = noted.take(played.message, played.now)
                if played.message.get_srcSystem() != system:
                    continue
            else:
                told = []
            for output in (*told, *_outputs(bridge)):
                if isinstance(output, GoalFeedback):
                    if player.now - feedback_s < _FEEDBACK_EVERY_S:
                        continue
                    feedback_s = player.now
                if (words := _words(output)) is not None:
                    outputs.append([round(played.now, 2), type(output).__name__, *words])
        if player.now >= len(states) * every_s or player.ended:
            states.append(_state(bridge, player.now))
    profile = bridge.vehicle.profile
    return player, {
        "vehicle": None if profile is None else profile.name,
        "outputs": outputs,
        "states": states,
    }


def _outputs(bridge: Bridge) -> Iterator[Output]:
    while (output := bridge.next_output()) is not None:
        yield output


def _words(output: Output) -> list[Any] | None:
    if isinstance(output, Annotation):
        return None
    if isinstance(output, LogLine):
        return [output.level.value, output.text]
    if isinstance(output, GoalHappened):
        return [output.goal_id, output.event, output.what, output.message]
    if isinstance(output, GoalFinished):
        return [output.goal_id, output.state.value, output.code.value, _number(output.elapsed_s)]
    if isinstance(output, PlanChanged):
        return [len(output.path_enu_m), *(_place(point) for point in output.path_enu_m[-1:])]
    if isinstance(output, GoalFeedback):
        left = (output.distance_remaining_m, output.time_remaining_s)
        return [output.status.value, *map(_number, left), output.replans]
    return [str(output)]


def _state(bridge: Bridge, now: float) -> dict[str, Any]:
    vehicle, pose = bridge.vehicle, bridge.pose
    state, battery = vehicle.state, vehicle.state.battery
    return {
        "time_s": round(now, 2),
        "connected": vehicle.heartbeats.alive,
        "mode": vehicle.mode_name,
        "armed": state.armed,
        "landed": state.landed_state.name,
        "position_valid": state.position_valid,
        "failsafe": None if state.failsafe is None else state.failsafe.kind.value,
        "battery": None
        if battery is None
        else [_number(battery.remaining), _number(battery.voltage_v)],
        "pose": None if pose is None else [*_place(pose.position_enu_m), _number(pose.yaw_enu_rad)],
        "goal": bridge.goals.active_id,
    }


def _number(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(value, 2)


def _place(point: tuple[float, float, float]) -> list[float | None]:
    return [_number(value) for value in point]


def differences(kept: Any, found: Any, where: str = "") -> list[str]:
    """Return where two golden files differ, as sentences; at most some."""
    if isinstance(kept, dict) and isinstance(found, dict):
        lines = [f"{where}/{key} is only in one" for key in kept.keys() ^ found.keys()]
        for key in kept.keys() & found.keys():
            if key not in MAY_DIFFER:
                lines += differences(kept[key], found[key], f"{where}/{key}")
        return sorted(lines)[:20]
    if isinstance(kept, list) and isinstance(found, list):
        lines = []
        for index, (one, other) in enumerate(zip(kept, found, strict=False)):
            lines += differences(one, other, f"{where}[{index}]")
        if len(kept) != len(found):
            lines.append(f"{where} has {len(found)} entries, not {len(kept)}")
        return lines[:20]
    numbers = isinstance(kept, float) and isinstance(found, (int, float))
    if numbers and math.isclose(kept, found, rel_tol=0.0, abs_tol=TOLERANCE):
        return []
    return [] if kept == found else [f"{where} is {found!r}, not {kept!r}"]


def write_golden(path: Path, golden: dict[str, Any]) -> None:
    """Keep what was found, each output and each state on a line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(_lines(golden, 4) + "\n", encoding="utf-8")


def _lines(value: Any, depth: int, indent: str = "") -> str:
    """Return JSON that is broken into lines down to a depth."""
    if depth == 0 or not isinstance(value, (dict, list)) or not value:
        return json.dumps(value, ensure_ascii=False)
    deeper = indent + " "
    if isinstance(value, list):
        parts = [_lines(item, depth - 1, deeper) for item in value]
        brackets = "[]"
    else:
        parts = [f"{json.dumps(k)}: {_lines(v, depth - 1, deeper)}" for k, v in value.items()]
        brackets = "{}"
    return f"{brackets[0]}\n{deeper}" + f",\n{deeper}".join(parts) + f"\n{indent}{brackets[1]}"
