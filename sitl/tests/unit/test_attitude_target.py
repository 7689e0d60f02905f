"""SET_ATTITUDE_TARGET in GUIDED: thrust is a climb rate, and nothing holds the position."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.state.attitude_target import from_angles
from sitl_support.ground_station import GUIDED, LOITER, GroundStation, copter, flying

NO_RATES = 0x07
NO_ATTITUDE = 0x80
NO_THRUST = 0x40


def send(
    station: GroundStation,
    pitch_deg: float = 0.0,
    yaw_deg: float = 0.0,
    thrust: float = 0.5,
    mask: int = NO_RATES,
    yaw_rate: float = 0.0,
    scale: float = 1.0,
) -> None:
    q = from_angles(0.0, math.radians(pitch_deg), math.radians(yaw_deg))
    station.send(
        mav.MAVLink_set_attitude_target_message(
            0, 1, 1, mask, [value * scale for value in q], 0.0, 0.0, yaw_rate, thrust
        )
    )


def yaw_deg(station: GroundStation) -> float:
    return math.degrees(float(station.simulation.truth.yaw_rad[0]))


def test_half_thrust_holds_the_height_and_a_lean_flies_away() -> None:
    station = flying(8.0)
    height = station.position[2]
    station.stream(4.0, 10.0, lambda: send(station, pitch_deg=-8.0, yaw_deg=90.0))
    assert station.velocity[1] > 2.0
    assert abs(station.velocity[0]) < 0.3
    assert station.position[2] == pytest.approx(height, abs=0.5)
    assert abs(math.remainder(yaw_deg(station) - 90.0, 360.0)) < 3.0


def test_it_levels_when_no_more_come_and_drifts_on_without_a_position() -> None:
    station = flying(8.0)
    station.stream(4.0, 10.0, lambda: send(station, pitch_deg=-8.0))
    station.run(3.5)
    assert abs(station.last("ATTITUDE").pitch) < math.radians(1.0)
    there, height = station.position[0], station.position[2]
    station.run(3.0)
    assert station.position[0] - there > 1.0, "no position hold"
    assert station.position[2] == pytest.approx(height, abs=0.3)
    since_s = station.now_s
    station.run(1.0)
    assert not station.messages("POSITION_TARGET_LOCAL_NED", since_s)


def test_more_thrust_climbs_and_less_sinks() -> None:
    station = flying(8.0)
    station.stream(3.0, 10.0, lambda: send(station, thrust=0.75))
    assert station.velocity[2] == pytest.approx(-1.25, abs=0.2), "half of WPNAV_SPEED_UP"
    station.stream(3.0, 10.0, lambda: send(station, thrust=0.0))
    assert station.velocity[2] == pytest.approx(1.5, abs=0.2), "WPNAV_SPEED_DN"


def test_a_yaw_rate_turns_while_it_is_streamed() -> None:
    station = flying(8.0)
    began = yaw_deg(station)
    mask = 0x03 | NO_ATTITUDE
    station.stream(2.0, 10.0, lambda: send(station, mask=mask, yaw_rate=0.4))
    turned = math.remainder(yaw_deg(station) - began, 360.0)
    assert turned == pytest.approx(math.degrees(0.8), abs=12.0), "less the lag"
    station.run(4.0)
    rested = yaw_deg(station)
    station.run(2.0)
    assert abs(math.remainder(yaw_deg(station) - rested, 360.0)) < 1.0


def test_what_is_ignored_in_silence_and_what_with_a_word() -> None:
    station = flying(8.0)
    before_s = station.now_s
    here = station.position
    send(station, pitch_deg=-20.0, mask=NO_RATES | NO_THRUST)
    send(station, pitch_deg=-20.0, scale=1.1)
    station.run(2.0)
    assert math.dist(station.position, here) < 0.4
    assert station.texts(before_s) == []
    send(station, thrust=math.nan)
    send(station, yaw_deg=math.nan)
    assert station.texts(before_s) == ["Setpoint ignored: thrust not usable"]
    station.vehicle.pilot_throttle(1500)
    station.mode(LOITER)
    station.stream(1.0, 10.0, lambda: send(station, pitch_deg=-20.0))
    assert math.hypot(*station.velocity) < 0.5, "only in GUIDED"


def test_a_climb_leaves_the_ground_and_a_setpoint_takes_over() -> None:
    station = copter().ready()
    station.mode(GUIDED)
    station.arm()
    station.stream(6.0, 10.0, lambda: send(station, thrust=0.8))
    assert station.position[2] < -2.0
    north, east, _ = station.position
    station.setpoint(0xDF8, (north, east, -6.0))
    station.run(8.0)
    assert math.dist(station.position, (north, east, -6.0)) < 0.7
