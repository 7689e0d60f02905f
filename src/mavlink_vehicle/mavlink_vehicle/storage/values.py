"""Values of parameters as they travel: ArduPilot's floats, PX4's integers bytewise."""

from __future__ import annotations

import math
import struct

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import Parameter, parameter_text
from mavlink_vehicle.protocols.parameters import decode_value

REAL32 = mavlink.MAV_PARAM_TYPE_REAL32
_INTEGERS = {
    mavlink.MAV_PARAM_TYPE_UINT8: ("UINT8", "<Bxxx", 0, 2**8 - 1),
    mavlink.MAV_PARAM_TYPE_INT8: ("INT8", "<bxxx", -(2**7), 2**7 - 1),
    mavlink.MAV_PARAM_TYPE_UINT16: ("UINT16", "<Hxx", 0, 2**16 - 1),
    mavlink.MAV_PARAM_TYPE_INT16: ("INT16", "<hxx", -(2**15), 2**15 - 1),
    mavlink.MAV_PARAM_TYPE_UINT32: ("UINT32", "<I", 0, 2**32 - 1),
    mavlink.MAV_PARAM_TYPE_INT32: ("INT32", "<i", -(2**31), 2**31 - 1),
}
_FLOAT32_INTEGER_MAX = 2**24

FLOAT_MAX = 1e7
"""The largest magnitude of a parameter that is a float.

Neither firmware has one that means anything beyond it, and ArduPilot stores whatever number it is
sent: a WPNAV_SPEED of 5e9 cm/s (observed). No message has a parameter's own range.
"""


def parameter_of(message: mavlink.MAVLink_param_value_message, bytewise: bool) -> Parameter:
    """Read a PARAM_VALUE; the arguments are those of `decode_value`."""
    value = decode_value(message, bytewise)
    return Parameter(message.param_id.rstrip("\0"), value, int(message.param_type))


def encode_value(value: float, kind: int, bytewise: bool) -> float:
    """Return what stands in PARAM_SET's float field; the value must have no `value_problem`.

    Raises:
        ValueError: with `bytewise`, the bytes of the integer are no float that a codec in Python
            carries unchanged (a signalling NaN).
    """
    layout = _INTEGERS.get(kind) if bytewise else None
    if layout is None:
        return value
    raw = struct.pack(layout[1], int(value))
    (number,) = struct.unpack("<f", raw)
    if struct.pack("<f", number) != raw:
        raise ValueError(f"The integer {value:.0f} cannot be sent in a float.")
    return float(number)


def value_problem(value: float, kind: int, bytewise: bool) -> str | None:
    """Return why a parameter of this MAV_PARAM_TYPE cannot have a value; part of a sentence."""
    if not math.isfinite(value):
        return f"{value} is not a finite number"
    known = _INTEGERS.get(kind)
    if known is None:
        if kind != REAL32:
            return f"its type, MAV_PARAM_TYPE {kind}, is not supported"
        if abs(value) > FLOAT_MAX:
            return f"{value:g} is beyond {FLOAT_MAX:.0f}, which no parameter's value is"
        return (
            f"{value:g} is sent as a float, which is 0" if value and not as_float32(value) else None
        )
    name, _, lowest, highest = known
    if value != int(value) or not lowest <= value <= highest:
        text = parameter_text(value)
        return f"{text} is not an integer from {lowest} to {highest}, as its type {name} needs"
    if not bytewise and abs(value) > _FLOAT32_INTEGER_MAX and as_float32(value) != value:
        return f"{value:.0f} is sent as a float, which rounds it to {as_float32(value):.0f}"
    return None


def same_value(wanted: float, parameter: Parameter) -> bool:
    """Return whether a parameter has a value, as far as its type can hold it."""
    if parameter.type in _INTEGERS:
        return wanted == parameter.value
    return as_float32(wanted) == as_float32(parameter.value)


def as_float32(value: float) -> float:
    """Return the nearest number of 32 bits; infinity where it is too large."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)
