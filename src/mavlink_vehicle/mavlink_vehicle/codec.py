"""Bytes <-> MAVLink messages.

Frames are decoded whole, with the tables of pymavlink's generated classes, instead of byte
by byte with its parser: the result is the same message object (a test holds every message
class to that) for a quarter of the time.

`Codec.decode` does not raise, whatever bytes it gets. Garbage, damaged frames and
messages that the dialect does not know are skipped and counted. MAVLink 2 rules are kept:
truncated payloads are filled with zeros, and fields that a newer dialect appended are ignored
(https://mavlink.io/en/guide/serialization.html). With a key, what isn't signed with it, or was
heard before, is dropped and counted (see `signing`).
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, TypeAlias, cast

from mavlink_vehicle import dialect as mavlink
from mavlink_vehicle.errors import MessageError
from mavlink_vehicle.message_layout import FrameHeader, MessageLayout
from mavlink_vehicle.signing import SIGNATURE_SIZE, SignatureVerdict, Signing

__all__ = [
    "MAVLINK_1_HEARTBEATS",
    "TARGETED",
    "Codec",
    "CodecStatistics",
    "Intake",
    "Measured",
    "Message",
    "Received",
    "Sender",
    "Targeted",
    "in_mavlink_1",
    "is_mavlink_1",
    "make",
    "mavlink",
    "message_id",
    "message_of",
    "target",
    "with_source",
]

Message: TypeAlias = mavlink.MAVLink_message
"""A pymavlink message object: fields as attributes, `get_type()`, `get_srcSystem()`..."""

Intake: TypeAlias = Callable[[bytes, float], bool]
"""Takes a measurement straight from its frame, at a time in seconds.

The bytes are those of a MAVLink 2 frame, with the full payload from `PAYLOAD_START` on: zeros that
were not sent are filled in, and what comes after the payload is of no account. False: it has not
been taken, and must be received as a message.
"""

Measured: TypeAlias = tuple["Sender", Intake, bytes, bytes]
"""A measurement that came: who sent it, who takes it, the bytes for that, and its frame."""

Received: TypeAlias = "Message | Measured"

PAYLOAD_START = 10
"""Where the payload of a MAVLink 2 frame begins."""

_MAGIC_1 = 0xFE
_MAGIC_2 = 0xFD
_HEADER_1 = struct.Struct("<BBBBBB")
_HEADER_2 = struct.Struct("<BBBBBBBHB")
# Length, flags, sequence number, sender and message number, all but its highest byte.
_SHORT_HEADER = struct.Struct("<xBBxBHHx").unpack_from
_HEADER_SIZE_1 = 6
_HEADER_SIZE_2 = PAYLOAD_START
_CHECKSUM_SIZE = 2
_LEAST_SIZE_2 = PAYLOAD_START + _CHECKSUM_SIZE
_FLAG_SIGNED = 0x01
_MAY_BE_UNSIGNED = mavlink.MAVLINK_MSG_ID_RADIO_STATUS
"""Telemetry radios hold no key; the specification lets this pass."""
_KEPT_SECRET = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING
"""Holds the key: the specification wants it in no recording and never forwarded."""

MAVLINK_1_HEARTBEATS = 5
"""After this many in a row in MAVLink 1 a vehicle is taken to speak nothing else.

