"""docs/autopilots.md agrees with the profiles and the tests."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mavlink_vehicle.profiles import (
    CommandAltitude,
    Profile,
    SetpointField,
    TakeoffForm,
    ardupilot,
    px4,
)

ROOT = Path(__file__).resolve().parents[3]
PAGE = (ROOT / "docs/autopilots.md").read_text("utf-8")
FLOWN = [
    ardupilot.COPTER, ardupilot.ROVER, ardupilot.BOAT, ardupilot.PLANE,
    px4.COPTER, px4.ROVER, px4.BOAT, px4.PLANE,
]  # fmt: skip


def section(heading: str) -> str:
    """Return the text under a heading."""
    return PAGE.split(f"# {heading}\n", 1)[1].split("\n#", 1)[0]


def rows(heading: str) -> list[list[str]]:
    """Return the cells of the table under a heading, without its first two lines."""
    lines = [line for line in section(heading).splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


@pytest.mark.parametrize("firmware", ["ArduPilot", "PX4"])
def test_every_rule_has_a_test_that_exists(firmware: str) -> None:
    source = "\n".join(
        path.read_text("utf-8")
        for folder in ("tests", "sitl/tests")
        for path in sorted((ROOT / folder).glob("**/test_*.py"))
    )
    names = set(re.findall(r"^def (test_\w+)", source, re.MULTILINE))
    rules = section(firmware).split("\n- ")[1:]
    assert len(rules) > 20
    for rule in rules:
        named = re.findall(r"`(test_\w+)`", rule)
        assert named, rule
        assert set(named) <= names, rule


@pytest.mark.parametrize("profile", FLOWN, ids=lambda profile: profile.name)
def test_every_profile_is_listed_as_it_is(profile: Profile) -> None:
    (row,) = [row for row in rows("The profiles") if profile.name in row[0].split(", ")]
    _, control, way, takeoff, hold, land, back = row
    assert control == profile.control_mode
    assert hold.removesuffix(" (circles)") == profile.hold_mode
    assert land == (profile.land_mode or "none")
    assert back.removesuffix(" (circles)") == profile.return_mode
    assert ("DO_REPOSITION" in way) == profile.reposition
    amsl = profile.altitude_reference is CommandAltitude.AMSL
    assert not profile.reposition or ("above sea level" in way) == amsl
    for word, group in (
        ("position", SetpointField.POSITION),
        ("velocity", SetpointField.VELOCITY),
        ("acceleration", SetpointField.ACCELERATION),
        ("yaw", SetpointField.YAW),
    ):
        assert (word in way.split(", ")) == (group in profile.setpoints.form)
    words = {
        TakeoffForm.NONE: "none",
        TakeoffForm.ABOVE_HOME: "NAV_TAKEOFF, above home",
        TakeoffForm.AMSL: "NAV_TAKEOFF, above sea level",
        TakeoffForm.MODE: f"the mode {profile.takeoff.mode}",
    }
    assert takeoff.startswith(words[profile.takeoff.form])


def test_the_speed_commands_are_reported_as_they_are() -> None:
    sentence = re.sub(r"\s+", " ", PAGE).split("The speed command", 1)[1].split(". Where", 1)[0]
    for name, profile in (
        ("ArduCopter", ardupilot.COPTER), ("ArduRover", ardupilot.ROVER),
        ("ArduPlane", ardupilot.PLANE), ("PX4", px4.COPTER),
    ):  # fmt: skip
        part = re.search(rf"{name} in ([^(;]*?)(?: \(|, Ardu|, PX4|$)", sentence)
        assert part is not None, name
        assert profile.speed_command is not None
        assert set(re.split(r", | and ", part.group(1))) == profile.speed_command.modes
