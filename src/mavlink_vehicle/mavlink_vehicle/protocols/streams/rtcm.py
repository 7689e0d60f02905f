"""RTCM corrections for the vehicle's GPS: GPS_RTCM_DATA, in fragments, at a limited rate.

A message of at most 180 bytes goes out whole, a longer one in 2 to 4 fragments with a common
sequence id. An ArduPilot knows the last fragment by its length below 180, so that a length that is
a multiple of 180 needs an empty one at the end, unless there are four (common.xml, AP_GPS.cpp). A
PX4 hands every fragment to its receiver as it comes, from a queue of 8 (gps.cpp): the messages go
out one by one with a pause.
"""

from __future__ import annotations

from collections import deque

from mavlink_vehicle.codec import Message, make
from mavlink_vehicle.protocols.service import SendingRank, VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState

__all__ = ["LONGEST_BYTES", "RtcmError", "RtcmSender", "fragments", "rtcm_messages"]

_FRAGMENT_BYTES = 180
LONGEST_BYTES = 4 * _FRAGMENT_BYTES
RATE_BYTES_S = 4000.0
"""At most; a base station sends 300 to 1500 bytes a second."""
_PAUSE_S = 0.05
_WAITING_MAX = 20

_PREAMBLE = 0xD3
_HEADER_BYTES, _CRC_BYTES = 3, 3
_POLYNOMIAL = 0x1864CFB


class RtcmError(ValueError):
    """These bytes are not sent as corrections; the text says why."""


def rtcm_messages(data: bytes) -> list[bytes]:
    """Return the RTCM 3 messages that follow one another in `data`.

    Each is a preamble (0xD3), 6 zero bits, 10 bits of length, that many bytes, and CRC-24Q (RTCM
    10403, section 4).

    Raises:
        RtcmError: something else stands between them, or a checksum is wrong.
    """
    found, start = [], 0
    while start < len(data):
        header = data[start : start + _HEADER_BYTES]
        if len(header) < _HEADER_BYTES or header[0] != _PREAMBLE or header[1] & 0xFC:
            raise RtcmError(f"Byte {start} of {len(data)} does not begin an RTCM 3 message.")
        size = int.from_bytes(header[1:], "big") + _HEADER_BYTES + _CRC_BYTES
        message = data[start : start + size]
        if len(message) < size:
            raise RtcmError(f"An RTCM message of {size} bytes ends after {len(message)}.")
        if _crc24q(message):
            raise RtcmError(f"The checksum of an RTCM message of {size} bytes is wrong.")
        found.append(message)
        start += size
    return found


def _crc24q(data: bytes) -> int:
    """Return CRC-24Q; 0 over a message with its checksum."""
    crc = 0
    for byte in data:
        crc ^= byte << 16
        for _ in range(8):
            crc <<= 1
            if crc & 0x1000000:
                crc ^= _POLYNOMIAL
    return crc


def fragments(data: bytes, sequence: int) -> list[Message]:
    """Return the GPS_RTCM_DATA of an RTCM message.

    Args:
        data: 1 to `LONGEST_BYTES` bytes.
        sequence: the message's sequence id, 0 to 31.
    """
    if len(data) <= _FRAGMENT_BYTES:
        return [_piece(data, sequence << 3)]
    pieces = [data[i : i + _FRAGMENT_BYTES] for i in range(0, len(data), _FRAGMENT_BYTES)]
    if len(pieces[-1]) == _FRAGMENT_BYTES and len(data) < LONGEST_BYTES:
        pieces.append(b"")
    return [_piece(piece, sequence << 3 | index << 1 | 1) for index, piece in enumerate(pieces)]


def _piece(data: bytes, flags: int) -> Message:
    padded = list(data) + [0] * (_FRAGMENT_BYTES - len(data))
    return make("GPS_RTCM_DATA", flags=flags, len=len(data), data=padded)


class RtcmSender(VehicleService):
    """Sends RTCM messages in their order."""

    rank = SendingRank.DATA

    def __init__(self) -> None:
        """Begin with nothing to send."""
        super().__init__()
        self._waiting: deque[bytes] = deque()
        self._sequence = 0
        self._free_s = 0.0

    def offer(self, data: bytes, now: float) -> None:
        """Send RTCM messages: all of them, or none.

        Args:
            data: whole RTCM 3 messages, one after the other.
            now: time in seconds.

        Raises:
            RtcmError: they are not sent, and why.
        """
        messages = rtcm_messages(data)
        if not messages:
            raise RtcmError("It contains no RTCM message.")
        longest = max(map(len, messages))
        if longest > LONGEST_BYTES:
            raise RtcmError(
                f"An RTCM message has {longest} bytes; MAVLink carries at most {LONGEST_BYTES}. "
                "Configure the base for shorter ones, such as MSM4 instead of MSM7."
            )
        if len(self._waiting) + len(messages) > _WAITING_MAX:
            raise RtcmError(
                f"RTCM comes faster than it is sent ({RATE_BYTES_S:g} bytes and "
                f"{1.0 / _PAUSE_S:g} messages a second)."
            )
        self._waiting += messages
        self.deadline_s = self._free_s
        self.handle_timer(now)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Drop what waits: corrections are of no use later."""
        self._waiting.clear()
        self.deadline_s = None

    def _on_deadline(self, now: float) -> None:
        """Send the next message."""
        message = self._waiting.popleft()
        self.outbox += fragments(message, self._sequence)
        self._sequence = (self._sequence + 1) % 32
        self._free_s = now + max(_PAUSE_S, len(message) / RATE_BYTES_S)
        self.deadline_s = self._free_s if self._waiting else None
