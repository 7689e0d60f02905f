"""Rules of PX4 that a client must know, each scripted.

docs/autopilots.md lists the rules and the tests that hold them.
"""

from __future__ import annotations

import math

import pytest

from mavlink_vehicle.codec import Message, make, mavlink, with_source
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import (
    ArmedChanged,
    LandedState,
    ModeChanged,
    OperationFinished,
    OperationKind,
    OperationResult,
    StreamClosed,
    VehicleEvent,
)
from mavlink_vehicle.vehicle import SetpointNed, Vehicle, VehicleConfig
from tests.support.messages.autopilot_messages import AutopilotMessages
from tests.support.models.told_vehicle import ToldVehicle

LOITER, TAKEOFF, LAND, RTL = 0x03040000, 0x02040000, 0x06040000, 0x05040000
PRECLAND = 0x09040000
OFFBOARD, MISSION, POSCTL = 0x00060000, 0x04040000, 0x00030000
SET_MODE, NAV_TAKEOFF = mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_NAV_TAKEOFF
ACCEPTED, REJECTED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED
SPEED = SetpointNed(velocity_ned_m_s=(1.0, 0.0, 0.0))
GROUND_M = 488.0


class Px4(ToldVehicle):
    """A vehicle that receives the messages of a PX4."""

    def __init__(self, mode: int = LOITER, armed: bool = True, status: int = 4) -> None:
        super().__init__(VehicleConfig(message_rates_hz={}), now=100.0)
        self.say = AutopilotMessages()
        self.tell(self.beat(LOITER, False, 3), self.landed(LandedState.ON_GROUND), *self.at(0.0))
        self.tell(self.beat(mode, armed, status))
        self.sent.clear()

    def beat(self, mode: int, armed: bool = True, status: int = 4) -> Message:
        return self.say.heartbeat(mode, armed, status, mavlink.MAV_AUTOPILOT_PX4)

    def landed(self, state: LandedState) -> Message:
        return self.say("EXTENDED_SYS_STATE", landed_state=state)

    def mode(self, mode: int, intended: int | None = None) -> Message:
        intended = mode if intended is None else intended
        return self.say("CURRENT_MODE", custom_mode=mode, intended_custom_mode=intended)

    def at(
        self, height_m: float, home_m: float = GROUND_M, climb_m_s: float = 0.0
    ) -> list[Message]:
        """Where it is; home may have moved."""
        boot_ms = round(1e3 * self.now)
        alt_m = GROUND_M + height_m
        return [
            self.say(
                "GLOBAL_POSITION_INT", time_boot_ms=boot_ms, lat=473977420, lon=85455940,
                alt=round(1e3 * alt_m), relative_alt=round(1e3 * (alt_m - home_m)),
                vz=-round(100 * climb_m_s), hdg=0,
            ),
            self.say("LOCAL_POSITION_NED", time_boot_ms=boot_ms, z=0.4 - height_m),
        ]  # fmt: skip


def ends(events: list[VehicleEvent]) -> list[OperationResult]:
    return [event.result for event in events if isinstance(event, OperationFinished)]


def test_of_two_acknowledgements_only_the_second_counts() -> None:
    px4 = Px4()
    px4.vehicle.change_mode("AUTO.MISSION", px4.now)
    assert ends(px4.tell(px4.say.ack(SET_MODE, ACCEPTED), px4.say.ack(SET_MODE, REJECTED))) == []
    (end,) = [e for e in px4.wait(1.0) if isinstance(e, OperationFinished)]
    assert end.result is OperationResult.REFUSED
    assert "TEMPORARILY_REJECTED" in end.reason


def test_a_mission_start_that_is_rejected_while_the_mission_is_judged_is_asked_for_again() -> None:
    px4 = Px4()
    refused = (px4.say.ack(SET_MODE, ACCEPTED), px4.say.ack(SET_MODE, REJECTED))
    px4.vehicle.missions.start(px4.now)
    assert ends(px4.tell(*refused) + px4.wait(0.3)) == []
    assert len(px4.commands(SET_MODE)) == 2
    px4.tell(px4.say.ack(SET_MODE, ACCEPTED), px4.say.ack(SET_MODE, ACCEPTED))
    assert ends(px4.tell(px4.beat(MISSION))) == [OperationResult.ACHIEVED]


