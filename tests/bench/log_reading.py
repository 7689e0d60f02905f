"""Reads a log in a process of its own and prints, as JSON, messages, seconds and memory.

``python -m tests.bench.log_reading READER LOG ROUNDS [FOLDER OF READER]``: the least processor time
of the rounds counts, because whatever disturbs a round only adds to it. The memory is that of this
process: `ru_maxrss` would begin with its parent's.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from flight_logs.tlog import iterate_tlog, read_tlog


def _read(path: Path) -> int:
    return sum(len(records) for records in read_tlog(path).values())


def iterate(path: Path) -> int:
    """Count the messages of a log that is read piece by piece."""
    return sum(len(records) for part in iterate_tlog(path) for records in part.values())


def forget(path: Path) -> None:
    """Have the system drop a file from its cache, so that all readers find the same."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def _fasttlogparser(path: Path) -> int:
    messages, _ = importlib.import_module("fasttlogparser").parseTLog(str(path))
    return sum(len(columns["timestamp"]) for columns in messages.values())


def _mavutil(path: Path) -> int:
    from pymavlink import mavutil  # noqa: PLC0415 - the other readers shouldn't carry its memory

    # `mavlink_connection` makes an index of a log first, and is slower.
    log = mavutil.mavlogfile(str(path))
    count = 0
    while log.recv_msg() is not None:
        count += 1
    return count


READERS: dict[str, Callable[[Path], int]] = {
    "read_tlog": _read,
    "iterate_tlog": iterate,
    "fasttlogparser": _fasttlogparser,
    "mavutil": _mavutil,
}


def main(reader: str, path: Path, rounds: int) -> None:
    """Read the log as often as asked, and print what it took."""
    least_s = float("inf")
    messages = 0
    for _ in range(rounds):
        forget(path)
        started_s = time.process_time()
        messages = READERS[reader](path)
        least_s = min(least_s, time.process_time() - started_s)
    status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
    peak_mb = int(status.partition("VmHWM:")[2].split()[0]) / 1024.0
    print(json.dumps({"messages": messages, "seconds": least_s, "peak_mb": peak_mb}))


if __name__ == "__main__":
    sys.path += sys.argv[4:]
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]))
