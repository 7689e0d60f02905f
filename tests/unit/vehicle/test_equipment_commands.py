"""Commands for cameras, gimbals and outputs: their order, their answers and their loss."""

from __future__ import annotations

from mavlink_vehicle.codec import Message, make, mavlink, with_source
from mavlink_vehicle.events import EquipmentAnswered
from mavlink_vehicle.profiles import ardupilot, px4
from mavlink_vehicle.profiles.equipment import EquipmentCommand
from mavlink_vehicle.protocols.equipment.equipment_commands import EquipmentCommands
from mavlink_vehicle.protocols.operations.command import Address, CommandTiming
from mavlink_vehicle.state.vehicle_state import VehicleState

RULES = px4.COPTER.equipment
ADDRESS = Address(1, 191, 1, 1)
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3


def service() -> EquipmentCommands:
    return EquipmentCommands(lambda: ADDRESS, CommandTiming())


def sent(equipment: EquipmentCommands) -> list[int]:
    return [getattr(message, "command", 0) for message in equipment.messages_to_send()]


def answer(
    equipment: EquipmentCommands, command: int, result: int, now: float = 0.1, sender: int = 1
) -> None:
    ack: Message = make("COMMAND_ACK", command=command, result=result)
    with_source(ack, 1, sender)
    equipment.receive(ack, now)


def failure_of(equipment: EquipmentCommands, number: int) -> str:
    event = equipment.next_event()
    assert isinstance(event, EquipmentAnswered)
    assert event.number == number
    assert equipment.next_event() is None, "one request, one answer"
    return event.failure


def test_commands_go_out_one_after_the_other_and_the_last_answer_counts() -> None:
    equipment = service()
    point = RULES.point_angle(-30.0, 10.0, locked=False)
    equipment.send(7, [RULES.control_gimbal(1, 191), point], 0.0)
    assert sent(equipment) == [mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE]
    answer(equipment, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, DENIED)
    assert equipment.next_event() is None
    assert sent(equipment) == [mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW]
    answer(equipment, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, ACCEPTED)
    assert failure_of(equipment, 7) == ""
    assert equipment.deadline_s is None


def test_a_photo_is_asked_of_a_camera_that_is_a_component_of_its_own() -> None:
    for kind, component in ((mavlink.MAV_TYPE_GIMBAL, 1), (mavlink.MAV_TYPE_CAMERA, 100)):
        equipment = service()
        beat: Message = make(
            "HEARTBEAT", type=kind, autopilot=8, base_mode=0, custom_mode=0, system_status=4
        )
        equipment.receive(with_source(beat, 1, 100), 0.0)
        equipment.send(4, [RULES.photo(1)], 0.0)
        (message,) = equipment.messages_to_send()
        assert isinstance(message, mavlink.MAVLink_command_long_message)
        assert message.target_component == component
        answer(equipment, mavlink.MAV_CMD_IMAGE_START_CAPTURE, ACCEPTED, sender=component)
        assert failure_of(equipment, 4) == ""
        equipment.send(5, [RULES.trigger_distance(5.0)], 0.0)
        (message,) = equipment.messages_to_send()
        assert isinstance(message, mavlink.MAVLink_command_long_message)
        assert message.target_component == 1, "its trigger is the autopilot's"


def test_a_lost_command_is_repeated_with_the_number_of_its_photo() -> None:
    equipment = service()
    equipment.send(3, [RULES.photo(3)], 0.0)
    (first,) = equipment.messages_to_send()
    equipment.handle_timer(0.6)
    (second,) = equipment.messages_to_send()
    assert isinstance(first, mavlink.MAVLink_command_long_message)
    assert isinstance(second, mavlink.MAVLink_command_long_message)
    assert (first.param4, second.param4) == (3.0, 3.0), "no second photo is taken"
    answer(equipment, mavlink.MAV_CMD_IMAGE_START_CAPTURE, ACCEPTED, 0.7)
    assert failure_of(equipment, 3) == ""


def test_an_older_firmware_gets_its_own_command() -> None:
    equipment = service()
    equipment.send(1, [RULES.photo(1)], 0.0)
    equipment.messages_to_send()
    answer(equipment, mavlink.MAV_CMD_IMAGE_START_CAPTURE, UNSUPPORTED)
    assert sent(equipment) == [mavlink.MAV_CMD_DO_DIGICAM_CONTROL]
    answer(equipment, mavlink.MAV_CMD_DO_DIGICAM_CONTROL, ACCEPTED)
    assert failure_of(equipment, 1) == ""


def test_a_rejection_and_a_silence_are_named() -> None:
    equipment = service()
    equipment.send(1, [RULES.gripper(grabs=True)], 0.0)
    answer(equipment, mavlink.MAV_CMD_DO_GRIPPER, DENIED)
    assert failure_of(equipment, 1) == "DO_GRIPPER was answered with DENIED"
    equipment.send(2, [RULES.gripper(grabs=True)], 1.0)
    for tick in range(100):
        equipment.handle_timer(1.0 + 0.1 * tick)
    assert failure_of(equipment, 2) == "DO_GRIPPER was not answered"


def test_a_lost_link_and_a_vehicle_that_is_gone_end_a_request() -> None:
    equipment = service()
    equipment.send(1, [RULES.gripper(grabs=True)], 0.0)
    equipment.link_lost(VehicleState(), 1.0)
    assert failure_of(equipment, 1) == "the link to the vehicle was lost"
    equipment.vehicle_gone("it restarted", 2.0)
    assert equipment.next_event() is None, "nothing was under way"
    nobody = EquipmentCommands(lambda: None, CommandTiming())
    nobody.send(2, [RULES.gripper(grabs=True)], 0.0)
    assert failure_of(nobody, 2) == "there is no vehicle"


def test_a_place_is_sent_in_degrees_times_1e7() -> None:
    equipment = service()
    equipment.send(1, [RULES.point_position((47.5, -8.25, 410.0))], 0.0)
    (message,) = equipment.messages_to_send()
    assert isinstance(message, mavlink.MAVLink_command_int_message)
    assert (message.x, message.y, message.z) == (475_000_000, -82_500_000, 410.0)


def test_outputs_are_pulses_for_one_firmware_and_shares_for_the_other() -> None:
    servo = ardupilot.COPTER.equipment.servo(9, 1250)
    assert servo == EquipmentCommand(mavlink.MAV_CMD_DO_SET_SERVO, (9.0, 1250.0))
    actuator = RULES.servo(2, 1250)
    assert actuator.command == mavlink.MAV_CMD_DO_SET_ACTUATOR
    assert actuator.params[1] == -0.5
