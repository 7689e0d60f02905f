"""Skips telemetry that has waited until it was stale, where newer of the same kind waits behind it.

A starved process reads in order, and the newest comes last. Acting on each message in turn would
mean acting on the past for seconds. So all that waits is read at once, and of each stream of
measurements only the last message is processed. Everything else is kept, in its order: answers,
texts, heartbeats, missions, parameters, logs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from mavlink_vehicle.codec import PAYLOAD_START, Received, mavlink

ReceivedT = TypeVar("ReceivedT", bound=Received)

STALE_S = 0.5
"""When measurements of one sender that wait span more than this, the older ones are skipped."""

_TIMED_MESSAGES = (
    mavlink.MAVLink_attitude_message,
    mavlink.MAVLink_global_position_int_message,
    mavlink.MAVLink_local_position_ned_message,
)
_TIMED = frozenset(message.id for message in _TIMED_MESSAGES)
_STREAMS = _TIMED | {
    mavlink.MAVLINK_MSG_ID_ALTITUDE,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET,
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU,
    mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT,
    mavlink.MAVLINK_MSG_ID_ODOMETRY,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED,
    mavlink.MAVLINK_MSG_ID_RAW_IMU,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS,
    mavlink.MAVLINK_MSG_ID_SCALED_IMU,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW,
    mavlink.MAVLINK_MSG_ID_VFR_HUD,
}
# Half the circle of sequence numbers: more that are missing would look like packets out of order.
_SKIPPED_IN_A_ROW = 100


def without_stale(messages: Sequence[ReceivedT], stale_s: float = STALE_S) -> list[ReceivedT]:
    """Return the messages but for stale telemetry; those of a sender that is not behind, all.

    Args:
        messages: what was read at once, of any senders, in order; measurements among them.
        stale_s: the span from which on a sender is behind, by its own clock.
    """
    first_ms: dict[int, int] = {}
    last_ms: dict[int, int] = {}
    last_place: dict[tuple[int, int], int] = {}
    for place, message in enumerate(messages):
        sender, number = _of(message)
        if number not in _STREAMS:
            continue
        last_place[sender, number] = place
        time_ms = _time_boot_ms(message, number)
        if time_ms is not None:
            first_ms.setdefault(sender, time_ms)
            last_ms[sender] = time_ms
    behind = {sender for sender, ms in first_ms.items() if last_ms[sender] - ms > 1e3 * stale_s}
    if not behind:
        return list(messages)
    kept: list[ReceivedT] = []
    skipped = dict.fromkeys(behind, 0)
    for place, message in enumerate(messages):
        sender, number = _of(message)
        if sender in behind:
            newest = last_place.get((sender, number), place)
            if newest != place and skipped[sender] < _SKIPPED_IN_A_ROW:
                skipped[sender] += 1
                continue
            skipped[sender] = 0
        kept.append(message)
    return kept


def _of(message: Received) -> tuple[int, int]:
    """Return sender and number of a message or of a measurement."""
    if isinstance(message, tuple):
        frame = message[3]
        return frame[5] | frame[6] << 8, frame[7] | frame[8] << 8 | frame[9] << 16
    header = message._header
    return header.srcSystem | header.srcComponent << 8, header.msgId


def _time_boot_ms(message: Received, number: int) -> int | None:
    if number not in _TIMED:
        return None
    if isinstance(message, tuple):
        return int.from_bytes(message[2][PAYLOAD_START : PAYLOAD_START + 4], "little")
    return message.time_boot_ms if isinstance(message, _TIMED_MESSAGES) else None
