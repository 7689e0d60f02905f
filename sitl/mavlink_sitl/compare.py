"""`python -m mavlink_sitl.compare RECORDING`: a recorded conversation, played again.

What the ground station sent in a tlog is written to a simulated vehicle at the recorded
times, and what the two vehicles answered is compared: acknowledgements, modes, landed states,
and the way through the air.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mavlink_sitl.config import PERSONALITIES, VehicleConfig
from mavlink_sitl.geodesy import GeoPoint, to_geodetic
from mavlink_sitl.mavlink.codec import Decoder, Message, dialect
from mavlink_sitl.simulation import Simulation
from mavlink_sitl.tlog import read_records

Timed = list[tuple[float, Message]]
Track = list[tuple[float, float, float, float]]

_KINDS = {1: "plane", 2: "copter", 10: "rover", 11: "boat", 13: "copter", 14: "copter"}
_AUTOPILOTS = {3: "ardupilot", 12: "px4"}
_READY_AFTER_S = {"ardupilot": 41.64, "px4": 4.4}
"""How long the recorded firmwares took until their estimators used GPS"""
_STEP_US = 50_000


class RecordingError(ValueError):
    """A file that is no conversation with one vehicle; the message says why."""


@dataclass(frozen=True)
class Recording:
    """A recorded conversation. Times are seconds since power-up.

    Attributes:
        config: the vehicle that was flown.
        sent: what was said to it.
        real: what it said.
        begin_s: when the recording begins.
    """

    config: VehicleConfig
    sent: Timed
    real: Timed
    begin_s: float


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


def load(path: Path, parameters: Mapping[str, float] | None = None) -> Recording:
    """Read a recording and find out what kind of vehicle is in it.

    Args:
        path: a tlog with both directions.
        parameters: of the vehicle, where they were not the defaults.

    Raises:
        RecordingError: there is no known vehicle in it, or more than one.
        OSError: the file cannot be read.
    """
    records: Timed = []
    for time_us, frame in read_records(path.read_bytes()):
        records += [(time_us / 1e6, message) for message in Decoder().feed(frame)]
    beats = [m for _, m in records if m.get_type() == "HEARTBEAT" and m.autopilot in _AUTOPILOTS]
    senders = {(m.get_srcSystem(), m.get_srcComponent()) for m in beats}
    if len(senders) != 1 or beats[0].type not in _KINDS:
        raise RecordingError(f"{path} has {len(senders)} known vehicles in it, and should have one")
    own = senders.pop()
    records = _vehicle_time(records, own)
    if not records:
        raise RecordingError(f"{path} does not tell the vehicle's time since boot")
    real = [(t, m) for t, m in records if _sender(m) == own]
    config = _config(beats[0], own[0], [m for _, m in real], dict(parameters or {}))
    return Recording(
        config,
        [(t, m) for t, m in records if _sender(m) not in (own, (0, 0))],
        real,
        records[0][0],
    )


def _sender(message: Message) -> tuple[int, int]:
    return message.get_srcSystem(), message.get_srcComponent()


def _vehicle_time(records: Timed, own: tuple[int, int]) -> Timed:
    """The records by the vehicle's clock, which need not run at the speed of the wall's.

    Each record is as late after the vehicle's latest timestamp as it was on the wall. A clock
    that jumps back (a reboot) is followed no further than its first run.
    """
    offset_s, timed, last_s = None, [], -math.inf
    for wall_s, message in records:
        boot_ms = getattr(message, "time_boot_ms", 0) if _sender(message) == own else 0
        if boot_ms and message.get_type() != "SYSTEM_TIME":
            now_s = boot_ms / 1e3
            if offset_s is None or now_s >= last_s - 1.0:
                # Timestamps are made a little before they are sent: the earliest counts.
                late_s = wall_s - now_s
                offset_s = late_s if offset_s is None else offset_s + 0.01 * (late_s - offset_s)
                last_s = now_s
        timed.append((wall_s, offset_s, message))
    first_s = next((offset for _, offset, _ in timed if offset is not None), None)
    if first_s is None:
        return []
    return [
        (wall - (first_s if offset is None else offset), message) for wall, offset, message in timed
    ]


def _config(
    beat: Message, system_id: int, real: list[Message], parameters: dict[str, float]
) -> VehicleConfig:
    autopilot, kind = _AUTOPILOTS[beat.autopilot], _KINDS[beat.type]
    if (kind, autopilot) not in PERSONALITIES:
        raise RecordingError(f"there is no {kind} with {autopilot} yet")
    onboard = any(m.get_type() == "HIGHRES_IMU" for m in real)
    attitude = next((m for m in real if m.get_type() == "ATTITUDE"), None)
    options: dict[str, object] = {}
    origin = _origin(real)
    if origin is not None:
        options["home"] = origin
    return VehicleConfig(
        vehicle=kind,
        autopilot=autopilot,
        system_id=system_id,
        heading_deg=0.0 if attitude is None else math.degrees(attitude.yaw),
        ready_after_s=_READY_AFTER_S[autopilot],
        parameters=parameters,
        links=("onboard", "gcs") if onboard else ("gcs",),
        **options,  # type: ignore[arg-type]
    )


def _origin(real: list[Message]) -> GeoPoint | None:
    """Where the local frame begins: from a global and a local position of the same moment."""
    places = {m.time_boot_ms: m for m in real if m.get_type() == "GLOBAL_POSITION_INT" and m.lat}
    for local in (m for m in real if m.get_type() == "LOCAL_POSITION_NED"):
        place = places.get(local.time_boot_ms)
        if place is not None:
            point = GeoPoint(place.lat / 1e7, place.lon / 1e7, place.alt / 1e3)
            return to_geodetic(point, -local.x, -local.y, -local.z)
    return None


def replay(recording: Recording, seed: int = 1) -> Conversation:
    """Play a recording into the simulator."""
    simulation = Simulation([recording.config], seed=seed)
    links = simulation.vehicles[0].links
    decoder = Decoder()
    ours: Timed = []

    def take() -> None:
        for other in links[1:]:
            other.read()
        ours.extend((simulation.time_s, m) for m in decoder.feed(links[0].read()))

    def run_until(time_s: float) -> None:
        while simulation.time_s < time_s:
            simulation.run_to_us(min(simulation.time_us + _STEP_US, math.ceil(time_s * 1e6)))
            take()

    run_until(recording.begin_s)
    ours.clear()
    for time_s, message in recording.sent:
        run_until(time_s)
        # A heartbeat that one link hands on to another came from a ground station there.
        handed_on = message.get_srcSystem() == 255 and len(links) > 1
        links[1 if handed_on else 0].write(bytes(message.get_msgbuf()))
        take()
    if recording.real:
        run_until(recording.real[-1][0])
    own = recording.config.system_id
    ours = [(t, m) for t, m in ours if _sender(m) == (own, 1)]
    return Conversation(recording.sent, recording.real, ours)


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


def mission_acknowledgements(messages: Timed) -> list[tuple[int, int]]:
    """List and result of each MISSION_ACK."""
    return [(m.mission_type, m.type) for _, m in messages if m.get_type() == "MISSION_ACK"]


def modes(messages: Timed) -> list[tuple[int, ...]]:
    """Mode, base mode and system status that the HEARTBEAT went through."""
    beats = changes(messages, "HEARTBEAT", "custom_mode", "base_mode", "system_status")
    return [values for _, values in beats]


def landed_states(messages: Timed) -> list[int]:
    """The landed states in order."""
    return [v for _, (v,) in changes(messages, "EXTENDED_SYS_STATE", "landed_state")]


def texts(messages: Timed) -> list[str]:
    """What was said, chunks apart."""
    return [m.text for _, m in messages if m.get_type() == "STATUSTEXT"]


def track(messages: Timed) -> Track:
    """Time since power-up and NED position."""
    return [
        (time_s, m.x, m.y, m.z) for time_s, m in messages if m.get_type() == "LOCAL_POSITION_NED"
    ]


def rms_distance_m(real: Track, ours: Track, from_s: float, to_s: float) -> float:
    """Root mean square distance of two tracks at equal times; NaN when there is nothing."""
    squares, place = [], 0
    for time_s, *position in real:
        if not from_s <= time_s <= to_s or not ours:
            continue
        while place + 1 < len(ours) and ours[place + 1][0] <= time_s:
            place += 1
        squares.append(math.dist(position, ours[place][1:]) ** 2)
    return math.sqrt(sum(squares) / len(squares)) if squares else math.nan


def armed_span_s(messages: Timed) -> tuple[float, float] | None:
    """From the first to the last HEARTBEAT that says armed."""
    armed = [
        t
        for t, m in messages
        if m.get_type() == "HEARTBEAT" and m.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED
    ]
    return (armed[0], armed[-1]) if armed else None


def report(conversation: Conversation) -> tuple[list[str], bool]:
    """Lines for people, and whether everything that must be equal is."""
    lines, equal = [], True
    for title, look in (
        ("command acknowledgements", acknowledgements),
        ("mission acknowledgements", mission_acknowledgements),
        ("modes (custom, base, status)", modes),
        ("landed states", landed_states),
    ):
        real, ours = look(conversation.real), look(conversation.ours)
        same = real == ours
        equal &= same
        lines.append(f"{'same' if same else 'DIFFERENT'}  {title}: {len(real)} recorded")
        if not same:
            lines += [f"    recorded   {real}", f"    simulated  {ours}"]
    span = armed_span_s(conversation.real)
    if span is not None:
        real_track, our_track = track(conversation.real), track(conversation.ours)
        distance_m = rms_distance_m(real_track, our_track, *span)
        lines.append(f"      {distance_m:.2f} m apart (root mean square) while armed")
    return lines, equal


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns:
        0 when everything is the same, 1 when something differs, 2 when it cannot be compared.
    """
    parser = argparse.ArgumentParser(
        prog="mavlink_sitl.compare",
        description="Play what a ground station sent in a recording to a simulated vehicle, "
        "and compare what the two vehicles answered.",
        epilog="Exits with 0 when all is the same, with 1 when something differs, with 2 when "
        "the recording cannot be played.",
    )
    parser.add_argument("recording", type=Path, help="a tlog with both directions in it")
    parser.add_argument(
        "--param",
        action="append",
        default=[],
        metavar="NAME=NUMBER",
        help="a parameter that the recorded vehicle did not have at its default",
    )
    options = parser.parse_args(arguments)
    try:
        pairs = [text.partition("=") for text in options.param]
        parameters = {name.upper(): float(value) for name, _, value in pairs}
        lines, equal = report(replay(load(options.recording, parameters)))
    except (OSError, ValueError, KeyError) as error:
        print(f"mavlink_sitl.compare: {error}", file=sys.stderr)
        return 2
    print("\n".join(lines))
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())
