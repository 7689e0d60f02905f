"""Names and values of failsafe parameters as text."""

from __future__ import annotations

import pytest

from mavlink_vehicle.profiles import Profile, ardupilot, px4
from mavlink_vehicle.profiles.failsafe_settings import FailsafeSetting

FLOWN = [
    ardupilot.COPTER, ardupilot.ROVER, ardupilot.BOAT, ardupilot.PLANE,
    px4.COPTER, px4.ROVER, px4.BOAT, px4.PLANE,
]  # fmt: skip


@pytest.mark.parametrize("profile", FLOWN, ids=lambda profile: profile.name)
def test_every_kind_that_is_flown_has_settings_with_names_that_fit(profile: Profile) -> None:
    names = [name for setting in profile.failsafe_settings for name in setting.names]
    assert len(names) > 5
    assert len(set(names)) == len(names)
    assert all(0 < len(name) <= 16 for name in names)
    for setting in profile.failsafe_settings:
        assert not setting.off or setting.off <= set(setting.values), setting.name


@pytest.mark.parametrize("profile", FLOWN[:4], ids=lambda profile: profile.name)
def test_the_ground_stations_system_id_is_known_by_both_of_its_names(profile: Profile) -> None:
    (setting,) = (s for s in profile.failsafe_settings if "MAV_GCS_SYSID" in s.names)
    assert setting.names == ("MAV_GCS_SYSID", "SYSID_MYGCS")


def test_only_stream_vehicles_report_what_follows_its_end() -> None:
    streamed = {p.name for p in FLOWN if "COM_OF_LOSS_T" in {s.name for s in p.failsafe_settings}}
    assert streamed == {"PX4 multicopter", "PX4 rover", "PX4 boat"}


def test_a_number_is_reported_with_its_meaning_or_its_unit() -> None:
    choice = FailsafeSetting("A", "a", {0: "nothing", 2: "land"})
    assert choice.describe(2.0) == "2 (land)"
    assert choice.describe(7.0) == "7"
    assert FailsafeSetting("B", "b", unit="s").describe(1.5) == "1.5 s"
