"""Writes the types of all MAVLink messages and constants: `make pages`.

pymavlink generates its dialects without types, so that a checker would accept any field. The stub
``mavlink_vehicle/dialect.pyi`` names each message's fields, as `mavlink_vehicle.codec` decodes
them. It comes from the installed pymavlink; tests/unit/vehicle/test_dialect_stub.py holds both
equal.
"""

from __future__ import annotations

from pathlib import Path

from mavlink_vehicle import dialect

STUB = Path(__file__).resolve().parents[1] / "src/mavlink_vehicle/mavlink_vehicle/dialect.pyi"
_HEAD = '''\
"""Types of pymavlink's dialect, written by scripts/write_dialect_stub.py."""

from collections.abc import Callable
from struct import Struct
from typing import Any

from mavlink_vehicle.message_layout import FrameHeader

class MAVLink_header:
    mlen: int
    incompat_flags: int
    compat_flags: int
    seq: int
    srcSystem: int
    srcComponent: int
    msgId: int

class MAVLinkSigning:
    secret_key: bytes | None
    sign_outgoing: bool
    link_id: int
    timestamp: int

class MAVLink:
    srcSystem: int
    srcComponent: int
    seq: int
    signing: MAVLinkSigning
    def __init__(self, file: object, srcSystem: int = 0, srcComponent: int = 0) -> None: ...

class EnumEntry:
    name: str
    description: str

class x25crc:
    crc: int
    def __init__(self, buf: bytes | None = None) -> None: ...

class MAVLink_message:
    id: int
    msgname: str
    fieldnames: list[str]
    ordered_fieldnames: list[str]
    fieldtypes: list[str]
    fieldenums_by_name: dict[str, str]
    lengths: list[int]
    array_lengths: list[int]
    crc_extra: int
    unpacker: Struct
    instance_field: str | None
    instance_offset: int
    source_is_set: bool  # by codec.with_source
    _header: FrameHeader | MAVLink_header
    _msgbuf: bytes
    _crc: int | None
    _payload: bytes | None
    _link_id: int | None
    _instances: dict[str, str] | None
    _signed: bool
    _fieldnames: list[str]
    _type: str
    _instance_field: str | None
    _instance_offset: int
    def __init__(self, *values: Any, **fields: Any) -> None: ...
    def get_type(self) -> str: ...
    def get_msgId(self) -> int: ...
    def get_msgbuf(self) -> bytes: ...
    def get_srcSystem(self) -> int: ...
    def get_srcComponent(self) -> int: ...
    def get_seq(self) -> int: ...
    def get_fieldnames(self) -> list[str]: ...
    def to_dict(self) -> dict[str, Any]: ...
    def pack(self, mav: MAVLink, force_mavlink1: bool = False) -> bytes: ...

mavlink_map: dict[int, type[MAVLink_message]]
enums: dict[str, dict[int, EnumEntry]]
mcrf4xx: Callable[[bytes], int] | None
'''


def _class(cls: type[dialect.MAVLink_message]) -> str:
    """Return the stub of a message: its fields, in the order of the dialect."""
    lengths = dict(zip(cls.ordered_fieldnames, cls.array_lengths, strict=True))
    lines = [f"class {cls.__name__}(MAVLink_message):"]
    for name, kind in zip(cls.fieldnames, cls.fieldtypes, strict=True):
        number = "float" if kind in ("float", "double") else "int"
        field = f"list[{number}]" if lengths[name] else number
        lines.append(f"    {name}: {'str' if kind == 'char' else field}")
    return "\n".join(lines)


def stub() -> str:
    """Return the stub of the installed dialect."""
    numbers = {
        name: value
        for name, value in vars(dialect).items()
        if name.isupper() and isinstance(value, int)
    }
    messages = [cls for number, cls in sorted(dialect.mavlink_map.items()) if number >= 0]
    constants = "\n".join(f"{name}: int" for name in sorted(numbers))
    return f"{_HEAD}\n{constants}\n\n" + "\n\n".join(map(_class, messages)) + "\n"


if __name__ == "__main__":
    STUB.write_text(stub(), encoding="utf-8")
