"""Scripted operations: every way in which one can end."""

from __future__ import annotations

import pytest

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import OperationFinished, OperationKind, OperationResult
from mavlink_vehicle.profiles.ardupilot import COPTER
from mavlink_vehicle.protocols.operations.command import Address, CommandTiming
from mavlink_vehicle.protocols.operations.operation_goals import ArmGoal, ModeGoal
from mavlink_vehicle.protocols.operations.operation_parts import (
    Goal,
    OperationInput,
    OperationState,
    OperationTiming,
)
from mavlink_vehicle.protocols.operations.operations import Operation
from mavlink_vehicle.protocols.operations.takeoff_goal import TakeoffGoal
from mavlink_vehicle.state.reducer import VehicleState, reduce
from tests.support.messages.autopilot_messages import AutopilotMessages

GUIDED, LOITER = 4, 5
SET_MODE, ARM = mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_COMPONENT_ARM_DISARM
TAKEOFF = mavlink.MAV_CMD_NAV_TAKEOFF
ACCEPTED, FAILED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_FAILED
TEMPORARILY_REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
ACHIEVED, REFUSED = OperationResult.ACHIEVED, OperationResult.REFUSED
TIMED_OUT, LINK_LOST = OperationResult.TIMED_OUT, OperationResult.LINK_LOST
CANCELLED = OperationResult.CANCELLED
ADDRESS = Address(1, 191, 1, 1)


class Script:
    """An operation, the vehicle's state, and what is said to both."""

    def __init__(
        self,
        goal: Goal | None = None,
        *,
        state: VehicleState | None = None,
        first_ack_counts: bool = True,
    ) -> None:
        self.autopilot = AutopilotMessages()
        self.now = 0.0
        self.connected = True
        self.sent: list[Message] = []
        self.state = state or VehicleState()
        if state is None:
            self.state = reduce(self.state, self.autopilot.heartbeat(), 0.0)
        self.operation = Operation(
            7,
            goal or ModeGoal("GUIDED", GUIDED, COPTER),
            ADDRESS,
            CommandTiming(timeout_s=0.5, retries=2),
            OperationTiming(timeout_s=8.0, texts_s=0.5, doubt_s=3.0),
            first_ack_counts=first_ack_counts,
        )
        self.operation.begin(self.state, self.connected, self.now)
        self._take()

    def say(self, message: Message) -> None:
        """The autopilot sends a message."""
        self.state = reduce(self.state, message, self.now)
        self.operation.receive(message, self.now)
        self.operation.observe(self.state, self.connected, self.now)
        self._take()

    def wait(self, seconds: float) -> None:
        """Time passes."""
        end_s = self.now + seconds
        while (deadline := self.operation.deadline_s) is not None and deadline <= end_s:
            self.now = deadline
            self.operation.handle_timer(self.now)
            self._take()
        self.now = end_s

    def end(self) -> OperationFinished:
        """The one event; there must be one and no second."""
        event = self.operation.next_event()
        assert event is not None
        assert self.operation.next_event() is None
        assert self.operation.deadline_s is None
        assert self.operation.finished
        assert event.operation_id == 7
        assert event.reason.endswith((".", '"'))
        return event

    def running(self) -> bool:
        assert self.operation.next_event() is None
        return not self.operation.finished

    def _take(self) -> None:
        self.sent += self.operation.messages_to_send()


def test_an_acknowledgement_alone_is_no_success() -> None:
    script = Script()
    script.say(script.autopilot.ack(SET_MODE, ACCEPTED))
    assert script.running()
    script.wait(8.0)
    end = script.end()
    assert end.result is TIMED_OUT
    assert end.reason == (
        "Mode change to GUIDED not confirmed within 8.0 s: DO_SET_MODE was ACCEPTED, but the "
        "vehicle's state does not show it."
    )
    assert len(script.sent) == 1


def test_the_state_is_success_with_or_without_an_acknowledgement() -> None:
    for acknowledged in (True, False):
        script = Script()
        if acknowledged:
            script.say(script.autopilot.ack(SET_MODE, ACCEPTED))
        script.say(script.autopilot.heartbeat(mode=GUIDED))
        assert script.end().result is ACHIEVED


