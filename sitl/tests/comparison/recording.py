"""Reads a tlog as a conversation with each vehicle in it.

Whatever a file holds, what comes out is conversations or one sentence. Places that are no
record are passed over and counted; a file may begin and end anywhere.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mavlink_sitl.mavlink.codec import Decoder, Message, dialect

Timed = list[tuple[float, Message]]
Sender = tuple[int, int]

AUTOPILOTS = {3: "ardupilot", 12: "px4"}
"""By MAV_AUTOPILOT"""
RESTART_S = 1.0
"""A clock that goes back by more was started again"""
REBOOT_TAKES_S = 10.0
SILENCE_S = 2.0
GAP_S = 300.0
"""Longer than this nothing is said only between two recordings"""
ANSWER_S = 0.5
"""Every recorded vehicle had answered after this time"""

_EARLIEST_US = 946_684_800_000_000
_LATEST_US = 4_102_444_800_000_000
"""2000 and 2100: a record of another time is none"""
_KINDS_READ = frozenset(
    number
    for number, kind in dialect.mavlink_map.items()
    if kind.msgname.startswith(("MISSION_", "PARAM_VALUE", "FENCE_", "RALLY_"))
    or kind.msgname
    in (
        "HEARTBEAT", "SYS_STATUS", "ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT",
        "COMMAND_ACK", "STATUSTEXT", "EXTENDED_SYS_STATE", "HOME_POSITION", "CURRENT_MODE",
        "GPS_GLOBAL_ORIGIN",
    )
)  # fmt: skip
"""The vehicle's messages that are compared; decoding the others would take most of the time"""


class RecordingError(ValueError):
    """A file that is no conversation with a vehicle; the message says why."""


@dataclass(frozen=True)
class Recording:
    """A recorded conversation with one vehicle. Times are seconds since its power-up.

    Attributes:
        own: its system and component id.
        autopilot: "ardupilot" or "px4".
        sent: what was said to it.
        real: what it said.
        said: the numbers of all kinds of messages that it sent.
        begin_s: when the recording begins.
        notes: what somebody who reads the comparison should know.
    """

    own: Sender
    autopilot: str
    sent: Timed
    real: Timed
    said: frozenset[int]
    begin_s: float
    notes: tuple[str, ...]

    @property
    def end_s(self) -> float:
        """The time at which the vehicle was last heard."""
        return self.real[-1][0]

    def of(self, *kinds: str) -> Timed:
        """The messages of the vehicle, of these types."""
        return [(t, m) for t, m in self.real if m.get_type() in kinds]


def read(path: Path) -> list[Recording]:
    """The conversations of a tlog, one for each vehicle.

    Raises:
        RecordingError: there is no known vehicle in it, or nobody speaks to it.
        OSError: the file cannot be read.
    """
    frames, lost_bytes = _frames(path.read_bytes())
    beats = [m for _, m in _decoded(frames, frozenset({0})) if m.get_type() == "HEARTBEAT"]
    beats = [m for m in beats if m.autopilot in AUTOPILOTS]
    vehicles = {sender_of(m): AUTOPILOTS[m.autopilot] for m in beats}
    if not vehicles:
        raise RecordingError(f"{path} has no HEARTBEAT of ArduPilot or PX4 in it")
    own_frames = [(t, f) for t, f in frames if _sender(f) in vehicles]
    others = [(t, f) for t, f in frames if _sender(f) not in vehicles]
    sent = [(t, m) for t, m in _decoded(others, None) if m.get_type() != "BAD_DATA"]
    if not sent:
        raise RecordingError(
            f"no ground station sends to the vehicle in {path}: there is nothing to replay"
        )
    notes = (
        (f"{lost_bytes} bytes that are not part of this conversation were skipped",)
        if lost_bytes
        else ()
    )
    return [
        _conversation(own, autopilot, own_frames, sent, notes)
        for own, autopilot in sorted(vehicles.items())
    ]


def sender_of(message: Message) -> Sender:
    """System and component id."""
    return message.get_srcSystem(), message.get_srcComponent()


def decode_telemetry(decoder: Decoder, frame: bytes) -> list[Message]:
    """One frame of a vehicle: nothing when it is of a kind that is not looked at."""
    return decoder.feed(frame) if _number(frame) in _KINDS_READ else []


def _sender(frame: bytes) -> Sender:
    return (frame[5], frame[6]) if frame[0] == 0xFD else (frame[3], frame[4])


def _number(frame: bytes) -> int:
    return int.from_bytes(frame[7:10], "little") if frame[0] == 0xFD else frame[5]


def _decoded(frames: list[tuple[float, bytes]], kinds: frozenset[int] | None) -> Timed:
    decoder = Decoder()
    found: Timed = []
    for time_s, frame in frames:
        if kinds is None or _number(frame) in kinds:
            decoder.reset()
            found += [(time_s, message) for message in decoder.feed(frame)]
    return found


