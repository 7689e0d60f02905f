"""Page, plot, bag and replay of one log show one track, from one origin, with the same figures."""

from __future__ import annotations

import math
import random
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drone_navigation.tlog2mcap import convert
from flight_reports.analysis.flight import Flight, read_flights
from flight_reports.analysis.warnings import lacking
from flight_reports.contents.log_reader import read_log
from flight_reports.flight_plot import plot_flight
from flight_reports.flight_recording import read_recording
from flight_reports.page.page import report_page
from mavlink_vehicle.codec import Codec, Message, make, mavlink
from mavlink_vehicle.io.tlog import TlogReader, TlogWriter
from mavlink_vehicle.positions.frames import LocalFrame
from mavlink_vehicle.profiles import profile_for
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.recording.replay import play
from tests.support.flights.made_flights import RECIPES
from tests.support.logs.bags import read_bag

pytestmark = pytest.mark.wide_but_first


BEGUN_UNIX_S = 1_700_000_000.0
ORIGIN = (52.5, 13.4, 88.89)
HOME_ALTITUDE_M = 92.55
SPEED_M_S, CLIMB_M_S = 5.0, 0.5
ARDUPILOT, PX4 = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4
NEAR_M = 0.1
"""A pair's origin is right to 2 cm, and to the way in the millisecond that times are rounded to."""


@dataclass(frozen=True)
class Shape:
    """The form of a log.

    Attributes:
        autopilot: MAV_AUTOPILOT.
        vehicle: MAV_TYPE.
        period_s: between two global positions.
        later_s: by which LOCAL_POSITION_NED comes after it; negative before.
        origin_s: when GPS_GLOBAL_ORIGIN comes; None never.
        estimator: flags of the estimator's reports; None without reports.
        lost: the share of the packets that is lost.
        seconds: of the flight.
        velocity: whether the log has velocities, not zeros.
    """

    autopilot: int = ARDUPILOT
    vehicle: int = mavlink.MAV_TYPE_QUADROTOR
    period_s: float = 0.25
    later_s: float = 0.007
    origin_s: float | None = None
    estimator: int | None = 831
    lost: float = 0.0
    seconds: float = 20.0
    velocity: bool = True


SHAPES = st.builds(
    Shape,
    autopilot=st.sampled_from([ARDUPILOT, PX4]),
    vehicle=st.sampled_from([mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_TYPE_FIXED_WING]),
    period_s=st.sampled_from([0.1, 0.25, 0.5, 1.0]),
    later_s=st.sampled_from([-0.09, -0.01, -0.0001, 0.0001, 0.007, 0.04, 0.09]),
    origin_s=st.sampled_from([None, 0.0, 3.0]),
    estimator=st.sampled_from([None, 831, 0]),
    lost=st.sampled_from([0.0, 0.2]),
)


def written(shape: Shape, path: Path) -> Path:
    """Write a flight that rises to the north-east."""
    projection = profile_for(shape.autopilot, shape.vehicle).projection
    assert projection is not None
    frame = LocalFrame(ORIGIN, projection)
    told: list[tuple[float, Message]] = [(0.0, heartbeat(shape))]
    for step in range(int(shape.seconds / shape.period_s)):
        time_s = 0.2 + step * shape.period_s
        position = globally(frame, time_s)
        if not shape.velocity:
            position.vx = position.vy = position.vz = 0
        told.append((time_s, position))
        told.append((time_s + shape.later_s, locally(time_s + shape.later_s)))
    for second in range(int(shape.seconds)):
        told.append((second + 0.05, heartbeat(shape)))
        told.append((second + 0.06, make("ATTITUDE", time_boot_ms=boot_ms(second), yaw=0.8)))
        if shape.estimator is not None:
            name = "EKF_STATUS_REPORT" if shape.autopilot == ARDUPILOT else "ESTIMATOR_STATUS"
            told.append((second + 0.07, make(name, flags=shape.estimator)))
    if shape.origin_s is not None:
        place = {"latitude": 525_000_000, "longitude": 134_000_000, "altitude": 88_890}
        told.append((shape.origin_s + 0.01, make("GPS_GLOBAL_ORIGIN", **place)))
    source, codec, writer = random.Random(repr(shape)), Codec(1, 1), TlogWriter(path)
    for time_s, message in sorted(told, key=lambda one: one[0]):
        packet = codec.encode(message)
        if source.random() >= shape.lost:
            writer.write(packet, BEGUN_UNIX_S + time_s)
    writer.close()
    return path


