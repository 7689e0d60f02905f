"""Logs from 1 MB to 1 GB: messages per second of processor time, and memory.

The logs are the recordings of `sitl/tests/data/recordings`, ArduPilot and PX4, one after the other
and again and again, with times that continue. They are made in a temporary folder; one that
doesn't fit on the disk is left out, and says so. Each reader works in a process of its own, so
that its memory is its own. The reference, `mavutil`, reads the log of 1 MB each time, right
before: its time is in proportion to the length. `fasttlogparser`, in C++, reads the same log where
it can be built; it holds a log whole, and reads none of 1 GB here. No reader finds a log in the
system's cache: each reads it from the disk.

A folder of logs is read in processes. Its rate is what the cores would read in a second if they
did nothing else: processor time counts, with the start of the processes.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flight_logs.tlog import for_each_log
from mavlink_vehicle.io.tlog import TlogReader
from tests.bench.limits import run_module
from tests.bench.log_reading import forget, iterate
from tests.bench.references import fasttlogparser
from tests.bench.rows import row
from tests.support.logs.recordings import SMALL

RECORDINGS = sorted(SMALL.glob("*.tlog"))
SIZES_MB, SHORT_SIZES_MB = (1, 10, 100, 1000), (1,)
WHOLE_LIMIT_MB = 100
"""Longer logs are read piece by piece."""
ROUNDS = {1: 9, 10: 3, 100: 2}
RATIO_GOALS = {1: 40.0, 10: 35.0, 100: 25.0, 1000: 35.0}
"""By size, MB: the longest that is read whole waits for its memory most"""
MEMORY_GOAL_MB = 2048.0
FOLDER_LOGS, FOLDER_LOG_MB = 12, 100
SHORT_FOLDER_LOGS, SHORT_FOLDER_LOG_MB = 2, 1
FOLDER_GOAL = 3.5e6
"""Messages per second of one core."""
STAMP_SIZE = 8
MB = 1_000_000
_CPU_S, _CPU_S_PER_MB = 30.0, 1.0


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Measure logs of all sizes."""
    rival = fasttlogparser(build=not short)
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder) / "part.tlog"
        write_log(part, MB)
        for size_mb in SHORT_SIZES_MB if short else SIZES_MB:
            free_mb = shutil.disk_usage(folder).free / MB
            if free_mb < 2 * size_mb:
                print(f"No log of {size_mb} MB: only {free_mb:.0f} MB of {folder} are free.")
                continue
            yield from _measure(Path(folder), part, size_mb, short, rival)
        many = (SHORT_FOLDER_LOGS, SHORT_FOLDER_LOG_MB) if short else (FOLDER_LOGS, FOLDER_LOG_MB)
        yield from _measure_folder(Path(folder), *many)


def _measure_folder(folder: Path, log_count: int, size_mb: int) -> list[dict[str, Any]]:
    if shutil.disk_usage(folder).free < 2 * log_count * size_mb * MB:
        print("No folder of logs: too little of the disk is free.")
        return []
    cores = min(2, os.cpu_count() or 1)
    logs = [folder / f"log{number}.tlog" for number in range(log_count)]
    write_log(logs[0], size_mb * MB)
    for log in logs[1:]:
        shutil.copyfile(logs[0], log)
    for log in logs:
        forget(log)
    before = os.times()
    count = sum(for_each_log(iterate, logs, cores))
    after = os.times()
    alone = _read("iterate_tlog", logs[0], 1)
    for log in logs:
        log.unlink()
    spent_s = sum(after[:4]) - sum(before[:4])  # of this process and its children
    rate, goal = cores * count / spent_s, cores * FOLDER_GOAL
    one = cores * alone["messages"] / alone["seconds"]
    name = f"messages per second of {cores} cores, {FOLDER_LOGS} logs of {FOLDER_LOG_MB} MB"
    reference = (f"{cores} x one log in one process", one)
    return [row(name, (rate, "1/s"), reference, f">= {goal:,.0f} 1/s")]


def _measure(
    folder: Path, part: Path, size_mb: int, short: bool, rival: Path | None
) -> list[dict[str, Any]]:
    log = folder / "log.tlog"
    write_log(log, size_mb * MB)
    reader = "read_tlog" if size_mb <= WHOLE_LIMIT_MB else "iterate_tlog"
    by_mavutil = _read("mavutil", part, rounds=1 if short else 3)
    rounds = 1 if short else ROUNDS.get(size_mb, 1)
    ours = _read(reader, log, rounds)
    theirs = None
    if reader == "read_tlog" and rival is not None:
        theirs = _read("fasttlogparser", log, rounds, rival)
    log.unlink()
    rate, reference = (what["messages"] / what["seconds"] for what in (ours, by_mavutil))
    name = f"messages per second of processor time, {reader}, log of {size_mb} MB"
    memory = f"memory of {reader}, log of {size_mb} MB"
    peak_mb = ours["peak_mb"]
    small = ("mavutil, 1 MB", by_mavutil["peak_mb"])
    rows = [
        row(name, (rate, "1/s"), ("mavutil", reference), f">= {RATIO_GOALS[size_mb]:g} x"),
        row(memory, (peak_mb, "MB"), small, f"< {MEMORY_GOAL_MB:g} MB"),
    ]
    if theirs is not None:
        beside = ("fasttlogparser", theirs["messages"] / theirs["seconds"])
        rows.append(row(f"{name}, beside C++", (rate, "1/s"), beside, ">= 1 x"))
    return rows


def _read(reader: str, path: Path, rounds: int, folder: Path | None = None) -> dict[str, Any]:
    cpu_s = rounds * (_CPU_S + _CPU_S_PER_MB * path.stat().st_size / MB)
    words = [reader, str(path), str(rounds), *([str(folder)] if folder else [])]
    return run_module("tests.bench.log_reading", words, cpu_s)


def write_log(path: Path, size: int) -> None:
    """Write a log of about `size` bytes, a little more: it ends with a whole packet."""
    data = np.frombuffer(
        b"".join(recording.read_bytes() for recording in RECORDINGS), dtype=np.uint8
    ).copy()
    lengths = [len(packet) + STAMP_SIZE for file in RECORDINGS for _, packet in TlogReader(file)]
    ends = np.cumsum(lengths, dtype=np.int64)
    places = ends - lengths
    # A packet every 2 ms: about what two vehicles send.
    stamps_us = 1_700_000_000_000_000 + 2000 * np.arange(len(places), dtype=np.uint64)
    written = 0
    with path.open("wb") as file:
        while written < size:
            _stamp(data, places, stamps_us)
            stamps_us += np.uint64(2000 * len(places))
            rest = int(np.searchsorted(ends, size - written))
            end = int(ends[min(rest, len(ends) - 1)])
            file.write(data[:end].tobytes())
            written += end


def _stamp(
    data: NDArray[np.uint8], places: NDArray[np.int64], stamps_us: NDArray[np.uint64]
) -> None:
    columns = stamps_us.astype(">u8").view(np.uint8).reshape(-1, STAMP_SIZE)
    for offset in range(STAMP_SIZE):
        data[places + offset] = columns[:, offset]
