"""PX4 1.18: a pilot takes over by moving a stick fast; NAV_RCL_ACT 7."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from sitl_support.ground_station import ACCEPTED, GroundStation
from sitl_support.px4_station import Px4Station, flying_px4

SAMPLE_S = 0.04
TEXT = "Pilot took over using sticks\t"


def flying(firmware: str = "px4-1.18", **parameters: float) -> Px4Station:
    station = flying_px4(parameters=parameters, firmware=firmware)
    station.heartbeats(True)
    return station


def move(station: Px4Station, places: Iterable[float]) -> None:
    """Push a stick forward, -1..1, a sample each, while the stream is kept."""
    for place in places:
        station.send(mav.MAVLink_manual_control_message(1, round(1000 * place), 0, 500, 0, 0))
        station.stream_to(SAMPLE_S, 0.0, 0.0, -10.0)


def ramp(speed_per_s: float, samples: int = 12, begin: float = 0.0) -> list[float]:
    return [begin + speed_per_s * SAMPLE_S * number for number in range(samples)]


def test_a_nudge_takes_offboard_away_and_is_reported() -> None:
    air = flying()
    move(air, ramp(2.0))
    assert air.vehicle.firmware.mode.spec.number == px4.POSCTL
    assert TEXT in air.texts()


@pytest.mark.parametrize(
    ("firmware", "places", "parameters"),
    [
        ("px4-1.18", ramp(0.7), {}),
        ("px4-1.18", [0.6] * 12, {}),
        ("px4-1.18", [0.3, -0.3] * 6, {}),
        ("px4-1.18", ramp(2.0), {"MAN_OVERRIDE_SPD": -1.0}),
        ("px4-1.17", ramp(2.0), {}),
    ],
    ids=["slow", "held aside", "noise", "switched off", "1.17"],
)
def test_what_takes_over_nothing(
    firmware: str, places: list[float], parameters: dict[str, float]
) -> None:
    air = flying(firmware, **parameters)
    move(air, places)
    assert air.vehicle.firmware.mode.spec.number == px4.OFFBOARD
    assert TEXT not in air.texts()


def test_an_auto_mode_is_taken_over_too_and_the_pilot_flies() -> None:
    air = flying()
    assert air.mode(px4.LOITER) == ACCEPTED
    move(air, ramp(2.0))
    assert air.vehicle.firmware.mode.spec.number == px4.POSCTL
    move(air, [0.5] * 50)
    assert air.velocity[0] > 2.0


@pytest.mark.night
def test_without_a_position_the_pilot_gets_altctl() -> None:
    air = flying()
    air.vehicle.lose_gps()
    air.stream_to(12.0, 0.0, 0.0, -10.0)
    move(air, ramp(2.0))
    assert air.vehicle.firmware.mode.spec.number == px4.ALTCTL


def test_nav_rcl_act_7_holds_without_a_failsafe() -> None:
    air = flying(NAV_RCL_ACT=7.0)
    move(air, ramp(2.0))
    assert air.vehicle.firmware.mode.spec.number == px4.POSCTL
    air.run(1.5)
    assert air.vehicle.firmware.mode.spec.number == px4.LOITER
    assert air.vehicle.firmware.system_status == 4
    assert "Failsafe activated\t" not in air.texts()


def test_nav_rcl_act_7_leaves_offboard_alone() -> None:
    air = flying(NAV_RCL_ACT=7.0)
    move(air, [0.0] * 12)
    air.stream_to(3.0, 0.0, 0.0, -10.0)
    assert air.vehicle.firmware.mode.spec.number == px4.OFFBOARD
    assert air.vehicle.firmware.system_status == 4


@pytest.mark.parametrize("vehicle", ["rover", "boat", "plane"])
def test_sticks_of_others_than_copters_take_nothing(vehicle: str) -> None:
    config = VehicleConfig(vehicle=vehicle, autopilot="px4", firmware="px4-1.18")
    ground = GroundStation(Simulation([config]))
    for place in range(0, 1000, 200):
        ground.send(mav.MAVLink_manual_control_message(1, place, 0, 500, 0, 0))
        ground.run(SAMPLE_S)
    firmware = ground.vehicle.firmware
    assert isinstance(firmware, Px4Vehicle)
    assert firmware.sticks.held() is not None
    assert TEXT not in ground.texts()
