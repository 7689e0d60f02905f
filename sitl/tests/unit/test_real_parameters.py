"""Parameters have the names and types of the real firmware and are sent as there.

`tests/data/real_parameters.tsv` has the facts: of each parameter that acts here the
MAV_PARAM_TYPE in the lists of the real simulators (ArduPilot 4.7-dev, PX4 v1.17).
"""

from __future__ import annotations

import runpy
from functools import cache
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.config import PERSONALITIES
from sitl_support.ground_station import (
    ACCEPTED,
    DENIED,
    TEMPORARILY_REJECTED,
    GroundStation,
    copter,
)
from sitl_support.missions import home, take_off, upload, waypoint

REAL = Path(__file__).resolve().parents[1] / "data" / "real_parameters.tsv"
AS_IN_FIRMWARE_S = 41.64
"""From power-up to a position, of the real copter: nothing is scaled then"""


@cache
def real_types(autopilot: str, vehicle: str) -> dict[str, int]:
    rows = [line.split("\t") for line in REAL.read_text("utf-8").splitlines()[1:]]
    kind = "rover" if vehicle == "boat" else vehicle
    return {name: int(number) for a, v, name, number in rows if (a, v) == (autopilot, kind)}


def listed(station: GroundStation) -> dict[str, int]:
    """The answer to PARAM_REQUEST_LIST: types by name."""
    begin_s = station.now_s
    station.send(mav.MAVLink_param_request_list_message(1, 1))
    station.run(3.0)
    values = station.messages("PARAM_VALUE", begin_s)
    return {m.param_id: m.param_type for m in values if m.param_index != 65535}


LENGTHS = {
    ("copter", "ardupilot"): 1343,
    ("plane", "ardupilot"): 1393,
    ("rover", "ardupilot"): 1227,
    ("boat", "ardupilot"): 1227,
    ("copter", "px4"): 880,
    ("plane", "px4"): 941,
    ("rover", "px4"): 658,
    ("boat", "px4"): 658,
}
"""How many the real simulators list"""


@pytest.mark.parametrize(("vehicle", "autopilot"), sorted(PERSONALITIES))
def test_the_list_is_that_of_the_real_firmware(vehicle: str, autopilot: str) -> None:
    """As long, and those that act have the firmware's types."""
    config = VehicleConfig(vehicle=vehicle, autopilot=autopilot)
    station = GroundStation(Simulation([config]))
    types = listed(station)
    assert len(types) == LENGTHS[vehicle, autopilot]
    assert types.items() >= real_types(autopilot, vehicle).items()
    values = [m for m in station.messages("PARAM_VALUE") if m.param_index != 65535]
    assert {m.param_count for m in values} == {len(types)}
    assert [m.param_index for m in values] == list(range(len(types)))
    for place in (0, len(types) - 1):
        station.send(mav.MAVLink_param_request_read_message(1, 1, b"", place))
        assert station.last("PARAM_VALUE").param_id == values[place].param_id


@pytest.mark.parametrize(
    ("vehicle", "autopilot", "name", "kind", "value"),
    [
        ("copter", "ardupilot", "ATC_ACCEL_P_MAX", 9, 110000.0),
        ("copter", "ardupilot", "FRAME_CLASS", 2, 1.0),
        ("plane", "ardupilot", "ACRO_PITCH_RATE", 4, 180.0),
        ("rover", "ardupilot", "BAL_PITCH_MAX", 9, 10.0),
        ("copter", "px4", "ASPD_SCALE_1", 9, 1.0),
    ],
)
def test_what_does_nothing_has_the_dumped_value_and_type(
    vehicle: str, autopilot: str, name: str, kind: int, value: float
) -> None:
    station = GroundStation(Simulation([VehicleConfig(vehicle=vehicle, autopilot=autopilot)]))
    assert not station.vehicle.parameters.acts(name)
    station.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
    answer = station.last("PARAM_VALUE")
    assert (answer.param_id, answer.param_type, answer.param_value) == (name, kind, value)


def test_what_does_nothing_can_be_set_and_outlives_a_restart() -> None:
    """Of one vehicle: the others have their own."""
    simulation = Simulation([VehicleConfig(), VehicleConfig()])
    station, other = GroundStation(simulation), GroundStation(simulation, 1)
    station.send(mav.MAVLink_param_set_message(1, 1, b"LOG_DISARMED", 3.2, 2))
    assert station.last("PARAM_VALUE").param_value == 3.0
    simulation.vehicles[0].power_cycle()
    station.run(3.0)
    for who, system, value in ((station, 1, 3.0), (other, 2, 0.0)):
        who.send(mav.MAVLink_param_request_read_message(system, 1, b"LOG_DISARMED", -1))
        assert who.last("PARAM_VALUE").param_value == value


def reset(station: GroundStation, what: float) -> int:
    station.send(mav.MAVLink_param_set_message(1, 1, b"LOG_DISARMED", 1.0, 2))
    return station.command(mav.MAV_CMD_PREFLIGHT_STORAGE, what)


