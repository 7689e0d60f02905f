"""The composed vehicle, scripted: behaviour that only shows in the composition."""

from __future__ import annotations

import dataclasses

import pytest

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.errors import MessageError, SetpointError, SettingError
from mavlink_vehicle.events import (
    ArmedChanged,
    FailsafeBegan,
    FailsafeKind,
    LandedChanged,
    LandedState,
    ModeChanged,
    OperationFinished,
    OperationResult,
    StatusTextReceived,
    StreamClosed,
    SystemStatusChanged,
    VehicleDiscovered,
    VehicleRebooted,
)
from mavlink_vehicle.profiles.ardupilot import COPTER
from mavlink_vehicle.vehicle import SetpointNed, Vehicle, VehicleConfig
from tests.support.messages.autopilot_messages import AutopilotMessages
from tests.support.models.told_vehicle import ToldVehicle

GUIDED, LOITER, BRAKE, RTL = 4, 5, 17, 6
SET_MODE, ARM = mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_COMPONENT_ARM_DISARM
ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
QUIET = VehicleConfig(message_rates_hz={})


class Script(ToldVehicle):
    """A vehicle that receives the messages of an autopilot."""

    def __init__(self, config: VehicleConfig = QUIET) -> None:
        super().__init__(config)
        self.autopilot = AutopilotMessages()


@pytest.fixture
def script() -> Script:
    script = Script()
    script.tell(script.autopilot.heartbeat(mode=LOITER))
    script.sent.clear()
    return script


def test_before_anyone_is_heard_it_only_beats() -> None:
    script = Script()
    script.wait(5.0)
    assert {m.get_type() for m in script.sent} == {"HEARTBEAT"}
    assert len(script.sent) == 6
    header = script.sent[0].get_header()
    assert (header.srcSystem, header.srcComponent) == (1, 191)
    assert script.vehicle.mode_name == ""
    assert not script.vehicle.heartbeats.alive
    assert not script.vehicle.in_control_mode


def test_it_takes_the_vehicles_own_system_id() -> None:
    script = Script()
    script.autopilot = AutopilotMessages(system_id=42)
    (found,) = script.tell(script.autopilot.heartbeat(mode=GUIDED))
    assert found == VehicleDiscovered(42, 1, 3, 2, "ArduCopter")
    script.wait(1.0)
    for message in script.sent[1:]:
        assert message.get_srcSystem() == 42
        if message.get_type() == "COMMAND_LONG":
            assert message.target_system == 42
    assert script.vehicle.in_control_mode


def test_a_configured_source_and_target_are_kept() -> None:
    script = Script(dataclasses.replace(QUIET, source_system=245, target_system=7))
    assert not script.tell(AutopilotMessages(1, 1).heartbeat())
    assert script.tell(AutopilotMessages(7, 1).heartbeat())
    assert script.vehicle.state.system_id == 7
    assert {message.get_srcSystem() for message in script.sent} == {245}


def test_events_tell_what_changed(script: Script) -> None:
    autopilot = script.autopilot
    assert script.tell(autopilot.heartbeat(mode=LOITER)) == []
    assert script.tell(autopilot.heartbeat(mode=RTL, armed=True, status=5)) == [
        ArmedChanged(armed=True, requested=False),
        ModeChanged(LOITER, RTL, "RTL", requested=False),
        SystemStatusChanged(3, 5),
    ]
    assert script.tell(autopilot("EXTENDED_SYS_STATE", landed_state=2)) == [
        LandedChanged(LandedState.UNDEFINED, LandedState.IN_AIR)
    ]
    assert script.tell(autopilot("STATUSTEXT", severity=4, text="Battery Failsafe")) == [
        StatusTextReceived("Battery Failsafe", 4),
        FailsafeBegan(FailsafeKind.BATTERY, "Battery Failsafe"),
    ]


def test_two_changes_in_the_same_instant_are_both_reported(script: Script) -> None:
    beats = [script.autopilot.heartbeat(mode=mode) for mode in (RTL, LOITER)]
    changes = script.tell(*beats)
    assert [(e.name, e.requested) for e in changes if isinstance(e, ModeChanged)] == [
        ("RTL", False),
        ("LOITER", False),
    ]


