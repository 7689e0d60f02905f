"""Every parameter has an effect: each has a flight that differs with it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as mav

import mavlink_sitl
from mavlink_sitl.autopilot.personality.ardupilot import ARDUCOPTER
from mavlink_sitl.config import PERSONALITIES
from sitl_support.ground_station import (
    AUTO,
    LAND,
    LOITER,
    POSITION,
    RTL,
    VELOCITY,
    GroundStation,
    copter,
)
from sitl_support.missions import home, item, take_off, upload, waypoint
from sitl_support.transmitter import Transmitter

pytestmark = pytest.mark.wide

CODE = Path(mavlink_sitl.__file__).parent
Seen = list[object]


class Flight:
    """A copter at 6 m in GUIDED, and what can be seen of it each second."""

    def __init__(self, base: Mapping[str, float], values: Mapping[str, float]) -> None:
        self.station = copter().ready()
        self.seen: Seen = []
        self._values = {**base, **values}

    def change(self) -> None:
        """From now on with the other values."""
        for name, value in self._values.items():
            self.station.vehicle.parameters.set(name, value)

    def up(self) -> GroundStation:
        self.station.take_off(6.0)
        self.change()
        return self.station

    def watch(self, seconds: int) -> None:
        for _ in range(seconds):
            self.station.run(1.0, step_s=0.5)
            place = tuple(round(value, 1) for value in self.station.position)
            self.seen += [place, self.station.vehicle.firmware.mode.spec.name]


def on_target(flight: Flight) -> None:
    """Landing on a target, 5 m ahead of where it begins."""
    station = flight.up()
    station.mode(LAND)
    for _ in range(100):
        ahead_m = 5.0 - math.hypot(*station.position[:2])
        seen = mav.MAVLink_landing_target_message(
            0, 0, mav.MAV_FRAME_BODY_FRD, 0.0, 0.0, 1.0, 0.0, 0.0, ahead_m, 0.0, 5.0, [1, 0, 0, 0],
            2, 1
        )  # fmt: skip
        station.send(seen)
        station.run(0.1)
    flight.watch(1)


def guided(flight: Flight) -> None:
    station = flight.up()
    station.setpoint(POSITION, (12.0, 5.0, -12.0))
    flight.watch(6)
    station.setpoint(VELOCITY, velocity=(1.0, 0.0, 1.2))
    flight.watch(5)
    station.setpoint(POSITION, (0.0, 0.0, -3.0))
    flight.watch(3)


def hover(flight: Flight) -> None:
    flight.up()
    flight.watch(14)


def back(flight: Flight) -> None:
    station = flight.up()
    rally = item(mav.MAV_CMD_NAV_RALLY_POINT, 25.0, 3.0, 8.0, mission_type=2)
    assert upload(station, [rally], mission_type=2) == 0
    station.setpoint(POSITION, (20.0, 0.0, -11.0))
    flight.watch(7)
    station.mode(RTL)
    flight.watch(30)


def back_from_near(flight: Flight) -> None:
    """Home is nearer than the rally point."""
    station = flight.up()
    rally = item(mav.MAV_CMD_NAV_RALLY_POINT, 25.0, 3.0, 8.0, mission_type=2)
    assert upload(station, [rally], mission_type=2) == 0
    station.mode(RTL)
    flight.watch(12)


def mission(flight: Flight) -> None:
    station = flight.station
    flight.change()
    assert upload(station, [home(), take_off(6), waypoint(12, 0), waypoint(12, 12)]) == 0
    station.mode(AUTO)
    flight.seen.append(station.arm())
    station.command(mav.MAV_CMD_MISSION_START)
    flight.watch(18)


def mission_again(flight: Flight) -> None:
    mission(flight)
    for mode in (LOITER, AUTO):
        flight.station.mode(mode)
    flight.watch(3)


def sticks(flight: Flight) -> None:
    station = flight.up()
    station.mode(LOITER)
    for throttle in (1900, 1150):
        channels = [65535, 65535, throttle, *[65535] * 5]
        station.send(mav.MAVLink_rc_channels_override_message(1, 1, *channels))
        flight.watch(4)


def round_and_round(flight: Flight) -> None:
    flight.up().mode(7)
    flight.watch(6)


def idle(flight: Flight) -> None:
    flight.change()
    flight.station.mode(4)
    flight.station.arm()
    for _ in range(12):
        flight.watch(1)
        flight.seen.append(flight.station.vehicle.firmware.armed)


def outwards(flight: Flight) -> None:
    station = flight.up()
    for _ in range(8):
        station.setpoint(VELOCITY, velocity=(5.0, 0.0, -1.0))
        flight.watch(1)


def silence(flight: Flight) -> None:
    station = flight.up()
    station.heartbeats(True)
    station.run(2.0)
    station.heartbeats(False)
    flight.watch(9)


def blind(flight: Flight) -> None:
    flight.up().vehicle.lose_gps()
    flight.watch(16)


def by_pilot(flight: Flight) -> None:
    """STABILIZE, ALT_HOLD and LOITER, all sticks out of their middle."""
    station = flight.up()
    pilot = Transmitter(station)
    moves = (
        (0, 1450, 1420, 1400),
        (2, 1800, 1620, 1700),
        (2, 1560, 1570, 1560),
        (5, 1200, 1900, 1100),
    )
    for number, roll, pitch, throttle in moves:
        station.mode(number)
        pilot.put({1: roll, 2: pitch, 3: throttle, 4: 3000 - roll, 5: 1700})
        flight.watch(2)
    pilot.put({1: 1500, 2: 1500, 3: 1500, 4: 1500})
    flight.watch(4)


def gently_by_pilot(flight: Flight) -> None:
    """A little off the middle."""
    station = flight.up()
    pilot = Transmitter(station)
    for number in (2, 0):
        station.mode(number)
        pilot.put({1: 1515, 2: 1485, 3: 1602 if number else 1455, 4: 1515})
        flight.watch(3)


def way_back(flight: Flight) -> None:
    flight.change()
    station = flight.station.take_off(6.0)
    for north, east in ((6.0, 0.0), (6.0, 6.0), (6.0, 0.5), (12.0, 1.0)):
        station.setpoint(POSITION, (north, east, -6.0))
        flight.watch(4)
    station.mode(21)
    flight.watch(16)


def throttle_down(flight: Flight) -> None:
    flight.up()
    flight.station.mode(LOITER)
    Transmitter(flight.station).put({3: 990})
    flight.watch(3)


def by_stick(flight: Flight) -> None:
    flight.change()
    flight.station.mode(0)
    Transmitter(flight.station).hold_yaw(2000)
    flight.seen.append(flight.station.vehicle.firmware.armed)


def by_throttle(flight: Flight) -> None:
    """Taken off by the stick, which is in its middle again at once."""
    flight.change()
    station = flight.station
    station.mode(LOITER)
    assert station.arm() == 0
    station.run(3.0)
    for raw_us in (1750, 1500):
        Transmitter(station).put({3: raw_us})
        flight.watch(2)
    flight.watch(4)


def switched(flight: Flight) -> None:
    flight.change()
    for raw_us in (1000, 1300, 1400, 1550, 1700, 1900):
        Transmitter(flight.station).put({5: raw_us})
        flight.watch(1)


def by_switch(channel: int) -> Callable[[Flight], None]:
    """That channel's switch is thrown in flight."""

    def fly(flight: Flight) -> None:
        flight.up()
        Transmitter(flight.station).put({channel: 1900})
        flight.watch(3)

    return fly


