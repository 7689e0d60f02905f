"""MAVSDK, unmodified from PyPI, as a ground station. Skips whoever imports it without MAVSDK."""

from __future__ import annotations

import contextlib
import json
import math
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any, TypeVar

import pytest

mavsdk = pytest.importorskip("mavsdk", reason="MAVSDK from PyPI is not installed")

from mavsdk.plugins.action import Action  # noqa: E402
from mavsdk.plugins.follow_me import FollowMe  # noqa: E402
from mavsdk.plugins.ftp import Ftp  # noqa: E402
from mavsdk.plugins.geofence import Geofence  # noqa: E402
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage  # noqa: E402
from mavsdk.plugins.mission import Mission  # noqa: E402
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw  # noqa: E402
from mavsdk.plugins.offboard import Offboard  # noqa: E402
from mavsdk.plugins.param import Param  # noqa: E402
from mavsdk.plugins.telemetry import Telemetry, TelemetryError  # noqa: E402

WAIT_S = 100.0
Answer = TypeVar("Answer")
METRES_PER_DEGREE = 111318.845
WAYPOINT, TAKE_OFF = 16, 22


def ask_for_rate(set_rate: Callable[[float], None], rate_hz: float) -> None:
    """Until MAVSDK knows the autopilot, it leaves NaN in a field; ArduPilot denies that."""
    end_s = time.monotonic() + WAIT_S
    while True:
        try:
            set_rate(rate_hz)
        except TelemetryError:
            if time.monotonic() > end_s:
                raise
            time.sleep(0.25)
        else:
            return


class Station:
    """A connected vehicle and MAVSDK's plugins for it."""

    def __init__(self, system: Any) -> None:
        self.system = system
        self.action = Action(system)
        self.telemetry = Telemetry(system)
        self.mission = MissionRaw(system)
        self.plan = Mission(system)
        self.offboard = Offboard(system)
        self.param = Param(system)
        self.ftp = Ftp(system)
        self.follow_me = FollowMe(system)
        self.geofence = Geofence(system)
        self.direct = MavlinkDirect(system)
        telemetry = self.telemetry
        for set_rate in (
            telemetry.set_rate_position,
            telemetry.set_rate_home,
            telemetry.set_rate_landed_state,
            telemetry.set_rate_health,
        ):
            ask_for_rate(set_rate, 20.0)

    def send(self, name: str, **fields: float) -> None:
        message = MavlinkMessage(name, 245, 190, 1, 1, json.dumps(fields))
        self.direct.send_message(message)

    def north_east_up(self) -> tuple[float, float, float]:
        """Where it says to be, metres from home."""
        position, home = self.telemetry.position(), self.telemetry.home()
        scale = math.cos(math.radians(home.latitude_deg)) * METRES_PER_DEGREE
        return (
            (position.latitude_deg - home.latitude_deg) * METRES_PER_DEGREE,
            (position.longitude_deg - home.longitude_deg) * scale,
            position.relative_altitude_m,
        )

    def point(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Latitude and longitude of an offset from home."""
        home = self.telemetry.home()
        scale = math.cos(math.radians(home.latitude_deg)) * METRES_PER_DEGREE
        latitude = home.latitude_deg + north_m / METRES_PER_DEGREE
        return latitude, home.longitude_deg + east_m / scale

    def arrives(self, target: tuple[float, float, float], within_m: float = 1.0) -> None:
        wait(lambda: math.dist(self.north_east_up(), target) < within_m, f"at {target}")

    def items(self, *places: tuple[int, float, float, float]) -> list[Any]:
        """Mission items; ArduPilot's first one is home."""
        latitude, longitude = self.point(0.0, 0.0)
        found = [
            MissionItem(0, 0, WAYPOINT, 1, 1, x=round(latitude * 1e7), y=round(longitude * 1e7))
        ]
        for seq, (command, north_m, east_m, up_m) in enumerate(places, 1):
            latitude, longitude = self.point(north_m, east_m)
            found.append(
                MissionItem(
                    seq, 3, command, 0, 1,
                    x=round(latitude * 1e7), y=round(longitude * 1e7), z=up_m,
                )
            )  # fmt: skip
        return found


def wait(condition: Callable[[], bool], what: str) -> None:
    limit_s = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < limit_s, f"not within {WAIT_S:g} s: {what}"
        time.sleep(0.02)


def within(limit_s: float, call: Callable[[], Answer]) -> Answer:
    """Return what a call returns, whose wait within a C library has no end of its own.

    MAVSDK 4.1.0 may wait for ever for parameters that were lost on their way. No timeout of
    pytest's can end that.
    """
    answer: Future[Answer] = Future()

    def run() -> None:
        try:
            answer.set_result(call())
        except Exception as error:
            answer.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return answer.result(limit_s)


@contextlib.contextmanager
def listening(port: int) -> Iterator[Station]:
    """A station that has found a vehicle by a UDP port of this machine."""
    kind = mavsdk.ComponentType.GROUND_STATION
    client = mavsdk.Mavsdk(mavsdk.Configuration.create_with_component_type(kind))
    try:
        result = client.add_any_connection(f"udpin://127.0.0.1:{port}")
        assert result == mavsdk.ConnectionResult.SUCCESS
        system = client.first_autopilot(WAIT_S)
        assert system is not None
        yield Station(system)
    finally:
        within(WAIT_S, client.destroy)
