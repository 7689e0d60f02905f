"""MAVSDK, unmodified from PyPI, flies the simulator over UDP as it would a real vehicle.

The real ArduPilot sends no telemetry unasked; so MAVSDK's rates are set, and MISSION_CURRENT,
for which it has none, is asked for with a message of its own. In real time: at eight times real
time a third of the parameters is lost at MAVSDK's socket, and on a busy machine it gives up
uploads, whose requests are repeated in simulated time.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Iterator

import pytest

from pytest_mavlink_sitl import simulator_process

pytest.importorskip("mavsdk", reason="MAVSDK from PyPI is not installed")

from mavsdk.plugins.geofence import (
    Circle,
    FenceType,
    GeofenceData,
    Point,
    Polygon,
)
from mavsdk.plugins.mission import MissionItem as PlanItem
from mavsdk.plugins.mission import MissionPlan
from mavsdk.plugins.offboard import PositionNedYaw
from mavsdk.plugins.telemetry import FlightMode

from tests.support.stations.mavsdk_station import (
    TAKE_OFF,
    WAIT_S,
    WAYPOINT,
    Station,
    listening,
    mavsdk,
    wait,
    within,
)

pytestmark = pytest.mark.wide


@contextlib.contextmanager
def connected(*options: str) -> Iterator[Station]:
    """A simulator that MAVSDK has found and that is ready to fly."""
    with simulator_process(*options) as port, listening(port) as flight:
        wait(lambda: flight.telemetry.health().is_armable, "armable")
        wait(lambda: flight.telemetry.health().is_global_position_ok, "a position")
        wait(lambda: flight.telemetry.health().is_home_position_ok, "home")
        wait(lambda: flight.telemetry.home().latitude_deg != 0.0, "home's place")
        yield flight


def take_off(flight: Station, height_m: float) -> None:
    flight.action.set_takeoff_altitude(height_m)
    flight.action.arm()
    flight.action.takeoff()
    flight.arrives((0.0, 0.0, height_m))


def test_ardupilot_take_off_goto_offboard_return_and_land() -> None:
    with connected() as flight:
        take_off(flight, 10.0)
        latitude, longitude = flight.point(20.0, 0.0)
        home_m = flight.telemetry.home().absolute_altitude_m
        flight.action.goto_location(latitude, longitude, home_m + 12.0, 0.0)
        flight.arrives((20.0, 0.0, 12.0))
        flight.offboard.set_position_ned(PositionNedYaw(0.0, 10.0, -12.0, 0.0))
        flight.offboard.start()
        flight.arrives((0.0, 10.0, 12.0))
        flight.offboard.stop()
        flight.action.return_to_launch()
        flight.arrives((0.0, 0.0, 15.0))
        flight.action.land()
        wait(lambda: not flight.telemetry.armed(), "landed and disarmed")
        assert math.hypot(*flight.north_east_up()[:2]) < 1.5


def test_ardupilot_mission_upload_progress_pause_and_clear() -> None:
    with connected() as flight:
        mission = flight.items(
            (TAKE_OFF, 0.0, 0.0, 10.0),
            (WAYPOINT, 25.0, 0.0, 10.0),
            (WAYPOINT, 25.0, 25.0, 12.0),
            (WAYPOINT, 0.0, 25.0, 10.0),
        )
        flight.mission.upload_mission(mission)
        back = flight.mission.download_mission()
        assert [item.command for item in back] == [item.command for item in mission]
        for got, sent in zip(back[1:], mission[1:], strict=True):
            assert (got.x, got.y, got.z) == (sent.x, sent.y, sent.z)
        flight.send(
            "COMMAND_LONG", command=511, confirmation=0, param1=42, param2=100000,
            param3=0, param4=0, param5=0, param6=0, param7=0, target_system=1, target_component=1,
        )  # fmt: skip
        take_off(flight, 10.0)
        flight.mission.start_mission()
        wait(lambda: flight.mission.mission_progress().current >= 2, "the second item")
        flight.mission.pause_mission()
        time.sleep(5.0)
        held = flight.north_east_up()
        time.sleep(3.0)
        assert math.dist(flight.north_east_up(), held) < 1.0
        flight.mission.start_mission()
        flight.arrives((0.0, 25.0, 10.0), within_m=1.5)
        assert flight.mission.mission_progress().current == 4
        flight.action.return_to_launch()
        flight.mission.clear_mission()
        assert len(flight.mission.download_mission()) == 1, "home stays"


def test_ardupilot_parameters_and_geofence() -> None:
    with connected() as flight:
        everything = within(3.0 * WAIT_S, flight.param.get_all_params)
        names = {p.name for p in (*everything.float_params, *everything.int_params)}
        assert {"WPNAV_SPEED", "RTL_ALT", "MAV_GCS_SYSID"} <= names
        assert flight.param.get_param_float("WPNAV_SPEED") == 1000.0
        flight.param.set_param_float("WPNAV_SPEED", 800.0)
        assert flight.param.get_param_float("WPNAV_SPEED") == 800.0
        with pytest.raises(mavsdk.MavsdkError):
            flight.param.get_param_float("NO_SUCH_PARAM")
        corners = [
            Point(*flight.point(n, e)) for n, e in ((-90, -90), (90, -90), (90, 90), (-90, 90))
        ]
        circle = Circle(Point(*flight.point(0, 0)), 200.0, FenceType.INCLUSION)
        fence = GeofenceData([Polygon(corners, FenceType.INCLUSION)], [circle])
        flight.geofence.upload_geofence(fence)
        back = flight.geofence.download_geofence()
        assert [len(polygon.points) for polygon in back.polygons] == [4]
        assert [c.radius for c in back.circles] == [200.0]
        assert back.polygons[0].points[2].latitude_deg == pytest.approx(corners[2].latitude_deg)
        flight.geofence.clear_geofence()
        assert not flight.geofence.download_geofence().polygons


def start_uploaded_mission(flight: Station) -> None:
    """Start a mission again and again: a PX4 in the air rejects that while it judges it."""
    started_s = time.monotonic()

    def flies() -> bool:
        nonlocal started_s
        if time.monotonic() >= started_s:
            flight.plan.start_mission()
            started_s = time.monotonic() + 1.0
        return bool(flight.telemetry.flight_mode() == FlightMode.MISSION)

    wait(flies, "mission mode")


def test_px4_take_off_goto_offboard_mission_fence_parameters_and_land() -> None:
    with connected("--autopilot", "px4") as flight:
        assert flight.param.get_param_float("MPC_XY_CRUISE") == 5.0
        flight.param.set_param_float("MPC_XY_CRUISE", 6.0)
        assert flight.param.get_param_float("MPC_XY_CRUISE") == 6.0
        circle = Circle(Point(*flight.point(0, 0)), 200.0, FenceType.INCLUSION)
        flight.geofence.upload_geofence(GeofenceData([], [circle]))
        assert len(flight.geofence.download_geofence().circles) == 1
        flight.action.set_takeoff_altitude(10.0)
        flight.action.arm()
        flight.action.takeoff()
        home = flight.telemetry.home()
        wait(lambda: flight.telemetry.position().relative_altitude_m > 9.0, "10 m")
        flight.action.goto_location(*flight.point(20.0, 0.0), home.absolute_altitude_m + 12.0, 0.0)
        wait(lambda: math.dist(flight.north_east_up()[:2], (20.0, 0.0)) < 1.0, "20 m north")
        flight.offboard.set_position_ned(PositionNedYaw(0.0, 10.0, -12.0, 0.0))
        flight.offboard.start()
        wait(lambda: math.dist(flight.north_east_up()[:2], (0.0, 10.0)) < 1.0, "10 m east")
        flight.offboard.stop()
        items = [
            PlanItem(*flight.point(north, east), 12.0, is_fly_through=True)
            for north, east in ((0.0, 0.0), (25.0, 0.0), (25.0, 25.0))
        ]
        flight.plan.upload_mission(MissionPlan(items))
        assert len(flight.plan.download_mission().mission_items) == 3
        start_uploaded_mission(flight)
        wait(lambda: flight.plan.mission_progress().current >= 1, "the second item")
        flight.plan.pause_mission()
        time.sleep(5.0)
        held = flight.north_east_up()
        time.sleep(3.0)
        assert math.dist(flight.north_east_up()[:2], held[:2]) < 1.5
        flight.plan.start_mission()
        wait(flight.plan.is_mission_finished, "the mission's end")
        flight.action.return_to_launch()
        flight.plan.clear_mission()
        flight.action.land()
        wait(lambda: not flight.telemetry.armed(), "landed and disarmed")