def restarted(flight: Flight) -> None:
    flight.change()
    flight.station.vehicle.power_cycle()
    flight.watch(4)


TO_LAND = 18.0
FENCE = {"FENCE_ENABLE": 1.0, "FENCE_RADIUS": 15.0, "AVOID_ENABLE": 0.0}
FLAT = {"SIM_BATT_VOLTAGE": 10.0, "BATT_LOW_TIMER": 6.0}
CRITICAL = {**FLAT, "BATT_CRT_VOLT": 10.2}
SPENT = {"BATT_LOW_MAH": 11_580.0, "BATT_LOW_TIMER": 3.0}
Case = tuple[Callable[[Flight], None], Mapping[str, float], float]
CASES: dict[str, Case] = {
    "ANGLE_MAX": (by_pilot, {}, 1500.0),
    "ARMING_RUDDER": (by_stick, {}, 0.0),
    "AUTO_OPTIONS": (mission, {}, 3.0),
    "AVOID_ENABLE": (outwards, FENCE, 3.0),
    "BATT_CAPACITY": (hover, SPENT, 20_000.0),
    "BATT_CRT_VOLT": (hover, FLAT, 10.2),
    "BATT_FS_CRT_ACT": (hover, CRITICAL, 1.0),
    "BATT_FS_LOW_ACT": (hover, FLAT, 2.0),
    "BATT_LOW_MAH": (hover, {"BATT_LOW_TIMER": 3.0}, 11_580.0),
    "BATT_LOW_TIMER": (hover, {**FLAT, "BATT_FS_LOW_ACT": 2.0}, 2.0),
    "BATT_LOW_VOLT": (hover, FLAT, 9.0),
    "CIRCLE_RADIUS": (round_and_round, {}, 500.0),
    "CIRCLE_RATE": (round_and_round, {}, -10.0),
    "DISARM_DELAY": (idle, {}, 5.0),
    "FENCE_ACTION": (outwards, FENCE, 2.0),
    "FENCE_ALT_MAX": (outwards, FENCE, 8.0),
    "FENCE_ALT_MIN": (guided, {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 8.0}, 5.0),
    "FENCE_ENABLE": (outwards, FENCE, 0.0),
    "FENCE_MARGIN": (outwards, {**FENCE, "AVOID_ENABLE": 3.0}, 5.0),
    "FENCE_RADIUS": (outwards, FENCE, 25.0),
    "FENCE_TYPE": (outwards, FENCE, 1.0),
    "FLTMODE1": (switched, {}, 17.0),
    "FLTMODE2": (switched, {}, 17.0),
    "FLTMODE3": (switched, {}, 17.0),
    "FLTMODE4": (switched, {}, 17.0),
    "FLTMODE5": (switched, {}, 17.0),
    "FLTMODE6": (switched, {}, 17.0),
    "FLTMODE_CH": (switched, {}, 6.0),
    "FS_EKF_ACTION": (blind, {}, 0.0),
    "FS_GCS_ENABLE": (silence, {}, 1.0),
    "FS_GCS_TIMEOUT": (silence, {"FS_GCS_ENABLE": 1.0}, 8.0),
    "FS_THR_ENABLE": (hover, {"SIM_RC_FAIL": 1.0, "FS_THR_ENABLE": 0.0}, 1.0),
    "FS_THR_VALUE": (throttle_down, {}, 995.0),
    "GUID_TIMEOUT": (guided, {}, 1.0),
    "INITIAL_MODE": (restarted, {"FLTMODE_CH": 0.0}, 2.0),
    "LAND_ALT_LOW": (back, {}, 300.0),
    "LAND_SPEED": (back, {}, 120.0),
    "LAND_SPEED_HIGH": (back, {}, 60.0),
    "LOIT_ACC_MAX": (by_pilot, {}, 100.0),
    "LOIT_ANG_MAX": (by_pilot, {}, 8.0),
    "LOIT_BRK_ACCEL": (by_pilot, {}, 50.0),
    "LOIT_BRK_DELAY": (by_pilot, {}, 0.0),
    "LOIT_BRK_JERK": (by_pilot, {}, 50.0),
    "LOIT_SPEED": (by_pilot, {}, 200.0),
    "MAV_GCS_SYSID": (sticks, {}, 250.0),
    "MIS_RESTART": (mission_again, {"AUTO_OPTIONS": 3.0}, 1.0),
    "MOT_THST_HOVER": (by_pilot, {}, 0.3),
    "PILOT_ACCEL_Z": (sticks, {}, 60.0),
    "PILOT_SPEED_DN": (sticks, {}, 100.0),
    "PILOT_SPEED_UP": (sticks, {}, 100.0),
    "PILOT_Y_RATE": (by_pilot, {}, 20.0),
    "PILOT_TKOFF_ALT": (by_throttle, {}, 300.0),
    "PLND_ENABLED": (on_target, {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}, 0.0),
    "PLND_TYPE": (on_target, {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}, 0.0),
    "PLND_XY_DIST_MAX": (on_target, {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}, 0.5),
    "PSC_JERK_XY": (guided, {}, 1.0),
    "PSC_JERK_Z": (guided, {}, 1.0),
    "RALLY_INCL_HOME": (back_from_near, {}, 0.0),
    "RALLY_LIMIT_KM": (back, {}, 0.002),
    **{f"RC{n}_OPTION": (by_switch(n), {}, TO_LAND) for n in range(1, 17)},
    "RC1_DZ": (gently_by_pilot, {}, 0.0),
    "RC1_MAX": (by_pilot, {}, 1750.0),
    "RC1_MIN": (by_pilot, {}, 1300.0),
    "RC1_REVERSED": (by_pilot, {}, 1.0),
    "RC1_TRIM": (by_pilot, {}, 1600.0),
    "RC2_DZ": (gently_by_pilot, {}, 0.0),
    "RC2_MAX": (by_pilot, {}, 1750.0),
    "RC2_MIN": (by_pilot, {}, 1300.0),
    "RC2_REVERSED": (by_pilot, {}, 1.0),
    "RC2_TRIM": (by_pilot, {}, 1600.0),
    "RC3_DZ": (gently_by_pilot, {}, 200.0),
    "RC3_MAX": (by_pilot, {}, 1750.0),
    "RC3_MIN": (by_pilot, {}, 1300.0),
    "RC3_REVERSED": (by_pilot, {}, 1.0),
    "RC4_DZ": (by_pilot, {}, 200.0),
    "RC4_MAX": (by_pilot, {}, 1750.0),
    "RC4_MIN": (by_pilot, {}, 1300.0),
    "RC4_REVERSED": (by_pilot, {}, 1.0),
    "RC4_TRIM": (by_pilot, {}, 1600.0),
    "RCMAP_PITCH": (by_pilot, {}, 4.0),
    "RCMAP_ROLL": (by_pilot, {}, 2.0),
    "RCMAP_THROTTLE": (by_pilot, {}, 1.0),
    "RCMAP_YAW": (by_pilot, {}, 1.0),
    "RC_OVERRIDE_TIME": (sticks, {}, 1.0),
    "RTL_ALT": (back, {}, 1200.0),
    "RTL_LOIT_TIME": (back, {}, 1000.0),
    "RTL_SPEED": (back, {}, 100.0),
    "SIM_BATT_VOLTAGE": (hover, {"BATT_LOW_TIMER": 3.0, "BATT_FS_LOW_ACT": 1.0}, 9.0),
    "SIM_ENGINE_FAIL": (hover, {}, 3.0),
    "SIM_ENGINE_MUL": (hover, {}, 0.3),
    "SIM_GPS1_ENABLE": (hover, {}, 0.0),
    "SIM_GPS1_GLTCH_X": (hover, {}, 0.0001),
    "SIM_GPS1_GLTCH_Y": (hover, {}, 0.0001),
    "SIM_GPS1_GLTCH_Z": (hover, {}, 5.0),
    "SIM_RC_FAIL": (hover, {}, 1.0),
    "SIM_WIND_DIR": (guided, {"SIM_WIND_SPD": 8.0}, 20.0),
    "SIM_WIND_SPD": (guided, {}, 8.0),
    "SRTL_ACCURACY": (way_back, {}, 0.3),
    "SRTL_POINTS": (way_back, {}, 3.0),
    "THR_DZ": (gently_by_pilot, {}, 20.0),
    "WPNAV_ACCEL": (guided, {}, 80.0),
    "WPNAV_ACCEL_Z": (guided, {}, 40.0),
    "WPNAV_JERK": (mission, {"AUTO_OPTIONS": 3.0}, 0.3),
    "WPNAV_RADIUS": (mission, {"AUTO_OPTIONS": 3.0}, 20.0),
    "WPNAV_SPEED": (guided, {}, 150.0),
    "WPNAV_SPEED_DN": (guided, {}, 60.0),
    "WPNAV_SPEED_UP": (guided, {}, 80.0),
}