def test_the_state_is_success_even_when_all_repetitions_went_unanswered() -> None:
    script = Script()
    script.wait(1.6)
    assert len(script.sent) == 3
    assert script.running()
    script.say(script.autopilot.heartbeat(mode=GUIDED))
    assert script.end().result is ACHIEVED


def test_no_answer_and_no_change_times_out() -> None:
    script = Script()
    script.wait(20.0)
    end = script.end()
    assert end.result is TIMED_OUT
    assert "DO_SET_MODE was sent 10 times and not answered" in end.reason
    assert [message.confirmation for message in script.sent] == list(range(10))


def test_a_link_that_is_down_for_a_while_only_delays_it() -> None:
    script = Script()
    script.wait(4.0)
    script.sent.clear()
    script.wait(2.0)
    assert script.sent  # it is still trying
    script.say(script.autopilot.ack(SET_MODE, ACCEPTED))
    script.sent.clear()
    script.wait(1.5)
    assert not script.sent
    script.say(script.autopilot.heartbeat(mode=GUIDED))
    assert script.end().result is ACHIEVED


def test_a_take_off_that_is_seen_is_not_commanded_again() -> None:
    script = take_off()
    script.wait(1.6)
    script.say(script.autopilot("EXTENDED_SYS_STATE", landed_state=3))
    assert len(script.sent) == 3
    script.wait(5.0)
    assert len(script.sent) == 3
    assert script.running()


def test_without_heartbeat_it_is_the_link_that_was_lost() -> None:
    script = Script()
    script.operation.observe(script.state, False, 3.0)
    script.wait(20.0)
    end = script.end()
    assert end.result is LINK_LOST
    assert end.reason.endswith("and no HEARTBEAT is received.")


def test_a_rejection_waits_for_its_reasons() -> None:
    script = Script(ArmGoal(True))
    script.say(script.autopilot("STATUSTEXT", severity=2, text="Arm: Battery failsafe"))
    script.say(script.autopilot.ack(ARM, FAILED))
    assert script.running()
    script.wait(0.2)
    script.say(script.autopilot("STATUSTEXT", severity=2, text="Arm: Need Position Estimate"))
    script.wait(0.3)
    end = script.end()
    assert end.result is REFUSED
    assert end.kind is OperationKind.ARM
    assert end.reason == (
        "Arming rejected: COMPONENT_ARM_DISARM was answered FAILED; autopilot: "
        '"Arm: Battery failsafe", "Arm: Need Position Estimate".'
    )


def test_older_texts_are_not_taken_for_reasons() -> None:
    autopilot = AutopilotMessages()
    state = reduce(VehicleState(), autopilot.heartbeat(), 0.0)
    state = reduce(state, autopilot("STATUSTEXT", severity=6, text="Mission: 6 WP"), 0.0)
    script = Script(ArmGoal(True), state=state)
    script.say(script.autopilot.ack(ARM, FAILED))
    script.wait(1.0)
    assert "Mission" not in script.end().reason


def test_a_state_that_contradicts_the_rejection_wins() -> None:
    script = Script(ArmGoal(True))
    script.say(script.autopilot.ack(ARM, FAILED))
    script.say(script.autopilot.heartbeat(armed=True))
    assert script.end().result is ACHIEVED


def test_the_rejection_of_a_repetition_is_doubted_for_longer() -> None:
    script = Script(ArmGoal(True))
    script.wait(0.6)
    script.say(script.autopilot.ack(ARM, FAILED))
    script.wait(1.0)
    assert script.running()
    script.wait(2.5)
    assert script.end().result is REFUSED


def test_the_first_of_two_answers_is_a_lie_where_the_profile_says_so() -> None:
    script = Script(first_ack_counts=False)
    script.say(script.autopilot.ack(SET_MODE, ACCEPTED))
    script.say(script.autopilot.ack(SET_MODE, TEMPORARILY_REJECTED))
    script.wait(1.0)
    end = script.end()
    assert end.result is REFUSED
    assert "DO_SET_MODE was answered TEMPORARILY_REJECTED" in end.reason


