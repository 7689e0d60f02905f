"""Encodes and decodes messages; the only import of pymavlink.

Messages that come in are pymavlink's. Those that go out are plain tuples made from
pymavlink's own tables: its objects with their headers cost more than what is in them.
"""

from __future__ import annotations

import hashlib
import struct
from collections import namedtuple
from collections.abc import Callable
from operator import itemgetter
from typing import Any

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import all as pymavlink_dialect

Message = Any
"""A message, in (pymavlink's) or out (see `Dialect`). Its fields are looked up by name."""

__all__ = ["MAVLINK_1", "Decoder", "Encoder", "Extended", "Message", "Raw", "dialect"]

_MAGIC_V1 = 0xFE
_MAGIC_V2 = 0xFD
_OVERHEAD_V1 = 8
_OVERHEAD_V2 = 12
_SIGNATURE = 13
_SIGNED = 0x01
_NUMBER = struct.Struct("<HB")
"""A message's number, of 24 bits"""


_TYPE_SIZES = {
    "char": 1, "uint8": 1, "int8": 1, "uint16": 2, "int16": 2, "uint32": 4, "int32": 4, "float": 4,
    "uint64": 8, "int64": 8, "double": 8,
}  # fmt: skip
MAVLINK_1 = ("", "begins", "sends", "only")
"""The versions of a vehicle: MAVLink 2; 1 until it hears 2 (PX4's MAV_PROTO_VER 0); it sends 1 and
hears both (ArduPilot's SERIALn_PROTOCOL 1); it knows nothing but 1."""


class Dialect:
    """Pymavlink's dialect, with lean messages in place of its own.

    `dialect.MAVLink_attitude_message(...)` takes what pymavlink's takes and has the same
    fields; constants are pymavlink's.
    """

    def __getattr__(self, name: str) -> Any:
        """A constant, or the class of a message; looked up once."""
        found = getattr(pymavlink_dialect, name)
        if name.startswith("MAVLink_") and name.endswith("_message"):
            found = _lean(found)
        setattr(self, name, found)
        return found


def _lean(kind: Any) -> type:
    """A class of messages to send, of the fields and the layout of pymavlink's class."""
    make: Any = namedtuple  # mypy wants fields that are known before it runs
    base = make(kind.msgname, kind.fieldnames, defaults=kind.__init__.__defaults__)
    pack = kind.unpacker.pack
    order = [kind.fieldnames.index(name) for name in kind.ordered_fieldnames]
    # A text is one value for struct, other arrays are as many as they have elements.
    spread = [
        length > 0 and kind.fieldtypes[place] != "char"
        for length, place in zip(kind.array_lengths, order, strict=True)
    ]
    if not any(spread):
        on_wire = itemgetter(*order) if order != sorted(order) else tuple

        def payload_bytes(self: Any) -> Any:
            return pack(*on_wire(self))

    else:
        # As one expression, which a loop over the fields takes three times as long for.
        values = ", ".join(
            f"*m[{place}][:{length}]" if many else f"m[{place}]"
            for place, length, many in zip(order, kind.array_lengths, spread, strict=True)
        )
        payload_bytes = eval(f"lambda m: pack({values})", {"pack": pack})

    return type(
        kind.__name__,
        (base,),
        {
            "__slots__": (),
            "wire_id": kind.id,
            "wire_crc_extra": bytes((kind.crc_extra,)),
            "payload_bytes": payload_bytes,
            "wire_base": _base_size(kind),
        },
    )


def _base_size(kind: Any) -> int:
    """Bytes of the payload without extension fields, each of which has a default in pymavlink."""
    count = len(kind.__init__.__defaults__ or ()) - (kind.msgname == "HEARTBEAT")
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    sizes = [
        _TYPE_SIZES[types[name].removesuffix("_t")] * max(length, 1)
        for name, length in zip(kind.ordered_fieldnames, kind.array_lengths, strict=True)
    ]
    return sum(sizes[: len(sizes) - count])


