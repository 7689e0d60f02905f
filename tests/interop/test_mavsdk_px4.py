"""MAVSDK, unmodified from PyPI, with what only the simulated PX4 has, and with files of both."""

from __future__ import annotations

import math
import queue
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mavsdk", reason="MAVSDK from PyPI is not installed")

from mavsdk.plugins.action import OrbitYawBehavior
from mavsdk.plugins.follow_me import Config, TargetLocation
from mavsdk.plugins.ftp import FtpResult
from mavsdk.plugins.mission import MissionItem, MissionPlan
from mavsdk.plugins.telemetry import FlightMode

from tests.interop.test_mavsdk import connected, start_uploaded_mission
from tests.support.stations.mavsdk_station import WAIT_S, Station, wait

pytestmark = pytest.mark.wide


SQUARE = ((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0), (0.0, 0.0))


def flying(flight: Station, height_m: float) -> None:
    flight.action.set_takeoff_altitude(height_m)
    flight.action.arm()
    flight.action.takeoff()
    wait(lambda: flight.telemetry.position().relative_altitude_m > height_m - 1.0, "the height")
    wait(lambda: flight.telemetry.flight_mode() == FlightMode.HOLD, "hold")


def corner(flight: Station, north_m: float, east_m: float, action: int) -> Any:
    """Flown through, with the gimbal down and something for the camera to do."""
    return MissionItem(
        *flight.point(north_m, east_m), 10.0, 5.0, True, -60.0, 0.0,
        MissionItem.CameraAction(action), float("nan"), 1.0, 2.0, float("nan"), 5.0,
    )  # fmt: skip


@pytest.mark.night
@pytest.mark.parametrize("ends_by", ["return", "land"])
def test_a_square_with_camera_and_gimbal_is_flown_and_ends(ends_by: str) -> None:
    with connected("--autopilot", "px4") as flight:
        items = [corner(flight, *place, number) for number, place in enumerate(SQUARE)]
        flight.plan.set_return_to_launch_after_mission(ends_by == "return")
        flight.plan.upload_mission(MissionPlan(items))
        back = flight.plan.download_mission().mission_items
        assert [item.camera_action for item in back] == [item.camera_action for item in items]
        flight.action.arm()
        start_uploaded_mission(flight)
        seen: list[tuple[float, float]] = []

        def flown() -> bool:
            seen.append(flight.north_east_up()[:2])
            return bool(flight.plan.is_mission_finished())

        wait(flown, "the mission's end")
        for place in SQUARE:
            assert min(math.dist(place, each) for each in seen) < 4.0, place
        if ends_by == "land":
            flight.action.land()
        wait(lambda: not flight.telemetry.armed(), "landed and disarmed")
        assert math.hypot(*flight.north_east_up()[:2]) < 2.0


@pytest.mark.night
def test_an_orbit_is_flown_until_hold() -> None:
    with connected("--autopilot", "px4") as flight:
        flying(flight, 10.0)
        home_m = flight.telemetry.home().absolute_altitude_m
        centre = (15.0, 0.0)
        rule = OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER
        flight.action.do_orbit(8.0, 3.0, rule, *flight.point(*centre), home_m + 10.0)
        seen: set[int] = set()

        def all_round() -> bool:
            north, east, _ = flight.north_east_up()
            angle = math.degrees(math.atan2(east, north - centre[0]))
            if abs(math.hypot(north - centre[0], east) - 8.0) < 2.0:
                seen.add(int(angle % 360.0) // 45)
            return len(seen) == 8

        wait(all_round, "all round the circle")
        flight.action.hold()
        wait(lambda: flight.telemetry.flight_mode() == FlightMode.HOLD, "hold")


@pytest.mark.night
def test_a_target_is_followed() -> None:
    with connected("--autopilot", "px4") as flight:
        flying(flight, 10.0)
        home_m = flight.telemetry.home().absolute_altitude_m
        heights = Config.FollowAltitudeMode.CONSTANT
        flight.follow_me.set_config(Config(12.0, 10.0, 0.1, heights, 8.0, 180.0))
        place = flight.point(30.0, 0.0)
        flight.follow_me.start()
        wait(flight.follow_me.is_active, "the mode")
        flight.follow_me.set_target_location(TargetLocation(*place, home_m, 0.0, 0.0, 0.0))
        # A target that stands counts as looking north: 10 m south of it.
        wait(lambda: math.dist(flight.north_east_up()[:2], (20.0, 0.0)) < 1.5, "behind the target")
        flight.follow_me.stop()
        wait(lambda: flight.telemetry.flight_mode() == FlightMode.HOLD, "hold")


def transferred(begin: Callable[[Callable[..., None]], None]) -> None:
    """Wait for the end of an upload or a download."""
    results: queue.Queue[Any] = queue.Queue()
    begin(lambda result, _progress, _user_data: results.put(result))
    while (result := results.get(timeout=WAIT_S)) == FtpResult.NEXT:
        pass
    assert result == FtpResult.SUCCESS


def download(flight: Station, remote: str, folder: Path, burst: bool) -> None:
    folder.mkdir()
    transferred(lambda done: flight.ftp.download_async(remote, str(folder), burst, done))


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_files_are_put_and_got_and_changed(autopilot: str, tmp_path: Path) -> None:
    sent = tmp_path / "sent.bin"
    sent.write_bytes(bytes(range(256)) * 40)
    folder = "/fs/microsd/new" if autopilot == "px4" else "/new"
    with connected("--autopilot", autopilot) as flight:
        ftp = flight.ftp
        ftp.create_directory(folder)
        transferred(lambda done: ftp.upload_async(str(sent), folder, done))
        if (
            autopilot == "px4"
        ):  # MAVSDK does not understand the two zeros between ArduPilot's entries
            names = [entry.name for entry in ftp.list_directory(folder).entries]
            assert [name for name in names if "sent.bin" in name]
        assert ftp.are_files_identical(str(sent), f"{folder}/sent.bin")
        ftp.rename(f"{folder}/sent.bin", f"{folder}/other.bin")
        for burst in (False, True):
            download(flight, f"{folder}/other.bin", tmp_path / f"got-{burst}", burst)
            assert (tmp_path / f"got-{burst}" / "other.bin").read_bytes() == sent.read_bytes()
        ftp.remove_file(f"{folder}/other.bin")
        ftp.remove_directory(folder)