def fly(case: Case, values: Mapping[str, float]) -> Seen:
    flight = Flight(case[1], values)
    case[0](flight)
    return [*flight.seen, *flight.station.texts()]


@cache
def ordinary(scenario: Callable[[Flight], None], base: tuple[tuple[str, float], ...]) -> Seen:
    return fly((scenario, dict(base), 0.0), {})


@pytest.mark.parametrize("name", sorted(CASES))
def test_a_flight_takes_another_path_with_another_value(name: str) -> None:
    scenario, base, value = CASES[name]
    assert fly(CASES[name], {name: value}) != ordinary(scenario, tuple(base.items()))


def test_every_parameter_of_the_copter_has_such_a_flight() -> None:
    assert sorted(CASES) == sorted(spec.name for spec in ARDUCOPTER.parameters)


def test_the_code_reads_every_parameter_of_every_vehicle() -> None:
    read: set[str] = set()
    for path in CODE.rglob("*.py"):
        if "personality" not in path.parts:
            text = path.read_text("utf-8")
            read.update(re.findall(r'"([A-Z][A-Z0-9_]+)"', text))
            for before, after in re.findall(r'f"([A-Z]+)\{n\}([A-Z_]*)"', text):
                read.update(f"{before}{n}{after}" for n in range(1, 17))
    for personality in PERSONALITIES.values():
        names = {spec.name for spec in personality.parameters}
        assert names <= read, f"{personality.name}: {names - read}"
