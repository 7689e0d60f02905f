"""docs/protocols.md and docs/frames_and_units.md agree with the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mavlink_vehicle.events import StationAct
from mavlink_vehicle.io.links import parse_url
from mavlink_vehicle.positions import frames
from mavlink_vehicle.profiles import GENERIC, ardupilot, px4
from mavlink_vehicle.protocols.operations.command import command_name
from mavlink_vehicle.protocols.stations.station_acts import COMMANDS
from mavlink_vehicle.vehicle import VehicleConfig
from tests.support.models import ellipsoid

DOCS = Path(__file__).resolve().parents[3] / "docs"
PROTOCOLS = (DOCS / "protocols.md").read_text("utf-8")
FRAMES = (DOCS / "frames_and_units.md").read_text("utf-8")


def test_links_are_written_in_ways_that_work() -> None:
    rows = re.findall(r"^\| [\w, ]+ \| `(\S+)` \| `(\S+)` \|$", PROTOCOLS, re.MULTILINE)
    assert len(rows) == 6
    for mavsdk, pymavlink in rows:
        assert parse_url(mavsdk) == parse_url(pymavlink)


def test_the_acts_of_other_stations_and_their_commands_are_all_there() -> None:
    rows = re.findall(r"^\| `([A-Z_]+)` \| ([^`\n]+) \|$", PROTOCOLS, re.MULTILINE)
    assert [name for name, _ in rows] == [act.name for act in StationAct]
    changes_of_mode = PROTOCOLS.partition("Changes of the mode are ")[2].partition(", in the")[0]
    text = " ".join([*(how for _, how in rows), changes_of_mode])
    words = set(re.findall(r"\b[A-Z_]{6,}\b", text))
    for command in COMMANDS:
        assert command_name(command) in words


def test_settings_that_are_named_exist() -> None:
    for name in re.findall(r"`(\w+_(?:s|retries))`", PROTOCOLS):
        places = (VehicleConfig(), GENERIC, GENERIC.setpoints)
        assert any(hasattr(place, name) for place in places), name


def test_conversions_that_are_named_exist_and_none_is_left_out() -> None:
    named = set(re.findall(r"`(\w+_to_\w+)`", FRAMES))
    there = {name for name in vars(frames) if "_to_" in name and not name.startswith("_")}
    assert named == there


def test_how_far_each_firmwares_metres_are_off_is_reported() -> None:
    """Every row: metres that a firmware counts too many on 1000 m, and sideways on 5000 m east."""
    for projection in (ardupilot.PROJECTION, px4.PROJECTION):
        degree_m, _ = projection.to_local(48.0, 8.0, (47.0, 8.0, 0.0))
        assert f"{degree_m:,.2f} m".replace(",", " ") in FRAMES
    rows = re.findall(r"^\| (\d+)\S* \|(.+)\|$", FRAMES, re.MULTILINE)
    assert [int(latitude) for latitude, _ in rows] == [0, 30, 45, 60, 85]
    for latitude, cells in rows:
        origin = (float(latitude), 8.0, 0.0)
        north = ellipsoid.on_ground(1000.0, 0.0, origin)
        east = ellipsoid.on_ground(0.0, 1000.0, origin)
        far = ellipsoid.on_ground(0.0, 5000.0, origin)
        found = []
        for projection in (ardupilot.PROJECTION, px4.PROJECTION):
            found += [
                projection.to_local(*north[:2], origin)[0] - 1000.0,
                projection.to_local(*east[:2], origin)[1] - 1000.0,
                projection.to_local(*far[:2], origin)[0],
            ]
        told = [float(cell.replace("−", "-")) for cell in cells.split("|")]
        assert told == pytest.approx(found, abs=0.051), f"latitude {latitude}"
