"""ArduPilot's @PARAM/param.pck: all parameters in a few kilobytes.

The format, read in AP_Filesystem_Param.cpp: a header of magic number, number of parameters in the
file and in the vehicle; for each parameter a byte with its type and whether its default follows, a
byte with the number of letters that its name shares with the one before and of those that it has
more (less one), these letters, the value, the default. Zeros are put in front of a parameter so
that no value lies in two packets, which is why one file is always read in packets of one size.
"""

from __future__ import annotations

import errno
import math
import struct
from dataclasses import dataclass
from urllib.parse import parse_qsl

from mavlink_sitl.autopilot.parameters import Parameters, ParameterType
from mavlink_sitl.mavlink.files.storage import StorageError

PATH = "@PARAM/param.pck"
MAGIC, MAGIC_WITH_DEFAULTS = 0x671B, 0x671C
_HEADER = struct.Struct("<HHH")
_PACKED = {
    ParameterType.INT8: (1, struct.Struct("<b")),
    ParameterType.INT16: (2, struct.Struct("<h")),
    ParameterType.INT32: (3, struct.Struct("<i")),
    ParameterType.REAL32: (4, struct.Struct("<f")),
}
"""The number of the type and its form"""
HAS_DEFAULT = 0x10
BYTES_EACH = 12
"""Bytes that the firmware reckons for each parameter when it reports the size of the file"""
COUNT_MAX = 0xFFFF


@dataclass(frozen=True)
class Query:
    """The options after the question mark in the name of the file.

    Attributes:
        start: number of the first parameter.
        count: most of them; 0 is all.
        with_defaults: values that are not their defaults come with these.
    """

    start: int = 0
    count: int = 0
    with_defaults: bool = False


def query(text: str) -> Query:
    """Read it; what is unknown is passed over.

    Raises:
        StorageError: a number is none, or too large.
    """
    given = dict(parse_qsl(text))
    numbers = {}
    for name, most in (("start", COUNT_MAX), ("count", COUNT_MAX), ("withdefaults", 2)):
        value = given.get(name, "0")
        if not (value.isascii() and value.isdigit()) or int(value) >= most:
            raise StorageError(errno.EINVAL)
        numbers[name] = int(value)
    return Query(numbers["start"], numbers["count"], numbers["withdefaults"] == 1)


class PackedParameters:
    """The file, as it is at the first read."""

    def __init__(self, parameters: Parameters, asked: Query) -> None:
        self._parameters = parameters
        self._asked = asked
        self._data = b""
        self._packet_bytes = 0

    @property
    def reported_size(self) -> int:
        """A guess."""
        return len(self._parameters) * BYTES_EACH

    def read(self, offset: int, count: int) -> bytes:
        """See `Contents`; always as many bytes as at first."""
        if not self._packet_bytes and count:
            if self._asked.start >= len(self._parameters):
                raise StorageError(errno.EINVAL)
            self._packet_bytes = count
            self._data = pack(self._parameters, self._asked, count)
        if count != self._packet_bytes:
            raise StorageError(errno.EINVAL)
        return self._data[offset : offset + count]


def pack(parameters: Parameters, asked: Query, packet_bytes: int) -> bytes:
    """The file for a size of packets."""
    names = parameters.names()[asked.start :]
    if asked.count:
        names = names[: asked.count]
    magic = MAGIC_WITH_DEFAULTS if asked.with_defaults else MAGIC
    data = bytearray(_HEADER.pack(magic, len(names), len(parameters)))
    before = ""
    for name in names:
        spec = parameters.specs[name]
        kind, form = _PACKED[spec.type]
        value = parameters[name]
        values = [value]
        if asked.with_defaults and not math.isclose(value, spec.default, rel_tol=1e-7):
            values.append(spec.default)
            kind |= HAS_DEFAULT
        common = min(_shared(before, name), len(name) - 1)
        own = name[common:].encode("ascii")
        number = float if form.format == "<f" else int
        packed = b"".join(form.pack(number(each)) for each in values)
        record = bytes((kind, common | (len(own) - 1) << 4)) + own + packed
        over = (len(data) + len(record)) % packet_bytes
        if form.size > 1 and 0 < over < form.size:
            data += bytes(form.size - over)
        data += record
        before = name
    return bytes(data)


def _shared(before: str, name: str) -> int:
    """How many letters two names have in common."""
    count = 0
    while before[count : count + 1] == name[count : count + 1] != "":
        count += 1
    return count