dialect: Any = Dialect()


class Raw:
    """A message that pymavlink does not know.

    Args:
        message_id: its number.
        crc_extra: the byte that stands for its definition in the checksum.
        payload: its fields as bytes.
    """

    def __init__(self, message_id: int, crc_extra: int, payload: bytes) -> None:
        self.wire_id = message_id
        self.wire_crc_extra = bytes((crc_extra,))
        self._payload = payload
        self.wire_base = len(payload)

    def payload_bytes(self) -> bytes:
        """Its fields as they are sent."""
        return self._payload


class Extended(Raw):
    """A message with extension fields that pymavlink does not know yet.

    Args:
        message: the rest of it; it must end with its last known extension field.
        extension: the bytes of the fields after that.
    """

    def __init__(self, message: Message, extension: bytes) -> None:
        payload = message.payload_bytes() + extension
        super().__init__(message.wire_id, message.wire_crc_extra[0], payload)
        self.wire_base = message.wire_base


class Encoder:
    """Messages to frames of one sender, numbered in sequence.

    Args:
        system_id: 1..255.
        component_id: 1..255.
        mavlink_1: one of `MAVLINK_1`.

    Attributes:
        signing: pymavlink's state of signing, for the decoder of the same link.
    """

    def __init__(self, system_id: int, component_id: int, mavlink_1: str = "") -> None:
        self._mavlink_1 = mavlink_1
        self.signing: Any = pymavlink_dialect.MAVLinkSigning()
        self._sender = bytes((system_id, component_id))
        self._seq = 0
        self._origins: dict[int, bytes] = {}
        """The ends of the header by message number: sender and number"""

    def set_up_signing(self, key: bytes, timestamp: int) -> None:
        """Sign from now on, and take nothing unsigned; all zeros end that.

        Args:
            key: 32 bytes.
            timestamp: 10 microseconds since 1 January 2015; never goes back.
        """
        signing = self.signing
        on = any(key)
        signing.secret_key = key if on else None
        signing.sign_outgoing = on
        signing.timestamp = max(signing.timestamp, timestamp) if on else 0
        signing.link_id = 0
        signing.stream_timestamps = {}

    def hears(self, frame: bytes) -> bool:
        """Whether a frame that came is understood."""
        if frame[0] == _MAGIC_V1:
            return True
        if self._mavlink_1 == "begins":
            self._mavlink_1 = ""
        return self._mavlink_1 != "only"

    def encode(self, message: Message) -> bytes:
        """One frame, none if it has no place in MAVLink 1.

        Raises struct.error when a field is outside its type.
        """
        full: bytes = message.payload_bytes()
        if self._mavlink_1:
            return self._encode_1(message, full)
        # MAVLink 2 leaves out the zeros at the end, but not the first byte.
        payload = full.rstrip(b"\0") or full[:1]
        signed = self.signing.sign_outgoing
        seq = self._seq
        self._seq = (seq + 1) & 0xFF
        origin = self._origins.get(message.wire_id) or self._origin(message.wire_id)
        body = bytes((len(payload), _SIGNED if signed else 0, 0, seq)) + origin + payload
        check = mcrf4xx(body + message.wire_crc_extra)
        frame = b"\xfd" + body + check.to_bytes(2, "little")
        return self._signed(frame) if signed else frame

    def _encode_1(self, message: Message, full: bytes) -> bytes:
        if message.wire_id > 0xFF:
            return b""
        seq = self._seq
        self._seq = (seq + 1) & 0xFF
        payload = full[: message.wire_base]
        body = bytes((len(payload), seq)) + self._sender + bytes((message.wire_id,)) + payload
        check = mcrf4xx(body + message.wire_crc_extra)
        return b"\xfe" + body + check.to_bytes(2, "little")

    def _origin(self, number: int) -> bytes:
        end = self._sender + _NUMBER.pack(number & 0xFFFF, number >> 16)
        return self._origins.setdefault(number, end)

    def _signed(self, frame: bytes) -> bytes:
        """With link, time and signature (https://mavlink.io/en/guide/message_signing.html)."""
        signing = self.signing
        frame += struct.pack("<BQ", signing.link_id, signing.timestamp)[:7]
        signing.timestamp += 1
        return frame + hashlib.sha256(signing.secret_key + frame).digest()[:6]


