"""The mission service, message by message, with the observed behaviour of each firmware."""

from __future__ import annotations

import math
import struct

import pytest

from mavlink_vehicle.codec import Codec, Message, make, mavlink
from mavlink_vehicle.events import OperationResult
from mavlink_vehicle.mission_items import (
    AMSL,
    NO_FRAME,
    RELATIVE_ALT,
    TERRAIN_ALT,
    MissionItem,
    MissionType,
    first_difference,
)
from mavlink_vehicle.profiles import ardupilot, px4
from mavlink_vehicle.protocols.mission.mission_clear import MissionClear
from mavlink_vehicle.protocols.mission.mission_download import MissionDownload
from mavlink_vehicle.protocols.mission.mission_upload import MissionUpload
from mavlink_vehicle.protocols.mission.transfer import (
    TransferResult,
    TransferTiming,
    ack_sentence,
)
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.state.reducer import VehicleState, reduce
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig
from tests.support.messages.autopilot_messages import AutopilotMessages

ADDRESS = Address(1, 191, 1, 1)
TIMING = TransferTiming(timeout_s=0.5, retries=2)
US = {"target_system": 1, "target_component": 191}
SOMEBODY = {"target_system": 255, "target_component": 190}
WAYPOINT = mavlink.MAV_CMD_NAV_WAYPOINT
ITEMS = [
    MissionItem(mavlink.MAV_CMD_NAV_TAKEOFF, RELATIVE_ALT, z=5.0),
    MissionItem(WAYPOINT, RELATIVE_ALT, (2.0, 1.0, 0.0, 90.0), 473_977_420, 85_455_940, 12.5),
]
say = AutopilotMessages()


def ack(result: int, mission_type: int = 0, **target: int) -> Message:
    return say("MISSION_ACK", **(target or US), type=result, mission_type=mission_type)


@pytest.fixture
def upload() -> MissionUpload:
    upload = MissionUpload(ITEMS, ADDRESS, TIMING)
    upload.start(10.0)
    return upload


@pytest.fixture
def download() -> MissionDownload:
    download = MissionDownload(ADDRESS, TIMING)
    download.start(10.0)
    return download


def names(machine: MissionUpload | MissionDownload | MissionClear) -> list[str]:
    return [message.get_type() for message in machine.messages_to_send()]


# --- upload ---------------------------------------------------------------------------


@pytest.mark.parametrize("request_name", ["MISSION_REQUEST", "MISSION_REQUEST_INT"])
def test_ardupilots_requests_and_px4s_are_answered_with_int_items(
    upload: MissionUpload, request_name: str
) -> None:
    (count,) = upload.messages_to_send()
    assert (count.get_type(), count.count, count.mission_type) == ("MISSION_COUNT", 2, 0)
    for seq in (0, 1):
        upload.receive(say(request_name, **US, seq=seq), 10.1)
        (item,) = upload.messages_to_send()
        assert (item.get_type(), item.seq, item.command) == (
            "MISSION_ITEM_INT", seq, ITEMS[seq].command,
        )  # fmt: skip
    upload.receive(ack(0), 10.2)
    end = upload.next_event()
    assert end is not None
    assert (end.result, end.opaque_id) == (TransferResult.DONE, None)
    assert upload.deadline_s is None


def test_an_item_is_given_again_as_often_as_it_is_asked_for(upload: MissionUpload) -> None:
    upload.messages_to_send()
    for _ in range(3):
        upload.receive(say("MISSION_REQUEST", **US, seq=0), 10.1)
    assert names(upload) == ["MISSION_ITEM_INT"] * 3


def test_requests_and_acks_for_another_station_or_list_are_ignored(upload: MissionUpload) -> None:
    upload.messages_to_send()
    upload.receive(say("MISSION_REQUEST", **SOMEBODY, seq=0), 10.1)
    upload.receive(say("MISSION_REQUEST", **US, seq=0, mission_type=1), 10.1)
    upload.receive(say("MISSION_REQUEST", **US, seq=7), 10.1)
    upload.receive(AutopilotMessages(2, 1)("MISSION_REQUEST", **US, seq=0), 10.1)
    upload.receive(ack(mavlink.MAV_MISSION_DENIED, **SOMEBODY), 10.1)
    upload.receive(ack(mavlink.MAV_MISSION_DENIED, mission_type=1), 10.1)
    assert names(upload) == []
    assert upload.next_event() is None


