"""A connected release is reported with whether goals have been flown with it."""

from __future__ import annotations

import pytest

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.profiles.flown_releases import FLOWN, flown_with

ARDUPILOT, PX4 = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4


@pytest.mark.parametrize(
    ("autopilot", "version", "words"),
    [
        (ARDUPILOT, "4.7.0-dev", "with this release"),
        (ARDUPILOT, "4.7.3", "in the simulator only"),
        (ARDUPILOT, "4.6.2", "in the simulator only"),
        (PX4, "1.17.0", "with this release"),
        (PX4, "1.17.2", "with this release"),
        (PX4, "1.18.0-beta1", "with this release"),
        (PX4, "1.18.0", "in the simulator only"),
    ],
)
def test_a_release_that_was_flown_is_said_to_be(autopilot: int, version: str, words: str) -> None:
    known, text = flown_with(autopilot, version)
    assert known
    assert text.endswith(words)
    assert text.startswith(f"{FLOWN[autopilot].firmware} {version}: ")


@pytest.mark.parametrize(
    ("autopilot", "version"),
    [
        (ARDUPILOT, "4.5.7"),
        (ARDUPILOT, "4.60.1"),
        (PX4, "1.16.0"),
        (PX4, "1.170.0"),
        (PX4, "2.0.0"),
    ],
)
def test_another_release_is_named_with_those_that_were_flown(autopilot: int, version: str) -> None:
    known, text = flown_with(autopilot, version)
    assert not known
    flown = FLOWN[autopilot]
    assert all(release in text for release in (*flown.real, *flown.simulated, version))
