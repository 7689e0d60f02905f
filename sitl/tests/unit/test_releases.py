"""Each release that a firmware is simulated as differs from the recorded one as its data say."""

from __future__ import annotations

import copy
import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import ConfigurationError, Simulation, VehicleConfig
from mavlink_sitl.autopilot.personality.versions import RELEASES, releases_of
from mavlink_sitl.command_line.options import parse
from mavlink_sitl.config import PERSONALITIES
from sitl_support.ground_station import ACCEPTED, DENIED, LAND, UNSUPPORTED, GroundStation
from sitl_support.missions import upload
from sitl_support.px4_station import Px4Station

Item = Any

KINDS = sorted(
    (vehicle, release)
    for vehicle, autopilot in PERSONALITIES
    for release in releases_of(autopilot)[1:]
)


def station(firmware: str, vehicle: str = "copter") -> GroundStation:
    autopilot = RELEASES[firmware].autopilot
    config = VehicleConfig(vehicle, autopilot, firmware=firmware, ready_after_s=0.5)
    kind = Px4Station if autopilot == "px4" else GroundStation
    made = kind(Simulation([config]))
    made.run(1.0)
    return made


def read(ground: GroundStation, name: str) -> float | None:
    """The answer to PARAM_REQUEST_READ; None for silence."""
    begin_s = ground.now_s
    ground.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
    ground.run(0.1)
    values = [m for m in ground.messages("PARAM_VALUE", begin_s) if m.param_id == name]
    return values[-1].param_value if values else None


@pytest.mark.parametrize(("vehicle", "firmware"), KINDS)
def test_a_release_is_listed_whole_and_reports_its_number(vehicle: str, firmware: str) -> None:
    ground = station(firmware, vehicle)
    ground.command(mav.MAV_CMD_REQUEST_MESSAGE, 148)
    ground.run(0.2)
    assert (
        ground.last("AUTOPILOT_VERSION").flight_sw_version == RELEASES[firmware].flight_sw_version
    )
    begin_s = ground.now_s
    ground.send(mav.MAVLink_param_request_list_message(1, 1))
    ground.run(3.0)
    values = ground.messages("PARAM_VALUE", begin_s)
    listed = [m.param_id for m in values if m.param_index != 65535]
    assert len(listed) == len(set(listed)) == len(ground.vehicle.parameters)
    changes = ground.vehicle.firmware.personality.changes
    assert changes
    table = ground.vehicle.parameters.table
    assert not set(listed) & set(table.renamed)
    assert all(other.name in listed for other in table.renamed.values())


def test_a_copter_of_1_18_lists_what_the_real_one_does() -> None:
    """As dumped: 43 of 1.17 are gone and 65 new; RCn_REV became integers."""
    before = PERSONALITIES["copter", "px4"].parameter_table
    table = station("px4-1.18").vehicle.parameters.table
    assert len(table.listed) - len(before.listed) == 65 - 43
    assert {"MAN_OVERRIDE_SPD", "COM_GNSSLOSS_ACT", "FD_ALT_LOSS"} <= set(table.listed)
    assert not {"COM_RC_OVERRIDE", "COM_OBC_LOSS_T", "COM_TAKEOFF_ACT"} & set(table.specs)
    assert table.specs["RC1_REV"].type == mav.MAV_PARAM_TYPE_INT32


@pytest.mark.parametrize(
    ("firmware", "old", "new", "value", "recorded"),
    [
        ("ardupilot-4.7", "RTL_ALT", "RTL_ALT_M", 15.0, 1500.0),
        ("ardupilot-4.7", "WPNAV_SPEED", "WP_SPD", 10.0, 1000.0),
        ("ardupilot-4.7", "PSC_JERK_XY", "PSC_NE_JERK", 5.0, 5.0),
        ("ardupilot-4.6", "MAV_GCS_SYSID", "SYSID_MYGCS", 255.0, 255.0),
        ("ardupilot-4.6", "SIM_GPS1_ENABLE", "SIM_GPS_DISABLE", 0.0, 1.0),
    ],
)
def test_a_renamed_parameter_answers_to_its_new_name_only(
    firmware: str, old: str, new: str, value: float, recorded: float
) -> None:
    ground = station(firmware)
    assert read(ground, old) is None
    assert read(ground, new) == value
    assert ground.vehicle.parameters[old] == pytest.approx(recorded)
    assert ground.vehicle.parameters.acts(old)