def boot_ms(time_s: float) -> int:
    return round(100_000 + time_s * 1000)


def moved(time_s: float) -> tuple[float, float, float]:
    way_m = SPEED_M_S * time_s / math.sqrt(2.0)
    return way_m, way_m, -CLIMB_M_S * time_s - 4.0


def heartbeat(shape: Shape) -> Message:
    return make("HEARTBEAT", type=shape.vehicle, autopilot=shape.autopilot, base_mode=209,
                custom_mode=4, system_status=4, mavlink_version=3)  # fmt: skip


def globally(frame: LocalFrame, time_s: float) -> Message:
    latitude, longitude, altitude_m = frame.geodetic(moved(time_s))
    speed = round(100.0 * SPEED_M_S / math.sqrt(2.0))
    return make(
        "GLOBAL_POSITION_INT", time_boot_ms=boot_ms(time_s), lat=round(latitude * 1e7),
        lon=round(longitude * 1e7), alt=round(altitude_m * 1e3),
        relative_alt=round((altitude_m - HOME_ALTITUDE_M) * 1e3), vx=speed, vy=speed,
        vz=round(-100 * CLIMB_M_S), hdg=4500,
    )  # fmt: skip


def locally(time_s: float) -> Message:
    north_m, east_m, down_m = moved(time_s)
    speed = SPEED_M_S / math.sqrt(2.0)
    return make("LOCAL_POSITION_NED", time_boot_ms=boot_ms(time_s), x=north_m, y=east_m, z=down_m,
                vx=speed, vy=speed, vz=-CLIMB_M_S)  # fmt: skip


def replayed(path: Path) -> list[tuple[float, tuple[float, float, float]]]:
    """The poses of a replay at each global position: time in s, east, north, up in m."""
    config = make_config({})
    bridge = Bridge(Vehicle(config.vehicle), config.bridge)
    poses = []
    for played in play(TlogReader(path), bridge, Codec(255, 190)):
        while bridge.next_output() is not None:
            pass
        message = played.message
        if message is not None and message.get_type() == "GLOBAL_POSITION_INT":
            pose = bridge.pose
            if pose is not None:
                poses.append((played.unix_s, pose.position_enu_m))
    return poses


def bagged(path: Path, out: Path) -> list[tuple[float, tuple[float, float, float]]]:
    """The poses of a bag: the recorder's time in s, east, north, up in m."""
    convert(path, out)
    topic = read_bag(out).topics["/navigation_server/pose"]
    return [
        (time_ns * 1e-9, (m.pose.position.x, m.pose.position.y, m.pose.position.z))
        for time_ns, m in topic.messages
    ]


def assert_one_track(path: Path, folder: Path) -> Flight:
    """Fail unless all that shows the log agrees."""
    (flight,) = read_flights(read_log(path))
    track, plot = flight.track, read_recording(path)
    assert plot.figures == flight.figures
    assert np.array_equal(plot.positions_enu_m, track.position_enu_m)
    assert np.array_equal(plot.times_s, track.time_s - track.time_s[0])
    assert np.array_equal(plot.speeds_m_s, track.ground_speed_m_s)
    times_s = flight.contents.begun_unix_s + track.time_s
    bag, replay = bagged(path, folder / "a.mcap"), replayed(path)
    for poses in (bag, replay):
        for time_s, position_enu_m in poses:
            index = int(np.argmin(np.abs(times_s - time_s)))
            assert times_s[index] == pytest.approx(time_s, abs=0.1)
            assert position_enu_m == pytest.approx(track.position_enu_m[index], abs=NEAR_M)
    assert {round(time_s, 3) for time_s, _ in replay} <= {round(time_s, 3) for time_s, _ in bag}
    return flight


