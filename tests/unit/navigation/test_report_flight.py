"""Findings of a report: commands and answers, vehicles, warnings."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from flight_logs.tlog import iterate_tlog
from flight_reports.analysis.commands import commands
from flight_reports.analysis.flight import Flight, read_flights
from flight_reports.analysis.sensed_obstacles import Sensed
from flight_reports.analysis.warnings import lacking, warnings
from flight_reports.contents import log_reader as report_log
from flight_reports.contents.log_reader import LogContents, read_contents
from flight_reports.page.comparison import align, comparison_page, energy_wh, in_one_frame
from flight_reports.page.figures import map_figure
from flight_reports.page.obstacle_traces import obstacle_traces
from flight_reports.page.page import report_page
from mavlink_vehicle.codec import Codec, Message, make, mavlink, with_source
from mavlink_vehicle.io.tlog import TlogWriter
from navigation_bridge import notes
from navigation_core.mapping.obstacles import Obstacles

DATA = Path(__file__).resolve().parents[2] / "data"
Source = tuple[int, int]
VEHICLE, SERVER, STATION = (1, 1), (1, 191), (255, 190)
Sent = tuple[float, Message]


def log_of(path: Path, sent: Iterable[Sent]) -> LogContents:
    codec = Codec(source_system=1, source_component=1)
    writer = TlogWriter(path)
    for time_s, message in sorted(sent, key=lambda one: one[0]):
        writer.write(codec.encode(message), 1_700_000_000.0 + time_s)
    writer.close()
    return read_contents(path)


def heartbeats(source: Source = VEHICLE, until_s: float = 10.0, armed: bool = True) -> list[Sent]:
    base_mode = 209 if armed else 81
    return [
        (float(time_s), with_source(make("HEARTBEAT", type=2, autopilot=3, base_mode=base_mode,
                                         custom_mode=4, system_status=4), *source))
        for time_s in np.arange(0.0, until_s)
    ]  # fmt: skip


def command(time_s: float, number: int, by: Source = SERVER) -> Sent:
    message = make("COMMAND_LONG", target_system=1, target_component=1, command=number)
    return time_s, with_source(message, *by)


def answer(time_s: float, number: int, result: int = mavlink.MAV_RESULT_ACCEPTED) -> Sent:
    return time_s, with_source(make("COMMAND_ACK", command=number, result=result), *VEHICLE)


def along(time_s: float, north_m: float, source: Source = VEHICLE, up_m: float = 5.0) -> Sent:
    message = make("LOCAL_POSITION_NED", time_boot_ms=int(time_s * 1e3), x=north_m, z=-up_m, vx=1.0)
    return time_s, with_source(message, *source)


ARM, LAND, HOME = 400, 21, 179


def test_commands_are_matched_with_their_answers(tmp_path: Path) -> None:
    sent = [
        *heartbeats(until_s=20.0),
        command(1.0, ARM), answer(1.1, ARM),
        command(2.0, LAND), command(3.0, LAND), answer(3.2, LAND),
        command(4.0, HOME, STATION),
        command(12.0, ARM), answer(12.1, ARM, mavlink.MAV_RESULT_IN_PROGRESS),
        answer(13.0, ARM, mavlink.MAV_RESULT_FAILED),
    ]  # fmt: skip
    found = commands(log_of(tmp_path / "a.tlog", sent), VEHICLE)
    assert [(one.name, one.sent, one.result) for one in found] == [
        ("COMPONENT_ARM_DISARM", 1, "ACCEPTED"),
        ("NAV_LAND", 2, "ACCEPTED"),
        ("DO_SET_HOME", 1, ""),
        ("COMPONENT_ARM_DISARM", 1, "FAILED"),
    ]
    after = [one.answered_after_s for one in found]
    assert after == [pytest.approx(0.1, abs=1e-4), pytest.approx(1.2, abs=1e-4), None,
                     pytest.approx(0.1, abs=1e-4)]  # fmt: skip
    assert found[2].by == STATION


def told(flight: Flight) -> list[str]:
    return [warned.first.text for warned in warnings(flight)]


def test_late_and_missing_answers_and_other_stations_are_warnings(tmp_path: Path) -> None:
    sent = [*heartbeats(until_s=20.0), command(1.0, ARM), answer(1.1, ARM), command(2.0, LAND)]
    sent += [command(3.0, LAND), answer(3.2, LAND), command(4.0, HOME, STATION)]
    (flight,) = read_flights(log_of(tmp_path / "a.tlog", sent))
    found = told(flight)
    assert "NAV_LAND of 1/191 was acknowledged only after 1.2 s" in found
    assert "DO_SET_HOME of 255/190 was never acknowledged (sent once)" in found
    assert any("Ground station 255/190" in text and "also sent commands" in text for text in found)
    assert not any("COMPONENT_ARM_DISARM" in text for text in found)


def test_a_recording_of_one_direction_has_no_warnings_about_answers(tmp_path: Path) -> None:
    sent = [*heartbeats(), command(1.0, ARM), command(2.0, LAND)]
    (flight,) = read_flights(log_of(tmp_path / "a.tlog", sent))
    assert told(flight) == []


def test_a_restart_and_a_silence_are_warnings(tmp_path: Path) -> None:
    boot_ms = [*range(50_000, 60_000, 1000), *range(2000, 12_000, 1000)]
    sent = [(i + 0.5, with_source(make("SYSTEM_TIME", time_boot_ms=time_ms), *VEHICLE))
            for i, time_ms in enumerate(boot_ms)]  # fmt: skip
    beats = [one for one in heartbeats(until_s=30.0) if one[0] < 20.0 or one[0] > 25.0]
    (flight,) = read_flights(log_of(tmp_path / "a.tlog", [*beats, *sent]))
    assert "The autopilot restarted" in told(flight)
    assert "The vehicle was silent for 6.5 s" in told(flight)


def test_a_failsafe_is_a_warning_and_modes_are_listed() -> None:
    (flight,) = read_flights(read_contents(DATA / "copter_lowbatt.tlog"))
    assert any(text.startswith("Failsafe (battery)") for text in told(flight))
    assert [name for _, name in flight.retold.modes][:3] == ["STABILIZE", "GUIDED", "RTL"]
    assert flight.armed_s == pytest.approx(70.0, abs=1.0)
    assert flight.track.position_enu_m[:, 2].max() == pytest.approx(15.0, abs=0.2)


def test_an_invalid_position_of_the_estimator_is_not_used() -> None:
    (flight,) = read_flights(read_contents(DATA / "rover_guided.tlog"))
    # Before 41 s it tells a place at sea level.
    assert flight.track.time_s[0] > 41.0
    assert np.ptp(flight.track.position_enu_m[:, 2]) < 1.0


def test_goals_are_reported_with_their_own_vehicle_only(tmp_path: Path) -> None:
    sent = [*heartbeats(), *heartbeats((2, 1))]
    for system in (1, 2):
        note = notes.goal_accepted(f"abcdef1{system}", (1.0, 2.0, 3.0 * system))
        sent.append((3.0 + system, with_source(note, system, notes.COMPONENT_ID)))
        sent += [along(0.1 * i, 0.1 * i, (system, 1)) for i in range(90)]
    contents = log_of(tmp_path / "a.tlog", sent)
    flights = read_flights(contents)
    assert [flight.name for flight in flights] == ["ArduCopter, system 1", "ArduCopter, system 2"]
    for flight, system in zip(flights, (1, 2), strict=True):
        (goal,) = flight.retold.noted.goals
        assert goal.targets_enu_m == ((1.0, 2.0, 3.0 * system),)
        assert any("no battery" in sentence for sentence in lacking(flight))
        assert any("local frame" in sentence for sentence in lacking(flight))
        assert not any("no goals" in sentence for sentence in lacking(flight))
    page = report_page(flights)
    assert page.count("<section") == 2
    assert 'href="#v2-1"' in page
    assert [flight.source for flight in read_flights(contents, system=2)] == [(2, 1)]


def test_a_clock_set_back_is_reported_and_keeps_the_order(tmp_path: Path) -> None:
    codec, writer = Codec(1, 1), TlogWriter(tmp_path / "a.tlog")
    for time_s, message in [*heartbeats(), *[along(t, t) for t in (10.0, 11.0, 4.0, 5.0, 12.0)]]:
        writer.write(codec.encode(message), 1_700_000_000.0 + time_s)
    writer.close()
    (flight,) = read_flights(read_contents(tmp_path / "a.tlog"))
    assert (np.diff(flight.track.time_s) >= 0.0).all()
    assert any("clock stepped back once" in text for text in told(flight))


@pytest.mark.parametrize("off_s", [4e9, 7200.0, -1e9])
def test_a_damaged_time_stretches_nothing(tmp_path: Path, off_s: float) -> None:
    sent = [*heartbeats(until_s=20.0), *[along(0.1 * i, 0.1 * i) for i in range(200)]]
    codec, writer = Codec(1, 1), TlogWriter(tmp_path / "a.tlog")
    for place, (time_s, message) in enumerate(sorted(sent, key=lambda one: one[0])):
        writer.write(codec.encode(message), 1_700_000_000.0 + time_s + off_s * (place == 100))
    writer.close()
    (flight,) = read_flights(read_contents(tmp_path / "a.tlog"))
    assert flight.contents.duration_s == pytest.approx(19.9, abs=0.2)
    assert flight.track.time_s == pytest.approx(0.1 * np.arange(200), abs=0.2)


def test_flights_are_aligned_at_their_first_common_event(
    tmp_path: Path,
) -> None:
    def flown(name: str, begin_s: float, goal: bool) -> Flight:
        sent = heartbeats(until_s=20.0)
        sent += [along(0.1 * i, max(0.1 * i - begin_s, 0.0), up_m=0.0 if 0.1 * i < begin_s else 5.0)
                 for i in range(200)]  # fmt: skip
        if goal:
            note = with_source(notes.goal_accepted("abcdef12", (9.0, 9.0, 5.0)), 1, 194)
            sent.append((begin_s - 1.0, note))
        return read_flights(log_of(tmp_path / name, sent))[0]

    first, second = flown("a.tlog", 5.0, True), flown("b.tlog", 8.0, True)
    assert align(first, second).event == "acceptance of the first goal"
    assert align(first, second).times_s == pytest.approx((4.0, 7.0), abs=1e-3)
    without = flown("c.tlog", 8.0, False)
    assert align(first, without).event.startswith("take-off")
    assert align(first, without).times_s == pytest.approx((5.0, 8.0), abs=0.11)
    page = comparison_page(first, without)
    assert "Time zero is take-off" in page
    assert "each track begins at its own" in page
    (rover,) = read_flights(read_contents(DATA / "rover_guided.tlog"))
    (copter,) = read_flights(read_contents(DATA / "copter_lowbatt.tlog"))
    assert align(copter, rover).event.startswith("first movement")


def test_two_tracks_of_one_location_share_the_map_frame() -> None:
    (copter,) = read_flights(read_contents(DATA / "copter_lowbatt.tlog"))
    (rover,) = read_flights(read_contents(DATA / "rover_guided.tlog"))
    (a, b), words = in_one_frame(copter, rover)
    assert "map frame of A" in words
    assert a is copter.track
    # Both began where the simulator puts what it simulates.
    assert np.hypot(*b.position_enu_m[0, :2]) < 1.0
    assert energy_wh(copter) == pytest.approx(6.0, abs=3.0)


def test_obstacles_are_drawn_beneath_the_track(tmp_path: Path) -> None:
    origin = make("GPS_GLOBAL_ORIGIN", latitude=450_000_000, longitude=80_000_000, altitude=100_000)
    sent = [*heartbeats(), (0.0, with_source(origin, *VEHICLE))]
    for i in range(90):
        place = make("GLOBAL_POSITION_INT", time_boot_ms=100 * i, lat=450_000_000, lon=80_000_000,
                     alt=100_000, hdg=65535)  # fmt: skip
        turned = make("ATTITUDE", time_boot_ms=100 * i)
        scan = make("OBSTACLE_DISTANCE", time_usec=100_000 * i, increment=5, increment_f=5.0,
                    distances=[500] + [1001] * 71, min_distance=20, max_distance=1000,
                    frame=mavlink.MAV_FRAME_BODY_FRD)  # fmt: skip
        sent.append(along(0.1 * i, 0.0, up_m=2.0))
        sent += [(0.1 * i, with_source(message, *VEHICLE)) for message in (place, turned, scan)]
    (flight,) = read_flights(log_of(tmp_path / "a.tlog", sent))
    drawn = obstacle_traces(flight.sensed)
    (held,) = drawn
    assert held["name"] == "obstacles at the end"
    north_m = [value for value in held["y"] if value is not None]
    assert np.median(north_m) == pytest.approx(5.0, abs=0.6)
    figure = map_figure(flight, drawn)
    assert figure is not None
    names = [trace["name"] for trace in figure["data"]]
    assert names.index("obstacles at the end") < names.index("flown")


def test_an_obstacle_that_has_gone_is_drawn_once_and_apart_from_those_still_held() -> None:
    post, lower = (1.0, 2.0, 0.2, 0.0, 5.0), (1.0, 2.0, 0.2, 0.0, 3.0)
    gone, as_low = (8.0, 2.0, 0.2, 0.0, 5.0), (8.0, 2.0, 0.2, 0.0, 3.0)
    ever, held = Obstacles(np.array([post, lower, gone, as_low])), Obstacles(np.array([post]))
    once, now = json.loads(json.dumps(obstacle_traces(Sensed(ever, held))))
    corners = 5  # four, and the break after them
    once_x, now_x = once["x"], now["x"]
    assert isinstance(once_x, list)
    assert isinstance(now_x, list)
    assert [len(once_x), len(now_x)] == [corners, corners]
    assert min(value for value in once_x if value is not None) > 7.0


def test_a_command_without_an_answer_in_five_seconds_is_unanswered(tmp_path: Path) -> None:
    sent = [*heartbeats(until_s=20.0), command(1.0, ARM), answer(7.0, ARM)]
    (found,) = commands(log_of(tmp_path / "a.tlog", sent), VEHICLE)
    assert found.answered_after_s is None
    assert found.result == ""


def test_without_a_heartbeat_a_vehicle_is_identified_by_its_position(tmp_path: Path) -> None:
    sent = [along(0.1 * i, 0.1 * i) for i in range(90)]
    (flight,) = read_flights(log_of(tmp_path / "a.tlog", sent))
    assert flight.name == "Vehicle, system 1"
    assert any("no HEARTBEAT" in sentence for sentence in lacking(flight))
    assert "unknown" in report_page([flight])


def test_rates_and_gaps_are_the_same_however_the_log_is_cut_in_pieces(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    times_s = [*np.arange(0.0, 40.0, 0.1), *np.arange(50.0, 60.0, 0.1)]
    sent = [*heartbeats(until_s=60.0), *[along(float(t), 1.0) for t in times_s]]
    whole = log_of(tmp_path / "a.tlog", sent)
    rate = whole.rates[VEHICLE, "LOCAL_POSITION_NED"]
    assert rate.count == 500
    assert rate.rate_hz == pytest.approx(499 / 59.9, rel=1e-3)
    assert rate.longest_gap_s == pytest.approx(10.1, abs=1e-3)
    monkeypatch.setattr(report_log, "iterate_tlog", partial(iterate_tlog, chunk_bytes=5000))
    pieces = read_contents(tmp_path / "a.tlog")
    assert pieces.rates == whole.rates
    assert np.array_equal(pieces.packets["time_s"], whole.packets["time_s"])


def test_unknown_messages_are_not_lost(tmp_path: Path) -> None:
    stamp, codec = struct.Struct(">Q"), Codec(1, 1)
    log = b""
    for i in range(100):
        packet = bytearray(codec.encode(make("HEARTBEAT", type=2, autopilot=3)))
        if i % 4 == 0:
            packet[7:10] = (54_321).to_bytes(3, "little")
        log += stamp.pack(1_700_000_000_000_000 + 100_000 * i) + packet
    (tmp_path / "a.tlog").write_bytes(log)
    (flight,) = read_flights(read_contents(tmp_path / "a.tlog"))
    assert flight.contents.counts.unknown_messages == {54_321: 25}
    assert (flight.link.received, flight.link.lost) == (100, 0)
