"""The wire layout of a message, prepared once for fast decoding."""

from __future__ import annotations

from typing import Any


class MessageLayout:
    """The layout of one of pymavlink's generated message classes."""

    __slots__ = ("arrays", "cls", "crc_extra", "names", "size", "strings", "template", "unpack")

    def __init__(self, cls: Any) -> None:
        """Prepare the layout of `cls`, one of the dialect's message classes."""
        self.cls = cls
        self.crc_extra = bytes([cls.crc_extra])
        self.unpack = cls.unpacker.unpack
        self.size: int = cls.unpacker.size
        self.names: tuple[str, ...] = tuple(cls.ordered_fieldnames)
        self.strings: tuple[str, ...] = ()
        self.arrays: tuple[tuple[str, int, int], ...] = ()
        # The attributes that the generated constructors set beside the fields.
        self.template: dict[str, Any] = {
            "_payload": None,
            "_fieldnames": cls.fieldnames,
            "_type": cls.msgname,
            "_signed": False,
            "_link_id": None,
            "_instances": None,
            "_instance_field": cls.instance_field,
            "_instance_offset": cls.instance_offset,
        }
        types = dict(zip(cls.fieldnames, cls.fieldtypes, strict=True))
        self.strings = tuple(name for name in self.names if types[name] == "char")
        if any(length > 1 for length in cls.lengths):
            start = 0
            slices = []
            for name, length in zip(self.names, cls.lengths, strict=True):
                slices.append((name, start, length))
                start += length
            self.arrays = tuple(slices)

    def fields(self, payload: bytes) -> dict[str, Any]:
        """Return the attributes of a message with this payload, padded to full size."""
        attributes = self.template.copy()
        values = self.unpack(payload)
        if self.arrays:
            for name, start, length in self.arrays:
                attributes[name] = (
                    values[start] if length == 1 else list(values[start : start + length])
                )
        else:
            attributes.update(zip(self.names, values))  # noqa: B905 - equal by construction
        for name in self.strings:
            raw = attributes[name].rstrip(b"\x00")
            attributes[f"_{name}_raw"] = raw
            attributes[name] = raw.split(b"\x00", 1)[0].decode("ascii", errors="replace")
        return attributes