def _frames(data: bytes) -> tuple[list[tuple[float, bytes]], int]:
    """The records of the longest run, wall time in seconds, and how many bytes are none of them.

    A gap of many minutes, or a time that is wrong, parts one run from another.
    """
    frames = sorted(((t / 1e6, frame) for t, frame in _records(data)), key=lambda record: record[0])
    runs: list[list[tuple[float, bytes]]] = [[]]
    for record in frames:
        if runs[-1] and record[0] - runs[-1][-1][0] > GAP_S:
            runs.append([])
        runs[-1].append(record)
    longest = max(runs, key=len)
    return longest, len(data) - sum(8 + len(frame) for _, frame in longest)


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    offset, decoder = 0, Decoder()
    sound = True
    while offset + 11 <= len(data):
        (time_us,) = struct.unpack_from(">Q", data, offset)
        size = _frame_size(data[offset + 8 : offset + 11])
        end = offset + 8 + size
        if size and _EARLIEST_US < time_us < _LATEST_US and end <= len(data):
            frame = data[offset + 8 : end]
            # After a gap only what decodes is believed to be the beginning of a record.
            if sound or decoder.feed(frame):
                yield time_us, frame
                offset, sound = end, True
                continue
            decoder.reset()
        sound = False
        offset += 1


def _frame_size(head: bytes) -> int:
    if head[0] == 0xFD:
        return head[1] + 12 + (13 if head[2] & 1 else 0)
    return head[1] + 8 if head[0] == 0xFE else 0


def _conversation(
    own: Sender,
    autopilot: str,
    frames: list[tuple[float, bytes]],
    sent: Timed,
    notes: tuple[str, ...],
) -> Recording:
    frames = [(t, f) for t, f in frames if _sender(f) == own]
    heard = _decoded(frames, _KINDS_READ)
    timed, note = _vehicle_time(sorted([*heard, *sent], key=lambda record: record[0]), own)
    notes += (note,) if note else ()
    real = [(t, m) for t, m in timed if sender_of(m) == own]
    answered_s = real[-1][0] - ANSWER_S
    said = [(t, m) for t, m in timed if sender_of(m) != own and t <= real[-1][0]]
    acks = sum(m.get_type() == "COMMAND_ACK" and t > answered_s for t, m in real)
    if not acks:
        # Whoever cut the recording may have cut the answers to the last commands off.
        said = [(t, m) for t, m in said if t <= answered_s or not _wants_answer(m)]
    kinds = frozenset(_number(frame) for _, frame in frames)
    return Recording(own, autopilot, said, real, kinds, timed[0][0], notes)


def _wants_answer(message: Message) -> bool:
    return message.get_type() in ("COMMAND_LONG", "COMMAND_INT")


def _vehicle_time(records: Timed, own: Sender) -> tuple[Timed, str]:
    """The records by the vehicle's clock, which need not run at the speed of the wall's.

    Each record is as late after the vehicle's latest timestamp as it was on the wall. After a
    reboot that was asked for the clock of the first run continues; a restart that nobody asked
    for (a crash, a killed simulator) ends the conversation, since it cannot be played.
    """
    clock, alive, note = _Clock(), 0, ""
    timed: list[tuple[float, float | None, Message]] = []
    for wall_s, message in records:
        if sender_of(message) != own:
            if getattr(message, "command", None) == dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
                clock.asked_s = wall_s
        else:
            if wall_s - clock.heard_s > SILENCE_S:
                alive = len(timed)
            if clock.restarts(wall_s, message):
                if 0 < alive < len(timed) and timed[alive][0] > clock.boot_wall_s + SILENCE_S:
                    del timed[alive:]
                note = f"restarted by itself {clock.boot_s:.1f} s after power-up: the end here"
                break
        timed.append((wall_s, clock.offset_s, message))
    first_s = next((offset for _, offset, _ in timed if offset is not None), None)
    if first_s is None:
        first_s = records[0][0]
        note = (
            "the vehicle does not report the time since its power-up: it is taken as starting there"
        )
    return [
        (wall - (first_s if offset is None else offset), message) for wall, offset, message in timed
    ], note


class _Clock:
    """The vehicle's clock beside the wall's."""

    def __init__(self) -> None:
        self.offset_s: float | None = None
        self.heard_s = self.asked_s = self.boot_s = self.boot_wall_s = -math.inf
        self._first_run = True

    def restarts(self, wall_s: float, message: Message) -> bool:
        """Process a message of the vehicle; true if it restarted unasked."""
        self.heard_s = wall_s
        boot_ms = getattr(message, "time_boot_ms", 0)
        if not boot_ms:
            return False
        boot_s = boot_ms / 1e3
        if self.boot_s - boot_s > RESTART_S:
            if wall_s - self.asked_s > REBOOT_TAKES_S:
                return True
            self._first_run = False
        if self._first_run:
            # Timestamps are made a little before they are sent: the earliest counts.
            late_s = wall_s - boot_s
            if self.offset_s is None:
                self.offset_s = late_s
            self.offset_s += 0.01 * (late_s - self.offset_s)
        self.boot_s, self.boot_wall_s = boot_s, wall_s
        return False