def test_a_renamed_parameter_acts_in_its_new_unit() -> None:
    ground = station("ardupilot-4.7").ready()
    ground.send(mav.MAVLink_param_set_message(1, 1, b"LAND_SPD_MS", 0.9, 9))
    ground.take_off(8.0)
    ground.mode(LAND)
    ground.run(5.0)
    assert ground.simulation.truth.velocity_ned_m_s[0, 2] == pytest.approx(0.9, abs=0.1)


def test_a_reversed_switch_of_4_6_takes_the_gps_away() -> None:
    ground = station("ardupilot-4.6").ready()
    ground.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 24, 200_000)
    ground.run(0.5)
    assert ground.last("GPS_RAW_INT").fix_type > 3
    ground.send(mav.MAVLink_param_set_message(1, 1, b"SIM_GPS_DISABLE", 1.0, 2))
    ground.run_until(lambda: ground.last("GPS_RAW_INT").fix_type < 3, 10.0)


@pytest.mark.parametrize("command", sorted(RELEASES["px4-1.18"].removed_commands))
def test_the_commands_that_1_18_removed_are_unknown_to_it(command: int) -> None:
    assert station("px4-1.18").command(command, 1.0) == UNSUPPORTED


def test_1_17_obeys_what_1_18_removed() -> None:
    assert station("px4-1.17").command(mav.MAV_CMD_GET_HOME_POSITION) == ACCEPTED


@pytest.mark.parametrize("firmware", ["ardupilot-4.6", "ardupilot-4.7"])
def test_the_banner_names_the_release(firmware: str) -> None:
    ground = station(firmware)
    ground.command(mav.MAV_CMD_DO_SEND_BANNER)
    ground.run(0.2)
    assert any(f"V{RELEASES[firmware].number} (" in text for text in ground.texts())


def test_a_release_selects_its_autopilot_and_another_one_is_rejected(
    capsys: pytest.CaptureFixture[str],
) -> None:
    options, config = parse(["--firmware", "px4-1.18"])
    assert (config.autopilot, config.firmware) == ("px4", "px4-1.18")
    assert [link.port for link in options.link] == [14550, 14540]
    with pytest.raises(SystemExit):
        parse(["--firmware", "px4-1.18", "--autopilot", "ardupilot"])
    assert capsys.readouterr().err == (
        "mavlink_sitl: the firmware of ardupilot must be one of ardupilot-4.7-dev, "
        "ardupilot-4.6, ardupilot-4.7, not px4-1.18\n"
    )
    with pytest.raises(ConfigurationError, match="the firmware of px4 must be one of"):
        VehicleConfig(autopilot="px4", firmware="px4-1.16")