@pytest.mark.parametrize(
    "answers", [(ACCEPTED, FAILED), (FAILED, ACCEPTED)], ids=["rejected last", "accepted last"]
)
def test_elsewhere_an_acceptance_beside_a_rejection_is_waited_on(answers: tuple[int, int]) -> None:
    script = Script()
    for answer in answers:
        script.say(script.autopilot.ack(SET_MODE, answer))
    script.wait(1.0 if answers[1] == FAILED else 2.0)
    assert script.running()
    script.say(script.autopilot.heartbeat(mode=GUIDED))
    assert script.end().result is ACHIEVED


def test_in_progress_neither_ends_nor_repeats() -> None:
    script = Script()
    script.say(script.autopilot.ack(SET_MODE, mavlink.MAV_RESULT_IN_PROGRESS))
    script.wait(3.0)
    assert script.running()
    assert len(script.sent) == 1
    script.say(script.autopilot.heartbeat(mode=GUIDED))
    assert script.end().result is ACHIEVED


def test_already_so_needs_no_command() -> None:
    autopilot = AutopilotMessages()
    state = reduce(VehicleState(), autopilot.heartbeat(mode=GUIDED), 0.0)
    script = Script(state=state)
    end = script.end()
    assert end.result is ACHIEVED
    assert end.reason == "Mode change to GUIDED: nothing to do."
    assert not script.sent


def test_a_stale_state_is_not_believed() -> None:
    autopilot = AutopilotMessages()
    state = reduce(VehicleState(), autopilot.heartbeat(mode=GUIDED), 0.0)
    operation = Operation(
        1, ModeGoal("GUIDED", GUIDED, COPTER), ADDRESS, CommandTiming(), OperationTiming()
    )
    operation.begin(state, False, 50.0)
    assert len(operation.messages_to_send()) == 1
    assert operation.next_event() is None


def test_an_earlier_request_under_way_makes_heartbeats_wait() -> None:
    autopilot = AutopilotMessages()
    state = reduce(VehicleState(), autopilot.heartbeat(mode=GUIDED), 0.0)
    operation = Operation(
        1, ModeGoal("GUIDED", GUIDED, COPTER), ADDRESS, CommandTiming(), OperationTiming()
    )
    operation.begin(state, True, 0.0, settle_s=1.5)
    assert len(operation.messages_to_send()) == 1
    operation.observe(reduce(state, autopilot.heartbeat(mode=GUIDED), 1.0), True, 1.0)
    assert operation.next_event() is None
    operation.observe(reduce(state, autopilot.heartbeat(mode=GUIDED), 2.0), True, 2.0)
    event = operation.next_event()
    assert event is not None
    assert event.result is ACHIEVED


@pytest.mark.parametrize("answer", [None, ACCEPTED, FAILED])
def test_cancelled_at_any_time_it_ends_once(answer: int | None) -> None:
    script = Script()
    if answer is not None:
        script.say(script.autopilot.ack(SET_MODE, answer))
    script.operation.stop(CANCELLED, "it was abandoned", script.now)
    script.operation.stop(CANCELLED, "again", script.now)
    script.operation.stop(LINK_LOST, "the autopilot restarted", script.now)
    end = script.end()
    assert end.result is CANCELLED
    assert end.reason == "Mode change to GUIDED ended: it was abandoned."
    script.say(script.autopilot.heartbeat(mode=GUIDED))
    script.say(script.autopilot.ack(SET_MODE, ACCEPTED))
    script.wait(30.0)
    assert script.operation.next_event() is None


# Take-off


def flying_state(autopilot: AutopilotMessages, armed: bool = True) -> VehicleState:
    state = VehicleState()
    for message in (
        autopilot.heartbeat(mode=GUIDED, armed=armed),
        autopilot.position(100.0),
        autopilot("EXTENDED_SYS_STATE", landed_state=1),
    ):
        state = reduce(state, message, 0.0)
    return state


def take_off(height_m: float = 10.0, armed: bool = True) -> Script:
    state = flying_state(AutopilotMessages(), armed)
    return Script(TakeoffGoal(height_m, state, COPTER), state=state)


def test_the_command_carries_the_height_above_home() -> None:
    (message,) = take_off(12.5).sent
    assert (message.command, message.param7) == (TAKEOFF, 12.5)


