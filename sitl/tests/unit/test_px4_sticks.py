"""A pilot at the sticks of a PX4: what a moved stick takes, and what lost sticks do.

Recorded with PX4 1.17 and sticks by MANUAL_CONTROL; that lost ones do not interrupt a return
was read in its source.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from sitl_support.ground_station import ACCEPTED
from sitl_support.px4_station import Px4Station, flying_px4, ready_px4

TOOK = "Pilot took over using sticks\t"


@pytest.fixture(scope="module")
def one() -> Px4Station:
    """In the air; each test moves the sticks of the same vehicle."""
    return flying_px4()


@pytest.fixture
def air(one: Px4Station) -> Px4Station:
    """In AUTO.LOITER, with the sticks in the middle."""
    one.stream(0.5, 10.0, lambda: stick(one))
    assert one.mode(px4.LOITER) == ACCEPTED
    one.gcs_heartbeat()
    return one


def stick(station: Px4Station, x: float = 0.0, z: float = 500.0) -> None:
    station.send(mav.MAVLink_manual_control_message(1, round(x), 0, round(z), 0, 0))


def hold_sticks(
    station: Px4Station, seconds: float, x: Callable[[float], float] = lambda _: 0.0
) -> None:
    """Send them at 10 Hz, by how many seconds have passed."""
    begun_s = station.now_s
    station.stream(seconds, 10.0, lambda: stick(station, x(station.now_s - begun_s)))


@pytest.mark.parametrize(
    ("speed", "takes"), [(200.0, False), (400.0, True)], ids=["slowly", "quickly"]
)
def test_the_speed_of_a_stick_takes_the_vehicle(air: Px4Station, speed: float, takes: bool) -> None:
    begun_s = air.now_s
    hold_sticks(air, 1.5, lambda s: speed * s)
    assert air.custom_mode == (px4.POSCTL if takes else px4.LOITER)
    assert (TOOK in air.texts(begun_s)) == takes


def test_a_throttle_that_is_moved_takes_it_too(air: Px4Station) -> None:
    stick(air, z=560)
    assert air.custom_mode == px4.POSCTL


def test_a_stick_that_was_held_when_the_mode_was_chosen_takes_nothing(air: Px4Station) -> None:
    hold_sticks(air, 2.0, lambda _: 600.0)
    assert air.custom_mode == px4.POSCTL
    assert air.mode(px4.LOITER) == ACCEPTED
    hold_sticks(air, 1.0, lambda _: 600.0)
    assert air.custom_mode == px4.LOITER


@pytest.mark.parametrize("mode", [px4.RTL, px4.LAND], ids=["return", "land"])
def test_a_return_and_a_landing_are_taken(air: Px4Station, mode: int) -> None:
    assert air.mode(mode) == ACCEPTED
    hold_sticks(air, 0.3)
    assert air.custom_mode == mode
    stick(air, 600)
    assert air.custom_mode == px4.POSCTL


@pytest.mark.parametrize(("bits", "mode"), [(1, px4.OFFBOARD), (3, px4.POSCTL)])
def test_offboard_is_taken_where_the_parameter_says_so(
    air: Px4Station, bits: int, mode: int
) -> None:
    air.set_parameter("COM_RC_OVERRIDE", bits, kind=6)
    air.stream_to(0.5, 0.0, 0.0, -10.0)
    stick(air)
    assert air.mode(px4.OFFBOARD) == ACCEPTED
    air.go_to(0.0, 0.0, -10.0)
    air.run(0.1)
    stick(air, 600)
    assert air.custom_mode == mode
    air.set_parameter("COM_RC_OVERRIDE", 1, kind=6)


def test_the_first_sticks_choose_the_mode_that_nobody_has_chosen() -> None:
    ground = ready_px4()
    assert ground.custom_mode == px4.LOITER
    stick(ground)
    assert ground.custom_mode == px4.POSCTL
    assert ground.mode(px4.LOITER) == ACCEPTED
    hold_sticks(ground, 0.3, lambda s: 2000.0 * s)
    assert ground.custom_mode == px4.LOITER, "disarmed, a moved stick takes nothing"


@pytest.mark.parametrize(
    ("mode", "then"),
    [(px4.LAND, px4.LAND), (px4.RTL, px4.RTL), (px4.LOITER, px4.RTL)],
    ids=["land", "return", "hold"],
)
def test_sticks_that_are_lost_interrupt_neither_a_landing_nor_a_return(
    mode: int, then: int
) -> None:
    air = flying_px4()
    hold_sticks(air, 0.5)
    assert air.mode(mode) == ACCEPTED
    hold_sticks(air, 0.3)
    air.run(3.0)
    assert air.custom_mode == mode
    assert air.vehicle.firmware.failsafe.active == (mode == px4.LOITER)
    air.run(4.0)
    assert air.custom_mode == then
