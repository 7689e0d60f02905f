"""COMPONENT_METADATA of PX4, and the files that it names: what parameters there are.

https://mavlink.io/en/services/component_information.html. The real one's files also have
descriptions, limits and units, events and actuators.
"""

from __future__ import annotations

import json
import lzma
import struct
import zlib
from functools import cache

from mavlink_sitl.autopilot.parameters import ParameterTable, ParameterType
from mavlink_sitl.mavlink.codec import Raw

FOLDER = "/etc/extras"
GENERAL, PARAMETERS = "component_general.json.xz", "parameters.json.xz"
NUMBER, CRC_EXTRA = 397, 182
_PARAMETER_TYPE = 1
_KINDS = {ParameterType.INT32: "Int32", ParameterType.REAL32: "Float"}


def crc32(data: bytes) -> int:
    """As MAVLink has it: from 0, and not inverted at the end."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def uri(name: str) -> str:
    """Where a file is."""
    return f"mftp:/{FOLDER}/{name}"


def _compressed(content: object) -> bytes:
    return lzma.compress(json.dumps(content).encode("ascii"), check=lzma.CHECK_CRC32)


@cache
def files(table: ParameterTable) -> dict[str, bytes]:
    """The contents by path; the same for all vehicles that share a table."""
    described = [
        {
            "name": spec.name,
            "type": _KINDS[spec.type],
            "default": int(spec.default) if spec.type is ParameterType.INT32 else spec.default,
            "group": spec.name.split("_")[0],
            "category": "Standard",
            "shortDesc": spec.name,
        }
        for spec in table.specs.values()
    ]
    parameters = _compressed({"version": 1, "parameters": described})
    of_parameters = {
        "type": _PARAMETER_TYPE,
        "uri": uri(PARAMETERS),
        "fileCrc": crc32(parameters),
    }
    general = _compressed({"version": 1, "metadataTypes": [of_parameters]})
    return {f"{FOLDER}/{GENERAL}": general, f"{FOLDER}/{PARAMETERS}": parameters}


def message(time_boot_ms: int, table: ParameterTable) -> Raw:
    """COMPONENT_METADATA."""
    crc = crc32(files(table)[f"{FOLDER}/{GENERAL}"])
    place = uri(GENERAL).encode("ascii")
    return Raw(NUMBER, CRC_EXTRA, struct.pack("<II100s", time_boot_ms, crc, place))
