"""Parameters have the names and types of the real firmware and are sent as there.

`tests/data/real_parameters.tsv` has the facts: of each parameter that is offered here the
MAV_PARAM_TYPE in the lists of the real simulators (ArduPilot 4.7-dev, PX4 v1.17).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.config import PERSONALITIES
from tests.support.stations.ground_station import GroundStation, copter
from tests.support.stations.missions import home, take_off, upload, waypoint

REAL = Path(__file__).resolve().parents[2] / "data" / "real_parameters.tsv"
AS_IN_FIRMWARE_S = 41.64
"""From power-up to a position, of the real copter: nothing is scaled then"""


@cache
def real_types(autopilot: str, vehicle: str) -> dict[str, int]:
    rows = [line.split("\t") for line in REAL.read_text("utf-8").splitlines()[1:]]
    kind = "rover" if vehicle == "boat" else vehicle
    return {name: int(number) for a, v, name, number in rows if (a, v) == (autopilot, kind)}


def listed(station: GroundStation) -> dict[str, int]:
    """What PARAM_REQUEST_LIST gives: types by name."""
    begin_s = station.now_s
    station.send(mav.MAVLink_param_request_list_message(1, 1))
    station.run(3.0)
    values = station.messages("PARAM_VALUE", begin_s)
    return {m.param_id: m.param_type for m in values if m.param_index != 65535}


@pytest.mark.parametrize(("vehicle", "autopilot"), sorted(PERSONALITIES))
def test_every_listed_parameter_is_one_of_the_real_firmware_with_its_type(
    vehicle: str, autopilot: str
) -> None:
    config = VehicleConfig(vehicle=vehicle, autopilot=autopilot)
    assert listed(GroundStation(Simulation([config]))) == real_types(autopilot, vehicle)


def test_px4_answers_for_what_it_does_not_list() -> None:
    """No module of the copter has looked at it; the plane's airframe sets it."""
    station = GroundStation(Simulation([VehicleConfig(autopilot="px4")]))
    name = "MIS_TKO_LAND_REQ"
    assert name not in listed(station)
    station.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
    answer = station.last("PARAM_VALUE")
    assert (answer.param_id, answer.param_type, answer.param_index) == (name, 6, 65535)


# What an ArduPilot saves by itself.


def unasked(station: GroundStation, since_s: float = 0.0) -> list[str]:
    values = station.messages("PARAM_VALUE", since_s)
    assert all(m.param_index == 65535 for m in values)
    return [m.param_id for m in values]


def test_21_values_come_unasked_in_the_first_6_seconds() -> None:
    """As in `copter_acks` and `copter_guided`: calibrations, saved while it starts."""
    station = copter(ready_after_s=AS_IN_FIRMWARE_S)
    station.run(6.0)
    told = unasked(station)
    assert len(told) == 21
    assert told[:3] == ["BARO1_GND_PRESS", "BARO2_GND_PRESS", "INS_GYR_ID"]
    assert told[-1] == "EK3_SRC1_POSXY"
    types = {m.param_id: m.param_type for m in station.messages("PARAM_VALUE")}
    assert (types["BARO1_GND_PRESS"], types["INS_GYR_ID"], types["EK3_SRC1_POSXY"]) == (9, 6, 2)


def test_the_length_of_the_mission_is_reported_with_each_item_of_an_upload() -> None:
    """As in `copter_auto_cleared`; home counts, once it is set."""
    station = copter().ready()
    assert unasked(station)[-1] == "MIS_TOTAL"
    begin_s = station.now_s
    assert upload(station, [home(), take_off(5), waypoint(10, 0), waypoint(20, 0)]) == 0
    totals = [m.param_value for m in station.messages("PARAM_VALUE", begin_s)]
    assert totals == [2.0, 3.0, 4.0]


def test_statistics_are_told_twice_a_minute_and_when_it_is_disarmed() -> None:
    station = copter().ready()
    begin_s = station.now_s
    station.run(31.0)
    assert unasked(station, begin_s) == ["STAT_RUNTIME"]
    station.take_off(5.0)
    station.mode(9)
    station.run_until(lambda: not station.vehicle.copter.armed)
    station.run(0.1)
    assert unasked(station)[-2:] == ["STAT_FLTTIME", "STAT_RUNTIME"]