class Decoder:
    """A stream of bytes to messages; whatever is no message is passed over.

    Frames that fail their checksum, are of an unknown message or have an impossible length
    cost the bytes up to the next start mark, nothing else. A frame cut short waits for the
    rest, which on a datagram link never comes: call `reset` between datagrams.
    """

    def __init__(
        self, signing: Any = None, hears: Callable[[bytes], bool] = lambda _frame: True
    ) -> None:
        """Nothing received yet.

        Args:
            signing: the encoder's, when frames may have to be signed.
            hears: whether a frame is understood.
        """
        self._hears = hears
        self._mav = pymavlink_dialect.MAVLink(None)
        if signing is not None:
            self._mav.signing = signing
        self._buffer = bytearray()
        self.bad_bytes = 0

    def reset(self) -> None:
        """Forget an unfinished frame."""
        self.bad_bytes += len(self._buffer)
        self._buffer.clear()

    def feed(self, data: bytes) -> list[Message]:
        """The messages that are complete with these bytes, in order."""
        buffer = self._buffer
        buffer += data
        messages = []
        start = 0
        while True:
            start = self._next_mark(start)
            length = self._frame_length(start)
            if length is None or start + length > len(buffer):
                break
            message = self._decode(bytes(buffer[start : start + length]))
            if message is None:
                start += 1
                self.bad_bytes += 1
            else:
                messages.append(message)
                start += length
        del buffer[:start]
        return messages

    def _next_mark(self, start: int) -> int:
        buffer = self._buffer
        marks = [
            i for i in (buffer.find(_MAGIC_V2, start), buffer.find(_MAGIC_V1, start)) if i >= 0
        ]
        found = min(marks, default=len(buffer))
        self.bad_bytes += found - start
        return found

    def _frame_length(self, start: int) -> int | None:
        """Length of the frame that begins at start, or None while it cannot be known."""
        header = self._buffer[start : start + 3]
        if len(header) < 3:
            return None
        if header[0] == _MAGIC_V1:
            return header[1] + _OVERHEAD_V1
        return header[1] + _OVERHEAD_V2 + (_SIGNATURE if header[2] & _SIGNED else 0)

    def _decode(self, frame: bytes) -> Message | None:
        signing = self._mav.signing
        if signing.secret_key is None:
            return self._decode_trusted(frame)
        known = dict(signing.stream_timestamps)
        message = self._decode_trusted(frame)
        if message is None:
            # A forged time must not shut out the true sender.
            signing.stream_timestamps = known
        return message

    def _decode_trusted(self, frame: bytes) -> Message | None:
        if not _intact(frame) or not self._hears(frame):
            return None
        try:
            return self._mav.decode(bytearray(frame))
        except (pymavlink_dialect.MAVError, struct.error, ValueError, IndexError, TypeError):
            # pymavlink raises MAVError for what it knows of, and the others for some frames
            # that are valid in their checksum but not in their content.
            return None


def _intact(frame: bytes) -> bool:
    """Whether the checksum is right; pymavlink builds an object with its header to find out.

    A message that is not in the dialect has no known checksum: that is for pymavlink to judge.
    """
    if frame[0] == _MAGIC_V1:
        number, end = frame[5], frame[1] + 6
    else:
        number, end = int.from_bytes(frame[7:10], "little"), frame[1] + 10
    kind = pymavlink_dialect.mavlink_map.get(number)
    if kind is None:
        return True
    check: int = mcrf4xx(frame[1:end] + bytes((kind.crc_extra,)))
    return check == int.from_bytes(frame[end : end + 2], "little")
