"""Every command of the dialect gets exactly one answer, in both forms, for any component."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from sitl_support.ground_station import UNSUPPORTED, GroundStation

REBOOT = mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
COMMANDS = sorted(
    {
        number
        for number, entry in mav.enums["MAV_CMD"].items()
        if entry.name != "MAV_CMD_ENUM_END" and number != REBOOT and number < 65536
    }
)
KINDS = ["copter", "rover", "boat", "plane"]
ANSWERED_BY_COPTERS = {
    "NAV_LOITER_UNLIM", "NAV_RETURN_TO_LAUNCH", "NAV_LAND", "NAV_TAKEOFF", "NAV_VTOL_LAND",
    "CONDITION_YAW", "DO_SET_MODE", "DO_CHANGE_SPEED", "DO_SET_HOME", "DO_SET_SERVO",
    "DO_LAND_START", "DO_REPOSITION", "DO_PAUSE_CONTINUE", "DO_SET_ROI_LOCATION",
    "DO_SET_ROI_NONE", "DO_SET_ROI", "DO_FENCE_ENABLE", "DO_MOTOR_TEST", "DO_GRIPPER",
    "DO_FLIGHTTERMINATION", "DO_SET_MISSION_CURRENT", "PREFLIGHT_CALIBRATION", "MISSION_START",
    "PREFLIGHT_STORAGE",
    "COMPONENT_ARM_DISARM", "RUN_PREARM_CHECKS", "GET_HOME_POSITION", "INJECT_FAILURE",
    "GET_MESSAGE_INTERVAL", "SET_MESSAGE_INTERVAL", "REQUEST_MESSAGE",
    "REQUEST_AUTOPILOT_CAPABILITIES", "SET_EKF_SOURCE_SET",
    "DO_MOUNT_CONTROL", "DO_SET_RELAY", "DO_REPEAT_SERVO", "DO_SET_CAM_TRIGG_DIST",
    "DO_DIGICAM_CONTROL", "VIDEO_START_CAPTURE", "DO_JUMP_TAG",
    "DO_GIMBAL_MANAGER_CONFIGURE", "DO_GIMBAL_MANAGER_PITCHYAW",
    "IMAGE_START_CAPTURE", "IMAGE_STOP_CAPTURE",
    "BATTERY_RESET", "DO_ACCEPT_MAG_CAL", "DO_AUX_FUNCTION",
    "DO_CANCEL_MAG_CAL", "DO_REPEAT_RELAY", "DO_SEND_BANNER", "DO_START_MAG_CAL",
}  # fmt: skip


def on_the_ground(kind: str) -> GroundStation:
    config = VehicleConfig(vehicle=kind, ready_after_s=0.5)
    station = GroundStation(Simulation([config], seed=1))
    station.run(2.0)
    return station


def forms(command: int, component: int, system: int = 1) -> list[mav.MAVLink_message]:
    """COMMAND_LONG and COMMAND_INT without anything in them."""
    empty = (0.0,) * 4
    return [
        mav.MAVLink_command_long_message(system, component, command, 0, *empty, 0.0, 0.0, 0.0),
        mav.MAVLink_command_int_message(system, component, 6, command, 0, 0, *empty, 0, 0, 0.0),
    ]


@pytest.mark.parametrize("kind", KINDS)
def test_every_command_gets_one_answer_of_the_autopilot_to_the_asker(kind: str) -> None:
    """Whatever component is addressed; a command for another system is met with silence."""
    station = on_the_ground(kind)
    assert len(COMMANDS) > 150
    for command in COMMANDS:
        for component in (0, 1, 190):
            for message in forms(command, component):
                acks = [m for m in station.send(message) if m.get_type() == "COMMAND_ACK"]
                assert [m.command for m in acks] == [command]
                assert acks[0].result in range(5)
                assert (acks[0].target_system, acks[0].target_component) == (255, 190)
                assert (acks[0].progress, acks[0].result_param2) == (0, 0)
                assert (acks[0].get_srcSystem(), acks[0].get_srcComponent()) == (1, 1)
        for message in forms(command, 1, system=7):
            assert station.send(message) == []


def test_a_reboot_is_answered_once_too() -> None:
    for message in forms(REBOOT, 1):
        acks = [m for m in on_the_ground("copter").send(message) if m.get_type() == "COMMAND_ACK"]
        assert [(m.command, m.result) for m in acks] == [(REBOOT, UNSUPPORTED)]


def test_what_is_not_known_is_unsupported_and_nothing_else_is() -> None:
    """So a command that is added has to be put into the table above, and gets a test."""
    station = on_the_ground("copter")
    answered = set()
    for command in COMMANDS:
        for message in forms(command, 1):
            acks = [m for m in station.send(message) if m.get_type() == "COMMAND_ACK"]
            if acks[0].result != UNSUPPORTED:
                answered.add(mav.enums["MAV_CMD"][command].name.removeprefix("MAV_CMD_"))
    # A failure of nothing is refused as UNSUPPORTED, too; it has tests of its own.
    assert answered == ANSWERED_BY_COPTERS - {"INJECT_FAILURE"}


@pytest.mark.parametrize("sender", [(1, 191), (42, 1), (254, 0)])
def test_anybody_is_answered_by_name(sender: tuple[int, int]) -> None:
    station = GroundStation(Simulation(seed=1), 0, *sender)
    station.run(1.5)
    (message, _) = forms(31999, 1)
    (ack,) = (m for m in station.send(message) if m.get_type() == "COMMAND_ACK")
    assert (ack.target_system, ack.target_component, ack.result) == (*sender, UNSUPPORTED)