def test_a_late_heartbeat_is_no_intervention(script: Script) -> None:
    old = script.autopilot.heartbeat(mode=LOITER)
    operation = script.vehicle.change_mode("GUIDED", 0.0)
    events = script.tell(script.autopilot.heartbeat(mode=GUIDED))
    assert events[0] == ModeChanged(LOITER, GUIDED, "GUIDED", requested=True)
    assert isinstance(events[1], OperationFinished)
    assert events[1].operation_id == operation
    assert script.tell(old) == []
    assert script.vehicle.mode_name == "GUIDED"


def test_a_third_mode_ends_the_mode_change_and_its_repetitions(script: Script) -> None:
    script.vehicle.change_mode("GUIDED", 0.0)
    events = script.tell(script.autopilot.heartbeat(mode=RTL))
    assert isinstance(events[0], ModeChanged)
    assert not events[0].requested
    assert isinstance(events[1], OperationFinished)
    assert events[1].result is OperationResult.CANCELLED
    assert "switched to RTL meanwhile" in events[1].reason
    script.sent.clear()
    script.wait(5.0)
    assert not script.commands(SET_MODE)


def test_a_request_of_ours_that_shows_late_is_not_a_third_mode(script: Script) -> None:
    script.vehicle.change_mode("BRAKE", 0.0)
    script.events()
    script.vehicle.change_mode("GUIDED", 0.1)
    script.events()
    assert script.tell(script.autopilot.heartbeat(mode=BRAKE)) == [
        ModeChanged(LOITER, BRAKE, "BRAKE", requested=True)
    ]
    events = script.tell(script.autopilot.heartbeat(mode=GUIDED))
    assert events[0] == ModeChanged(BRAKE, GUIDED, "GUIDED", requested=True)
    assert isinstance(events[1], OperationFinished)
    assert events[1].result is OperationResult.ACHIEVED


def test_one_operation_at_a_time(script: Script) -> None:
    first = script.vehicle.change_mode("GUIDED", 0.0)
    second = script.vehicle.arm(0.0)
    assert script.vehicle.operations.operation_id == second
    (end,) = script.events()
    assert isinstance(end, OperationFinished)
    assert (end.operation_id, end.result) == (first, OperationResult.CANCELLED)
    assert end.reason.endswith("ended: arming was requested instead.")
    script.vehicle.operations.abandon(0.0)
    script.vehicle.operations.abandon(0.0)
    assert len(script.events()) == 1
    assert script.vehicle.operations.operation_id is None


def test_a_restart_ends_the_operation_and_closes_the_stream() -> None:
    script = Script()
    autopilot = script.autopilot
    script.tell(autopilot.heartbeat(mode=GUIDED, armed=True), autopilot.position(100.0))
    script.vehicle.setpoints.open(0.0)
    script.vehicle.change_mode("RTL", 0.0)
    script.events()
    script.wait(1.5)
    script.events()
    time = {"time_boot_ms": 2000}
    events = script.tell(autopilot("SYSTEM_TIME", **time), autopilot("ATTITUDE", **time))
    assert [type(event) for event in events] == [VehicleRebooted, StreamClosed, OperationFinished]
    assert isinstance(events[2], OperationFinished)
    assert events[2].result is OperationResult.LINK_LOST
    assert "restarted" in events[2].reason
    assert not script.vehicle.setpoints.is_open


def test_a_booting_autopilot_is_asked_for_its_rates_again() -> None:
    script = Script(dataclasses.replace(QUIET, message_rates_hz={"ATTITUDE": 10.0}))
    autopilot = script.autopilot
    ask = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
    script.tell(autopilot.heartbeat(status=3))
    script.tell(autopilot.ack(ask, ACCEPTED))
    assert len(script.commands(ask)) == 1
    script.tell(*[autopilot.heartbeat(status=mavlink.MAV_STATE_BOOT) for _ in range(2)])
    assert len(script.commands(ask)) == 2


@pytest.mark.parametrize(("mode", "closed"), [(LOITER, True), (GUIDED, False)])
def test_only_leaving_the_control_mode_closes_the_stream(mode: int, closed: bool) -> None:
    script = Script()
    script.tell(script.autopilot.heartbeat(mode=GUIDED, armed=True))
    script.vehicle.setpoints.open(0.0)
    events = script.tell(script.autopilot.heartbeat(mode=mode, armed=True))
    assert any(isinstance(event, StreamClosed) for event in events) is closed
    assert script.vehicle.setpoints.is_open is not closed


