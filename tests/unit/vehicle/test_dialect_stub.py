"""The types of MAVLink messages in `dialect.pyi`."""

from __future__ import annotations

import ast
import runpy
from pathlib import Path
from typing import Any

from mavlink_vehicle import dialect
from mavlink_vehicle.codec import Codec, make

ROOT = Path(__file__).parents[3]
SCRIPT: dict[str, Any] = runpy.run_path(str(ROOT / "scripts/write_dialect_stub.py"))


def test_the_stub_is_that_of_the_installed_dialect() -> None:
    assert SCRIPT["STUB"].read_text(encoding="utf-8") == SCRIPT["stub"](), "Run `make pages`."


def test_decoded_fields_have_the_types_of_the_stub() -> None:
    types = {"int": int, "float": float, "str": str, "list[int]": list, "list[float]": list}
    stub = ast.parse(SCRIPT["stub"]())
    classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
    sender, receiver = Codec(1, 1), Codec(1, 1)
    for number, cls in dialect.mavlink_map.items():
        if number < 0:
            continue
        (message,) = receiver.decode(sender.encode(make(cls.msgname)))
        fields = [node for node in classes[cls.__name__].body if isinstance(node, ast.AnnAssign)]
        assert [ast.unparse(node.target) for node in fields] == cls.fieldnames
        for node in fields:
            value = getattr(message, ast.unparse(node.target))
            assert type(value) is types[ast.unparse(node.annotation)], (cls.msgname, value)
