from __future__ import annotations

import pytest

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.errors import ProtocolError
from mavlink_vehicle.protocols.operations.command import (
    Address,
    CommandExchange,
    CommandFinished,
    CommandInput,
    CommandRequest,
    CommandState,
    CommandTiming,
    command_name,
    result_name,
)
from tests.support.messages.autopilot_messages import AutopilotMessages

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
ACCEPTED, FAILED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_FAILED
IN_PROGRESS = mavlink.MAV_RESULT_IN_PROGRESS
TEMPORARILY_REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
TIMING = CommandTiming(timeout_s=0.5, retries=3, progress_timeout_s=2.0, limit_s=10.0)
ADDRESS = Address(source_system=1, source_component=191, target_system=1, target_component=1)


@pytest.fixture
def command() -> CommandExchange:
    command = CommandExchange(CommandRequest(ARM, (1.0,)), ADDRESS, TIMING)
    command.start(10.0)
    return command


@pytest.fixture
def autopilot() -> AutopilotMessages:
    return AutopilotMessages()


def sent(command: CommandExchange) -> list[Message]:
    return command.messages_to_send()


def test_it_is_sent_at_once_to_the_autopilot(command: CommandExchange) -> None:
    (message,) = sent(command)
    assert message.get_type() == "COMMAND_LONG"
    assert (message.target_system, message.target_component) == (1, 1)
    assert (message.command, message.param1, message.param7) == (ARM, 1.0, 0.0)
    assert message.confirmation == 0
    assert command.deadline_s == 10.5


def test_command_int_keeps_its_frame() -> None:
    request = CommandRequest(
        mavlink.MAV_CMD_DO_REPOSITION, (-1.0, 1.0, 0.0, 0.5, 473977420, 85455940, 12.5), frame=6
    )
    message = request.message(ADDRESS, confirmation=2)
    assert message.get_type() == "COMMAND_INT"
    assert (message.frame, message.x, message.y, message.z) == (6, 473977420, 85455940, 12.5)


@pytest.mark.parametrize("result", [ACCEPTED, FAILED, TEMPORARILY_REJECTED])
def test_an_answer_ends_it_and_doubles_are_ignored(
    command: CommandExchange, autopilot: AutopilotMessages, result: int
) -> None:
    command.receive(autopilot.ack(ARM, result), 10.1)
    command.receive(autopilot.ack(ARM, FAILED), 10.2)
    command.receive(autopilot.ack(ARM, IN_PROGRESS), 10.2)
    assert command.next_event() == CommandFinished(result, attempts=1)
    assert command.next_event() is None
    assert command.deadline_s is None


def test_it_is_repeated_with_a_rising_confirmation_and_then_given_up(
    command: CommandExchange,
) -> None:
    now, messages = 10.0, sent(command)
    while (deadline := command.deadline_s) is not None:
        assert deadline == pytest.approx(now + 0.5)
        now = deadline
        command.handle_timer(now - 0.01)  # too early: nothing happens
        command.handle_timer(now)
        messages += sent(command)
    assert [message.confirmation for message in messages] == [0, 1, 2, 3]
    assert command.next_event() == CommandFinished(None, attempts=4)
    assert command.next_event() is None
    assert now == pytest.approx(12.0)


def test_in_progress_extends_the_time_without_repeating(
    command: CommandExchange, autopilot: AutopilotMessages
) -> None:
    sent(command)
    for now in (10.2, 12.0, 13.9):
        command.receive(autopilot.ack(ARM, IN_PROGRESS), now)
        command.handle_timer(now + 1.0)
        assert not sent(command)
    command.receive(autopilot.ack(ARM, ACCEPTED), 15.0)
    assert command.next_event() == CommandFinished(ACCEPTED, attempts=1)


def test_silence_after_in_progress_asks_again(
    command: CommandExchange, autopilot: AutopilotMessages
) -> None:
    sent(command)
    command.receive(autopilot.ack(ARM, IN_PROGRESS), 10.2)
    command.handle_timer(12.2)
    (message,) = sent(command)
    assert message.confirmation == 1


def test_endless_progress_ends(command: CommandExchange, autopilot: AutopilotMessages) -> None:
    now = 10.0
    while command.state is not CommandState.FINISHED:
        now += 0.5
        assert now < 30.0
        command.receive(autopilot.ack(ARM, IN_PROGRESS), now)
        command.handle_timer(now)
    assert command.next_event() == CommandFinished(None, attempts=1)
    assert now == pytest.approx(20.0)


def test_acks_for_others_and_of_others_are_ignored(
    command: CommandExchange, autopilot: AutopilotMessages
) -> None:
    for message in (
        autopilot.ack(ARM, FAILED, target=(255, 190)),
        autopilot.ack(ARM, FAILED, target=(1, 195)),
        autopilot.ack(mavlink.MAV_CMD_DO_SET_MODE, FAILED),
        AutopilotMessages(2, 1).ack(ARM, FAILED),
        AutopilotMessages(1, 154).ack(ARM, FAILED),
        autopilot.heartbeat(),
    ):
        command.receive(message, 10.1)
    assert command.next_event() is None
    command.receive(autopilot.ack(ARM, ACCEPTED, target=(0, 0)), 10.2)  # an older firmware
    assert command.next_event() == CommandFinished(ACCEPTED, attempts=1)


def test_a_cancelled_command_is_silent(
    command: CommandExchange, autopilot: AutopilotMessages
) -> None:
    command.cancel(10.1)
    command.handle_timer(20.0)
    command.receive(autopilot.ack(ARM, ACCEPTED), 20.0)
    assert not sent(command)
    assert command.next_event() is None


def test_starting_twice_is_a_mistake_of_the_caller(command: CommandExchange) -> None:
    with pytest.raises(ProtocolError, match="no transition for START in WAITING"):
        command.start(11.0)


def test_the_table_knows_every_state_and_nothing_leaves_the_end() -> None:
    states = {state for state, _ in CommandExchange.table} | {
        state for state, _ in CommandExchange.table.values()
    }
    assert states == set(CommandState)
    for (state, _), (after, action) in CommandExchange.table.items():
        if state is CommandState.FINISHED:
            assert after is CommandState.FINISHED
            assert action is None
    assert {what for _, what in CommandExchange.table} == set(CommandInput)


def test_names_for_people() -> None:
    assert command_name(mavlink.MAV_CMD_NAV_TAKEOFF) == "NAV_TAKEOFF"
    assert command_name(31999) == "MAV_CMD 31999"
    assert result_name(mavlink.MAV_RESULT_DENIED) == "DENIED"
    assert result_name(77) == "MAV_RESULT 77"