def test_a_mission_that_stays_rejected_is_rejected() -> None:
    px4 = Px4()
    px4.vehicle.missions.start(px4.now)
    results: list[OperationResult] = []
    answered = 0
    for _ in range(12):
        if len(px4.commands(SET_MODE)) > answered:
            answered = len(px4.commands(SET_MODE))
            px4.tell(px4.say.ack(SET_MODE, ACCEPTED), px4.say.ack(SET_MODE, REJECTED))
        results += ends(px4.wait(0.25))
    assert results == [OperationResult.REFUSED]
    assert answered > 2


def test_two_good_acknowledgements_are_no_success_without_the_heartbeat() -> None:
    """A main mode that does not exist is accepted twice, and nothing changes."""
    px4 = Px4()
    px4.vehicle.change_mode("AUTO.EXTERNAL1", px4.now)
    px4.tell(px4.say.ack(SET_MODE, ACCEPTED), px4.say.ack(SET_MODE, ACCEPTED))
    results: list[OperationResult] = []
    for _ in range(11):
        results += ends(px4.wait(1.0) + px4.tell(px4.beat(LOITER)))
    assert results == [OperationResult.TIMED_OUT]


ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM


def standing(mode: int, status: int) -> tuple[Px4, int]:
    """A disarmed PX4 that is asked to arm, and the operation's id."""
    px4 = Px4(mode, armed=False, status=status)
    return px4, px4.vehicle.arm(px4.now)


def test_disarmed_in_offboard_it_is_armed_in_loiter_and_one_end_is_reported() -> None:
    px4, operation_id = standing(OFFBOARD, 0)
    px4.events()
    assert (len(px4.commands(SET_MODE)), len(px4.commands(ARM))) == (1, 0)
    px4.tell(px4.say.ack(SET_MODE, ACCEPTED), px4.say.ack(SET_MODE, ACCEPTED))
    events = px4.tell(px4.beat(LOITER, False, 3))
    assert [e.requested for e in events if isinstance(e, ModeChanged)] == [True]
    assert ends(events) == []
    assert len(px4.commands(ARM)) == 1
    events = px4.tell(px4.say.ack(ARM, ACCEPTED), px4.beat(LOITER, True))
    (end,) = [e for e in events if isinstance(e, OperationFinished)]
    assert (end.operation_id, end.kind, end.result) == (
        operation_id, OperationKind.ARM, OperationResult.ACHIEVED,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("mode", "status", "left"),
    [(LOITER, 0, False), (LOITER, 3, False), (POSCTL, 3, False), (POSCTL, 0, True)],
)
def test_only_a_mode_that_it_cannot_be_armed_in_is_left(mode: int, status: int, left: bool) -> None:
    px4, _ = standing(mode, status)
    px4.events()
    assert bool(px4.commands(SET_MODE)) is left
    assert bool(px4.commands(ARM)) is not left


def test_without_the_mode_to_arm_in_it_is_not_armed() -> None:
    px4, operation_id = standing(OFFBOARD, 0)
    px4.tell(px4.say.ack(SET_MODE, ACCEPTED), px4.say.ack(SET_MODE, REJECTED))
    (end,) = [e for e in px4.wait(1.0) if isinstance(e, OperationFinished)]
    assert (end.operation_id, end.kind, end.result) == (
        operation_id, OperationKind.ARM, OperationResult.REFUSED,
    )  # fmt: skip
    assert "AUTO.LOITER" in end.reason
    assert px4.commands(ARM) == []


def test_a_pilot_who_chooses_a_mode_meanwhile_is_not_armed() -> None:
    px4, _ = standing(OFFBOARD, 0)
    assert ends(px4.tell(px4.beat(POSCTL, False, 3))) == [OperationResult.CANCELLED]
    assert ends(px4.wait(3.0)) == []
    assert px4.commands(ARM) == []


def test_a_selected_mode_that_cannot_run_is_not_control() -> None:
    """Landed, it goes back to OFFBOARD, with system_status 0."""
    px4 = Px4(OFFBOARD, armed=False, status=0)
    assert px4.vehicle.mode_name == "OFFBOARD"
    assert not px4.vehicle.in_control_mode
    px4.tell(px4.beat(OFFBOARD, False, 3))
    assert px4.vehicle.in_control_mode


