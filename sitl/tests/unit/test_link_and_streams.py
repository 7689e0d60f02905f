"""Rules observed on the wire of the real ArduPilot: link, streams, requests."""

from __future__ import annotations

import itertools

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import ACCEPTED, DENIED, FAILED, GUIDED, LAND, copter

UNASKED = 65535
"""PARAM_VALUE.param_index of what was not asked for by index or list"""


def test_nothing_but_heartbeat_timesync_texts_home_and_what_is_saved_comes_unasked() -> None:
    station = copter()
    station.run(25.0)
    kinds = {message.get_type() for _, message in station.log}
    home = {"HOME_POSITION", "GPS_GLOBAL_ORIGIN"}
    assert kinds == {"HEARTBEAT", "TIMESYNC", "STATUSTEXT", "PARAM_VALUE", *home}


def test_heartbeat_comes_at_1_hz() -> None:
    station = copter()
    station.run(30.0)
    assert len(station.messages("HEARTBEAT")) == 30


def test_timesync_is_asked_every_10_s_with_tc1_0() -> None:
    station = copter()
    station.run(35.0)
    requests = station.messages("TIMESYNC")
    assert [m.tc1 for m in requests] == [0, 0, 0]
    assert [round(m.ts1 / 1e9) for m in requests] == [10, 20, 30]


def test_timesync_is_answered_with_the_time_since_boot() -> None:
    station = copter()
    station.run(2.0)
    (answer,) = station.send(mav.MAVLink_timesync_message(0, 123456789))
    assert answer.ts1 == 123456789
    assert answer.tc1 / 1e9 == pytest.approx(2.0, abs=0.01)


def test_a_timesync_answer_is_not_answered() -> None:
    station = copter()
    assert station.send(mav.MAVLink_timesync_message(5, 6)) == []


def test_ping_gets_no_answer() -> None:
    station = copter()
    assert station.send(mav.MAVLink_ping_message(0, 1, 0, 0)) == []


