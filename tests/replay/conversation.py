"""Plays a recorded conversation again: the ground station's half into the simulator.

A recording is a tlog of the real ArduCopter simulator with both directions in it. What the
ground station sent is written to `mavlink_sitl` at the recorded times; what the two vehicles
answered is then compared by the tests.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.tlog import read_records

DATA = Path(__file__).parent / "data"
READY_AFTER_S = 41.64
"""How long the real firmware took until its estimator used GPS"""

Message = Any
Timed = list[tuple[float, Message]]


@dataclass(frozen=True)
class Conversation:
    """One flight, twice. Times are seconds since power-up.

    Attributes:
        sent: what the ground station said.
        real: what the real vehicle said.
        ours: what the simulated one said.
    """

    sent: Timed
    real: Timed
    ours: Timed


def load(name: str) -> tuple[Timed, Timed]:
    """A recording: what the ground station sent, and what the vehicle sent."""
    decoder = mav.MAVLink(None)
    records = [
        (time_us / 1e6, decoder.decode(bytearray(frame)))
        for time_us, frame in read_records((DATA / f"{name}.tlog").read_bytes())
    ]
    boot_s = next(
        t - m.time_boot_ms / 1e3 for t, m in records if m.get_type() == "LOCAL_POSITION_NED"
    )
    timed = [(t - boot_s, m) for t, m in records]
    return (
        [(t, m) for t, m in timed if m.get_srcSystem() == 255],
        [(t, m) for t, m in timed if m.get_srcSystem() == 1],
    )


def replay(
    name: str,
    parameters: dict[str, float] | None = None,
    config: VehicleConfig | None = None,
) -> Conversation:
    """Play a recording into the simulator; into another vehicle than a copter if given one."""
    sent, real = load(name)
    if config is None:
        config = VehicleConfig(ready_after_s=READY_AFTER_S, parameters=parameters or {})
    simulation = Simulation([config], seed=1)
    decoder = mav.MAVLink(None)
    ours: Timed = []

    def until(time_s: float) -> None:
        while simulation.time_s < time_s:
            simulation.run_to_us(min(simulation.time_us + 50_000, math.ceil(time_s * 1e6)))
            take()

    def take() -> None:
        for message in decoder.parse_buffer(simulation.link.read()) or []:
            ours.append((simulation.time_s, message))

    for time_s, message in sent:
        until(time_s)
        simulation.link.write(bytes(message.get_msgbuf()))
        take()
    until(real[-1][0])
    return Conversation(sent, real, ours)


def changes(messages: Timed, kind: str, *fields: str) -> list[tuple[float, tuple[int, ...]]]:
    """When which values of a message's fields were seen first."""
    seen: list[tuple[float, tuple[int, ...]]] = []
    for time_s, message in messages:
        if message.get_type() == kind:
            values = tuple(int(getattr(message, field)) for field in fields)
            if not seen or seen[-1][1] != values:
                seen.append((time_s, values))
    return seen


def acknowledgements(messages: Timed) -> list[tuple[int, int]]:
    """Command and result of each COMMAND_ACK."""
    return [(m.command, m.result) for _, m in messages if m.get_type() == "COMMAND_ACK"]


def texts(messages: Timed) -> list[str]:
    """What was said."""
    return [m.text for _, m in messages if m.get_type() == "STATUSTEXT"]


def track(messages: Timed) -> list[tuple[float, float, float, float]]:
    """Time since power-up and NED position."""
    return [
        (time_s, m.x, m.y, m.z) for time_s, m in messages if m.get_type() == "LOCAL_POSITION_NED"
    ]


def rms_distance_m(conversation: Conversation, from_s: float, to_s: float) -> float:
    """Root mean square distance of the two vehicles at equal times."""
    ours = track(conversation.ours)
    squares = []
    place = 0
    for time_s, *real in track(conversation.real):
        if not from_s <= time_s <= to_s:
            continue
        while place + 1 < len(ours) and ours[place + 1][0] <= time_s:
            place += 1
        squares.append(math.dist(real, ours[place][1:]) ** 2)
    assert squares, "the recording has positions in that time"
    return math.sqrt(sum(squares) / len(squares))


def arrival_s(
    messages: Timed, target: tuple[float, float, float], from_s: float, within_m: float = 1.0
) -> float:
    """Time from a moment until the position is within a distance of a target."""
    for time_s, *position in track(messages):
        if time_s >= from_s and math.dist(position, target) <= within_m:
            return time_s - from_s
    raise AssertionError(f"never within {within_m} m of {target}")