def test_an_acceptance_before_the_last_item_belongs_to_something_else(
    upload: MissionUpload,
) -> None:
    upload.receive(ack(0), 10.1)
    upload.receive(say("MISSION_REQUEST", **US, seq=0), 10.1)
    upload.receive(ack(0), 10.1)
    assert upload.next_event() is None


def test_an_item_out_of_turn_does_not_end_it(upload: MissionUpload) -> None:
    upload.receive(say("MISSION_REQUEST", **US, seq=0), 10.1)
    upload.receive(ack(mavlink.MAV_MISSION_INVALID_SEQUENCE), 10.2)
    assert upload.next_event() is None


def test_the_count_is_repeated_and_then_given_up(upload: MissionUpload) -> None:
    sent = names(upload)
    while (deadline := upload.deadline_s) is not None:
        upload.handle_timer(deadline)
        sent += names(upload)
    assert sent == ["MISSION_COUNT"] * 3
    end = upload.next_event()
    assert end is not None
    assert end.result is TransferResult.UNANSWERED


def test_an_ardupilot_that_gives_up_says_cancelled(upload: MissionUpload) -> None:
    upload.receive(say("MISSION_REQUEST", **US, seq=0), 10.1)
    upload.receive(ack(mavlink.MAV_MISSION_OPERATION_CANCELLED), 18.1)
    end = upload.next_event()
    assert end is not None
    assert end.result is TransferResult.GIVEN_UP


def test_a_px4_that_gives_up_says_nothing(upload: MissionUpload) -> None:
    upload.receive(say("MISSION_REQUEST_INT", **US, seq=0), 10.1)
    deadline = upload.deadline_s
    assert deadline is not None
    assert deadline == pytest.approx(10.1 + TIMING.silence_s)
    upload.handle_timer(deadline)
    end = upload.next_event()
    assert end is not None
    assert end.result is TransferResult.UNANSWERED


@pytest.mark.parametrize("result", [None, 1, mavlink.MAV_MISSION_OPERATION_CANCELLED])
def test_without_a_clear_answer_to_the_last_item_the_read_back_decides(
    upload: MissionUpload, result: int | None
) -> None:
    for seq in (0, 1):
        upload.receive(say("MISSION_REQUEST", **US, seq=seq), 10.1)
    if result is None:
        upload.handle_timer(upload.deadline_s or 0.0)
    else:
        upload.receive(ack(result), 10.2)
    end = upload.next_event()
    assert end is not None
    assert end.result is TransferResult.UNSURE
    upload.messages_to_send()
    upload.receive(say("MISSION_REQUEST", **US, seq=1), 10.5)
    assert names(upload) == ["MISSION_ITEM_INT"], "a transfer that began again is served"


def test_every_rejection_has_a_sentence_and_the_first_one_counts(upload: MissionUpload) -> None:
    upload.receive(say("MISSION_REQUEST", **US, seq=0), 10.1)
    upload.receive(ack(mavlink.MAV_MISSION_UNSUPPORTED_FRAME), 10.2)
    upload.receive(ack(mavlink.MAV_MISSION_UNSUPPORTED), 10.3)
    end = upload.next_event()
    assert end is not None
    assert end.result is TransferResult.REFUSED
    assert "frame" in end.reason
    assert end.reason.endswith(" (item 0 of the 2 sent, NAV_TAKEOFF)")
    assert upload.next_event() is None
    refusals = [n for n in mavlink.enums["MAV_MISSION_RESULT"] if 0 < n < 16]
    assert len({ack_sentence(n) for n in refusals}) == len(refusals)
    assert "99" in ack_sentence(99)


