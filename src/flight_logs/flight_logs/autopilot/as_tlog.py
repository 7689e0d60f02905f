"""Writes the content of an autopilot's own log as a telemetry log."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

from flight_logs.autopilot import dataflash, ulog
from flight_logs.autopilot.telling import OwnLog
from flight_logs.errors import EmptyLogError, LogError
from mavlink_vehicle.codec import Codec

_SYSTEM, _AUTOPILOT = 1, 1
_STAMP = struct.Struct(">Q")
_APART = 128


def is_autopilot_log(path: Path) -> bool:
    """Return whether a file begins as a DataFlash or ULog log.

    Raises:
        LogError: it cannot be read.
    """
    try:
        with path.open("rb") as file:
            begin = file.read(len(ulog.MAGIC))
    except OSError as error:
        raise LogError(f"Cannot read {path}: {error.strerror or error}.") from error
    return begin.startswith((dataflash.MAGIC, ulog.MAGIC))


def write_as_tlog(
    path: Path, out: Path, progress: Callable[[int, int], None] | None = None
) -> OwnLog:
    """Write modes, positions, texts and battery of an autopilot's log as a tlog.

    Without a date in the log, its times are since the autopilot started, in 1970.

    Args:
        path: a DataFlash or ULog log.
        out: the tlog.
        progress: called now and then with the bytes done and the size of the file.

    Returns:
        The result: the records written, the damage of the log, and the data that it lacks.

    Raises:
        LogError: it cannot be read, or contains no flight data.
        OSError: the tlog cannot be written.
    """
    size = path.stat().st_size

    def show(share: float) -> None:
        if progress is not None:
            progress(int(share * size), size)

    with path.open("rb") as file:
        is_ulog = file.read(len(ulog.MAGIC)) == ulog.MAGIC
    read = ulog.read_ulog if is_ulog else dataflash.read_dataflash
    log = read(path, show)
    messages = log.messages
    if not messages:
        raise EmptyLogError(f"{path} contains no flight data.")
    # Two codecs in turn, so that nobody can count losses by the sequence numbers.
    codecs = [Codec(_SYSTEM, _AUTOPILOT) for _ in range(2)]
    for _ in range(_APART):
        codecs[1].encode(messages[0][1])
    latest_us = 0
    with out.open("wb") as tlog:
        for count, (time_s, message) in enumerate(messages):
            latest_us = max(latest_us, round(time_s * 1e6))
            tlog.write(_STAMP.pack(latest_us) + codecs[count % 2].encode(message))
    show(1.0)
    return log