@pytest.mark.parametrize("rate_hz", [1, 4, 10, 20, 50])
def test_set_message_interval_gives_exactly_the_rate(rate_hz: int) -> None:
    station = copter()
    assert station.interval(mav.MAVLINK_MSG_ID_ATTITUDE, rate_hz) == ACCEPTED
    station.run(10.0)
    times = [m.time_boot_ms for m in station.messages("ATTITUDE")]
    assert len(times) == 10 * rate_hz
    gaps = {b - a for a, b in itertools.pairwise(times)}
    assert gaps == {1000 // rate_hz}


def test_a_rate_that_is_no_divisor_of_the_tick_is_right_on_average() -> None:
    station = copter()
    station.interval(mav.MAVLINK_MSG_ID_ATTITUDE, 30.0)
    station.run(20.0)
    assert len(station.messages("ATTITUDE")) == pytest.approx(600, abs=1)


def test_request_data_stream_has_no_ack_and_starts_the_usual_messages() -> None:
    station = copter().ready()
    answers = station.send(mav.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
    assert answers == []
    since = station.now_s
    station.run(10.0)
    kinds = {m.get_type() for _, m in station.log}
    assert {"SYS_STATUS", "GPS_RAW_INT", "VFR_HUD", "EKF_STATUS_REPORT", "RC_CHANNELS"} <= kinds
    assert {"SERVO_OUTPUT_RAW", "NAV_CONTROLLER_OUTPUT", "SYSTEM_TIME"} <= kinds
    assert len(station.messages("VFR_HUD", since)) == 40
    station.send(mav.MAVLink_request_data_stream_message(1, 1, 0, 4, 0))
    before = len(station.messages("VFR_HUD"))
    station.run(5.0)
    assert len(station.messages("VFR_HUD")) == before


@pytest.mark.parametrize("message_id", [230, 330, 331, 436, 410, 9999])
def test_an_unknown_message_is_denied_with_a_text_and_not_given(message_id: int) -> None:
    """OBSTACLE_DISTANCE (330) is among them: an ArduPilot takes it and makes none."""
    station = copter()
    assert station.interval(message_id, 10.0) == DENIED
    assert station.texts()[-1] == f"No ap_message for mavlink id ({message_id})"
    said = len(station.texts())
    assert station.command(mav.MAV_CMD_REQUEST_MESSAGE, message_id) == FAILED
    assert station.command(mav.MAV_CMD_GET_MESSAGE_INTERVAL, message_id) == FAILED
    assert station.last("MESSAGE_INTERVAL").interval_us == 0
    assert len(station.texts()) == said


@pytest.mark.parametrize("message_id", [22, 46, 124, 173, 226, 11030])
def test_a_message_that_it_knows_and_has_nothing_to_say_for_is_accepted(message_id: int) -> None:
    station = copter().ready()
    assert station.interval(message_id, 10.0) == ACCEPTED
    assert station.command(mav.MAV_CMD_REQUEST_MESSAGE, message_id) == ACCEPTED
    assert station.command(mav.MAV_CMD_GET_MESSAGE_INTERVAL, message_id) == ACCEPTED
    assert station.last("MESSAGE_INTERVAL").interval_us == 100_000
    begin_s = station.now_s
    station.run(2.0)
    assert message_id not in {m.get_msgId() for t, m in station.log if t > begin_s}


def test_terrain_report_comes_as_often_as_asked_for() -> None:
    """As recorded, without heights from anybody: the ground counts as at sea level."""
    station = copter().ready()
    assert station.interval(136, 0.5) == ACCEPTED
    station.run(8.0)
    reports = station.messages("TERRAIN_REPORT")
    assert len(reports) == 4
    report, here = reports[-1], station.last("GLOBAL_POSITION_INT")
    assert (report.spacing, report.terrain_height, report.loaded) == (0, 0.0, 0)
    assert report.current_height == pytest.approx(here.alt / 1000.0, abs=0.1)
    assert (report.lat, report.lon) == (here.lat, here.lon)


def test_terrain_report_before_the_gps() -> None:
    station = copter(ready_after_s=41.64)
    station.interval(136, 4.0)
    station.run(5.0)
    report = station.last("TERRAIN_REPORT")
    assert (report.lat, report.lon, report.spacing, report.pending) == (0, 0, 100, 56)


def test_too_short_an_interval_is_denied_and_its_text_comes_in_two_chunks() -> None:
    station = copter()
    assert station.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 30, 1000) == DENIED
    chunks = station.messages("STATUSTEXT")[-2:]
    assert [m.text for m in chunks] == [
        "Requested rate for message ID 30 too fast. Increas",
        "e SCHED_LOOP_RATE",
    ]
    assert [m.chunk_seq for m in chunks] == [0, 1]
    assert chunks[0].id == chunks[1].id != 0


def test_short_texts_have_id_0() -> None:
    station = copter()
    station.run(1.0)
    assert {m.id for m in station.messages("STATUSTEXT")} == {0}


def test_interval_minus_1_stops_a_message_and_get_message_interval_reports() -> None:
    station = copter()
    station.interval(30, 5.0)
    assert station.command(mav.MAV_CMD_GET_MESSAGE_INTERVAL, 30) == ACCEPTED
    assert station.last("MESSAGE_INTERVAL").interval_us == 200_000
    assert station.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 30, -1) == ACCEPTED
    station.command(mav.MAV_CMD_GET_MESSAGE_INTERVAL, 30)
    assert station.last("MESSAGE_INTERVAL").interval_us == -1
    station.run(2.0)
    assert station.messages("ATTITUDE") == []


@pytest.mark.parametrize(
    "message_id",
    [0, 1, 2, 24, 30, 31, 32, 33, 36, 42, 49, 62, 65, 74, 147, 148, 193, 241, 242, 245],
)
def test_request_message_sends_the_message_after_the_ack(message_id: int) -> None:
    station = copter().ready()
    answers = station.send(
        mav.MAVLink_command_long_message(1, 1, 512, 0, message_id, 0, 0, 0, 0, 0, 0)
    )
    assert [m.get_msgId() for m in answers] == [mav.MAVLINK_MSG_ID_COMMAND_ACK, message_id]


def test_request_message_of_an_unknown_id_fails() -> None:
    assert copter().command(mav.MAV_CMD_REQUEST_MESSAGE, 9999) == FAILED


@pytest.mark.parametrize("component", [0, 1, 2, 190])
def test_commands_to_any_component_are_answered_by_1_1(component: int) -> None:
    station = copter()
    assert station.command(mav.MAV_CMD_REQUEST_MESSAGE, 0, component=component) == ACCEPTED
    ack = station.last("COMMAND_ACK")
    assert (ack.get_srcSystem(), ack.get_srcComponent()) == (1, 1)


