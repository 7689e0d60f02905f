"""HEARTBEAT and landed state as the real ArduCopter was observed to report them."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    GUIDED,
    LAND,
    RTL,
    STABILIZE,
    GroundStation,
    copter,
    flying,
)

ON_GROUND, IN_AIR, TAKEOFF, LANDING = 1, 2, 3, 4


@pytest.fixture(scope="module")
def flight() -> GroundStation:
    """Up to 5 m, hover, LAND, disarmed."""
    station = copter().ready().take_off(5.0)
    station.run(3.0)
    station.mode(LAND)
    station.run_until(lambda: not station.vehicle.firmware.armed, 40.0)
    station.run(2.0)
    return station


def test_landed_state_goes_through_takeoff_air_and_landing(flight: GroundStation) -> None:
    assert flight.changes("EXTENDED_SYS_STATE", "landed_state") == [
        ON_GROUND,
        TAKEOFF,
        IN_AIR,
        LANDING,
        ON_GROUND,
    ]


def test_the_vtol_state_of_a_copter_is_mc(flight: GroundStation) -> None:
    assert set(flight.changes("EXTENDED_SYS_STATE", "vtol_state")) == {mav.MAV_VTOL_STATE_MC}


def test_system_status_is_standby_on_the_ground_even_armed(flight: GroundStation) -> None:
    seen: list[tuple[int, bool]] = []
    for message in flight.messages("HEARTBEAT"):
        state = (message.system_status, bool(message.base_mode & 128))
        if not seen or seen[-1] != state:
            seen.append(state)
    standby, active = mav.MAV_STATE_STANDBY, mav.MAV_STATE_ACTIVE
    ready = seen.index((standby, False))
    assert seen[ready:] in (
        [(standby, False), (standby, True), (active, True), (standby, True), (standby, False)],
        # The second on the ground before disarming falls between two heartbeats sometimes.
        [(standby, False), (standby, True), (active, True), (standby, False)],
    )


def test_base_mode_as_recorded(flight: GroundStation) -> None:
    """0x59 in GUIDED, 0x51 in STABILIZE, with 0x80 when armed."""
    seen = {
        (message.custom_mode, message.base_mode)
        for message in flight.messages("HEARTBEAT")
        if message.system_status != mav.MAV_STATE_BOOT
    }
    assert seen == {(STABILIZE, 0x51), (GUIDED, 0x59), (GUIDED, 0xD9), (LAND, 0xD9), (LAND, 0x59)}


def test_takeoff_shows_in_the_landed_state_some_3_s_after_the_ack() -> None:
    station = copter().ready()
    station.mode(GUIDED)
    station.arm()
    station.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
    took = station.run_until(
        lambda: TAKEOFF in station.changes("EXTENDED_SYS_STATE", "landed_state")
    )
    assert took == pytest.approx(3.5, abs=0.3)


def test_land_disarms_by_itself_2_s_after_touchdown(flight: GroundStation) -> None:
    hit = next(t for t, m in flight.log if "Hit ground" in getattr(m, "text", ""))
    off = next(t for t, m in flight.log if getattr(m, "text", "") == "Disarming motors")
    assert off - hit == pytest.approx(2.08, abs=0.25)


def test_rtl_is_landing_only_in_its_last_stage() -> None:
    station = flying(10.0)
    station.setpoint(0xDF8, (15.0, 0.0, -10.0))
    station.run(10.0)
    station.mode(RTL)
    station.run_until(lambda: station.last("EXTENDED_SYS_STATE").landed_state == LANDING, 40.0)
    north, east, down = station.position
    assert (north, east) == pytest.approx((0.0, 0.0), abs=1.0)
    assert down == pytest.approx(-15.0, abs=0.3)


def test_values_agree_with_the_truth() -> None:
    """Units, signs and frames of what is streamed, in fast flight to the north-east and up."""
    station = flying(10.0)
    for message_id in (24, 32, 33, 74):
        station.interval(message_id, 100.0)
    station.setpoint(0xDF8, (60.0, 30.0, -25.0))
    station.run(4.0)
    north, east, down = station.position
    v_n, v_e, v_d = station.velocity
    assert v_n > 2.0
    assert v_e > 1.0
    assert v_d < -0.5
    local = station.last("LOCAL_POSITION_NED")
    assert (local.x, local.y, local.z) == pytest.approx((north, east, down), abs=0.2)
    assert (local.vx, local.vy, local.vz) == pytest.approx((v_n, v_e, v_d), abs=0.2)
    world = station.last("GLOBAL_POSITION_INT")
    assert (world.vx, world.vy, world.vz) == pytest.approx(
        (v_n * 100, v_e * 100, v_d * 100), abs=20
    )
    assert world.relative_alt == pytest.approx(-down * 1000, abs=200)
    assert world.alt == pytest.approx(584000 - down * 1000, abs=200)
    assert world.lat == pytest.approx(-353632610 + north / 0.011131884502, abs=30)
    hud = station.last("VFR_HUD")
    assert hud.groundspeed == pytest.approx((v_n**2 + v_e**2) ** 0.5, abs=0.2)
    assert hud.climb == pytest.approx(-v_d, abs=0.2)
    assert hud.heading == pytest.approx(26.6, abs=5)
    assert world.hdg / 100 == pytest.approx(hud.heading, abs=1)
    assert station.last("GPS_RAW_INT").vel == pytest.approx(hud.groundspeed * 100, abs=60)


def test_a_copter_that_accelerates_forward_noses_down() -> None:
    station = flying(10.0)
    station.setpoint(0xDF8 - 0x400, (0.0, 40.0, -10.0), yaw=1.5708)
    station.run(4.0)
    attitude = station.last("ATTITUDE")
    assert attitude.yaw == pytest.approx(1.57, abs=0.1)
    assert attitude.pitch < -0.15
    assert abs(attitude.roll) < 0.1


def test_a_copter_that_accelerates_to_its_right_rolls_right() -> None:
    station = flying(10.0)
    station.setpoint(0xDF8 - 0x400, (0.0, 40.0, -10.0), yaw=0.0)
    station.run(4.0)
    attitude = station.last("ATTITUDE")
    assert attitude.roll > 0.15
    assert abs(attitude.pitch) < 0.1
