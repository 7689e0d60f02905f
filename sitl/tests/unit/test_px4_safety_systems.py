"""PX4 1.18: the loss of its parachute, its Remote ID, its receivers or its altitude acts."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from sitl_support.px4_station import Px4Station, flying_px4, ready_px4

AT_ONCE = {"COM_FAIL_ACT_T": 0.0}


def beat(station: Px4Station, kind: int, status: int = mav.MAV_STATE_ACTIVE) -> None:
    sender = mav.MAVLink(None, srcSystem=1, srcComponent=161)
    station.link.write(mav.MAVLink_heartbeat_message(kind, 8, 0, 0, status, 3).pack(sender))


def flying(**parameters: float) -> Px4Station:
    station = flying_px4(parameters={**AT_ONCE, **parameters}, firmware="px4-1.18")
    station.heartbeats(True)
    return station


def keep(station: Px4Station, seconds: float) -> None:
    station.stream_to(seconds, 0.0, 0.0, -10.0)


@pytest.mark.parametrize(
    ("kind", "name", "values", "text"),
    [
        (mav.MAV_TYPE_PARACHUTE, "COM_PARACHUTE", {2: px4.RTL, 3: px4.LAND}, "Parachute"),
        (mav.MAV_TYPE_ODID, "COM_ARM_ODID", {3: px4.RTL, 4: px4.LAND}, "Remote ID"),
    ],
)
def test_a_system_that_is_lost_acts_by_its_parameter(
    kind: int, name: str, values: dict[int, int], text: str
) -> None:
    for value, mode in values.items():
        air = flying()
        for _ in range(4):
            beat(air, kind)
            keep(air, 1.0)
        air.vehicle.parameters.set(name, value)
        beat(air, kind)
        keep(air, 2.5)
        assert air.vehicle.firmware.mode.spec.number == px4.OFFBOARD, "its last HEARTBEAT is young"
        keep(air, 1.0)
        assert air.vehicle.firmware.mode.spec.number == mode
        assert f"{text} system lost\t" in air.texts()


@pytest.mark.night
def test_a_parachute_that_is_not_well_is_as_one_that_is_lost_and_1_warns() -> None:
    air = flying()
    beat(air, mav.MAV_TYPE_PARACHUTE)
    air.vehicle.parameters.set("COM_PARACHUTE", 2)
    keep(air, 0.5)
    beat(air, mav.MAV_TYPE_PARACHUTE, mav.MAV_STATE_CRITICAL)
    keep(air, 0.5)
    assert air.vehicle.firmware.mode.spec.number == px4.RTL
    air = flying(COM_PARACHUTE=1)
    keep(air, 5.0)
    assert air.vehicle.firmware.mode.spec.number == px4.OFFBOARD


@pytest.mark.parametrize(
    ("action", "mode"),
    [(0, px4.OFFBOARD), (1, px4.RTL), (2, px4.LAND)],
    ids=["warn", "return", "land"],
)
def test_too_few_receivers_act_before_the_position_is_lost(action: int, mode: int) -> None:
    air = flying(SYS_HAS_NUM_GNSS=1, COM_GNSSLOSS_ACT=action)
    keep(air, 1.0)
    assert air.vehicle.firmware.mode.spec.number == px4.OFFBOARD
    air.vehicle.lose_gps()
    keep(air, 0.5)
    assert air.vehicle.firmware.mode.spec.number == mode


@pytest.mark.night
def test_nobody_needs_a_receiver_by_default_and_1_17_has_none_of_it() -> None:
    air = flying(COM_GNSSLOSS_ACT=1)
    air.vehicle.lose_gps()
    keep(air, 0.5)
    assert air.vehicle.firmware.mode.spec.number == px4.OFFBOARD
    air = flying_px4(parameters={**AT_ONCE, "COM_ARM_ODID": 3.0})
    air.heartbeats(True)
    keep(air, 5.0)
    assert air.vehicle.firmware.mode.spec.number == px4.OFFBOARD


@pytest.mark.wide
@pytest.mark.parametrize("breaker", [0.0, 121212.0])
def test_a_vehicle_that_sinks_below_its_setpoint_is_terminated_unless_a_breaker_forbids(
    breaker: float,
) -> None:
    air = flying(FD_ALT_LOSS=2.0, FD_ALT_LOSS_T=0.3, CBRK_FLIGHTTERM=breaker)
    keep(air, 4.0)
    air.vehicle.blow((0.0, 0.0, 15.0))
    keep(air, 3.0)
    assert air.vehicle.firmware.armed is (breaker != 0.0)
    assert "Failsafe activated\t" in air.texts()


@pytest.mark.night
def test_a_descent_that_was_asked_for_is_no_loss_of_altitude() -> None:
    air = flying(FD_ALT_LOSS=1.0, FD_ALT_LOSS_T=0.0, CBRK_FLIGHTTERM=0.0)
    keep(air, 4.0)
    air.stream_to(5.0, 0.0, 0.0, -4.0)
    air.stream_to(5.0, 0.0, 0.0, -12.0)
    assert air.vehicle.firmware.armed
    assert "Failsafe activated\t" not in air.texts()


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ({"COM_PARACHUTE": 2.0}, "Preflight Fail: Parachute system missing\t"),
        ({"COM_ARM_ODID": 2.0}, "Preflight Fail: Remote ID system missing\t"),
        ({"COM_GNSSLOSS_ACT": 1.0, "SYS_HAS_NUM_GNSS": 2.0}, "Preflight Fail: GPS 0 lost fix\t"),
    ],
)
def test_what_has_to_be_there_is_needed_to_arm(parameters: dict[str, float], text: str) -> None:
    ground = ready_px4(parameters=parameters, firmware="px4-1.18")
    ground.gcs_heartbeat()
    assert ground.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == 1
    assert text in ground.texts()
