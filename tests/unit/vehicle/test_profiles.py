from __future__ import annotations

import pytest

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.profiles import GENERIC, TakeoffForm, profile_for
from mavlink_vehicle.profiles.ardupilot import COPTER, OTHER, PLANE, ROVER, SUB

ARDUPILOT = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA


@pytest.mark.parametrize(
    ("vehicle_type", "profile"),
    [
        (mavlink.MAV_TYPE_QUADROTOR, COPTER),
        (mavlink.MAV_TYPE_HELICOPTER, COPTER),
        (mavlink.MAV_TYPE_GROUND_ROVER, ROVER),
        (mavlink.MAV_TYPE_SURFACE_BOAT, ROVER),
        (mavlink.MAV_TYPE_FIXED_WING, PLANE),
        (mavlink.MAV_TYPE_VTOL_QUADROTOR, PLANE),
        (mavlink.MAV_TYPE_SUBMARINE, SUB),
        (mavlink.MAV_TYPE_ANTENNA_TRACKER, OTHER),
    ],
)
def test_the_heartbeat_chooses(vehicle_type: int, profile: object) -> None:
    assert profile_for(ARDUPILOT, vehicle_type) is profile


def test_an_unknown_firmware_is_only_watched() -> None:
    profile = profile_for(mavlink.MAV_AUTOPILOT_GENERIC, mavlink.MAV_TYPE_QUADROTOR)
    assert profile is GENERIC
    assert profile.control_mode is None
    assert not profile.setpoint_motions
    assert profile.takeoff is TakeoffForm.NONE
    assert profile.mode_name(9) == "MODE_9"


def test_copter_modes_by_their_numbers() -> None:
    """The same numbers as in the recordings; 9 is LAND on a copter and CIRCLE on a rover."""
    for name, number in (
        ("STABILIZE", 0), ("AUTO", 3), ("GUIDED", 4), ("LOITER", 5), ("RTL", 6), ("LAND", 9),
        ("BRAKE", 17),
    ):  # fmt: skip
        assert COPTER.modes[name] == number
        assert COPTER.mode_name(number) == name
    assert ROVER.mode_name(9) == "CIRCLE"
    assert COPTER.mode_name(99) == "MODE_99"


@pytest.mark.parametrize("profile", [COPTER, ROVER, PLANE, SUB, OTHER, GENERIC])
def test_profiles_are_consistent(profile: object) -> None:
    assert isinstance(profile, type(COPTER))
    for mode in (
        profile.control_mode, profile.hold_mode, profile.land_mode, profile.return_mode
    ):  # fmt: skip
        assert mode is None or mode in profile.modes
    assert (profile.control_mode is None) == (not profile.setpoint_motions)
    assert len(set(profile.modes.values())) == len(profile.modes)
    with pytest.raises(TypeError):
        profile.modes["X"] = 1  # type: ignore[index]
