"""Programs that fly by `Vehicle`, with asyncio and without, over DDS with the simulator."""

from __future__ import annotations

import asyncio
import re
import signal
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeAlias

import pytest

from drone_navigation.client.events import Telemetry
from drone_navigation.programs import BlockingVehicle, NavigationError, Vehicle
from tests.support.processes import Process
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, Flight

pytestmark = pytest.mark.xdist_group("ros_programs")
Program: TypeAlias = Callable[[Vehicle], Awaitable[None]]
LIMIT_S = 300.0
CTRL_C = """
from drone_navigation.programs import BlockingVehicle
with BlockingVehicle() as vehicle:
    print("connected", flush=True)
    try:
        vehicle.goto(60, 0, 4, speed_m_s=1)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
print("left", flush=True)
"""


README = Path(__file__).parents[2] / "README.md"


@pytest.fixture(autouse=True)
def in_its_domain(flight: Flight, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(flight.domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


def run(program: Program) -> None:
    async def within_limits() -> None:
        async with Vehicle(timeout_s=60.0) as vehicle:
            await program(vehicle)

    asyncio.run(asyncio.wait_for(within_limits(), LIMIT_S))


def test_a_program_takes_off_flies_and_reads_the_state() -> None:
    async def program(vehicle: Vehicle) -> None:
        end = await vehicle.takeoff(4)
        assert end.code == "SUCCESS"
        assert vehicle.state.armed
        feedback = [each async for each in vehicle.goto(8, 2, 4)]
        assert len(feedback) > 3
        assert {each.status for each in feedback} >= {"NAVIGATING"}
        assert feedback[-1].distance_left_m < feedback[0].distance_left_m
        state = vehicle.state
        assert state.landed_state == "in air"
        assert state.position_enu_m == pytest.approx((8, 2, 4), abs=1.0)
        assert state.global_position is not None
        assert state.battery_percent is not None

    run(program)


def test_a_later_goal_replaces_the_first_which_raises_its_code() -> None:
    async def program(vehicle: Vehicle) -> None:
        first = vehicle.goto(60, 0, 4, speed_m_s=1)
        await first.accepted()
        second = await vehicle.goto(4, 0, 4)
        assert second.code == "SUCCESS"
        with pytest.raises(NavigationError) as caught:
            await first
        assert caught.value.code == "PREEMPTED"
        assert caught.value.end is not None

    run(program)


def test_a_rejected_goal_raises_the_servers_code_and_sentence() -> None:
    async def program(vehicle: Vehicle) -> None:
        with pytest.raises(NavigationError) as caught:
            await vehicle.goto(1e5, 0, 4)
        assert caught.value.code == "OUTSIDE_VOLUME"
        assert caught.value.message
        assert caught.value.end is None
        # The next one has its own reason.
        with pytest.raises(NavigationError) as caught:
            await anext(aiter(vehicle.goto(float("nan"), 0, 4)))
        assert caught.value.code == "INVALID_NUMBER"

    run(program)


def test_goals_that_are_rejected_at_once_have_their_own_reasons() -> None:
    async def program(vehicle: Vehicle) -> None:
        targets = [(1e5, 0.0, 4.0), (float("nan"), 0.0, 4.0), (0.0, 1e5, 4.0), (0.0, 0.0, -5.0)] * 3
        ends = await asyncio.gather(
            *(vehicle.goto(*target) for target in targets), return_exceptions=True
        )
        codes = [end.code if isinstance(end, NavigationError) else repr(end) for end in ends]
        alone = []
        for target in targets[:4]:
            with pytest.raises(NavigationError) as caught:
                await vehicle.goto(*target)
            alone.append(caught.value.code)
        assert codes == alone * 3
        assert len(set(alone)) == 3

    run(program)


def test_a_cancel_a_hold_and_a_cancelled_task_end_the_goal() -> None:
    async def program(vehicle: Vehicle) -> None:
        goal = vehicle.goto(60, 0, 4, speed_m_s=1)
        await goal.accepted()
        end = await goal.cancel()
        assert end is not None
        assert end.code == "CANCELED"

        task = asyncio.ensure_future(_fly_far(vehicle))
        await asyncio.sleep(2.0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        await _until_idle(vehicle)

        goal = vehicle.goto(60, 0, 4, speed_m_s=1)
        await goal.accepted()
        await vehicle.hold()
        with pytest.raises(NavigationError) as caught:
            await goal
        assert caught.value.code == "PREEMPTED"
        await vehicle.set_mode("GUIDED")

    run(program)


async def _until_idle(vehicle: Vehicle) -> None:
    """The state is a topic of its own, and may come after the end of a goal."""
    async for state in vehicle.states():
        if state.active_goal is None:
            return


async def _fly_far(vehicle: Vehicle) -> None:
    await vehicle.goto(60, 0, 4, speed_m_s=1)


def test_a_route_an_orbit_and_velocities_are_flown() -> None:
    async def program(vehicle: Vehicle) -> None:
        end = await vehicle.route([(2, 0, 4), (4, 2, 4)])
        assert end.waypoints_reached == 2
        end = await vehicle.orbit(4, 2, -3, laps=0.25, height_m=4)
        assert end.laps_flown == pytest.approx(0.25, abs=0.1)
        before = vehicle.state.position_enu_m
        assert before is not None
        steering = vehicle.steer(2.0)
        await steering.move(1.0, seconds=3.0, frame="map")
        after = vehicle.state.position_enu_m
        assert after is not None
        assert after[0] > before[0] + 1.0
        await steering.cancel()

    run(program)


def test_parameters_are_read_and_changed_and_a_rejection_is_an_exception() -> None:
    async def program(vehicle: Vehicle) -> None:
        value = await vehicle.get_parameter("WPNAV_SPEED")
        await vehicle.set_parameter("WPNAV_SPEED", value + 10, while_armed=True)
        assert await vehicle.get_parameter("WPNAV_SPEED") == value + 10
        await vehicle.set_parameter("WPNAV_SPEED", value, while_armed=True)
        with pytest.raises(NavigationError) as caught:
            await vehicle.get_parameter("NO_SUCH_NAME")
        assert caught.value.code == "REQUEST_REJECTED"

    run(program)


def test_the_end_of_the_block_cancels_what_is_flown() -> None:
    async def program(vehicle: Vehicle) -> None:
        await vehicle.goto(60, 0, 4, speed_m_s=1).accepted()

    run(program)

    async def later(vehicle: Vehicle) -> None:
        await _until_idle(vehicle)
        assert vehicle.state.landed_state == "in air"

    run(later)


def test_a_program_without_an_event_loop_flies_by_the_same_methods() -> None:
    with BlockingVehicle(timeout_s=60.0) as vehicle:
        assert vehicle.goto(4, 0, 4).code == "SUCCESS"
        going = vehicle.goto(8, 0, 4, wait=False)
        seen = list(going)
        assert all(isinstance(each, Telemetry) for each in seen)
        assert going.wait().code == "SUCCESS"
        with pytest.raises(NavigationError) as caught:
            vehicle.takeoff(4)
        assert caught.value.code == "ALREADY_FLYING"
        assert vehicle.state.armed


def test_ctrl_c_cancels_the_goal_of_a_program(flight: Flight) -> None:
    assert flight.server is not None
    line = len(flight.server.lines)
    program = Process("program", ["python", "-c", CTRL_C], flight.environment)
    flight.server.wait_for("accepted", FLIGHT_TIMEOUT_S, after=line)
    program.signal(signal.SIGINT)
    flight.server.wait_for("CANCELED", FLIGHT_TIMEOUT_S, after=line)
    assert program.wait(FLIGHT_TIMEOUT_S) == 0, program.text
    assert "interrupted" in program.text
    assert "left" in program.text


def test_without_a_server_the_error_comes_before_the_first_goal(flight: Flight) -> None:
    code = "from drone_navigation.programs import BlockingVehicle as V\nwith V('nobody', 1): pass"
    done = subprocess.run(
        [sys.executable, "-c", code], env=flight.environment, capture_output=True, text=True,
        timeout=LIMIT_S, check=False,
    )  # fmt: skip
    assert "NO_SERVER: No server reports the state of nobody" in done.stderr, done.stderr


def test_the_program_of_the_first_page_flies(flight: Flight) -> None:
    """Before the tests that need it on the ground: it returns and lands."""
    (shown,) = re.findall(
        r"^```python\n(.*?)^```", README.read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    assert len(shown.splitlines()) <= 30
    flight.ground()
    program = Process("program", ["python", "-u", "-c", shown], flight.environment)
    assert program.wait(2.0 * FLIGHT_TIMEOUT_S) == 0, program.text
    assert "NAVIGATING: " in program.text
    assert "OUTSIDE_VOLUME: " in program.text


def test_a_server_that_is_killed_is_an_exception(flight: Flight) -> None:
    async def program(vehicle: Vehicle) -> None:
        goal = vehicle.goto(60, 0, 4, speed_m_s=1)
        await goal.accepted()
        assert flight.server is not None
        flight.server.signal(signal.SIGKILL)
        flight.server.stop()
        with pytest.raises(NavigationError) as caught:
            await goal
        assert caught.value.code == "NO_SERVER"
        with pytest.raises(NavigationError) as caught:
            await vehicle.set_mode("LOITER")
        assert caught.value.code == "NO_SERVER"

    run(program)