def test_an_ardupilot_has_the_defaults_again_after_a_reset_and_a_restart() -> None:
    station = copter().ready()
    values = station.vehicle.parameters
    values.set("RTL_ALT", 900.0)
    assert reset(station, 1.0) == DENIED
    assert reset(station, 2.0) == ACCEPTED
    station.run(0.1)
    assert station.texts()[-1] == "All parameters reset, reboot board"
    assert (values["RTL_ALT"], values["LOG_DISARMED"]) == (900.0, 1.0)
    values.set("LAND_SPEED", 60.0)  # set after the reset: it is stored again
    station.vehicle.power_cycle()
    station.run(3.0)
    names = ("RTL_ALT", "LOG_DISARMED", "LAND_SPEED")
    assert [values[name] for name in names] == [1500.0, 0.0, 60.0]


def test_an_ardupilot_counts_its_starts() -> None:
    station = GroundStation(Simulation([VehicleConfig()]))
    station.run(2.0)
    counts = [station.vehicle.parameters["STAT_BOOTCNT"]]
    for _ in range(2):
        assert station.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1.0) == ACCEPTED
        station.run(5.0)
        counts.append(station.vehicle.parameters["STAT_BOOTCNT"])
    assert counts == [1.0, 2.0, 3.0]


def test_a_px4_has_the_defaults_again_at_once_but_not_while_armed() -> None:
    station = GroundStation(Simulation([VehicleConfig(autopilot="px4")]))
    station.run(4.0)
    values = station.vehicle.parameters
    values.set("RTL_RETURN_ALT", 50.0)
    for what in (0.0, 1.0, 3.0):
        assert station.command(mav.MAV_CMD_PREFLIGHT_STORAGE, what) == ACCEPTED
    assert values["RTL_RETURN_ALT"] == 50.0
    assert station.command(mav.MAV_CMD_PREFLIGHT_STORAGE, 2.0) == ACCEPTED
    assert values["RTL_RETURN_ALT"] == 30.0
    assert station.arm() == ACCEPTED
    assert station.command(mav.MAV_CMD_PREFLIGHT_STORAGE, 2.0) == TEMPORARILY_REJECTED


def test_the_page_names_all_that_act() -> None:
    """docs/parameters.md."""
    root = Path(__file__).resolve().parents[2]
    tables = runpy.run_path(str(root / "scripts/list_simulated.py"))["parameter_tables"]
    page = (root / "docs/parameters.md").read_text("utf-8")
    assert page.endswith(tables(PERSONALITIES.values()).rstrip() + "\n")
    for personality in PERSONALITIES.values():
        table = personality.parameter_table
        assert table.acting.keys() <= table.specs.keys()


def test_vehicles_share_what_nobody_changed() -> None:
    simulation = Simulation([VehicleConfig() for _ in range(3)])
    first, *others = (vehicle.parameters for vehicle in simulation.vehicles)
    assert all(parameters.table is first.table for parameters in others)
    first.set("LOG_BITMASK", 3.0)
    assert set(first.of_interest()) == {*first.table.acting, "LOG_BITMASK"}


def test_a_list_comes_as_fast_as_the_real_one() -> None:
    """Recorded: an ArduPilot's 1,343 in 0.7 s, a PX4's 887 in 0.9 s."""
    for autopilot, seconds in (("ardupilot", 0.7), ("px4", 0.9)):
        station = GroundStation(Simulation([VehicleConfig(autopilot=autopilot)]))
        station.run(3.0)
        begin_s, count = station.now_s, len(station.vehicle.parameters)
        station.send(mav.MAVLink_param_request_list_message(1, 1))
        station.run(seconds + 0.1)
        values = station.messages("PARAM_VALUE", begin_s)
        assert len([m for m in values if m.param_index != 65535]) == count
        late = [m for at_s, m in station.log if at_s > begin_s + 0.7 * seconds]
        assert any(m.get_type() == "PARAM_VALUE" for m in late)


def test_px4_answers_for_what_it_does_not_list() -> None:
    """No module of the copter has looked at it; the plane's airframe sets it."""
    station = GroundStation(Simulation([VehicleConfig(autopilot="px4")]))
    name = "MIS_TKO_LAND_REQ"
    assert name not in listed(station)
    station.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
    answer = station.last("PARAM_VALUE")
    assert (answer.param_id, answer.param_type, answer.param_index) == (name, 6, 65535)


# Parameters that an ArduPilot saves by itself.


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


def test_statistics_are_reported_twice_a_minute_and_when_it_is_disarmed() -> None:
    station = copter().ready()
    begin_s = station.now_s
    station.run(31.0)
    assert unasked(station, begin_s) == ["STAT_RUNTIME"]
    station.take_off(5.0)
    station.mode(9)
    station.run_until(lambda: not station.vehicle.firmware.armed)
    station.run(0.1)
    assert unasked(station)[-2:] == ["STAT_FLTTIME", "STAT_RUNTIME"]