def test_a_cancelled_upload_is_cancelled_at_the_vehicle(upload: MissionUpload) -> None:
    upload.receive(say("MISSION_REQUEST", **US, seq=0), 10.1)
    upload.messages_to_send()
    upload.cancel(10.2)
    (message,) = upload.messages_to_send()
    assert message.get_type() == "MISSION_ACK"
    assert message.type == mavlink.MAV_MISSION_OPERATION_CANCELLED
    upload.receive(say("MISSION_REQUEST", **US, seq=0), 10.3)
    assert names(upload) == []
    assert upload.next_event() is None


def test_px4s_acknowledgement_carries_the_number_of_what_is_stored(upload: MissionUpload) -> None:
    for seq in (0, 1):
        upload.receive(say("MISSION_REQUEST_INT", **US, seq=seq), 10.1)
    upload.receive(extended("MISSION_ACK", struct.pack("<BBBBI", 1, 191, 0, 0, 0xBEEF)), 10.2)
    end = upload.next_event()
    assert end is not None
    assert end.opaque_id == 0xBEEF


def test_an_empty_list_is_acknowledged_at_once() -> None:
    upload = MissionUpload([], ADDRESS, TIMING, MissionType.FENCE)
    upload.start(0.0)
    (count,) = upload.messages_to_send()
    assert (count.count, count.mission_type) == (0, 1)
    upload.receive(ack(0, mission_type=1), 0.1)
    end = upload.next_event()
    assert end is not None
    assert end.result is TransferResult.DONE


# --- download and clearing ------------------------------------------------------------


def test_each_item_is_asked_for_until_it_comes(download: MissionDownload) -> None:
    assert names(download) == ["MISSION_REQUEST_LIST"]
    download.receive(say("MISSION_COUNT", **US, count=2), 10.1)
    assert names(download) == ["MISSION_REQUEST_INT"]
    download.handle_timer(10.6)
    assert names(download) == ["MISSION_REQUEST_INT"]
    for seq in (0, 0, 1):  # the second 0 is the late answer to the repetition
        message = ITEMS[seq].message(seq, (1, 191))
        download.receive(resent(message), 10.7)
    end = download.next_event()
    assert end is not None
    assert end.items == tuple(ITEMS)
    assert names(download)[-1] == "MISSION_ACK"


def test_acks_of_an_earlier_upload_do_not_end_a_download(download: MissionDownload) -> None:
    for result in (0, 1, mavlink.MAV_MISSION_INVALID_SEQUENCE):
        download.receive(ack(result), 10.1)
    assert download.next_event() is None
    download.receive(ack(mavlink.MAV_MISSION_UNSUPPORTED), 10.1)
    end = download.next_event()
    assert end is not None
    assert end.result is TransferResult.REFUSED


def test_a_download_without_answers_ends(download: MissionDownload) -> None:
    while (deadline := download.deadline_s) is not None:
        download.handle_timer(deadline)
    end = download.next_event()
    assert end is not None
    assert end.result is TransferResult.UNANSWERED


def test_clearing_is_repeated_until_it_is_answered() -> None:
    clear = MissionClear(ADDRESS, TIMING)
    clear.start(0.0)
    clear.handle_timer(0.5)
    assert names(clear) == ["MISSION_CLEAR_ALL"] * 2
    clear.receive(ack(1), 0.6)  # what an ArduPilot in AUTO answers
    end = clear.next_event()
    assert end is not None
    assert end.result is TransferResult.REFUSED
    assert "AUTO" in end.reason


# --- what a firmware may change -------------------------------------------------------

COPTER, PLANE, PX4 = ardupilot.COPTER.missions, ardupilot.PLANE.missions, px4.COPTER.missions


def differs(sent: MissionItem, stored: MissionItem, rules: object) -> str | None:
    assert rules is not None
    return first_difference([sent], [stored], rules)  # type: ignore[arg-type]


def waypoint(
    frame: int = RELATIVE_ALT,
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
    x: int = 473_977_420,
    z: float = 12.5,
) -> MissionItem:
    return MissionItem(WAYPOINT, frame, params, x, 85_455_940, z)


