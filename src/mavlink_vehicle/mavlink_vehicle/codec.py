"""Bytes <-> MAVLink messages. The only module that imports pymavlink.

Frames are decoded whole, with the tables of pymavlink's generated classes, instead of byte
by byte with its parser: the result is the same message object (a test holds every message
class to that) for a quarter of the time.

Whatever comes from outside, `Codec.decode` does not raise. Garbage, damaged frames and
messages that the dialect does not know are skipped and counted. MAVLink 2 rules are kept:
truncated payloads are filled with zeros, and fields that a newer dialect appended are ignored
(https://mavlink.io/en/guide/serialization.html). With a key, what isn't signed with it, or was
heard before, is dropped and counted (see `signing`).
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from pymavlink.dialects.v20 import all as mavlink

from mavlink_vehicle.errors import MessageError
from mavlink_vehicle.message_layout import FrameHeader, MessageLayout
from mavlink_vehicle.signing import SIGNATURE_SIZE, SignatureVerdict, Signing

__all__ = [
    "TARGETED",
    "Codec",
    "CodecStatistics",
    "Message",
    "make",
    "mavlink",
    "message_id",
    "with_source",
]

Message: TypeAlias = mavlink.MAVLink_message
"""A pymavlink message object: fields as attributes, `get_type()`, `get_srcSystem()`..."""

_MAGIC_1 = 0xFE
_MAGIC_2 = 0xFD
_HEADER_1 = struct.Struct("<BBBBBB")
_HEADER_2 = struct.Struct("<BBBBBBBHB")
_HEADER_SIZE_1 = 6
_HEADER_SIZE_2 = 10
_CHECKSUM_SIZE = 2
_FLAG_SIGNED = 0x01
_MAY_BE_UNSIGNED = mavlink.MAVLINK_MSG_ID_RADIO_STATUS
"""Telemetry radios hold no key; the specification lets this pass."""
_KEPT_SECRET = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING
"""Holds the key: the specification wants it in no recording and never forwarded."""

_make_header: Callable[..., FrameHeader] = tuple.__new__
_crc: Callable[[bytes], int] = mavlink.mcrf4xx or (lambda data: mavlink.x25crc(data).crc)


_LAYOUTS: dict[int, MessageLayout] = {
    number: MessageLayout(cls) for number, cls in mavlink.mavlink_map.items() if number >= 0
}
TARGETED: frozenset[int] = frozenset(
    number for number, layout in _LAYOUTS.items() if "target_system" in layout.names
)
"""Numbers of the messages that can be meant for one system."""

_CLASSES: dict[str, Any] = {layout.cls.msgname: layout.cls for layout in _LAYOUTS.values()}


def message_id(name: str) -> int:
    """Return the number of the message called `name`.

    Raises:
        MessageError: the dialect has no such message.
    """
    return int(_message_class(name).id)


def _message_class(name: str) -> Any:
    try:
        return _CLASSES[name]
    except KeyError:
        raise MessageError(
            f"There is no MAVLink message {name!r}; use a name such as 'HEARTBEAT'."
        ) from None


def make(name: str, /, **fields: Any) -> Message:
    """Build a message; fields that are not given are zero (or empty).

    Args:
        name: the message's name in the dialect, for example "COMMAND_LONG".
        fields: values by field name; str or bytes for text, sequences for arrays.

    Raises:
        MessageError: unknown message or field, or a value that the field cannot hold.
    """
    cls = _message_class(name)
    unknown = sorted(set(fields) - set(cls.fieldnames))
    if unknown:
        raise MessageError(
            f"{name} has no field {', '.join(unknown)}; its fields are {', '.join(cls.fieldnames)}."
        )
    lengths = dict(zip(cls.ordered_fieldnames, cls.array_lengths, strict=True))
    values = [
        _field_value(name, field_name, field_type, lengths[field_name], fields.get(field_name))
        for field_name, field_type in zip(cls.fieldnames, cls.fieldtypes, strict=True)
    ]
    try:
        message = cls(*values)
        message.pack(_SCRATCH)
    except (struct.error, TypeError, ValueError, OverflowError, IndexError) as error:
        raise MessageError(f"{name} cannot hold {fields}: {error}.") from error
    return message


def _field_value(name: str, field_name: str, field_type: str, length: int, value: Any) -> Any:
    if field_type == "char":
        raw = value.encode("utf-8") if isinstance(value, str) else bytes(value or b"")
        if len(raw) > max(length, 1):
            raise MessageError(f"{name}.{field_name} holds {length} bytes, not {len(raw)}.")
        return raw if length else raw or b"\x00"
    if length == 0:
        return 0 if value is None else value
    elements = [0] * length if value is None else list(value)
    if len(elements) != length:
        raise MessageError(f"{name}.{field_name} has {length} elements, not {len(elements)}.")
    return elements


_SCRATCH = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)


def with_source(message: Message, system_id: int, component_id: int) -> Message:
    """Set the sender of the message; without it a `Codec` puts in its own ids. Returns it."""
    header = message._header
    if isinstance(header, FrameHeader):  # it was received
        message._header = header._replace(srcSystem=system_id, srcComponent=component_id)
    else:
        header.srcSystem, header.srcComponent = system_id, component_id
    message.source_is_set = True
    return message


@dataclass
class CodecStatistics:
    """Counts since the codec was made.

    Attributes:
        frames: frames that were decoded.
        bad_crc: places that looked like a frame and whose checksum was wrong.
        unknown: well-formed frames with a message id that the dialect lacks.
        bytes_dropped: bytes that belong to no frame.
        lost: frames missing by the gaps of the sequence numbers, per (system, component).
        unsigned: frames that were dropped because they bear no signature.
        badly_signed: frames that were dropped because their signature is of another key.
        replayed: frames that were dropped because they are rightly signed but not new.
    """

    frames: int = 0
    bad_crc: int = 0
    unknown: int = 0
    bytes_dropped: int = 0
    lost: dict[tuple[int, int], int] = field(default_factory=dict)
    unsigned: int = 0
    badly_signed: int = 0
    replayed: int = 0

    @property
    def lost_total(self) -> int:
        """Frames missing from all sources together."""
        return sum(self.lost.values())


class Codec:
    """Decodes what one link receives and encodes what it sends.

    The same object serves datagrams and streams. A frame cut off at the end of the input is
    kept; if the next input continues it, it is decoded, and if that begins with a frame of its
    own (a new datagram after a damaged one), the remainder is dropped at once.

    Attributes:
        statistics: what was met so far.
        link_id: what signatures name as the link, 0 to 255. The same for all endpoints of a link,
            however often they come and go: MAVLink's C library, and so an autopilot, follows 16
            streams (MAVLINK_MAX_SIGNING_STREAMS) and rejects any further one until it restarts.
        frame_observer: called with the raw bytes of each frame that was received, known to
            the dialect or not, SETUP_SIGNING excepted; a recorder goes here.
        unknown_observer: called with the raw bytes of each frame that the dialect lacks.
    """

    def __init__(
        self, source_system: int, source_component: int, signing: Signing | None = None
    ) -> None:
        """Say as whom `encode` sends, and with which key.

        Args:
            source_system: MAVLink system id, 1 to 255.
            source_component: MAVLink component id, 1 to 255.
            signing: shared by all codecs of a server: what is sent is signed and what is
                received must be. None: nothing is signed, and signatures aren't looked at.
        """
        for what, number in (("system", source_system), ("component", source_component)):
            if not 1 <= number <= 255:
                raise MessageError(f"A MAVLink {what} id is 1 to 255, not {number}.")
        self.statistics = CodecStatistics()
        self.link_id = 0
        self.frame_observer: Callable[[bytes], None] | None = None
        self.unknown_observer: Callable[[bytes], None] | None = None
        self._source = (source_system, source_component)
        self._carry = b""
        self._packer = mavlink.MAVLink(None)
        self._signing = signing
        if signing is not None:
            self._packer.signing.secret_key = signing.key
            self._packer.signing.sign_outgoing = True
        self._next_sequence: dict[tuple[int, int], int] = {}
        self._expected_sequence: dict[tuple[int, int], int] = {}

    def encode(self, message: Message) -> bytes:
        """Return the MAVLink 2 frame; counts a sequence number per source.

        Raises:
            MessageError: a field was set to what it cannot hold.
        """
        header = message._header
        source = self._source
        if getattr(message, "source_is_set", False):
            source = (header.srcSystem, header.srcComponent)
        packer = self._packer
        packer.srcSystem, packer.srcComponent = source
        packer.seq = self._next_sequence.get(source, 0)
        if self._signing is not None:
            packer.signing.link_id = self.link_id
            packer.signing.timestamp = self._signing.next_timestamp()
        try:
            frame: bytes = message.pack(packer)
        except (struct.error, TypeError, ValueError) as error:
            raise MessageError(f"{message.get_type()} cannot be encoded: {error}.") from error
        self._next_sequence[source] = (packer.seq + 1) % 256
        return frame

    def decode(self, data: bytes) -> list[Message]:
        """Return the messages in `data` (a datagram or a piece of a stream). Never raises."""
        messages: list[Message] = []
        carried = len(self._carry)
        buffer = self._carry + data if carried else bytes(data)
        self._carry = b""
        position = 0
        end = len(buffer)
        while position < end:
            size = self._frame(buffer, position, end, messages)
            if size > 0:
                position += size
                continue
            if size < 0:  # incomplete
                if position < carried and self._starts_a_frame(buffer, carried, end):
                    self.statistics.bytes_dropped += carried - position
                    position = carried
                    continue
                self._carry = buffer[position:]
                break
            start = position
            position = _next_magic(buffer, position + 1)
            self.statistics.bytes_dropped += position - start
        return messages

    def _frame(self, buffer: bytes, start: int, end: int, messages: list[Message]) -> int:
        """Decode the frame at `start`; its size, 0 when there is none, -1 when incomplete."""
        length: int
        try:
            if buffer[start] == _MAGIC_2:
                _, length, flags, compatible, sequence, system, component, low, high = (
                    _HEADER_2.unpack_from(buffer, start)
                )
                number = low | high << 16
                body = start + _HEADER_SIZE_2
            elif buffer[start] == _MAGIC_1:
                _, length, sequence, system, component, number = _HEADER_1.unpack_from(
                    buffer, start
                )
                flags = compatible = 0
                body = start + _HEADER_SIZE_1
            else:
                return 0
        except struct.error:
            return -1
        if flags & ~_FLAG_SIGNED:
            return 0  # the specification: drop frames with flags one doesn't know
        checksum = body + length
        stop = checksum + (_CHECKSUM_SIZE + SIGNATURE_SIZE if flags else _CHECKSUM_SIZE)
        if stop > end:
            return -1
        layout = _LAYOUTS.get(number)
        if layout is None:
            return self._unknown(buffer, start, stop, end, number, flags)
        crc = buffer[checksum] | buffer[checksum + 1] << 8
        if _crc(buffer[start + 1 : checksum] + layout.crc_extra) != crc:
            self.statistics.bad_crc += 1
            return 0
        frame = buffer[start:stop]
        if self._signing is not None and not self._trust(self._signing, frame, number, flags):
            return stop - start
        fields = (length, flags, compatible, sequence, system, component, number)
        header = _make_header(FrameHeader, fields)
        if length < layout.size:  # zeros at the end are not sent
            payload = buffer[body:checksum] + bytes(layout.size - length)
            messages.append(layout.decode(payload, 0, frame, crc, header))
        else:
            messages.append(layout.decode(buffer, body, frame, crc, header))
        self.statistics.frames += 1
        self._note(frame, number, system, component, sequence)
        return stop - start

    def _trust(self, signing: Signing, frame: bytes, number: int, flags: int) -> bool:
        """Return whether the frame may be believed; one that may not is counted."""
        if not flags:
            trusted: bool = number == _MAY_BE_UNSIGNED
            self.statistics.unsigned += not trusted
            return trusted
        verdict = signing.check(frame)
        self.statistics.badly_signed += verdict is SignatureVerdict.WRONG
        self.statistics.replayed += verdict is SignatureVerdict.REPLAYED
        return verdict is SignatureVerdict.GOOD

    def _unknown(
        self, buffer: bytes, start: int, stop: int, end: int, number: int, flags: int
    ) -> int:
        """Step over a frame whose checksum can't be checked, if what follows looks right."""
        if stop < end and buffer[stop] not in (_MAGIC_1, _MAGIC_2):
            return 0
        frame = buffer[start:stop]
        if self._signing is not None and not self._trust(self._signing, frame, number, flags):
            return stop - start
        self.statistics.unknown += 1
        if self.unknown_observer is not None:
            self.unknown_observer(frame)
        version_2 = buffer[start] == _MAGIC_2
        sequence, system, component = frame[4:7] if version_2 else frame[2:5]
        self._note(frame, number, system, component, sequence)
        return stop - start

    def _starts_a_frame(self, buffer: bytes, start: int, end: int) -> bool:
        """Return whether a whole frame with a right checksum stands at `start`."""
        if start == end or buffer[start] not in (_MAGIC_1, _MAGIC_2):
            return False
        version_2 = buffer[start] == _MAGIC_2
        header = _HEADER_SIZE_2 if version_2 else _HEADER_SIZE_1
        if end - start < header:
            return False
        number = (
            int.from_bytes(buffer[start + 7 : start + 10], "little")
            if version_2
            else buffer[start + 5]
        )
        checksum = start + header + buffer[start + 1]
        layout = _LAYOUTS.get(number)
        if layout is None or checksum + _CHECKSUM_SIZE > end:
            return False
        expected = buffer[checksum] | buffer[checksum + 1] << 8
        return bool(_crc(buffer[start + 1 : checksum] + layout.crc_extra) == expected)

    def _note(self, frame: bytes, number: int, system: int, component: int, sequence: int) -> None:
        """Show the frame around, and count what is missing before it (late ones not twice)."""
        if self.frame_observer is not None and number != _KEPT_SECRET:
            self.frame_observer(frame)
        source = (system, component)
        expected = self._expected_sequence.get(source, sequence)
        if sequence != expected:
            gap = (sequence - expected) & 0xFF
            if gap > 0x7F:  # late or a duplicate: nothing new is missing
                return
            lost = self.statistics.lost
            lost[source] = lost.get(source, 0) + gap
        self._expected_sequence[source] = (sequence + 1) & 0xFF


def _next_magic(buffer: bytes, start: int) -> int:
    """Return where the next frame may begin, or the end of the buffer."""
    second = buffer.find(_MAGIC_2, start)
    first = buffer.find(_MAGIC_1, start, second if second >= 0 else len(buffer))
    if first >= 0:
        return first
    return second if second >= 0 else len(buffer)
