"""Switches on the transmitter whose channels have a function (RCn_OPTION)."""

from __future__ import annotations

import pytest

from mavlink_sitl.exchange import Severity
from tests.support.stations.ground_station import GroundStation, copter
from tests.support.stations.kinds import kind
from tests.support.stations.transmitter import Transmitter

RTL, LAND, FENCE, ARM, AUTO_MODE, RELAY = 4, 18, 11, 153, 16, 28
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
    copter_ = station.vehicle.copter
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
    assert station.vehicle.copter.mode.spec.name == "GUIDED", "it has to settle"
    station.run(0.3)
    assert station.vehicle.copter.mode.spec.name == "LAND"
    switch = station.vehicle.copter.mode_switch
    assert switch is not None
    position = switch.read()
    assert position is not None
    sticks.put({7: LOW})
    station.run(0.5)
    assert station.vehicle.copter.mode.spec.number == switch.mode_there(position)


def test_one_that_stands_high_acts_at_once_but_arms_nobody() -> None:
    station = copter().ready()
    sticks = Transmitter(station)
    sticks.put({9: HIGH, 10: HIGH})
    station.run(1.0)
    station.vehicle.parameters.set("RC9_OPTION", float(FENCE))
    station.vehicle.parameters.set("RC10_OPTION", float(ARM))
    station.run(1.0)
    assert station.vehicle.copter.fence.enabled
    assert not station.vehicle.copter.armed


def test_a_function_that_does_not_exist_is_reported() -> None:
    station, sticks = with_option("copter", 9, 250)
    sticks.put({9: HIGH})
    station.run(1.0)
    texts = [(m.severity, m.text) for m in station.messages("STATUSTEXT")]
    assert (Severity.INFO, "Invalid channel option (250)") in texts