Those that begin with it, as PX4 does with MAV_PROTO_VER 0, change with the first MAVLink 2 frame
that they hear; ArduPilot with SERIALn_PROTOCOL 1 and PX4 with MAV_PROTO_VER 1 never do, but hear
both.
"""
_MAVLINK_2_EVERY = 4
"""One in this many HEARTBEATs stays MAVLink 2: a restarted vehicle changes when it hears one."""
_NUMBER_MAX_1 = 255

_make_header: Callable[..., FrameHeader] = tuple.__new__
_crc: Callable[[bytes], int] = mavlink.mcrf4xx or (lambda data: mavlink.x25crc(data).crc)


_LAYOUTS: dict[int, MessageLayout] = {
    number: MessageLayout(cls) for number, cls in mavlink.mavlink_map.items() if number >= 0
}
TARGETED: frozenset[int] = frozenset(
    number for number, layout in _LAYOUTS.items() if "target_system" in layout.names
)
"""Numbers of the messages that can be meant for one system."""

_CLASSES: dict[str, type[Message]] = {
    layout.cls.msgname: layout.cls for layout in _LAYOUTS.values()
}


class _Form(NamedTuple):
    """How a message is made.

    Attributes:
        cls: its class.
        names: its fields.
        fields: of each field in the order of the constructor its name, whether it is text, and its
            length as an array, 0 for a single value.
    """

    cls: type[Message]
    names: frozenset[str]
    fields: tuple[tuple[str, bool, int], ...]


def message_id(name: str) -> int:
    """Return the number of the message called `name`.

    Raises:
        MessageError: the dialect has no such message.
    """
    return _message_class(name).id


def _message_class(name: str) -> type[Message]:
    try:
        return _CLASSES[name]
    except KeyError:
        raise MessageError(
            f"There is no MAVLink message {name!r}; use a name such as 'HEARTBEAT'."
        ) from None


@functools.cache
def _form(name: str) -> _Form:
    cls = _message_class(name)
    lengths = dict(zip(cls.ordered_fieldnames, cls.array_lengths, strict=True))
    fields = [
        (field, kind == "char", lengths[field])
        for field, kind in zip(cls.fieldnames, cls.fieldtypes, strict=True)
    ]
    return _Form(cls, frozenset(cls.fieldnames), tuple(fields))


def make(name: str, /, **fields: Any) -> Message:
    """Build a message; fields that are not given are zero (or empty).

    Args:
        name: the message's name in the dialect, for example "COMMAND_LONG".
        fields: values by field name; str or bytes for text, sequences for arrays.

    Raises:
        MessageError: unknown message or field, or a value that the field cannot hold.
    """
    cls, names, known = _form(name)
    if not fields.keys() <= names:
        unknown = ", ".join(sorted(fields.keys() - names))
        raise MessageError(
            f"{name} has no field {unknown}; its fields are {', '.join(cls.fieldnames)}."
        )
    values = [
        _text_or_array(name, field_name, is_text, length, fields.get(field_name))
        if is_text or length
        else (0 if (value := fields.get(field_name)) is None else value)
        for field_name, is_text, length in known
    ]
    try:
        message = cls(*values)
        message.pack(_SCRATCH)
    except (struct.error, TypeError, ValueError, OverflowError, IndexError) as error:
        raise MessageError(f"{name} cannot hold {fields}: {error}.") from error
    return message


def _text_or_array(name: str, field_name: str, is_text: bool, length: int, value: Any) -> Any:
    if is_text:
        raw = value.encode("utf-8") if isinstance(value, str) else bytes(value or b"")
        if len(raw) > max(length, 1):
            raise MessageError(f"{name}.{field_name} holds {length} bytes, not {len(raw)}.")
        return raw if length else raw or b"\x00"
    elements = [0] * length if value is None else list(value)
    if len(elements) != length:
        raise MessageError(f"{name}.{field_name} has {length} elements, not {len(elements)}.")
    return elements


_SCRATCH = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)


def is_mavlink_1(message: Message) -> bool:
    """Return whether a message that was received came in MAVLink 1."""
    return bool(message._msgbuf) and message._msgbuf[0] == _MAGIC_1


def message_of(frame: bytes) -> Message:
    """Return the message of a frame whose checksum is known to be right."""
    (message,) = Codec(1, 1).decode(frame)
    return message


def in_mavlink_1(frame: bytes) -> bytes:
    """Return a frame in MAVLink 1 with all of its content; empty if it has no such form.

    Numbers above 255, unknown messages, extension fields that are not 0 and signatures have none.

    Args:
        frame: a whole frame, of MAVLink 1 or 2.
    """
    if frame[0] == _MAGIC_1:
        return frame
    number = int.from_bytes(frame[7:10], "little")
    layout = _LAYOUTS.get(number)
    if layout is None or number > _NUMBER_MAX_1 or frame[2] & _FLAG_SIGNED:
        return b""
    payload = frame[_HEADER_SIZE_2:-_CHECKSUM_SIZE].rstrip(b"\0")
    if len(payload) > layout.base_size:
        return b""
    body = bytes((layout.base_size, *frame[4:7], number)) + payload.ljust(layout.base_size, b"\0")
    checksum = _crc(body + layout.crc_extra)
    return bytes((_MAGIC_1,)) + body + checksum.to_bytes(2, "little")


class Targeted(Protocol):
    """A message of `TARGETED` that names a component, too."""

    target_system: int
    target_component: int


def target(message: Message) -> tuple[int, int]:
    """Return for which system and component a message is meant; 0 for all."""
    if message._header.msgId not in TARGETED:
        return 0, 0
    return cast("Targeted", message).target_system, getattr(message, "target_component", 0)


def with_source(
    message: Message, system_id: int, component_id: int, sequence: int | None = None
) -> Message:
    """Set the sender of the message; without it a `Codec` puts in its own ids. Returns it.

    `sequence` is the number in its header, for a message that is not encoded.
    """
    header = message._header
    number = header.seq if sequence is None else sequence
    if isinstance(header, FrameHeader):  # it was received
        message._header = header._replace(
            seq=number, srcSystem=system_id, srcComponent=component_id
        )
    else:
        header.seq, header.srcSystem, header.srcComponent = number, system_id, component_id
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


class Sender:
    """One who sends measurements that are taken straight from their frames.

    Attributes:
        frames: how many of its frames were received.
    """

    __slots__ = ("frames", "takes")

    def __init__(self) -> None:
        """Begin with messages only."""
        self.frames = 0
        self.takes: dict[int, tuple[Intake, int, bytes]] = {}

    def grant(self, intakes: Mapping[int, Intake]) -> None:
        """Have measurements taken from their frames from now on: by message number below 65536."""
        self.takes = {
            number: (intake, _LEAST_SIZE_2 + _LAYOUTS[number].size, _LAYOUTS[number].crc_extra)
            for number, intake in intakes.items()
        }


class Codec:
    """Decodes what one link receives and encodes what it sends.

    The same object serves datagrams and streams. A frame cut off at the end of the input is
    kept; if the next input continues it, it is decoded, and if that begins with a frame of its
    own (a new datagram after a damaged one), the remainder is dropped at once.

    Attributes:
        statistics: counts of frames and errors.
        link_id: what signatures name as the link, 0 to 255. The same for all endpoints of a link,
            however often they come and go: MAVLink's C library, and so an autopilot, follows 16
            streams (MAVLINK_MAX_SIGNING_STREAMS) and rejects any further one until it restarts.
        frame_observer: called with the raw bytes of each frame that was received, known to
            the dialect or not, SETUP_SIGNING excepted; a recorder goes here.
        unknown_observer: called with the raw bytes of each frame that the dialect lacks.
        senders: whose measurements are taken from their frames, by system id and 256 times the
            component id. Those that are signed come as messages.
        speaks_1: whether the vehicle there speaks MAVLink 1 only; never with a key, which needs 2.
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
        self.senders: dict[int, Sender] = {}
        self._source = (source_system, source_component)
        self._carry = b""
        self._packer = mavlink.MAVLink(None)
        self._signing = signing
        if signing is not None:
            self._packer.signing.secret_key = signing.key
            self._packer.signing.sign_outgoing = True
        self.speaks_1 = False
        self._heartbeats_1 = self._own_heartbeats = 0
        self._next_sequence: dict[tuple[int, int], int] = {}
        self._expected_sequence: dict[int, int] = {}

    def encode(self, message: Message) -> bytes:
        """Return the frame; counts a sequence number per source.

        It is MAVLink 2, unless only MAVLink 1 is spoken there and the message fits into that.

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
            if self.speaks_1:
                frame = self._frame_1(message, frame)
        except (struct.error, TypeError, ValueError) as error:
            raise MessageError(f"{message.get_type()} cannot be encoded: {error}.") from error
        self._next_sequence[source] = (packer.seq + 1) % 256
        return frame

    def _frame_1(self, message: Message, frame: bytes) -> bytes:
        """Return the MAVLink 1 frame of a message, or its MAVLink 2 frame if it has none."""
        number = message.get_msgId()
        if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self._own_heartbeats += 1
            if self._own_heartbeats % _MAVLINK_2_EVERY == 0:
                return frame
        return in_mavlink_1(frame) or frame

    def decode(self, data: bytes) -> list[Message]:
        """Return the messages in `data` (a datagram or a piece of a stream). Never raises.

        Measurements of `senders` are not among them.
        """
        return [message for message in self.receive(data) if not isinstance(message, tuple)]

    def receive(self, data: bytes) -> list[Received]:
        """Return the messages in `data` (a datagram or a piece of a stream). Never raises.

        A measurement of one of `senders` is a `Measured`, in the place of its message.
        """
        messages: list[Received] = []
        carried = len(self._carry)
        buffer = self._carry + data if carried else bytes(data)
        self._carry = b""
        position = 0
        end = len(buffer)
        senders = self.senders
        while position < end:
            size = self._measured(buffer, position, end, messages) if senders else 0
            if size == 0:
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

    def _measured(self, buffer: bytes, start: int, end: int, messages: list[Received]) -> int:
        """Take the measurement at `start`; its size, 0 when `_frame` must see what is there.

        Most of what comes is a measurement; so everything is done here, in one pass.
        """
        if end - start < _LEAST_SIZE_2 or buffer[start] != _MAGIC_2:
            return 0
        length: int
        length, flags, sequence, source, number = _SHORT_HEADER(buffer, start)
        sender = self.senders.get(source)
        if sender is None or flags or buffer[start + 9]:
            return 0
        take = sender.takes.get(number)
        size = length + _LEAST_SIZE_2
        if take is None or size > end - start or self._signing is not None:
            return 0
        frame = buffer[start : start + size]
        intake, full, crc_extra = take
        if _crc(frame[1:-2] + crc_extra) != frame[-2] | frame[-1] << 8:
            return 0
        self.statistics.frames += 1
        if self.frame_observer is not None:
            self.frame_observer(frame)
        if self._expected_sequence.get(source) == sequence:
            self._expected_sequence[source] = (sequence + 1) & 0xFF
        else:
            self._follow(source, sequence)
        data = frame if size >= full else frame[:-2] + bytes(full - size)
        messages.append((sender, intake, data, frame))
        return size

    def _frame(self, buffer: bytes, start: int, end: int, messages: list[Received]) -> int:
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
        if number == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self._heartbeats_1 = self._heartbeats_1 + 1 if frame[0] == _MAGIC_1 else 0
            enough = self._heartbeats_1 >= MAVLINK_1_HEARTBEATS
            self.speaks_1 = enough and self._signing is None
        self._follow(system | component << 8, sequence)

    def _follow(self, source: int, sequence: int) -> None:
        """Count what is missing before a frame, late ones not twice."""
        expected = self._expected_sequence.get(source, sequence)
        if sequence != expected:
            gap = (sequence - expected) & 0xFF
            if gap > 0x7F:  # late or a duplicate: nothing new is missing
                return
            lost, who = self.statistics.lost, (source & 0xFF, source >> 8)
            lost[who] = lost.get(who, 0) + gap
        self._expected_sequence[source] = (sequence + 1) & 0xFF


def _next_magic(buffer: bytes, start: int) -> int:
    """Return where the next frame may begin, or the end of the buffer."""
    second = buffer.find(_MAGIC_2, start)
    first = buffer.find(_MAGIC_1, start, second if second >= 0 else len(buffer))
    if first >= 0:
        return first
    return second if second >= 0 else len(buffer)