@pytest.mark.parametrize("mode", [LAND, PRECLAND, RTL])
def test_the_earlier_mode_after_a_landing_is_no_intervention(mode: int) -> None:
    """Each is a landing of its own: v1.17 shows AUTO.LOITER with the disarming."""
    px4 = Px4(mode)
    events = px4.tell(px4.beat(LOITER, armed=False))
    assert [e.requested for e in events if isinstance(e, ModeChanged)] == [True]


def test_current_mode_shows_a_mode_before_the_heartbeat() -> None:
    px4 = Px4()
    (change,) = px4.tell(px4.mode(RTL))
    assert change == ModeChanged(LOITER, RTL, "AUTO.RTL", requested=False)
    assert px4.tell(px4.beat(RTL)) == []


def test_a_late_current_mode_is_no_intervention() -> None:
    px4 = Px4()
    old = px4.mode(LOITER)
    px4.tell(px4.beat(RTL))
    assert px4.tell(old) == []
    assert px4.vehicle.mode_name == "AUTO.RTL"


def test_a_heartbeat_that_a_current_mode_overtook_still_shows_life_and_arming() -> None:
    px4 = Px4()
    overtaken = px4.beat(LOITER, armed=False)
    px4.tell(px4.mode(RTL))
    px4.now += 0.2
    assert px4.tell(overtaken) == [ArmedChanged(False, requested=False)]
    assert px4.vehicle.mode_name == "AUTO.RTL"
    assert px4.vehicle.state.last_heartbeat_s == px4.now


def test_a_take_off_goes_through_its_own_modes_and_is_judged_without_home() -> None:
    """Home moves by metres in flight; relative altitude with it."""
    px4 = Px4()
    px4.vehicle.take_off(10.0, px4.now)
    events = px4.tell(px4.say.ack(NAV_TAKEOFF, ACCEPTED), px4.beat(TAKEOFF))
    assert events == [ModeChanged(LOITER, TAKEOFF, "AUTO.TAKEOFF", requested=True)]
    (command,) = px4.commands(NAV_TAKEOFF)
    assert command.param7 == GROUND_M + 10.0
    px4.now += 5.0
    # 6 m up, though relative altitude says 11.
    rising = (px4.landed(LandedState.IN_AIR), *px4.at(6.0, GROUND_M - 5.0, 0.2))
    assert ends(px4.tell(*rising)) == []
    px4.now += 5.0
    # 9.8 m up, though relative altitude says 7.
    assert ends(px4.tell(*px4.at(9.8, GROUND_M + 2.8, 0.2))) == [OperationResult.ACHIEVED]
    # AUTO.LOITER then comes by itself.
    (change,) = px4.tell(px4.beat(LOITER))
    assert change == ModeChanged(TAKEOFF, LOITER, "AUTO.LOITER", requested=True)


def test_a_take_off_that_is_over_by_the_firmwares_own_measure_is_achieved() -> None:
    """AUTO.LOITER is entered within 0.8 m of the height."""
    px4 = Px4(TAKEOFF)
    px4.vehicle.take_off(10.0, px4.now)
    px4.tell(px4.landed(LandedState.IN_AIR), *px4.at(9.25, climb_m_s=0.3))
    events = px4.tell(px4.beat(LOITER))
    assert ends(events) == [OperationResult.ACHIEVED]
    assert not any(isinstance(e, ModeChanged) and not e.requested for e in events)


def test_a_pilots_hold_in_the_middle_of_a_take_off_ends_it() -> None:
    px4 = Px4(TAKEOFF)
    px4.vehicle.take_off(10.0, px4.now)
    px4.tell(px4.landed(LandedState.IN_AIR), *px4.at(3.0, climb_m_s=1.0))
    events = px4.tell(px4.beat(LOITER))
    assert ends(events) == [OperationResult.CANCELLED]
    assert [e.requested for e in events if isinstance(e, ModeChanged)] == [False]


def test_a_take_off_that_is_not_flown_ends_with_the_disarming() -> None:
    """Even "Already higher than takeoff altitude" is acknowledged as ACCEPTED."""
    px4 = Px4()
    px4.vehicle.take_off(10.0, px4.now)
    px4.tell(px4.say.ack(NAV_TAKEOFF, ACCEPTED), px4.beat(TAKEOFF))
    px4.now += 10.0
    assert ends(px4.tell(px4.beat(TAKEOFF, False, 3))) == [OperationResult.REFUSED]


