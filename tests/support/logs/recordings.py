"""The recordings of real simulators and vehicles.

The small ones are those that the simulator is held against. The large ones lie packed in
`tests/data/recordings`, 10 MB instead of 26, and are unpacked into `out/recordings`.
"""

from __future__ import annotations

import lzma
import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
PACKED = ROOT / "tests/data/recordings"
UNPACKED = ROOT / "out/recordings"
SMALL = ROOT / "sitl/tests/data/recordings"
NAMES = sorted(
    f"{path.parent.name}/{path.name.removesuffix('.tlog.xz')}"
    for path in PACKED.glob("*/*.tlog.xz")
)
"""Such as ``ardupilot/copter_acks``."""


def recording(name: str) -> Path:
    """Return the path of a recording by its name; several processes may ask at once."""
    packed, path = PACKED / f"{name}.tlog.xz", UNPACKED / f"{name}.tlog"
    if not path.exists() or path.stat().st_mtime < packed.stat().st_mtime:
        path.parent.mkdir(parents=True, exist_ok=True)
        own = path.with_suffix(f".{os.getpid()}")
        own.write_bytes(lzma.decompress(packed.read_bytes()))
        own.replace(path)
    return path
