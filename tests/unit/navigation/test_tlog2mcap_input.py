"""`tlog2mcap` turns odd logs and options into a correct bag, or a sentence and no file."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import pytest
from std_msgs.msg import String

from drone_navigation.bag.mcap_bag import Bag, open_bag
from drone_navigation.bag.topics import BagClock, BagNode
from drone_navigation.tlog2mcap import main
from mavlink_vehicle.codec import Codec, make
from navigation_bridge.recording.replay import LONGEST_SILENCE_S
from tests.support.logs.bags import read_bag
from tests.support.logs.made_logs import START_US, tlog_of
from tests.support.logs.recordings import SMALL

SERVER = "/navigation_server"
SEVERAL = SMALL / "multi_udp.tlog"


HEARTBEAT = Codec(1, 1).encode(make("HEARTBEAT", type=2, autopilot=3, mavlink_version=3))


def test_a_log_of_one_message_is_a_bag(tmp_path: Path) -> None:
    log = tmp_path / "one.tlog"
    log.write_bytes(tlog_of([HEARTBEAT]))
    assert main([str(log)]) == 0
    bag = read_bag(log.with_suffix(".mcap"))
    assert set(bag.log_times_ns) == {START_US * 1000}
    statuses = bag.topics[f"{SERVER}/vehicle_status"].messages
    assert [status.connected for _, status in statuses] == [False, True]


def test_a_clock_that_stepped_back_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "back.tlog"
    log.write_bytes(tlog_of([HEARTBEAT] * 50) + tlog_of([HEARTBEAT] * 50, START_US - 10**9))
    assert main([str(log)]) == 0
    assert "clock stepped back 1 times" in capsys.readouterr().out
    bag = read_bag(log.with_suffix(".mcap"))
    assert min(bag.log_times_ns) < (START_US - 10**9 + 10**6) * 1000


def test_topics_are_named_as_a_node_names_them() -> None:
    clock, stream = BagClock(), io.BytesIO()
    clock.time.advance(12.5)
    clock.move(0.0)
    bag = Bag(stream)
    node = BagNode(bag, clock, "a")
    for topic in ("~/own", "beside", "/tf"):
        node.create_publisher(String, topic, 100).publish(String(data="x"))
    bag.finish()
    assert bag.counts == {"/a/navigation_server/own": 1, "/a/beside": 1, "/tf": 1}
    assert clock.now().nanoseconds == 12_500_000_000


def test_a_step_of_the_clock_is_the_next_packets() -> None:
    clock = BagClock()
    clock.time.advance(1000.0)
    assert clock.time.advance(500.0) == 0.0  # the player looks ahead
    clock.move(0.0)
    assert clock.unix_ns == 1000 * 10**9
    assert clock.time.advance(1500.0) == LONGEST_SILENCE_S
    clock.move(0.0)
    assert clock.unix_ns == 500 * 10**9
    clock.move(LONGEST_SILENCE_S - 1.0)
    assert clock.unix_ns == 1499 * 10**9


def test_an_unconvertible_log_is_an_error_and_leaves_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    station = Codec(255, 190).encode(make("HEARTBEAT", type=6, autopilot=8))
    contents = {
        "empty": (b"", "is empty"),
        "text": (b"no log\n" * 100, "is not a tlog"),
        "station": (tlog_of([station] * 20), "no HEARTBEAT of an autopilot"),
        "late": (tlog_of([HEARTBEAT] * 20, 2**31 * 10**6 + 1), "past 2038"),
        "raw": (HEARTBEAT * 20, "has no times|have no times"),
        "swapped": (
            b"".join(struct.pack("<Q", START_US + index) + HEARTBEAT for index in range(20)),
            "little-endian",
        ),
    }
    for name, (content, sentence) in contents.items():
        log = tmp_path / f"{name}.tlog"
        log.write_bytes(content)
        assert main([str(log)]) == 2, name
        said = capsys.readouterr()
        assert any(word in said.err for word in sentence.split("|")), said.err
        assert said.err.count("\n") == 1
        assert not said.out
    assert main([str(tmp_path / "missing.tlog")]) == 2
    assert "No such file" in capsys.readouterr().err
    assert not [path for path in tmp_path.iterdir() if path.suffix != ".tlog"]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--system", "9"], "no system 9; it contains 1, 2, 3"),
        (["--out", str(SEVERAL)], "is the log itself"),
    ],
)
def test_unavailable_options_are_rejected(
    options: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = SEVERAL.read_bytes()
    assert main([str(SEVERAL), "--out", str(tmp_path / "a.mcap"), *options]) == 2
    assert sentence in capsys.readouterr().err
    assert SEVERAL.read_bytes() == before
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "options",
    [
        ["--vehicle-name", "a"],
        ["--system", "1", "--system", "1"],
        ["--system", "1", "--vehicle-name", "no spaces"],
        ["--system", "one"],
    ],
)
def test_invalid_options_are_rejected(
    options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        main([str(SEVERAL), *options])
    assert end.value.code == 2
    assert "tlog2mcap: error: " in capsys.readouterr().err


def test_an_unwritable_output_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    out = tmp_path / "file/out.mcap"
    assert main([str(SEVERAL), "--out", str(out)]) == 1
    assert capsys.readouterr().err.startswith(f"Cannot write {out}: ")


def test_the_folder_of_a_bag_is_made(tmp_path: Path) -> None:
    log, out = tmp_path / "one.tlog", tmp_path / "bags/2026/out.mcap"
    log.write_bytes(tlog_of([HEARTBEAT]))
    assert main([str(log), "--out", str(out)]) == 0
    assert read_bag(out).log_times_ns


def test_a_bag_that_is_not_finished_does_not_replace_another(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"before")
    with pytest.raises(RuntimeError), open_bag(path):
        raise RuntimeError
    assert path.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [path]
