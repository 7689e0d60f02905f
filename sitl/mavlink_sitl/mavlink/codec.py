"""Bytes to messages and back; the only import of pymavlink."""

from __future__ import annotations

import struct
from typing import Any

from pymavlink.dialects.v20 import all as dialect

Message = Any
"""A pymavlink message. Its classes are generated; their fields are looked up by name."""

__all__ = ["Decoder", "Encoder", "Extended", "Message", "dialect"]

_MAGIC_V1 = 0xFE
_MAGIC_V2 = 0xFD
_OVERHEAD_V1 = 8
_OVERHEAD_V2 = 12
_SIGNATURE = 13
_SIGNED = 0x01
_HEADER = struct.Struct("<BBBBBBHB")
"""Of MAVLink 2, after the start mark; the message's number is the last two"""


class Encoder:
    """Messages to MAVLink 2 frames of one sender, numbered in sequence.

    Args:
        system_id: 1..255.
        component_id: 1..255.
    """

    def __init__(self, system_id: int, component_id: int) -> None:
        """See the class."""
        self._mav = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)

    @property
    def signing(self) -> Any:
        """Pymavlink's state of signing, for the decoder of the same link."""
        return self._mav.signing

    def set_up_signing(self, key: bytes, timestamp: int) -> None:
        """Sign from now on, and take nothing unsigned; all zeros end that.

        Args:
            key: 32 bytes.
            timestamp: 10 microseconds since 1 January 2015; never goes back.
        """
        signing = self._mav.signing
        on = any(key)
        signing.secret_key = key if on else None
        signing.sign_outgoing = on
        signing.timestamp = max(signing.timestamp, timestamp) if on else 0
        signing.link_id = 0
        signing.stream_timestamps = {}

    def encode(self, message: Message) -> bytes:
        """One frame; raises struct.error when a field is outside its type."""
        mav = self._mav
        if not (mav.signing.sign_outgoing or isinstance(message, Extended)):
            number = message.get_msgId()  # not .id: some have a field of that name
            # Half of the time of pymavlink's own, which builds an object for each header.
            message._pack = lambda mav, extra, payload, **_: _frame(mav, number, extra, payload)
        frame = bytes(message.pack(mav))
        mav.seq = (mav.seq + 1) % 256
        return frame


def _frame(mav: Any, number: int, crc_extra: int, payload: bytes) -> bytes:
    """Header, payload without the zeros at its end, checksum: MAVLink 2, unsigned."""
    payload = payload.rstrip(b"\0") or payload[:1]
    body = (
        _HEADER.pack(
            len(payload),
            0,
            0,
            mav.seq,
            mav.srcSystem,
            mav.srcComponent,
            number & 0xFFFF,
            number >> 16,
        )
        + payload
    )
    check = dialect.x25crc(body + bytes((crc_extra,))).crc
    return b"\xfd" + body + int(check).to_bytes(2, "little")


class Extended:
    """A message with extension fields that the generated classes do not know yet.

    Args:
        message: the rest of it; it must end with its last known extension field.
        extension: the bytes of the fields after that.
    """

    def __init__(self, message: Message, extension: bytes) -> None:
        """See the class."""
        self._message = message
        self._extension = extension

    def get_type(self) -> str:
        """The message's name."""
        return str(self._message.get_type())

    def pack(self, mav: Any) -> bytes:
        """One frame."""
        message = self._message
        fields = [getattr(message, name) for name in message.ordered_fieldnames]
        payload = struct.pack(message.unpacker.format, *fields) + self._extension
        return bytes(message._pack(mav, message.crc_extra, payload))


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
        self._mav = dialect.MAVLink(None)
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
        try:
            return self._mav.decode(bytearray(frame))
        except (dialect.MAVError, struct.error, ValueError, IndexError, TypeError):
            # pymavlink raises MAVError for what it knows of, and the others for some frames
            # that are valid in their checksum but not in their content.
            return None
