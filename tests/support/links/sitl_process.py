"""The simulator as a process that talks UDP to a client of somebody else."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
from collections.abc import Iterator


def environment(**more: str) -> dict[str, str]:
    """That of the tests, with what they import."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p), **more}


@contextlib.contextmanager
def simulator(*options: str) -> Iterator[int]:
    """The program, which sends to a free port of this machine; gives the port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    link = f"udpout:127.0.0.1:{port}"
    process = subprocess.Popen(
        [sys.executable, "-m", "mavlink_sitl", "--link", link, *options],
        env=environment(),
        stdout=subprocess.DEVNULL,
    )
    try:
        yield port
    finally:
        process.kill()
        process.wait()
