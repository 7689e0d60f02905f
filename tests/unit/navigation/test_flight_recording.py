"""Flights are read from tlogs of any recorder."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from flight_reports.flight_recording import NoFlightError, read_recording
from mavlink_vehicle.codec import Codec, Message, make, mavlink, with_source
from mavlink_vehicle.io.tlog import TlogReader, TlogWriter
from navigation_bridge import notes
from navigation_core.geometry import Vector3
from navigation_core.tasks.progress import Progress, Status

DATA = Path(__file__).resolve().parents[2] / "data"
NOTES = (1, notes.COMPONENT_ID)


def write(path: Path, messages: Iterable[tuple[float, Message]]) -> Path:
    """Write (time in s, message) as a tlog."""
    codec = Codec(source_system=1, source_component=1)
    writer = TlogWriter(path)
    for time_s, message in messages:
        writer.write(codec.encode(message), 1_700_000_000.0 + time_s)
    writer.close()
    return path


def heartbeat(source: tuple[int, int] = (1, 1)) -> Message:
    message = make(
        "HEARTBEAT", type=2, autopilot=3, base_mode=209, custom_mode=4, system_status=4,
        mavlink_version=3,
    )  # fmt: skip
    return with_source(message, *source)


def local(x: float, y: float, z: float, boot_ms: int, source: tuple[int, int] = (1, 1)) -> Message:
    message = make(
        "LOCAL_POSITION_NED", time_boot_ms=boot_ms, x=x, y=y, z=z, vx=1.0, vy=0.0, vz=0.0
    )
    return with_source(message, *source)


def globally(north_m: float, boot_ms: int, source: tuple[int, int] = (1, 1)) -> Message:
    degree_m = 111_132.0  # near enough at this latitude
    message = make(
        "GLOBAL_POSITION_INT", time_boot_ms=boot_ms, lat=int((45.0 + north_m / degree_m) * 1e7),
        lon=80_000_000, alt=100_000, relative_alt=0, vx=0, vy=0, vz=0, hdg=65535,
    )  # fmt: skip
    return with_source(message, *source)


def note(message: Message) -> Message:
    return with_source(message, *NOTES)


def flight() -> list[tuple[float, Message]]:
    """Return a flight of ten seconds, one metre a second to the north."""
    begin: list[tuple[float, Message]] = [(0.0, heartbeat())]
    return begin + [(0.1 * i, local(0.1 * i, 0.0, -2.0, 100 * i)) for i in range(100)]


@pytest.mark.parametrize(
    ("name", "vehicle", "length_m"),
    [
        ("copter_lowbatt.tlog", "ArduCopter", 25.0),
        ("rover_guided.tlog", "ArduRover", 27.0),
        ("offboard_10m_20n_gt_api.tlog", "PX4 multicopter", 20.0),
    ],
)
def test_a_recording_of_another_program_is_read_and_missing_content_is_listed(
    name: str, vehicle: str, length_m: float
) -> None:
    recording = read_recording(DATA / name)
    assert recording.vehicle == f"{vehicle}, system 1"
    assert np.ptp(recording.positions_enu_m[:, :2], axis=0).max() == pytest.approx(
        length_m, abs=1.5
    )
    assert any("goals, plans and distances" in remark for remark in recording.remarks)
    assert recording.status.values[-1].startswith("mode ")
    assert not len(recording.goals)
    assert not len(recording.distance_m)


def test_notes_of_the_server_are_read_back(tmp_path: Path) -> None:
    corners: tuple[Vector3, ...] = tuple((float(i), -float(i), 2.0) for i in range(45))
    noted = [
        notes.goal_accepted("abcdef12", (1.0, 2.0, 3.0)),
        notes.goal_accepted("abcdef12", (4.0, 5.0, 6.0)),
        *notes.plan(corners),
        notes.text("goal abcdef12 NAVIGATING"),
        *notes.progress(Progress(Status.NAVIGATING, 12.5, 6.25, replans=1), 5.0),
        *notes.plan(corners[:2]),
        notes.text("goal abcdef12 ended SUCCESS"),
    ]
    messages = flight() + [(5.0, note(message)) for message in noted]
    recording = read_recording(write(tmp_path / "a.tlog", sorted(messages, key=lambda m: m[0])))
    (goal,) = recording.goals.values
    assert goal.targets_enu_m == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    assert recording.plans.values == (corners, corners[:2])
    assert recording.status.values == ("NAVIGATING", "ended SUCCESS")
    assert recording.replans.values == (1,)
    assert recording.distance_m.at(4.9) is None
    assert recording.distance_m.at(5.1) == 12.5
    assert recording.time_left_s.at(9.0) == 6.25
    assert not any("goals" in remark for remark in recording.remarks)


def test_without_a_global_position_the_local_one_is_drawn_with_a_remark(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path / "a.tlog", flight()))
    assert recording.positions_enu_m[-1] == pytest.approx((0.0, 9.9, 2.0), abs=1e-5)
    assert recording.speeds_m_s[-1] == pytest.approx(1.0)
    assert any("local frame" in remark for remark in recording.remarks)


def test_without_an_origin_the_first_position_is_used_with_a_remark(tmp_path: Path) -> None:
    messages = [(0.0, heartbeat())] + [(0.1 * i, globally(0.1 * i, 100 * i)) for i in range(100)]
    recording = read_recording(write(tmp_path / "a.tlog", messages))
    assert recording.positions_enu_m[0] == pytest.approx((0.0, 0.0, 0.0))
    assert recording.positions_enu_m[-1] == pytest.approx((0.0, 9.9, 0.0), abs=0.05)
    assert any("first position" in remark for remark in recording.remarks)


def test_of_several_vehicles_the_first_with_a_position_is_drawn_with_a_remark(
    tmp_path: Path,
) -> None:
    station = make(
        "HEARTBEAT", type=6, autopilot=mavlink.MAV_AUTOPILOT_INVALID, base_mode=0, custom_mode=0,
        system_status=4, mavlink_version=3,
    )  # fmt: skip
    messages = [(0.0, with_source(station, 255, 190)), (0.0, heartbeat((7, 1)))]
    messages += [(0.1, heartbeat((3, 1))), (0.2, local(1.0, 0.0, 0.0, 100, (3, 1)))]
    messages += [(0.3, local(50.0, 0.0, 0.0, 100, (7, 1)))]
    messages += [(0.4, local(2.0, 0.0, 0.0, 200, (3, 1)))]
    recording = read_recording(write(tmp_path / "a.tlog", messages))
    assert recording.vehicle == "ArduCopter, system 3"
    assert recording.positions_enu_m[:, 1] == pytest.approx([1.0, 2.0])
    assert "System 3 is drawn; the recording also contains system 7." in recording.remarks


def test_a_clock_set_back_while_recording_keeps_the_order(tmp_path: Path) -> None:
    messages = [(0.0, heartbeat())]
    messages += [(time_s, local(i, 0.0, 0.0, 100 * i)) for i, time_s in enumerate((5.0, 6.0, 2.0))]
    recording = read_recording(write(tmp_path / "a.tlog", messages))
    assert (np.diff(recording.times_s) >= 0.0).all()


def test_sensor_readings_are_placed_in_the_map_at_their_time(tmp_path: Path) -> None:
    origin = make("GPS_GLOBAL_ORIGIN", latitude=450_000_000, longitude=80_000_000, altitude=100_000)
    messages: list[tuple[float, Message]] = [(0.0, heartbeat()), (0.0, with_source(origin, 1, 1))]
    for i in range(60):
        time_s, boot_ms = 0.1 * i, 100 * i
        turned = make(
            "ATTITUDE", time_boot_ms=boot_ms, roll=0.0, pitch=0.0, yaw=math.pi / 2, rollspeed=0.0,
            pitchspeed=0.0, yawspeed=0.0,
        )  # fmt: skip
        # Five metres ahead, which is east, from the third second to the fourth.
        ahead_cm = 500 if 30 <= i < 40 else 1001
        scan = make(
            "OBSTACLE_DISTANCE", time_usec=boot_ms * 1000, sensor_type=0, increment=5,
            distances=[ahead_cm] + [1001] * 71, min_distance=20, max_distance=1000,
            increment_f=5.0, angle_offset=0.0, frame=mavlink.MAV_FRAME_BODY_FRD,
        )  # fmt: skip
        place = (globally(0.0, boot_ms), local(0.0, 0.0, -2.0, boot_ms))
        told = (*place, with_source(turned, 1, 1), with_source(scan, 1, 1))
        messages.extend((time_s, message) for message in told)
    recording = read_recording(write(tmp_path / "a.tlog", messages))
    seen = recording.obstacles
    assert not len(seen.at(2.5) or ())
    held = seen.at(3.9)
    assert held is not None
    assert np.abs(held.posts[:, 0] - 5.0).max() < 0.6
    assert np.abs(held.posts[:, 1]).max() < 0.6
    assert not len(seen.at(5.9) or ())


@pytest.mark.parametrize("content", [None, b"", b"not a log at all" * 100])
def test_a_file_that_is_not_a_flight_recording_is_an_error(
    tmp_path: Path, content: bytes | None
) -> None:
    log = tmp_path / "flight.tlog"
    if content is not None:
        log.write_bytes(content)
    with pytest.raises(NoFlightError, match=r"flight\.tlog"):
        read_recording(log)


def test_a_recording_that_is_cut_off_is_read_up_to_there(tmp_path: Path) -> None:
    whole = (DATA / "copter_lowbatt.tlog").read_bytes()
    log = tmp_path / "cut.tlog"
    log.write_bytes(whole[: len(whole) // 2 + 7])
    recording = read_recording(log)
    until_s = list(TlogReader(log))[-1][0] - next(iter(TlogReader(log)))[0]
    assert 0.0 < recording.duration_s <= until_s
    assert math.isfinite(recording.positions_enu_m.sum())


def test_of_several_vehicles_each_is_read_with_its_own_notes(tmp_path: Path) -> None:
    messages = flight()
    for system in (2, 3):
        source = (system, 1)
        messages += [(0.1, heartbeat(source))]
        messages += [(0.2 + i, local(0.0, 0.0, -1.0, 1000 * i, source)) for i in range(5)]
        goal = notes.goal_accepted(f"goal{system}", (float(system), 0.0, 3.0))
        messages += [(4.0, with_source(goal, system, notes.COMPONENT_ID))]
    path = write(tmp_path / "a.tlog", sorted(messages, key=lambda m: m[0]))
    for system in (2, 3):
        (goal_read,) = read_recording(path, system).goals.values
        assert goal_read.targets_enu_m == ((float(system), 0.0, 3.0),)
    assert not read_recording(path, 1).goals.values
    with pytest.raises(NoFlightError, match="no position of system 7; it contains system 1, 2, 3"):
        read_recording(path, 7)
