"""The generated pages are those of the code, and the simulator answers as they say."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from sitl_support.ground_station import ACCEPTED, UNSUPPORTED, GroundStation

ROOT = Path(__file__).resolve().parents[2]
SCRIPT: dict[str, Any] = runpy.run_path(str(ROOT / "scripts/list_simulated.py"))
REBOOT = mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
VEHICLES: tuple[str, ...] = SCRIPT["VEHICLES"]


@pytest.mark.parametrize("autopilot", SCRIPT["FIRMWARES"])
def test_the_page_is_up_to_date(autopilot: str) -> None:
    text = SCRIPT["path_of"](autopilot).read_text("utf-8")
    assert text == SCRIPT["page"](autopilot), "run make pages"


def listed(autopilot: str, vehicle: str) -> dict[int, str]:
    """The answer that the page gives for each command, by number."""
    text = SCRIPT["path_of"](autopilot).read_text("utf-8")
    part = text.split("## Commands")[1].split("## Modes")[0]
    rows = re.findall(r"^\| (\d+) \w+ \| (.*) \|$", part, re.MULTILINE)
    column = VEHICLES.index(vehicle)
    return {int(number): cells.split(" | ")[column] for number, cells in rows}


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("autopilot", SCRIPT["FIRMWARES"])
def test_commands_are_answered_as_the_page_says(autopilot: str, vehicle: str) -> None:
    """Each with zeros, on the ground; the tables of the code are not looked at."""
    said = listed(autopilot, vehicle)
    assert len(said) > 20
    simulation = Simulation([VehicleConfig(vehicle=vehicle, autopilot=autopilot)], seed=1)
    station = GroundStation(simulation)
    station.run(4.0)
    for number in set(mav.enums["MAV_CMD"]) - {REBOOT}:
        if number >= 65536 or number == mav.MAV_CMD_ENUM_END:
            continue
        message = mav.MAVLink_command_long_message(1, 1, number, 0, *(0.0,) * 7)
        results = [m.result for m in station.send(message) if m.get_type() == "COMMAND_ACK"]
        name = mav.enums["MAV_CMD"][number].name
        match said.get(number, "-"):
            case "-":
                assert results == [UNSUPPORTED], name
            case "silent":
                assert results == [], name
            case "refused":
                assert results, name
                assert ACCEPTED not in results, name
            case "accepted":
                assert len(results) == 1, name