def test_frames_come_back_under_their_other_number() -> None:
    for sent, stored in ((6, 3), (3, 6), (5, 0), (11, 10)):
        assert differs(waypoint(sent), waypoint(stored), COPTER) is None
    assert "frame" in (differs(waypoint(AMSL), waypoint(RELATIVE_ALT), PX4) or "")
    assert "frame" in (differs(waypoint(TERRAIN_ALT), waypoint(RELATIVE_ALT), COPTER) or "")


def test_ardupilot_keeps_of_a_waypoint_the_time_or_for_a_plane_the_radii() -> None:
    sent = waypoint(params=(3.0, 2.0, 1.0, math.nan))
    assert differs(sent, waypoint(params=(3.0, 0.0, 0.0, 0.0)), COPTER) is None
    assert "param1" in (differs(sent, waypoint(params=(0.0, 2.0, 1.0, 0.0)), COPTER) or "")
    assert differs(sent, waypoint(params=(0.0, 2.0, 1.0, 0.0)), PLANE) is None


def test_px4_keeps_time_radius_and_heading_and_nan() -> None:
    sent = waypoint(params=(3.0, 2.0, 1.0, math.nan))
    assert differs(sent, waypoint(params=(3.0, 2.0, 0.0, math.nan)), PX4) is None
    assert "param4" in (differs(sent, waypoint(params=(3.0, 2.0, 0.0, 0.0)), PX4) or "")
    west = waypoint(params=(0.0, 0.0, 0.0, -90.0))
    assert differs(west, waypoint(params=(0.0, 0.0, 0.0, 270.0)), PX4) is None


def test_numbers_are_compared_as_float32_and_heights_as_centimetres() -> None:
    assert differs(waypoint(z=584.1237), waypoint(z=584.12), COPTER) is None
    assert "height" in (differs(waypoint(z=12.5), waypoint(z=12.6), COPTER) or "")
    assert "latitude" in (differs(waypoint(), waypoint(x=473_977_500), PX4) or "")


def test_commands_without_a_place_have_no_frame() -> None:
    command = mavlink.MAV_CMD_DO_CHANGE_SPEED
    params = (1.0, 3.3, -1.0, 0.0)
    stored = MissionItem(command, 0, (1.0, struct.unpack("<f", struct.pack("<f", 3.3))[0], -1, 0))
    assert differs(MissionItem(command, NO_FRAME, params), stored, COPTER) is None


# --- the vehicle's state --------------------------------------------------------------


def resent(message: Message) -> Message:
    (decoded,) = Codec(1, 191).decode(Codec(1, 1).encode(message))
    return decoded


def extended(name: str, payload: bytes) -> Message:
    """A message with fields that the dialect lacks, as PX4 sends them."""
    frame = bytearray(Codec(1, 1).encode(make(name)))
    header = bytes([len(payload), *frame[2:10]])
    crc = mavlink.x25crc(header + payload + bytes([make(name).crc_extra])).crc
    (message,) = Codec(1, 191).decode(b"\xfd" + header + payload + struct.pack("<H", crc))
    return message


def heard(*messages: Message) -> VehicleState:
    state = VehicleState(system_id=1)
    for message in messages:
        state = reduce(state, message, 5.0)
    return state


def test_px4s_mission_current_with_its_number_and_without_a_mission() -> None:
    payload = struct.pack("<HHBBI", 3, 7, 3, 1, 0xBEEF)
    mission = heard(extended("MISSION_CURRENT", payload)).mission
    assert mission is not None
    assert (mission.current, mission.total, mission.state) == (3, 7, 3)
    assert mission.mission_id == 0xBEEF
    mission = heard(say("MISSION_CURRENT", seq=0, total=65535, mission_state=1)).mission
    assert mission is not None
    assert (mission.total, mission.mission_id) == (0, 0)


