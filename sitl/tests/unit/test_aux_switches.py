"""Switches on the transmitter whose channels have a function (RCn_OPTION)."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.exchange import Severity
from sitl_support.ground_station import GroundStation, copter
from sitl_support.kinds import kind
from sitl_support.missions import home, upload, waypoint
from sitl_support.transmitter import Transmitter

RTL, LAND, FENCE, ARM, AUTO_MODE = 4, 18, 11, 153, 16
SAVE_WAYPOINT, OBEY_OVERRIDES = 7, 46
LOW, MIDDLE, HIGH = 1000, 1500, 1900


def with_option(vehicle: str, channel: int, function: int) -> tuple[GroundStation, Transmitter]:
    station = copter().ready() if vehicle == "copter" else kind(vehicle)
    sticks = Transmitter(station)
    sticks.put({channel: LOW})
    station.run(1.0)
    station.vehicle.parameters.set(f"RC{channel}_OPTION", float(function))
    station.run(1.0)
    return station, sticks


@pytest.mark.parametrize("vehicle", ["copter", "rover", "boat", "plane"])
def test_a_switch_arms_and_disarms(vehicle: str) -> None:
    station, sticks = with_option(vehicle, 9, ARM)
    copter_ = station.vehicle.firmware
    if vehicle == "plane":
        copter_.disarm(True)
        station.run(0.5)
    sticks.put({9: HIGH})
    station.run(1.0)
    assert copter_.armed
    sticks.put({9: MIDDLE})
    station.run(1.0)
    assert copter_.armed
    sticks.put({9: LOW})
    station.run(1.0)
    if vehicle != "plane":
        assert not copter_.armed


def test_a_switch_changes_the_mode_and_gives_it_back_to_the_mode_switch() -> None:
    station, sticks = with_option("copter", 7, LAND)
    station.take_off(6.0)
    sticks.put({7: HIGH})
    station.run(0.15)
    assert station.vehicle.firmware.mode.spec.name == "GUIDED", "it has to settle"
    station.run(0.3)
    assert station.vehicle.firmware.mode.spec.name == "LAND"
    switches = station.vehicle.firmware.switches
    assert switches is not None
    position = switches.mode.read()
    assert position is not None
    sticks.put({7: LOW})
    station.run(0.5)
    assert station.vehicle.firmware.mode.spec.number == switches.mode.mode_there(position)


def test_one_that_stands_high_acts_at_once_but_arms_nobody() -> None:
    station = copter().ready()
    sticks = Transmitter(station)
    sticks.put({9: HIGH, 10: HIGH})
    station.run(1.0)
    station.vehicle.parameters.set("RC9_OPTION", float(FENCE))
    station.vehicle.parameters.set("RC10_OPTION", float(ARM))
    station.run(1.0)
    assert station.vehicle.firmware.fence.enabled
    assert not station.vehicle.firmware.armed


def test_a_function_that_does_not_exist_is_reported() -> None:
    station, sticks = with_option("copter", 9, 250)
    sticks.put({9: HIGH})
    station.run(1.0)
    texts = [(m.severity, m.text) for m in station.messages("STATUSTEXT")]
    assert (Severity.INFO, "Invalid channel option (250)") in texts


# Saving waypoints.


def commands(station: GroundStation) -> list[int]:
    return [each.command for each in station.vehicle.plans.mission.items]


def test_a_switch_saves_where_the_copter_is() -> None:
    station, sticks = with_option("copter", 7, SAVE_WAYPOINT)
    station.take_off(6.0)
    for throttle_us in (1500, 1000):
        sticks.move({3: throttle_us, 7: HIGH}, 0.6)
        sticks.move({7: LOW}, 0.6)
    assert commands(station) == [16, 22, 16, 21], "home, a take-off, a waypoint, and a landing"
    saved = station.vehicle.plans.mission.items[2]
    assert saved.z == pytest.approx(6.0, abs=0.5)
    assert saved.x == pytest.approx(station.last("GLOBAL_POSITION_INT").lat, abs=30)


def test_disarmed_the_copter_saves_nothing_and_the_rover_forgets_its_mission() -> None:
    station, sticks = with_option("copter", 7, SAVE_WAYPOINT)
    sticks.move({7: HIGH}, 0.6)
    assert commands(station) == []
    station, sticks = with_option("rover", 7, SAVE_WAYPOINT)
    assert upload(station, [home(), waypoint(5, 5)]) == 0
    sticks.move({7: HIGH}, 0.6)
    assert commands(station) == []
    assert "SaveWP: Mission cleared!" in station.texts()
    sticks.move({7: LOW}, 0.6)
    assert station.arm() == 0
    sticks.move({7: HIGH}, 0.6)
    assert commands(station) == [16, 16]


def test_a_plane_does_not_know_that_function() -> None:
    assert kind("plane").command(mav.MAV_CMD_DO_AUX_FUNCTION, SAVE_WAYPOINT, 2) == 4


# When they are looked at.


def test_what_the_pilot_holds_has_the_same_stamp_until_something_moves() -> None:
    copter_ = copter().ready().vehicle.firmware
    radio, pilot, now_s = copter_.radio, copter_.pilot, copter_.now_s
    stamps = [radio.stamp(now_s)]

    def changed() -> bool:
        stamps.append(radio.stamp(now_s))
        return stamps[-1] != stamps[-2]

    assert not changed()
    pilot.receive([1500, 1500, 1000, 1500])
    assert not changed(), "nothing moved"
    pilot.receive([1500, 1500, 1200, 1500])
    assert changed()
    pilot.override([0, 0, 1300], now_s)
    assert changed()
    pilot.override([0, 0, 1300], now_s)
    assert not changed()
    now_s += copter_.parameters["RC_OVERRIDE_TIME"] + 0.1
    assert changed(), "the override has run out"
    pilot.fail(lost=True)
    assert changed()
    copter_.parameters.set("RC7_OPTION", 18.0)
    assert changed()


def test_a_switch_has_a_ground_stations_overrides_count_or_not() -> None:
    station, sticks = with_option("rover", 9, OBEY_OVERRIDES)
    copter_ = station.vehicle.firmware

    def overridden() -> bool:
        station.send(mav.MAVLink_rc_channels_override_message(1, 1, *[0, 0, 1700, 0, 0, 0, 0, 0]))
        station.run(0.5)
        return copter_.radio.raw_us("Throttle", copter_.now_s) == 1700

    assert overridden()
    station.run(4.0)
    sticks.move({9: HIGH}, 0.6)
    sticks.move({9: LOW}, 0.6)
    assert not overridden()
    sticks.move({9: HIGH}, 0.6)
    assert overridden()


def test_an_override_time_of_0_has_overrides_not_count_until_it_is_changed_back() -> None:
    copter_ = copter().ready().vehicle.firmware
    pilot, now_s, usual_s = copter_.pilot, copter_.now_s, 3.0
    pilot.override([0, 1700], now_s)
    assert [pilot.channels(now_s, t)[1] for t in (usual_s, 0.0, usual_s)] == [1700, 1500, 1700]
    pilot.fail(lost=True)
    assert [pilot.heard(now_s, t) for t in (usual_s, 0.0, usual_s)] == [True, False, True]
    assert pilot.channels(now_s + 3.1, usual_s)[1] == 1500
