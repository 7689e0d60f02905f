"""PX4's parameter service: integers bytewise, and a hash over everything.

As recorded (`probe_ground`): a missing name and a wrong type in PARAM_SET get no answer; the
list begins with _HASH_CHECK, whose index is 65535 and which is not counted.
"""

from __future__ import annotations

import math
import struct
import zlib

from mavlink_sitl.autopilot.parameters import Parameters, ParameterType
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.parameters import ECHO_INDEX, ParameterServer

HASH_CHECK = "_HASH_CHECK"


def as_float(value: int, code: str = "i") -> float:
    """The float with the same four bytes."""
    return float(struct.unpack("<f", struct.pack(f"<{code}", value))[0])


def as_int(value: float) -> int:
    """The signed integer with the same four bytes."""
    return int(struct.unpack("<i", struct.pack("<f", value))[0])


def parameter_hash(parameters: Parameters) -> int:
    """CRC-32 over names and values in their order, without PX4's usual inversions."""
    state = 0xFFFFFFFF
    for name in parameters.names():
        value = parameters[name]
        integer = parameters.specs[name].type is not ParameterType.REAL32
        raw = struct.pack("<i", int(value)) if integer else struct.pack("<f", value)
        state = zlib.crc32(name.encode("ascii") + raw, state)
    return state ^ 0xFFFFFFFF


class Px4ParameterServer(ParameterServer):
    """Answers for one vehicle's parameters on one link."""

    per_tick = 10
    """887 messages were recorded in 0.9 s"""

    def request_list(self) -> None:
        """PARAM_REQUEST_LIST: the hash and all of them."""
        super().request_list()
        self._to_list = (HASH_CHECK, *self._to_list)

    def take_portion(self) -> list[Message]:
        """The next part of a list in progress."""
        if self._to_list and self._to_list[0] == HASH_CHECK:
            self._to_list = self._to_list[1:]
            return [self._hash()]
        return super().take_portion()

    def read(self, name: str, index: int) -> Message | None:
        """PARAM_REQUEST_READ: by index when it is not negative, else by name."""
        if index < 0 and name == HASH_CHECK:
            return self._hash()
        return super().read(name, index)

    def set_typed(self, name: str, value: float, kind: int) -> Message | None:
        """PARAM_SET; of _HASH_CHECK: the asker knows all values and wants no list."""
        if name == HASH_CHECK:
            self._to_list = ()
            return None
        spec = self._parameters.specs.get(name)
        if spec is None or int(spec.type) != kind:
            return None
        if spec.type is ParameterType.INT32:
            self._parameters.set(name, float(as_int(value)))
        elif math.isfinite(value):
            self._parameters.set(name, value)
        return self._indexed(name)

    def _value(self, name: str, index: int) -> Message:
        spec = self._parameters.specs[name]
        value = self._parameters[name]
        if spec.type is ParameterType.INT32:
            value = as_float(int(value))
        return dialect.MAVLink_param_value_message(
            name.encode("ascii"), value, int(spec.type), len(self._parameters), index
        )

    def _hash(self) -> Message:
        return dialect.MAVLink_param_value_message(
            HASH_CHECK.encode("ascii"), as_float(parameter_hash(self._parameters), "I"),
            dialect.MAV_PARAM_TYPE_UINT32, len(self._parameters), ECHO_INDEX,
        )  # fmt: skip