def test_an_old_firmware_reports_the_current_item_only() -> None:
    mission = heard(say("MISSION_CURRENT", seq=4)).mission
    assert mission is not None
    assert (mission.current, mission.total) == (4, None)


def test_px4_repeats_mission_item_reached_and_it_counts_once() -> None:
    messages = [say("MISSION_ITEM_REACHED", seq=seq) for seq in (0, 0, 0, 1, 1, 2)]
    mission = heard(say("MISSION_CURRENT", seq=0, total=3), *messages).mission
    assert mission is not None
    assert mission.reached == (0, 1, 2)


def test_nothing_is_sent_to_who_has_no_missions_or_was_not_heard() -> None:
    vehicle = Vehicle(VehicleConfig(message_rates_hz={}))
    vehicle.missions.upload(ITEMS, 0.0)
    vehicle.missions.start(0.0)
    vehicle.receive(say.heartbeat(autopilot=mavlink.MAV_AUTOPILOT_GENERIC), 1.0)
    vehicle.missions.clear(1.0)
    results = []
    while (event := vehicle.next_event()) is not None:
        results.append(getattr(event, "result", None))
    lost, refused = OperationResult.LINK_LOST, OperationResult.REFUSED
    assert results == [lost, lost, None, refused]
    assert not [m for m in vehicle.messages_to_send() if "MISSION" in m.get_type()]


# --- another station's transfer is under way ---------------------------------------------


def wait(machine: MissionUpload | MissionDownload | MissionClear) -> list[str]:
    deadline = machine.deadline_s
    assert deadline is not None
    machine.handle_timer(deadline)
    return names(machine)


@pytest.mark.parametrize("answer", [mavlink.MAV_MISSION_DENIED, mavlink.MAV_MISSION_ERROR])
def test_an_upload_waits_for_another_stations_transfer(upload: MissionUpload, answer: int) -> None:
    """An ArduPilot answers DENIED then, a PX4 ERROR (its mavlink_mission.cpp)."""
    upload.messages_to_send()
    upload.receive(ack(answer), 10.1)
    assert upload.next_event() is None
    assert wait(upload) == ["MISSION_COUNT"]
    for seq in (0, 1):
        upload.receive(say("MISSION_REQUEST_INT", **US, seq=seq), 10.6)
    upload.receive(ack(0), 10.7)
    end = upload.next_event()
    assert end is not None
    assert end.result is TransferResult.DONE


def test_a_download_waits_for_another_stations_upload(download: MissionDownload) -> None:
    download.messages_to_send()
    download.receive(ack(mavlink.MAV_MISSION_DENIED), 10.1)
    assert download.next_event() is None
    assert wait(download) == ["MISSION_REQUEST_LIST"]
    download.receive(say("MISSION_COUNT", **US, count=0), 10.6)
    end = download.next_event()
    assert end is not None
    assert end.result is TransferResult.DONE


def test_clearing_waits_for_another_stations_upload() -> None:
    clear = MissionClear(ADDRESS, TIMING)
    clear.start(10.0)
    clear.messages_to_send()
    clear.receive(ack(mavlink.MAV_MISSION_DENIED), 10.1)
    assert clear.next_event() is None
    assert wait(clear) == ["MISSION_CLEAR_ALL"]
    clear.receive(ack(0), 10.6)
    end = clear.next_event()
    assert end is not None
    assert end.result is TransferResult.DONE


@pytest.mark.parametrize(
    "machine",
    [
        MissionUpload(ITEMS, ADDRESS, TIMING),
        MissionDownload(ADDRESS, TIMING),
        MissionClear(ADDRESS, TIMING),
    ],
)
def test_who_is_denied_all_the_time_ends_and_says_why(
    machine: MissionUpload | MissionDownload | MissionClear,
) -> None:
    machine.start(10.0)
    while machine.deadline_s is not None:
        machine.receive(ack(mavlink.MAV_MISSION_DENIED), 10.1)
        wait(machine)
    end = machine.next_event()
    assert end is not None
    assert end.result is TransferResult.BUSY
    assert "another ground station" in end.reason