def test_a_parameter_of_the_recorded_release_alone_is_unknown(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        parse(["--firmware", "ardupilot-4.7", "--param", "RTL_ALT=900"])
    assert "similar are: RTL_ALT_M" in capsys.readouterr().err


def item(command: int, frame: int, *numbers: float, x: int = 0, y: int = 0, z: float = 0.0) -> Item:
    """A MISSION_ITEM_INT with these param1 and following."""
    params = (*numbers, *[0.0] * (4 - len(numbers)))
    return mav.MAVLink_mission_item_int_message(1, 1, 0, frame, command, 0, 1, *params, x, y, z, 0)


HERE: dict[str, Any] = {"x": 473977430, "y": 85455940, "z": 20.0}
NOWHERE: dict[str, Any] = {"x": 2**31 - 1, "y": 2**31 - 1}


@pytest.mark.parametrize(
    ("sent", "result"),
    [
        (item(16, 6, 1.0, 2.0, math.nan, 90.0, **HERE), 0),
        (item(16, 6, 1.0, 2.0, 5.0, 90.0, **HERE), 8),
        (item(20, 2), 0),
        (item(20, 2, **NOWHERE), 0),
        (item(20, 2, 1.0), 6),
        (item(20, 2, x=5), 10),
        (item(178, 2, 1.0, 5.0, -1.0), 0),
        (item(178, 2, 1.0, 5.0, -1.0, 1.0), 9),
        (item(22, 6, 15.0, 0.0, 0.0, math.nan, **HERE), 6),
        (item(177, 2, 0.0, 1.0, z=3.0), 12),
    ],
)
def test_1_18_rejects_an_item_with_a_number_that_it_does_not_use(sent: Item, result: int) -> None:
    for firmware, expected in (("px4-1.18", result), ("px4-1.17", 0)):
        ground = station(firmware)
        assert upload(ground, [copy.copy(sent)]) == expected


def test_a_plane_of_1_18_uses_the_pitch_of_a_take_off() -> None:
    sent = item(22, 6, 15.0, 0.0, 0.0, math.nan, **HERE)
    assert upload(station("px4-1.18", "plane"), [sent]) == 0


@pytest.mark.parametrize(
    ("command", "params", "result"),
    [
        (mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, (), ACCEPTED),
        (mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, (1.0,), DENIED),
        (mav.MAV_CMD_DO_SET_MODE, (1.0, 4.0, 3.0, 0.0, 7.0), DENIED),
        (mav.MAV_CMD_COMPONENT_ARM_DISARM, (1.0, 0.0, 0.0, math.nan), ACCEPTED),
        (mav.MAV_CMD_COMPONENT_ARM_DISARM, (1.0, 0.0, 4.0), DENIED),
    ],
)
def test_1_18_denies_a_command_with_a_number_that_it_does_not_use(
    command: int, params: tuple[float, ...], result: int
) -> None:
    ground = station("px4-1.18")
    ground.run(3.0)
    assert isinstance(ground, Px4Station)
    assert ground.command_results(command, *params)[-1] == result


@pytest.mark.parametrize(
    ("firmware", "reports"),
    [("px4-1.18", True), ("px4-1.17", False), ("ardupilot-4.7", True), ("ardupilot-4.6", False)],
)
def test_an_unknown_parameter_is_reported_by_the_releases_of_2026(
    firmware: str, reports: bool
) -> None:
    ground = station(firmware)
    begin_s = ground.now_s
    ground.send(mav.MAVLink_param_request_read_message(1, 1, b"NO_SUCH_NAME", -1))
    ground.send(mav.MAVLink_param_set_message(1, 1, b"NO_SUCH_NAME", 1.0, 9))
    ground.run(0.1)
    errors = [(m.param_id, m.error) for m in ground.messages("PARAM_ERROR", begin_s)]
    assert errors == [("NO_SUCH_NAME", mav.MAV_PARAM_ERROR_DOES_NOT_EXIST)] * 2 * reports


def test_what_cannot_be_set_is_reported() -> None:
    ground = station("ardupilot-4.7")
    ground.send(mav.MAVLink_param_set_message(1, 1, b"RTL_ALT_M", math.nan, 9))
    assert ground.last("PARAM_ERROR").error == mav.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE
    px4 = station("px4-1.18")
    px4.send(mav.MAVLink_param_set_message(1, 1, b"NAV_RCL_ACT", 1.0, 9))
    assert px4.last("PARAM_ERROR").error == 7, "MAV_PARAM_ERROR_TYPE_MISMATCH"


@pytest.mark.parametrize(
    ("firmware", "result"), [("px4-1.18", ACCEPTED), ("px4-1.17", UNSUPPORTED)]
)
def test_the_origin_is_set_by_a_command_from_1_18_on(firmware: str, result: int) -> None:
    config = VehicleConfig(
        autopilot="px4", firmware=firmware, ready_after_s=1.0, external_position=True
    )
    ground = Px4Station(Simulation([config]))
    ground.run(2.0)
    command, x, y = mav.MAV_CMD_DO_SET_GLOBAL_ORIGIN, round(47.0 * 1e7), round(8.0 * 1e7)
    if result == ACCEPTED:
        assert ground.command_int(command, 0, x=2**31 - 1, y=y, z=500.0) == DENIED
    assert ground.command_int(command, 0, x=x, y=y, z=500.0) == result
    altitude_m = ground.vehicle.firmware.navigator.origin.altitude_amsl_m
    assert (altitude_m == pytest.approx(500.0)) is (result == ACCEPTED)