def test_a_take_off_is_over_when_it_flies_high_and_slowly() -> None:
    script = take_off()
    say, autopilot = script.say, script.autopilot
    say(autopilot.ack(TAKEOFF, ACCEPTED))
    say(autopilot("EXTENDED_SYS_STATE", landed_state=3))
    say(autopilot.position(101.0, height_m=5.0, climb_m_s=2.0))
    say(autopilot.position(102.0, height_m=9.6, climb_m_s=0.4))
    assert script.running()  # it says that it still takes off
    say(autopilot("EXTENDED_SYS_STATE", landed_state=2))
    assert script.end().result is ACHIEVED


@pytest.mark.parametrize(
    ("height_m", "reached_m", "climb_m_s", "done"),
    [
        (10.0, 9.5, 0.0, True),
        (10.0, 9.4, 0.0, False),
        (10.0, 9.9, 1.0, False),
        (2.0, 1.71, 0.0, True),
        (2.0, 1.6, 0.0, False),
    ],
)
def test_how_high_is_high_enough(
    height_m: float, reached_m: float, climb_m_s: float, done: bool
) -> None:
    script = take_off(height_m)
    script.say(script.autopilot("EXTENDED_SYS_STATE", landed_state=2))
    script.say(script.autopilot.position(101.0, height_m=reached_m, climb_m_s=climb_m_s))
    assert script.operation.finished is done


def test_disarming_by_itself_ends_the_take_off() -> None:
    """As when setpoints were streamed meanwhile: acknowledged, but it stays on the ground."""
    script = take_off()
    script.say(script.autopilot.ack(TAKEOFF, ACCEPTED))
    script.say(script.autopilot("STATUSTEXT", severity=6, text="Disarming motors"))
    script.say(script.autopilot.heartbeat(mode=GUIDED, armed=False))
    end = script.end()
    assert end.result is REFUSED
    assert end.reason == (
        "Take-off to 10.0 m above the ground ended: the autopilot disarmed the motors; autopilot: "
        '"Disarming motors".'
    )


@pytest.mark.parametrize(
    "sign",
    [
        lambda a: a("EXTENDED_SYS_STATE", landed_state=3),
        lambda a: a.position(101.0, height_m=1.0, climb_m_s=1.0),
    ],
)
@pytest.mark.parametrize("first", ["sign", "refusal"])
def test_a_repetition_rejected_in_the_air_does_not_end_the_take_off(
    sign: object, first: str
) -> None:
    """The first acknowledgement was lost; the second says "already flying"."""
    script = take_off()
    shown = sign(script.autopilot)  # type: ignore[operator]
    refusal = script.autopilot.ack(TAKEOFF, FAILED)
    script.wait(0.6)
    assert len(script.sent) == 2
    for message in (shown, refusal) if first == "sign" else (refusal, shown):
        script.say(message)
        assert script.running()
    script.wait(6.0)
    assert script.running()
    script.say(script.autopilot("EXTENDED_SYS_STATE", landed_state=2))
    script.say(script.autopilot.position(110.0, height_m=10.0))
    assert script.end().result is ACHIEVED


def test_the_table_is_complete() -> None:
    """In every state but the last, everything that can come is provided for."""
    always = {OperationInput.REACHED, OperationInput.STOP}
    answers = {OperationInput.ACCEPTED, OperationInput.REFUSED, OperationInput.TIME_UP}
    expected = {
        OperationState.IDLE: always | {OperationInput.START, OperationInput.PREPARE},
        OperationState.PREPARING: always | {OperationInput.READY},
        OperationState.COMMANDING: always
        | answers
        | {OperationInput.UNANSWERED, OperationInput.CLOSED},
        OperationState.CONFIRMING: always | answers | {OperationInput.AGAIN, OperationInput.CLOSED},
        OperationState.REFUSING: always
        | answers
        | {OperationInput.UNDER_WAY, OperationInput.WAITED, OperationInput.AGAIN}
        | {OperationInput.CLOSED},
        OperationState.FINISHED: set(),
    }
    for state, inputs in expected.items():
        assert {what for at, what in Operation.table if at is state} == inputs