@settings(max_examples=8, deadline=None)
@given(SHAPES)
def test_page_plot_bag_and_replay_show_one_track(shape: Shape) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        flight = assert_one_track(written(shape, folder / "a.tlog"), folder)
        figures, contents = flight.figures, flight.contents
        assert figures is not None
        flown_s = float(flight.track.time_s[-1] - flight.track.time_s[0])
        assert figures.fastest_m_s is not None
        assert figures.distance_m == pytest.approx(
            math.hypot(SPEED_M_S, CLIMB_M_S) * flown_s, rel=0.01, abs=0.5
        )
        assert figures.fastest_m_s == pytest.approx(SPEED_M_S, abs=0.01)
        assert figures.height_reference == "home"
        end_s = flight.track.time_s[-1] + contents.begun_unix_s - BEGUN_UNIX_S
        assert figures.highest_m == pytest.approx(
            ORIGIN[2] - moved(end_s)[2] - HOME_ALTITUDE_M, abs=0.1
        )
        # The server publishes every position once it has the map frame.
        poses = replayed(folder / "a.tlog")
        if shape.estimator == 0:
            assert "confirms no position" in " ".join(lacking(flight))
        else:
            begun_s = poses[0][0] - contents.begun_unix_s if poses else 0.0
            assert len(poses) == int((flight.track.time_s >= begun_s - 1e-3).sum())


@pytest.mark.parametrize("later_s", [0.0001, 0.007, 0.09])
@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_a_local_position_just_after_the_global_one_gives_a_pose(
    tmp_path: Path, later_s: float, autopilot: int
) -> None:
    path = written(Shape(autopilot=autopilot, later_s=later_s), tmp_path / "a.tlog")
    (flight,) = read_flights(read_log(path))
    assert len(replayed(path)) >= len(flight.track.time_s) - 1
    assert len(bagged(path, tmp_path / "a.mcap")) >= len(flight.track.time_s) - 1


def test_the_page_and_the_plot_write_the_same_figures(tmp_path: Path) -> None:
    path = written(Shape(origin_s=0.0), tmp_path / "a.tlog")
    (flight,) = read_flights(read_log(path))
    figures = flight.figures
    assert figures is not None
    text = report_page([flight])
    assert f"<dd>{figures.distance_m:.0f} m</dd>" in text
    assert f"<dd>{figures.highest_m:.1f} m above home</dd>" in text
    assert figures.fastest_m_s is not None
    assert f"<dd>{figures.fastest_m_s:.1f} m/s</dd>" in text
    assert plot_flight(path, tmp_path / "a.png").figures == figures


def test_a_log_without_velocity_has_no_fastest(tmp_path: Path) -> None:
    """Old autopilots' logs have positions only; their page said "fastest 0.0 m/s"."""
    path = written(Shape(velocity=False), tmp_path / "a.tlog")
    (flight,) = read_flights(read_log(path))
    assert flight.figures is not None
    assert flight.figures.fastest_m_s is None
    text = report_page([flight])
    assert "fastest" not in text
    assert "no velocity of this vehicle" in text
    assert plot_flight(path, tmp_path / "a.png").figures == flight.figures


@pytest.mark.wide
def test_the_recording_of_a_server_has_one_track(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    RECIPES["px4_copter_goals"].fly(path)
    assert_one_track(path, tmp_path)


@pytest.mark.parametrize("above_m", [0.0, 12.0, 488.0])
def test_highest_counts_from_home_or_from_the_first_position(
    tmp_path: Path, above_m: float
) -> None:
    """A home that is not set yet is at sea level; heights that are never told are not above it."""
    codec, writer = Codec(1, 1), TlogWriter(tmp_path / "a.tlog")
    writer.write(codec.encode(heartbeat(Shape())), BEGUN_UNIX_S)
    for step in range(50):
        altitude_m = 488.0 + 0.2 * step
        height_m = altitude_m if above_m == 488.0 and step < 10 else altitude_m - 488.0
        fields = {"lat": 525_000_000, "lon": 134_000_000, "alt": round(altitude_m * 1e3)}
        relative = 0 if above_m == 0.0 else round(height_m * 1e3)
        message = make("GLOBAL_POSITION_INT", time_boot_ms=step * 100, relative_alt=relative,
                       hdg=0, **fields)  # fmt: skip
        writer.write(codec.encode(message), BEGUN_UNIX_S + 0.1 * step)
    writer.close()
    (flight,) = read_flights(read_log(tmp_path / "a.tlog"))
    figures = flight.figures
    assert figures is not None
    assert figures.highest_m == pytest.approx(9.8, abs=0.01)
    assert figures.height_reference == ("home" if above_m else "the first position")