def test_standing_in_loiter_is_no_finished_take_off() -> None:
    px4 = Px4()
    px4.vehicle.take_off(1.0, px4.now)
    assert ends(px4.events()) == []
    assert px4.commands(NAV_TAKEOFF)


@pytest.mark.parametrize("landing", [LAND, RTL])
def test_the_mode_that_comes_back_after_landing_is_nobodys_choice(landing: int) -> None:
    px4 = Px4(landing)
    px4.tell(px4.landed(LandedState.ON_GROUND))
    assert px4.tell(px4.mode(OFFBOARD)) == [
        ModeChanged(landing, OFFBOARD, "OFFBOARD", requested=True)
    ]
    events = px4.tell(px4.beat(OFFBOARD, False, 0))
    assert ArmedChanged(armed=False, requested=False) in events


def test_a_mode_chosen_in_the_middle_of_a_landing_is_somebodys_choice() -> None:
    px4 = Px4(LAND)
    px4.tell(px4.landed(LandedState.LANDING))
    (change,) = px4.tell(px4.mode(LOITER))
    assert isinstance(change, ModeChanged)
    assert not change.requested


def test_a_flapping_landed_state_changes_neither_mode_nor_arming() -> None:
    px4 = Px4(RTL)
    states = (
        LandedState.LANDING,
        LandedState.ON_GROUND,
        LandedState.LANDING,
        LandedState.ON_GROUND,
    )
    px4.tell(*(px4.landed(state) for state in states))
    assert px4.vehicle.state.armed
    assert px4.vehicle.mode_name == "AUTO.RTL"


def test_the_ground_is_remembered_only_while_it_stands_there_disarmed() -> None:
    px4 = Px4()
    assert px4.vehicle.state.ground_altitude_amsl_m == GROUND_M
    assert px4.vehicle.state.ground_down_m == pytest.approx(0.4)
    px4.now += 1.0
    px4.tell(*px4.at(5.0))
    assert px4.vehicle.state.ground_altitude_amsl_m == GROUND_M
    px4.tell(px4.beat(LOITER, False, 3))
    px4.now += 1.0
    px4.tell(*px4.at(-3.0))
    assert px4.vehicle.state.ground_altitude_amsl_m == GROUND_M, "the next HEARTBEAT may deny it"
    px4.now += 1.0
    px4.tell(*px4.at(-3.0))
    assert px4.vehicle.state.ground_altitude_amsl_m == GROUND_M - 3.0


def test_a_stream_whose_control_was_taken_never_starts_again() -> None:
    """PX4 would take a new stream as the reason to go back to OFFBOARD."""
    px4 = Px4(OFFBOARD)
    px4.vehicle.setpoints.open(px4.now)
    px4.vehicle.send_setpoint(SPEED, px4.now)
    events = px4.tell(px4.mode(RTL, OFFBOARD))
    assert any(isinstance(event, StreamClosed) for event in events)
    px4.tell(px4.beat(OFFBOARD))
    with pytest.raises(SetpointError, match="closed"):
        px4.vehicle.send_setpoint(SPEED, px4.now)


def test_the_stream_runs_on_until_our_own_hold_is_shown() -> None:
    px4 = Px4(OFFBOARD)
    px4.vehicle.setpoints.open(px4.now)
    px4.vehicle.hold(px4.now)
    px4.vehicle.send_setpoint(SPEED, px4.now)
    px4.tell(px4.say.ack(SET_MODE, ACCEPTED), px4.say.ack(SET_MODE, ACCEPTED))
    px4.vehicle.send_setpoint(SPEED, px4.now)
    events = px4.tell(px4.mode(LOITER))
    assert ends(events) == [OperationResult.ACHIEVED]
    assert StreamClosed("control was released for AUTO.LOITER") in events


def test_somebody_elses_mode_while_the_stream_runs_ahead_closes_it() -> None:
    px4 = Px4()
    px4.vehicle.setpoints.open(px4.now)
    px4.vehicle.send_setpoint(SPEED, px4.now)
    px4.tell(px4.beat(RTL))
    assert not px4.vehicle.setpoints.is_open