def test_disarming_closes_the_stream_for_good() -> None:
    script = Script()
    setpoint = SetpointNed(velocity_ned_m_s=(1.0, 0.0, 0.0))
    script.tell(script.autopilot.heartbeat(mode=GUIDED, armed=True))
    script.vehicle.setpoints.open(0.0)
    script.vehicle.send_setpoint(setpoint, 0.0)
    script.tell(script.autopilot.heartbeat(mode=GUIDED, armed=False))
    script.tell(script.autopilot.heartbeat(mode=GUIDED, armed=True))  # somebody arms it again
    with pytest.raises(SetpointError, match="closed"):
        script.vehicle.send_setpoint(setpoint, 0.0)


def test_setpoints_need_a_vehicle() -> None:
    script = Script()
    script.vehicle.setpoints.open(0.0)
    with pytest.raises(SetpointError, match="No vehicle has been detected"):
        script.vehicle.send_setpoint(SetpointNed(position_ned_m=(0.0, 0.0, -1.0)), 0.0)


def test_a_profile_may_want_the_stream_before_its_mode(script: Script) -> None:
    """As PX4 does: it enters OFFBOARD only with a stream running."""
    script.vehicle.profile = dataclasses.replace(
        COPTER,
        setpoints=dataclasses.replace(
            COPTER.setpoints, outside_control_mode=True, while_disarmed=True
        ),
    )
    script.vehicle.setpoints.open(0.0)
    script.vehicle.send_setpoint(SetpointNed(position_ned_m=(0.0, 0.0, -1.0)), 0.0)
    assert [m.get_type() for m in script.vehicle.messages_to_send()].count(
        "SET_POSITION_TARGET_LOCAL_NED"
    ) == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"target_system": 256}, "target_system is 256; it must be 0 to 255"),
        ({"source_system": 0}, "source_system is 0; it must be 1 to 255"),
        ({"source_component": 0}, "source_component"),
        ({"heartbeat_timeout_s": 0.0}, "heartbeat_timeout_s must be a positive"),
        ({"command_timeout_s": float("nan")}, "command_timeout_s"),
        ({"command_retries": -1}, "command_retries"),
        ({"message_rates_hz": {"ATTITUDE": -1.0}}, "between 0"),
        ({"message_rates_hz": {"ATTITUDE": float("nan")}}, "between 0"),
    ],
)
def test_settings_without_sense_are_rejected(changes: dict[str, object], words: str) -> None:
    with pytest.raises(SettingError, match=words):
        VehicleConfig(**changes)  # type: ignore[arg-type]


def test_an_unknown_telemetry_name_is_rejected() -> None:
    with pytest.raises(MessageError, match="no MAVLink message 'ALTITUDES'"):
        Vehicle(VehicleConfig(message_rates_hz={"ALTITUDES": 1.0}))


def test_a_motor_test_is_an_arming_that_nobody_asked_for(script: Script) -> None:
    """DO_MOTOR_TEST makes an ArduPilot's HEARTBEAT say armed while it lasts."""
    (event,) = script.tell(script.autopilot.heartbeat(mode=LOITER, armed=True))
    assert event == ArmedChanged(armed=True, requested=False)


def test_armed_is_not_derived_from_the_system_status(script: Script) -> None:
    """A rover is ACTIVE when disarmed in GUIDED, and STANDBY when armed in HOLD."""
    script.tell(script.autopilot.heartbeat(mode=LOITER, armed=False, status=4))
    assert not script.vehicle.state.armed
    script.tell(script.autopilot.heartbeat(mode=LOITER, armed=True, status=3))
    assert script.vehicle.state.armed


def test_an_item_reached_in_guided_is_no_mission(script: Script) -> None:
    """Rovers and planes send MISSION_ITEM_REACHED 0 when they come to a GUIDED place."""
    state = script.vehicle.state
    assert script.tell(script.autopilot("MISSION_ITEM_REACHED", seq=0)) == []
    assert script.vehicle.state is state
