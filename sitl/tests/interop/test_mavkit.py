"""mavkit, unmodified from PyPI, flies the simulated firmwares over UDP."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable

import pytest

from pytest_mavlink_sitl import simulator_process

pytest.importorskip("mavkit", reason="mavkit from PyPI is not installed")

import mavkit

pytestmark = pytest.mark.wide

WAIT_S = 120.0
HOME_DEG = (-35.3632610, 149.1652300)
NORTH_DEG = HOME_DEG[0] + 2e-4
TAKE_OFF, WAYPOINT, DO_SET_MODE, SET_MESSAGE_INTERVAL = 22, 16, 176, 511
GLOBAL_POSITION_INT, MISSION_CURRENT = 33, 42
PX4_AUTO, PX4_RTL = 4.0, 5.0


@pytest.mark.night
def test_an_arducopter_takes_parameters_and_a_mission_and_flies() -> None:
    with simulator_process() as port:
        asyncio.run(asyncio.wait_for(fly_arducopter(port), 3.0 * WAIT_S))


def test_a_px4_takes_parameters_and_a_mission_and_flies() -> None:
    with simulator_process("--autopilot", "px4") as port:
        asyncio.run(asyncio.wait_for(fly_px4(port), 3.0 * WAIT_S))


async def fly_arducopter(port: int) -> None:
    async with await mavkit.Vehicle.connect_udp(f"127.0.0.1:{port}") as vehicle:
        assert {"GUIDED", "AUTO", "RTL"} <= {mode.name for mode in vehicle.available_modes()}
        await exchange_parameters(vehicle, "RTL_ALT", 2000.0)
        await exchange_mission(vehicle)

        # The real one sends neither unasked.
        for message in (GLOBAL_POSITION_INT, MISSION_CURRENT):
            await vehicle.command_long(SET_MESSAGE_INTERVAL, message, 100_000.0)
        await vehicle.set_mode_by_name("GUIDED")
        await arm(vehicle)
        await vehicle.takeoff(10.0)
        await until(lambda: altitude_m(vehicle) > 9.0)
        await vehicle.goto(NORTH_DEG, HOME_DEG[1], 15.0)
        await until(lambda: vehicle.position.latitude_deg == pytest.approx(NORTH_DEG, abs=1e-5))
        await vehicle.set_mode_by_name("AUTO")
        # Counted from home, which is not among the items.
        await until(lambda: vehicle.mission_state.current_seq == 2)
        await vehicle.set_mode_by_name("RTL")
        await until(lambda: not vehicle.state.armed)


async def fly_px4(port: int) -> None:
    async with await mavkit.Vehicle.connect_udp(f"127.0.0.1:{port}") as vehicle:
        await exchange_parameters(vehicle, "RTL_RETURN_ALT", 20.0)
        await exchange_mission(vehicle)

        # It begins each mission with an item for ArduPilot's home, which PX4 would fly to; and
        # it knows none of PX4's modes.
        await arm(vehicle)
        home = await vehicle.wait_home_position()
        assert home is not None
        await vehicle.takeoff(home.altitude_m + 10.0)
        # Its altitude is that of either message: above home, or above sea level.
        await until(lambda: 8.0 < altitude_m(vehicle) < 100.0)
        await vehicle.command_long(DO_SET_MODE, 1.0, PX4_AUTO, PX4_RTL)
        await until(lambda: not vehicle.state.armed)


def altitude_m(vehicle: mavkit.Vehicle) -> float:
    altitude_m = vehicle.position.altitude_m
    return math.nan if altitude_m is None else altitude_m


async def arm(vehicle: mavkit.Vehicle) -> None:
    """Arm as soon as the autopilot is ready: home is known before."""
    limit_s = time.monotonic() + WAIT_S
    while not vehicle.state.armed:
        assert time.monotonic() < limit_s
        with contextlib.suppress(mavkit.MavkitError):
            await vehicle.arm(force=False)
        await asyncio.sleep(0.5)


async def exchange_parameters(vehicle: mavkit.Vehicle, name: str, value: float) -> None:
    parameters = await vehicle.download_params()
    assert len(parameters) >= parameters.expected_count > 800
    assert (await vehicle.write_param(name, value)).value == value


async def exchange_mission(vehicle: mavkit.Vehicle) -> None:
    mission = mavkit.MissionType.Mission
    items = [item(0, TAKE_OFF, 10.0), item(1, WAYPOINT, 12.0)]
    await vehicle.upload_mission(mavkit.MissionPlan(mission_type=mission, items=items))
    downloaded = (await vehicle.download_mission(mission)).items
    assert [fields(each) for each in downloaded] == [fields(each) for each in items]


def item(number: int, command: int, height_m: float) -> mavkit.MissionItem:
    """An item north of home."""
    x, y = round(NORTH_DEG * 1e7), round(HOME_DEG[1] * 1e7)
    frame = mavkit.MissionFrame.GlobalRelativeAltInt
    return mavkit.MissionItem(
        seq=number, command=command, frame=frame, x=x, y=y, z=height_m, current=number == 0
    )


def fields(item: mavkit.MissionItem) -> tuple[float, ...]:
    return item.seq, item.command, item.x, item.y, item.z, item.param1, item.param4


async def until(condition: Callable[[], bool]) -> None:
    limit_s = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < limit_s
        await asyncio.sleep(0.1)
