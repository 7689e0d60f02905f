"""`python -m comparison` on recordings that nobody has seen, and on no recordings."""

from __future__ import annotations

import random
import struct
from pathlib import Path

import pytest

from comparison.__main__ import main
from comparison.recording import read
from comparison.start import start_of
from sitl_support.recorded_flights import DATA
from sitl_support.tlogs import read_records

pytestmark = pytest.mark.wide


def cut(tmp_path: Path, name: str, from_s: float, to_s: float = 1e9) -> Path:
    """A part of a recording under a name that nobody knows; seconds since its beginning."""
    records = list(read_records((DATA / f"{name}.tlog").read_bytes()))
    begin_us = records[0][0]
    path = tmp_path / "unseen.tlog"
    kept = [(t, f) for t, f in records if from_s <= (t - begin_us) / 1e6 <= to_s]
    path.write_bytes(b"".join(struct.pack(">Q", t) + f for t, f in kept))
    return path


def test_differences_that_are_meant_are_reported_with_their_reason(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([str(DATA / "px4_offboard_loss_stop.tlog")]) == 0
    said = capsys.readouterr().out
    assert "meant     order of landed states" in said
    assert "(expected: the landing detector of the real one let go once" in said
    assert "m apart" in said


def test_the_same_difference_under_another_name_is_not_meant(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(cut(tmp_path, "px4_offboard_loss_stop", 0.0))]) == 1
    assert "DIFFERENT order of landed states" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["copter_auto_cleared", "copter_gcsloss", "copter_lowbatt"])
def test_settings_are_found_out_from_what_they_did(name: str, tmp_path: Path) -> None:
    assert main([str(cut(tmp_path, name, 0.0))]) == 0


@pytest.mark.parametrize(
    ("name", "from_s"), [("copter_guided", 62.0), ("px4_mavsdk_offboard_goto", 14.5)]
)
def test_a_recording_that_begins_in_the_air_begins_there(
    name: str, from_s: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = cut(tmp_path, name, from_s)
    (recording,) = read(path)
    start = start_of(recording)
    assert start.armed
    assert start.position_ned_m is not None
    assert start.position_ned_m[2] < -4.0
    assert main([str(path)]) == 0, capsys.readouterr().out


def test_three_vehicles_in_one_recording_are_compared_one_by_one(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([str(DATA / "multi_udp.tlog")]) == 0
    said = capsys.readouterr().out
    assert "copter with ardupilot, system 1" in said
    assert "rover with ardupilot, system 3" in said


@pytest.mark.night
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("rover_guided", "no limit is known that fits a rover"),
        ("plane_guided", "no limit is known that fits a plane"),
        ("px4_probe_ground", "the recorded copter did not fly in these modes"),
    ],
)
def test_a_position_that_is_not_compared_is_not_called_the_same(
    name: str, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(DATA / f"{name}.tlog")]) == 0
    said = capsys.readouterr().out
    assert f"not compared: position in GUIDED and OFFBOARD, within 1.5 m: {reason}" in said
    assert "same      position" not in said


def test_the_position_of_a_copter_is_compared(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(DATA / "copter_guided.tlog")]) == 0
    said = capsys.readouterr().out
    assert "same      position in GUIDED and OFFBOARD, within 1.5 m" in said
    assert "not compared" not in said


def broken_files() -> dict[str, bytes]:
    rng = random.Random(1)
    whole = (DATA / "rover_auto.tlog").read_bytes()
    spoiled = bytearray(whole)
    for _ in range(200):
        spoiled[rng.randrange(len(spoiled))] = rng.randrange(256)
    return {
        "empty": b"",
        "one_byte": b"\0",
        "zeros": bytes(5000),
        "noise": rng.randbytes(50_000),
        "marks": b"\xfd" * 5000,
        "text": b"no telemetry " * 100,
        "begun_in_a_record": whole[77:],
        "ended_in_a_record": whole[:-5],
        "first_record": whole[:40],
        "middle": whole[len(whole) // 3 : len(whole) // 2],
        "spoiled": bytes(spoiled),
        "twice": whole + whole,
        "backwards": whole[len(whole) // 2 :] + whole[: len(whole) // 2],
    }


@pytest.mark.parametrize("kind", broken_files())
def test_whatever_the_file_holds_it_ends_with_a_verdict_or_one_sentence(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"{kind}.tlog"
    path.write_bytes(broken_files()[kind])
    outcome = main([str(path)])
    captured = capsys.readouterr()
    if outcome == 2:
        assert captured.err.startswith("comparison: ")
        assert captured.err.count("\n") == 1
    else:
        assert "result of each COMMAND_ACK" in captured.out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["missing.tlog"], "missing.tlog"),
        (["rover_auto.tlog", "--param", "FENCE_RADIUS"], "NAME=NUMBER"),
        (["rover_auto.tlog", "--param", "FENCE_RADIUS=x"], "NAME=NUMBER"),
        (["rover_auto.tlog", "--param", "NO_SUCH=1"], "no parameter NO_SUCH"),
    ],
)
def test_what_cannot_be_played_is_said_in_one_sentence(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(DATA / arguments[0]), *arguments[1:]]) == 2
    assert said in capsys.readouterr().err
