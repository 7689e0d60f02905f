"""Recordings in numbered files take a bounded part of the disk, and delete nothing of others."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mavlink_vehicle.codec import Codec, make
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.tlog import TlogReader
from mavlink_vehicle.io.tlog_series import SeriesTlogWriter, TlogSeries
from tests.support.processes import HANGS_AFTER_S, patient_s

FRAME = Codec(1, 1).encode(make("GPS_RTCM_DATA", flags=0, len=180, data=[7] * 180))
MB = 1_000_000
RECORDS_PER_MB = MB // (len(FRAME) + 8)


def opened(folder: Path, files: int = 3) -> SeriesTlogWriter:
    path = folder / "flight.tlog"
    return SeriesTlogWriter(TlogSeries(path, MB, files), path)


def record_one(folder: Path, files: int = 3, time_s: float | None = None) -> Path:
    """Record a flight of one packet; return its file."""
    writer = opened(folder, files)
    writer.write(FRAME, time_s)
    writer.close()
    assert writer.failure is None
    return writer.path


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("*.tlog"))


def wait_until(condition: Callable[[], bool]) -> None:
    limit_s = time.monotonic() + patient_s(20.0)
    while not condition():
        assert time.monotonic() < limit_s
        threading.Event().wait(0.01)


def test_each_start_has_a_file_of_its_own(tmp_path: Path) -> None:
    first, second = record_one(tmp_path), record_one(tmp_path)
    assert [first.name, second.name] == ["flight-000001.tlog", "flight-000002.tlog"]
    assert [packet for _, packet in TlogReader(first)] == [FRAME]


def test_a_long_flight_continues_in_other_files_of_bounded_size(tmp_path: Path) -> None:
    writer = opened(tmp_path, files=10)
    count = 3 * RECORDS_PER_MB + 5
    for number in range(count):
        writer.write(FRAME, float(number))
    writer.close()
    assert writer.failure is None
    files = sorted(tmp_path.glob("*.tlog"))
    assert len(files) == 4
    assert max(path.stat().st_size for path in files) <= MB
    times_s = [time_s for path in files for time_s, _ in TlogReader(path)]
    assert times_s == [float(number) for number in range(count)]


def test_the_oldest_closed_files_are_deleted_at_a_start(tmp_path: Path) -> None:
    for _ in range(5):
        record_one(tmp_path, files=3)
    assert names(tmp_path) == [f"flight-00000{number}.tlog" for number in (3, 4, 5)]


def test_a_long_flight_stays_within_the_bound_and_keeps_its_newest_files(tmp_path: Path) -> None:
    writer = opened(tmp_path, files=3)
    for number in range(6 * RECORDS_PER_MB):
        writer.write(FRAME, float(number))
    writer.close()
    assert writer.failure is None
    files = sorted(tmp_path.glob("*.tlog"))
    assert len(files) == 3
    assert sum(path.stat().st_size for path in files) <= 3 * MB
    assert files[-1] == writer.path
    newest_s = [time_s for path in files[1:] for time_s, _ in TlogReader(path)]
    assert newest_s == [float(6 * RECORDS_PER_MB - len(newest_s) + n) for n in range(len(newest_s))]


def test_a_smaller_bound_deletes_what_exceeds_it_but_for_the_newest(tmp_path: Path) -> None:
    writer = SeriesTlogWriter(TlogSeries(tmp_path / "flight.tlog", 9 * MB, 3), tmp_path / "f.tlog")
    for _ in range(4 * RECORDS_PER_MB):
        writer.write(FRAME)
    writer.close()
    record_one(tmp_path, files=3)
    assert names(tmp_path) == ["flight-000001.tlog", "flight-000002.tlog"]
    record_one(tmp_path, files=3)
    assert names(tmp_path) == ["flight-000002.tlog", "flight-000003.tlog"]


def test_files_that_no_server_has_written_stay(tmp_path: Path) -> None:
    others = [tmp_path / name for name in ("flight.tlog", "flight-000000.tlog", "mine.tlog")]
    for path in others:
        path.write_bytes(b"another program's")
    for _ in range(6):
        record_one(tmp_path)
    assert all(path.read_bytes() == b"another program's" for path in others)
    assert len(names(tmp_path)) == 3 + len(others)


def test_a_file_that_took_the_name_of_an_old_one_stays(tmp_path: Path) -> None:
    first = record_one(tmp_path)
    first.unlink()
    first.write_bytes(b"a flight of somebody else")
    linked = record_one(tmp_path)
    elsewhere = shutil.move(linked, tmp_path / "kept")
    linked.symlink_to(elsewhere)
    for _ in range(6):
        record_one(tmp_path)
    assert first.read_bytes() == b"a flight of somebody else"
    assert linked.is_symlink()
    assert Path(elsewhere).exists()


def test_the_list_cannot_lead_out_of_the_folder(tmp_path: Path) -> None:
    folder = tmp_path / "flights"
    folder.mkdir()
    outside = shutil.copy(record_one(folder, time_s=5.0), tmp_path / "flight-000009.tlog")
    stamp = (folder / "flight.tlog.list").read_text().split()[1]
    (folder / "flight.tlog.list").write_text(f"../flight-000009.tlog {stamp}\nnonsense\n")
    for _ in range(6):
        record_one(folder)
    assert Path(outside).exists()


def test_a_file_that_another_server_writes_stays(tmp_path: Path) -> None:
    long_one = opened(tmp_path)
    long_one.write(FRAME)
    wait_until(lambda: (tmp_path / "flight.tlog.list").read_text() != "")
    for _ in range(6):
        record_one(tmp_path)
    assert long_one.path.exists()
    long_one.write(FRAME)
    long_one.close()
    assert len(list(TlogReader(long_one.path))) == 2


def test_a_killed_server_leaves_a_file_that_is_deleted_in_its_turn(tmp_path: Path) -> None:
    program = (
        "import os, sys, threading\n"
        "from pathlib import Path\n"
        "from mavlink_vehicle.io.tlog_series import SeriesTlogWriter, TlogSeries\n"
        "path = Path(sys.argv[1])\n"
        "writer = SeriesTlogWriter(TlogSeries(path, 1_000_000, 3), path)\n"
        "writer.write(bytes.fromhex(sys.argv[2]))\n"
        "while not writer.path.stat().st_size: threading.Event().wait(0.01)\n"
        "os.kill(os.getpid(), 9)\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "flight.tlog"), FRAME.hex()]
    assert subprocess.run(command, timeout=HANGS_AFTER_S, check=False).returncode == -9
    assert [packet for _, packet in TlogReader(tmp_path / "flight-000001.tlog")] == [FRAME]
    for _ in range(3):
        record_one(tmp_path)
    assert names(tmp_path) == [f"flight-00000{number}.tlog" for number in (2, 3, 4)]


def test_a_start_without_a_packet_leaves_no_file(tmp_path: Path) -> None:
    opened(tmp_path).close()
    assert names(tmp_path) == []


def test_a_full_disk_ends_the_recording_with_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next file cannot be made."""
    writer = opened(tmp_path)
    writer.write(FRAME)
    wait_until(lambda: writer.path.stat().st_size > 0)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(TlogSeries, "begin", full)
    for _ in range(2 * RECORDS_PER_MB):
        writer.write(FRAME)
    wait_until(lambda: writer.failure is not None)
    assert str(writer.failure) == f"Recording to {writer.path} has ended: No space left on device."
    writer.write(FRAME)
    writer.close()
    assert writer.path.stat().st_size > 0


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_is_one_sentence(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(LinkError, match=r"^Cannot record to .*: Permission denied\.$"):
            opened(tmp_path)
    finally:
        tmp_path.chmod(0o700)


def test_a_missing_folder_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"the folder .*flihgts does not exist; create it first"):
        opened(tmp_path / "flihgts")
