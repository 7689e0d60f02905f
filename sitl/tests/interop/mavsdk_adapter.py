"""Runs one example of MAVSDK-Python on free ports: a process of its own.

    PYTHON mavsdk_adapter.py EXAMPLE UDP_PORT GRPC_PORT [ARGUMENT ...]

PYTHON has `mavsdk` before version 4 and nothing of this repository, so this module imports nothing
of it. The examples name ports, and a serial device, that others on this machine may use.
"""

from __future__ import annotations

import runpy
import sys
from typing import Any


def main() -> None:
    """Run the example as if it had been started itself."""
    example, udp_port, grpc_port, *arguments = sys.argv[1:]
    import mavsdk  # noqa: PLC0415 - only where this runs

    whole: Any = mavsdk.System
    begin, connect = whole.__init__, whole.connect

    def begin_on_a_free_port(self: Any, *_: Any, **options: Any) -> None:
        begin(self, port=int(grpc_port), sysid=options.get("sysid", 245))

    async def connect_here(self: Any, system_address: str | None = None) -> None:
        if system_address is not None and system_address.startswith("invalid"):
            await connect(self, system_address=system_address)
        else:
            await connect(self, system_address=f"udpin://127.0.0.1:{udp_port}")

    whole.__init__, whole.connect = begin_on_a_free_port, connect_here
    sys.argv = [example, *arguments]
    runpy.run_path(example, run_name="__main__")


if __name__ == "__main__":
    main()
