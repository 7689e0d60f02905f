"""Encodes and decodes messages; the only import of pymavlink.

Messages that come in are pymavlink's. Those that go out are plain tuples made from
pymavlink's own tables: its objects with their headers cost more than what is in them.
"""

from __future__ import annotations

import hashlib
import struct
from collections import namedtuple
from operator import itemgetter
from typing import Any

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import all as pymavlink_dialect

Message = Any
"""A message, in (pymavlink's) or out (see `Dialect`). Its fields are looked up by name."""

__all__ = ["Decoder", "Encoder", "Extended", "Message", "Raw", "dialect"]

_MAGIC_V1 = 0xFE
_MAGIC_V2 = 0xFD
_OVERHEAD_V1 = 8
_OVERHEAD_V2 = 12
_SIGNATURE = 13
_SIGNED = 0x01
_NUMBER = struct.Struct("<HB")
"""A message's number, of 24 bits"""


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
        },
    )


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


class Encoder:
    """Messages to MAVLink 2 frames of one sender, numbered in sequence.

    Args:
        system_id: 1..255.
        component_id: 1..255.

    Attributes:
        signing: pymavlink's state of signing, for the decoder of the same link.
    """

    def __init__(self, system_id: int, component_id: int) -> None:
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

    def encode(self, message: Message) -> bytes:
        """One frame; raises struct.error when a field is outside its type."""
        full: bytes = message.payload_bytes()
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

    def __init__(self, signing: Any = None) -> None:
        """Nothing received yet.

        Args:
            signing: the encoder's, when frames may have to be signed.
        """
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
        if not _intact(frame):
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
