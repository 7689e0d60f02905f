"""The wire layout of a message, prepared once for fast decoding."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class FrameHeader(NamedTuple):
    """The header of a received frame, with the names that pymavlink's has."""

    mlen: int
    incompat_flags: int
    compat_flags: int
    seq: int
    srcSystem: int  # noqa: N815
    srcComponent: int  # noqa: N815
    msgId: int  # noqa: N815


Decode = Callable[[bytes, int, bytes, int, FrameHeader], Any]
"""Makes a message of the bytes that hold its full payload, where in them that begins, its frame,
its checksum and its header."""


_SIZES = {
    "char": 1, "uint8_t": 1, "int8_t": 1, "uint16_t": 2, "int16_t": 2, "uint32_t": 4, "int32_t": 4,
    "float": 4, "uint64_t": 8, "int64_t": 8, "double": 8,
}  # fmt: skip


class MessageLayout:
    """The layout of one of pymavlink's generated message classes.

    Attributes:
        cls: the class.
        crc_extra: what its checksum ends with.
        size: bytes of the full payload.
        base_size: bytes of the payload without extension fields, which MAVLink 1 lacks.
        names: its fields, in the order of the wire.
        decode: makes a message; written and compiled when the first one comes.
    """

    __slots__ = ("base_size", "cls", "crc_extra", "decode", "names", "size")

    def __init__(self, cls: Any) -> None:
        """Prepare the layout of `cls`, one of the dialect's message classes."""
        self.cls = cls
        self.crc_extra = bytes([cls.crc_extra])
        self.size: int = cls.unpacker.size
        self.names: tuple[str, ...] = tuple(cls.ordered_fieldnames)
        self.base_size = self.size - _extension_size(cls)
        self.decode: Decode = self._decode_first

    def _decode_first(
        self, data: bytes, start: int, frame: bytes, crc: int, header: FrameHeader
    ) -> Any:
        # The generated constructors set these in each message besides the fields.
        self.cls._payload = self.cls._link_id = self.cls._instances = None
        self.cls._signed = False
        self.cls._fieldnames, self.cls._type = self.cls.fieldnames, self.cls.msgname
        self.cls._instance_field = self.cls.instance_field
        self.cls._instance_offset = self.cls.instance_offset
        scope = {"new": object.__new__, "cls": self.cls, "unpack": self.cls.unpacker.unpack_from}
        exec(self._source(), scope)
        self.decode = scope["decode"]
        return self.decode(data, start, frame, crc, header)

    def _source(self) -> str:
        """Return the code of `decode`: to assign each field is several times as fast as a loop."""
        types = dict(zip(self.cls.fieldnames, self.cls.fieldtypes, strict=True))
        lines = ["message = new(cls)"]
        if any(length > 1 for length in self.cls.lengths):
            lines.append("values = unpack(data, start)")
            start = 0
            for name, length in zip(self.names, self.cls.lengths, strict=True):
                part = (
                    f"list(values[{start}:{start + length}])" if length > 1 else f"values[{start}]"
                )
                lines.append(f"message.{name} = {part}")
                start += length
        else:
            targets = "".join(f"message.{name}, " for name in self.names)
            lines.append(f"({targets}) = unpack(data, start)")
        for name in self.names:
            if types[name] == "char":
                lines += [
                    f"message._{name}_raw = raw = message.{name}.rstrip(b'\\0')",
                    f"message.{name} = raw.split(b'\\0', 1)[0].decode('ascii', errors='replace')",
                ]
        lines += ["message._msgbuf = frame", "message._crc = crc", "message._header = header"]
        body = "".join(f"    {line}\n" for line in [*lines, "return message"])
        return f"def decode(data, start, frame, crc, header):\n{body}"


def _extension_size(cls: Any) -> int:
    """Return the bytes of the extension fields, the last ones on the wire.

    The generated constructors have a default for each of them, and for one field besides.
    """
    count = len(cls.__init__.__defaults__ or ())
    if cls.msgname == "HEARTBEAT":
        count -= 1  # mavlink_version
    types = dict(zip(cls.fieldnames, cls.fieldtypes, strict=True))
    sizes = [
        _SIZES[types[name]] * max(length, 1)
        for name, length in zip(cls.ordered_fieldnames, cls.array_lengths, strict=True)
    ]
    return sum(sizes[len(sizes) - count :])