def test_a_command_to_another_system_is_met_with_silence() -> None:
    assert copter().command(mav.MAV_CMD_REQUEST_MESSAGE, 0, system=42) == -1


def test_the_ack_names_the_asker_and_has_no_progress() -> None:
    station = copter()
    station.command(31999)
    ack = station.last("COMMAND_ACK")
    assert (ack.target_system, ack.target_component) == (255, 190)
    assert (ack.progress, ack.result_param2) == (0, 0)


def test_autopilot_version_as_recorded() -> None:
    station = copter()
    station.command(mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1)
    version = station.last("AUTOPILOT_VERSION")
    assert version.capabilities == 0xFBEF
    assert version.flight_sw_version == 0x04070000
    assert bytes(version.flight_custom_version) == b"cef8bcef"


def test_a_mode_change_causes_an_immediate_heartbeat_after_the_ack() -> None:
    station = copter().ready()
    answers = station.send(mav.MAVLink_command_long_message(1, 1, 176, 0, 1, 4, 0, 0, 0, 0, 0))
    assert [m.get_type() for m in answers] == ["COMMAND_ACK", "HEARTBEAT"]
    assert answers[1].custom_mode == GUIDED


def test_arming_shows_only_in_the_next_regular_heartbeat() -> None:
    station = copter().ready()
    station.mode(GUIDED)
    answers = station.send(mav.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    assert "HEARTBEAT" not in [m.get_type() for m in answers]
    assert not station.last("HEARTBEAT").base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    station.run(1.0)
    assert station.last("HEARTBEAT").base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED


def test_the_same_mode_again_causes_no_heartbeat() -> None:
    station = copter().ready()
    station.mode(LAND)
    answers = station.send(mav.MAVLink_command_long_message(1, 1, 176, 0, 1, 9, 0, 0, 0, 0, 0))
    assert [m.get_type() for m in answers] == ["COMMAND_ACK"]


def test_mavlink_2_is_spoken_and_mavlink_1_understood() -> None:
    station = copter()
    message = mav.MAVLink_command_long_message(1, 1, 512, 0, 0, 0, 0, 0, 0, 0, 0)
    out = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    station.vehicle.link.write(bytes(message.pack(out, force_mavlink1=True)))
    frames = station.vehicle.link.read_datagrams()
    assert len(frames) == 2
    assert all(frame[0] == 0xFD for frame in frames)


def test_frames_are_numbered_in_sequence() -> None:
    station = copter()
    station.interval(30, 50.0)
    station.run(10.0)
    numbers = [m.get_seq() for _, m in station.log]
    assert all((a + 1) % 256 == b for a, b in itertools.pairwise(numbers))


def test_parameters_by_list_name_and_index() -> None:
    station = copter()
    station.send(mav.MAVLink_param_request_list_message(1, 1))
    station.run(2.0)
    values = [m for m in station.messages("PARAM_VALUE") if m.param_index != UNASKED]
    count = values[0].param_count
    assert sorted(m.param_index for m in values) == list(range(count))
    assert len({m.param_id for m in values}) == count
    (by_index,) = station.send(mav.MAVLink_param_request_read_message(1, 1, b"", 3))
    assert by_index.param_id == values[3].param_id
    (by_name,) = station.send(mav.MAVLink_param_request_read_message(1, 1, b"GUID_TIMEOUT", -1))
    assert by_name.param_value == 3.0


def test_a_set_parameter_is_echoed_with_index_65535() -> None:
    station = copter()
    (echo,) = station.send(mav.MAVLink_param_set_message(1, 1, b"WPNAV_SPEED", 300.0, 9))
    assert (echo.param_id, echo.param_value, echo.param_index) == ("WPNAV_SPEED", 300.0, 65535)


def test_an_unknown_parameter_gets_no_answer() -> None:
    station = copter()
    assert station.send(mav.MAVLink_param_request_read_message(1, 1, b"NO_SUCH", -1)) == []
    assert station.send(mav.MAVLink_param_set_message(1, 1, b"NO_SUCH", 1.0, 9)) == []


def test_a_parameter_is_never_set_to_nan() -> None:
    station = copter()
    (echo,) = station.send(mav.MAVLink_param_set_message(1, 1, b"WPNAV_SPEED", float("nan"), 9))
    assert echo.param_value == 1000.0
