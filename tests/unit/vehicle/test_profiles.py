from __future__ import annotations

import pytest

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.profiles import (
    GENERIC,
    Profile,
    SetpointField,
    TakeoffForm,
    VehicleKind,
    profile_for,
    px4,
)
from mavlink_vehicle.profiles.ardupilot import BOAT, COPTER, OTHER, PLANE, QUADPLANE, ROVER, SUB

ARDUPILOT = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA


@pytest.mark.parametrize(
    ("vehicle_type", "profile"),
    [
        (mavlink.MAV_TYPE_QUADROTOR, COPTER),
        (mavlink.MAV_TYPE_HELICOPTER, COPTER),
        (mavlink.MAV_TYPE_GROUND_ROVER, ROVER),
        (mavlink.MAV_TYPE_SURFACE_BOAT, BOAT),
        (mavlink.MAV_TYPE_FIXED_WING, PLANE),
        (mavlink.MAV_TYPE_VTOL_QUADROTOR, QUADPLANE),
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
    assert not profile.setpoints.motions
    assert profile.takeoff.form is TakeoffForm.NONE
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


PX4_PROFILES = [px4.COPTER, px4.ROVER, px4.BOAT, px4.PLANE, px4.VTOL, px4.OTHER]


@pytest.mark.parametrize(
    "profile",
    [COPTER, ROVER, BOAT, PLANE, QUADPLANE, SUB, OTHER, GENERIC, *PX4_PROFILES],
    ids=lambda profile: profile.name,
)
def test_profiles_are_consistent(profile: Profile) -> None:
    for mode in (
        profile.control_mode, profile.hold_mode, profile.land_mode, profile.return_mode,
        profile.mission_mode, profile.takeoff.mode, profile.takeoff.mode_after,
    ):  # fmt: skip
        assert mode is None or mode in profile.modes
    flown = bool(profile.setpoints.motions) or profile.reposition
    assert (profile.control_mode is not None) == flown
    assert not (profile.setpoints.motions and profile.reposition)
    motion = SetpointField.POSITION | SetpointField.VELOCITY | SetpointField.ACCELERATION
    assert not profile.setpoints.motions or profile.setpoints.form & motion
    assert (profile.kind is VehicleKind.OTHER) == (profile.control_mode is None)
    assert profile.unsupported is None or profile.control_mode is None
    assert profile.speed_command is None or profile.speed_command.modes <= set(profile.modes)
    assert not profile.setpoints.prestream_s or profile.setpoints.outside_control_mode
    assert len(set(profile.modes.values())) == len(profile.modes)
    with pytest.raises(TypeError):
        profile.modes["X"] = 1  # type: ignore[index]


@pytest.mark.parametrize(
    ("vehicle_type", "profile"),
    [
        (mavlink.MAV_TYPE_QUADROTOR, px4.COPTER),
        (mavlink.MAV_TYPE_HEXAROTOR, px4.COPTER),
        (mavlink.MAV_TYPE_GROUND_ROVER, px4.ROVER),
        (mavlink.MAV_TYPE_SURFACE_BOAT, px4.BOAT),
        (mavlink.MAV_TYPE_FIXED_WING, px4.PLANE),
        (mavlink.MAV_TYPE_VTOL_TILTROTOR, px4.VTOL),
        (mavlink.MAV_TYPE_SUBMARINE, px4.OTHER),
        (250, px4.OTHER),
    ],
)
def test_a_px4s_heartbeat_chooses(vehicle_type: int, profile: Profile) -> None:
    assert profile_for(mavlink.MAV_AUTOPILOT_PX4, vehicle_type) is profile


def test_a_vtol_is_known_and_rejected_with_a_sentence() -> None:
    for profile in (px4.VTOL, QUADPLANE):
        assert profile.unsupported is not None
        assert "VTOL vehicles are not supported" in profile.unsupported
        assert profile.mode_number(profile.return_mode) is not None


def test_px4_modes_by_their_recorded_numbers() -> None:
    """Main << 16 | sub << 24, as the real PX4's HEARTBEATs and AVAILABLE_MODES show them."""
    for name, number in (
        ("MANUAL", 0x00010000), ("ALTCTL", 0x00020000), ("POSCTL", 0x00030000),
        ("OFFBOARD", 0x00060000), ("AUTO.TAKEOFF", 0x02040000), ("AUTO.LOITER", 0x03040000),
        ("AUTO.MISSION", 0x04040000), ("AUTO.RTL", 0x05040000), ("AUTO.LAND", 0x06040000),
        ("POSCTL.SLOW", 0x02030000), ("ALTITUDE_CRUISE", 0x000B0000),
        ("AUTO.EXTERNAL8", 0x12040000),
    ):  # fmt: skip
        assert px4.COPTER.modes[name] == number
        assert px4.COPTER.mode_name(number) == name
    assert px4.COPTER.mode_name(0x00630000) == "MODE_6488064"


def test_what_a_kind_cannot_do_is_said_by_its_profile() -> None:
    for profile in (ROVER, BOAT, px4.ROVER, px4.BOAT):
        assert profile.takeoff.form is TakeoffForm.NONE
        assert profile.land_mode is None
        assert profile.setpoints.form is SetpointField.VELOCITY
    for profile in (PLANE, px4.PLANE):
        assert profile.reposition
        assert profile.setpoints.form is SetpointField.NONE