def test_no_setpoint_goes_to_a_disarmed_px4() -> None:
    px4 = Px4(armed=False, status=3)
    px4.vehicle.setpoints.open(px4.now)
    with pytest.raises(SetpointError, match="disarmed"):
        px4.vehicle.send_setpoint(SPEED, px4.now)
    px4.vehicle.take_control(px4.now)
    (end,) = [e for e in px4.events() if isinstance(e, OperationFinished)]
    assert end.reason == "PX4 multicopter is disarmed; arm it before OFFBOARD is entered."


def test_its_gimbal_commands_and_its_requests_are_not_for_us() -> None:
    """COMMAND_LONG 1000 and 1001 with target component 0, repeated; TIMESYNC; PING."""
    px4 = Px4()
    state = px4.vehicle.state
    for confirmation in range(4):
        px4.tell(
            px4.say(
                "COMMAND_LONG", target_system=1, command=1000 + confirmation % 2,
                confirmation=confirmation,
            ),
            px4.say("TIMESYNC", tc1=0, ts1=5),
            px4.say("PING", seq=confirmation),
        )  # fmt: skip
    assert px4.vehicle.state is state
    px4.wait(2.0)
    quiet = {
        "HEARTBEAT", "COMMAND_LONG", "PARAM_REQUEST_READ", "TIMESYNC", "MISSION_REQUEST_LIST",
    }  # fmt: skip
    assert {message.get_type() for message in px4.sent} <= quiet
    # TIMESYNC is our own question, not an answer: it carries no time of the peer's.
    assert all(message.tc1 == 0 for message in px4.sent if message.get_type() == "TIMESYNC")
    assert {m.command for m in px4.sent if m.get_type() == "COMMAND_LONG"} <= {512}


def test_heartbeats_that_it_forwards_are_not_its_own() -> None:
    px4 = Px4()
    state = px4.vehicle.state
    for system, component in ((255, 190), (1, 191), (1, 154), (1, 100)):
        beat = make("HEARTBEAT", type=6, autopilot=8, base_mode=192, custom_mode=4)
        px4.tell(with_source(beat, system, component))
    assert px4.vehicle.state is state


def test_a_repeated_item_reached_changes_nothing() -> None:
    """It comes ten times, and from rovers and planes in GUIDED, too."""
    px4 = Px4()
    state = px4.vehicle.state
    for _ in range(10):
        assert px4.tell(px4.say("MISSION_ITEM_REACHED", seq=0)) == []
    assert px4.vehicle.state is state


def test_a_ready_px4_is_known_by_the_health_bit_that_it_does_not_list_as_present() -> None:
    px4 = Px4()
    px4.tell(px4.say("SYS_STATUS", onboard_control_sensors_health=0x10000000))
    assert px4.vehicle.state.prearm_ok is True
    px4.tell(px4.say("SYS_STATUS", onboard_control_sensors_health=0x20))
    assert px4.vehicle.state.prearm_ok is False


def test_our_heartbeat_goes_out_as_a_ground_stations() -> None:
    px4 = Px4()
    px4.wait(2.0)
    types = [m.type for m in px4.sent if m.get_type() == "HEARTBEAT"]
    assert set(types) == {mavlink.MAV_TYPE_GCS}


def test_a_configured_heartbeat_type_wins() -> None:
    kind = mavlink.MAV_TYPE_ONBOARD_CONTROLLER
    vehicle = Vehicle(VehicleConfig(message_rates_hz={}, heartbeat_type=kind))
    vehicle.start(0.0)
    say = AutopilotMessages()
    vehicle.receive(say.heartbeat(autopilot=mavlink.MAV_AUTOPILOT_PX4), 0.5)
    vehicle.handle_timer(1.0)
    beats = [m for m in vehicle.messages_to_send() if m.get_type() == "HEARTBEAT"]
    assert {beat.type for beat in beats} == {kind}


def test_a_place_is_never_not_a_number_where_a_setpoint_goes() -> None:
    px4 = Px4(OFFBOARD)
    px4.vehicle.setpoints.open(px4.now)
    with pytest.raises(SetpointError, match="finite"):
        px4.vehicle.send_setpoint(SetpointNed((math.nan, 0.0, 0.0)), px4.now)
    with pytest.raises(SetpointError, match="neither position"):
        px4.vehicle.send_setpoint(SetpointNed(yaw_ned_rad=0.0), px4.now)
