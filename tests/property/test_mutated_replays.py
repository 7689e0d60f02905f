"""Damaged recordings are replayed to their end without an error."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink_vehicle.codec import Codec
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.tlog import TlogReader
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.goals.goal import GoalFinished, GoalHappened
from navigation_bridge.goals.requests import NavigateRequest
from navigation_bridge.recording.noted_outputs import NotedOutputs
from navigation_bridge.recording.replay import LONGEST_SILENCE_S, USUAL_GAP_S, Player, RecordedTime
from navigation_bridge.recording.shadow_file import ShadowGoal
from navigation_bridge.recording.shadow_goals import OPEN, REJECTED, work_shadow_goals
from tests.support.flights.made_flights import FOLDER

pytestmark = pytest.mark.wide


YEAR_S = 365.25 * 86_400
LOGS = ("battery_failsafe", "link_gap", "px4_reboot", "station_cancel", "no_path")
FAR = NavigateRequest("map", (30.0, 0.0, 4.0), (0.0, 0.0, 0.0, 1.0), False, 0.0)
CONFIG = make_config({"arming": "auto"})

Record = tuple[int, bytes]


class Damaged(bytes):
    """Too long to be shown; hypothesis tells what was drawn to make it."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"<{len(self)} bytes>"


def records_of(name: str) -> list[Record]:
    return [(round(t * 1e6), packet) for t, packet in TlogReader(FOLDER / f"{name}.tlog")]


def as_bytes(records: list[Record]) -> bytes:
    return b"".join(struct.pack(">Q", t % 2**64) + packet for t, packet in records)


@st.composite
def mutated(draw: st.DrawFn) -> Damaged:
    """A recording with some of: clock jumps, reordered, doubled and lost records, damage, cuts."""
    records = records_of(draw(st.sampled_from(LOGS)))
    places = st.integers(0, len(records) - 1)
    for kind in draw(st.lists(st.sampled_from(["jump", "swap", "double", "lose", "sort"]))):
        at = min(draw(places), len(records) - 1)
        to = min(draw(places), len(records) - 1)
        if kind == "jump":
            years = draw(st.floats(-60.0, 60.0))
            shift = round(years * YEAR_S * 1e6)
            records[at:] = [(t + shift, packet) for t, packet in records[at:]]
        elif kind == "swap":
            records[at], records[to] = records[to], records[at]
        elif kind == "double":
            records[at:at] = records[min(at, to) : max(at, to) + 1]
        elif kind == "lose" and len(records) > 2:
            del records[at : at + draw(st.integers(1, 20))]
            records = records or records_of(LOGS[0])[:1]
        elif kind == "sort":
            records = sorted(records, key=lambda record: record[1])
    data = bytearray(as_bytes(records))
    for _ in range(draw(st.integers(0, 30))):
        data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
    begin = draw(st.just(0) | st.integers(0, 200))
    end = draw(st.just(len(data)) | st.integers(0, len(data)))
    return Damaged(data[begin:end])


@given(data=mutated())
@settings(max_examples=60)
def test_a_damaged_recording_is_played_to_its_end(data: bytes, tmp_path_factory: object) -> None:
    path = write(data, tmp_path_factory)
    reader = opened(path)
    if reader is None:
        return
    packets = sum(1 for _ in reader)
    bridge = Bridge(Vehicle(CONFIG.vehicle), CONFIG.bridge)
    noted, player, before, timers = (
        NotedOutputs(bridge),
        Player(reader, bridge, Codec(1, 191)),
        0.0,
        0,
    )
    told: list[object] = []
    while not player.ended:
        for played in player.step():
            assert played.now >= before
            before = played.now
            timers += played.message is None
            if played.is_note and played.message is not None:
                told += noted.take(played.message, played.now)
    assert timers <= 10.0 * player.now + 10 * packets + 100
    ends = [output.goal_id for output in told if isinstance(output, GoalFinished)]
    happened = [o.goal_id for o in told if isinstance(o, GoalHappened) and o.event == "ENDED"]
    assert set(ends) <= set(happened)


@given(data=mutated(), at_s=st.floats(0.0, 12.0))
@settings(max_examples=40)
def test_a_goal_on_a_damaged_recording_ends_or_is_open_at_its_end(
    data: bytes, at_s: float, tmp_path_factory: object
) -> None:
    path = write(data, tmp_path_factory)
    reader = opened(path)
    if reader is None:
        return
    goals = (
        ShadowGoal(at_s, "navigate_to_waypoint", FAR, cancel_at_s=at_s + 5.0),
        ShadowGoal(at_s + 2.0, "navigate_to_waypoint", FAR),
    )
    for result in work_shadow_goals(reader, CONFIG, goals):
        assert result.message
        assert (result.ended_s is None) == (result.end in (OPEN, "NOT_SENT"))
        if result.end == REJECTED:
            assert not result.feedback
        times = [time_s for time_s, _ in result.feedback]
        assert times == sorted(times)
        assert all(math.isfinite(f.distance_remaining_m) for _, f in result.feedback)


@given(
    steps_s=st.lists(st.floats(-YEAR_S * 100, YEAR_S * 100) | st.floats(-10.0, 10.0) | st.just(0.0))
)
def test_time_never_goes_back_and_is_bounded_by_the_number_of_packets(
    steps_s: list[float],
) -> None:
    time, unix_s, before = RecordedTime(), 1.7e9, 0.0
    for step_s in steps_s:
        unix_s += step_s
        now = time.advance(unix_s)
        assert before <= now <= before + LONGEST_SILENCE_S
        before = now
    assert time.stepped_back <= len(steps_s)


@given(st.permutations(range(100)))
def test_records_out_of_order_take_no_longer_than_those_in_order(order: list[int]) -> None:
    time = RecordedTime()
    for place in order:
        time.advance(1.7e9 + 30.0 * place)
    assert time.now <= 100 * USUAL_GAP_S + LONGEST_SILENCE_S * 100


def test_a_clock_that_is_set_back_continues_from_there() -> None:
    time = RecordedTime()
    for unix_s in (1000.0, 1001.0, 500.0, 501.0, 502.0):
        time.advance(unix_s)
    assert (time.now, time.stepped_back) == (3.0, 1)
    for step in range(11):
        time.advance(503.0 + step)
    assert time.now == 14.0
    assert time.advance(543.0) == 44.0, "a silence, long after the clock was set"


def test_two_clocks_in_turns_count_as_one() -> None:
    time = RecordedTime()
    for second in range(100):
        time.advance(1000.0 + second)
        time.advance(1000.0 + second + YEAR_S)
    assert time.now < LONGEST_SILENCE_S + 110.0


def opened(path: Path) -> TlogReader | None:
    """Return a recording; None if it is damaged so much that it is none."""
    try:
        return TlogReader(path)
    except LinkError:
        return None


def write(data: bytes, tmp_path_factory: object) -> Path:
    folder = tmp_path_factory.mktemp("mutated")
    path = Path(folder) / "a.tlog"
    path.write_bytes(data)
    return path
