"""Rules observed on the real firmware that hold for rovers, boats and planes, too.

The rules of one kind alone are in `test_rover.py`, `test_plane.py` and `test_kinds_telemetry.py`.
"""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from sitl_support.ground_station import (
    ACCEPTED,
    DENIED,
    FAILED,
    UNSUPPORTED,
    VELOCITY,
    YAW,
    YAW_RATE,
    GroundStation,
)
from sitl_support.kinds import (
    HOLD,
    PLANE_AUTO,
    PLANE_GUIDED,
    ROVER_AUTO,
    ROVER_GUIDED,
    TAKEOFF,
    kind,
    mode_of,
    plane,
    rover,
)
from sitl_support.missions import download, item, upload, waypoint

KINDS = ["rover", "boat", "plane"]
ERROR = 1
"""MAV_MISSION_ERROR"""


def under_way(vehicle: str) -> GroundStation:
    """One that is armed and moves."""
    return plane() if vehicle == "plane" else rover(vehicle=vehicle)


# Link.


@pytest.mark.parametrize("vehicle", KINDS)
def test_only_heartbeats_and_time_come_unasked(vehicle: str) -> None:
    """Once it has started: texts and the home position belong to the start."""
    config = VehicleConfig(vehicle=vehicle, ready_after_s=1.0)
    station = GroundStation(Simulation([config], seed=1))
    station.run(5.0)
    station.log.clear()
    station.run(30.0)
    kinds = [message.get_type() for _, message in station.log]
    assert sorted(set(kinds)) == ["HEARTBEAT", "PARAM_VALUE", "TIMESYNC"]
    assert [m.param_id for m in station.messages("PARAM_VALUE")] == ["STAT_RUNTIME"]
    assert (kinds.count("HEARTBEAT"), kinds.count("TIMESYNC")) == (30, 3)


@pytest.mark.parametrize("vehicle", KINDS)
def test_a_reboot_forgets_the_streams_and_the_time(vehicle: str) -> None:
    station = kind(vehicle)
    station.interval(30, 10.0)
    station.run(5.0)
    before_ms = station.last("ATTITUDE").time_boot_ms
    assert station.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == ACCEPTED
    station.log.clear()
    station.run(5.0)
    assert station.messages("HEARTBEAT")
    assert not station.messages("ATTITUDE")
    station.interval(30, 10.0)
    station.run(1.0)
    assert station.last("ATTITUDE").time_boot_ms < before_ms


def test_no_reboot_while_it_flies() -> None:
    assert plane().command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == FAILED


@pytest.mark.parametrize("vehicle", KINDS)
def test_set_mode_changes_the_mode_without_an_acknowledgement(vehicle: str) -> None:
    station = kind(vehicle)
    answers = station.send(mav.MAVLink_set_mode_message(1, 1, ROVER_GUIDED))
    assert [message.get_type() for message in answers] == ["HEARTBEAT"], "at once"
    assert mode_of(station) == ROVER_GUIDED


@pytest.mark.parametrize("vehicle", KINDS)
def test_arming_shows_in_the_next_regular_heartbeat(vehicle: str) -> None:
    station = kind(vehicle)
    station.mode(TAKEOFF if vehicle == "plane" else ROVER_GUIDED)
    beats = len(station.messages("HEARTBEAT"))
    assert station.arm() == ACCEPTED
    assert len(station.messages("HEARTBEAT")) == beats
    station.run(1.0)
    assert station.last("HEARTBEAT").base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED


@pytest.mark.parametrize("vehicle", KINDS)
@pytest.mark.parametrize("component", [0, 2, 190])
def test_commands_for_any_component_are_answered_by_the_autopilot(
    vehicle: str, component: int
) -> None:
    station = kind(vehicle)
    request = mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES
    assert station.command(request, 1, component=component) == ACCEPTED
    assert station.command(request, 1, system=2) == -1, "silence"


# Commands.


@pytest.mark.parametrize("vehicle", KINDS)
def test_a_mode_that_does_not_exist_fails_and_the_custom_flag_is_needed(vehicle: str) -> None:
    station = kind(vehicle)
    assert station.mode(99) == FAILED
    assert "No such mode 99" in station.texts()
    assert station.command(mav.MAV_CMD_DO_SET_MODE, 0, ROVER_GUIDED) == DENIED


@pytest.mark.parametrize("vehicle", KINDS)
@pytest.mark.parametrize(
    "command",
    [31999, mav.MAV_CMD_DO_ORBIT, mav.MAV_CMD_DO_SET_PARAMETER, mav.MAV_CMD_DO_PAUSE_CONTINUE],
)
def test_what_it_does_not_know_is_unsupported(vehicle: str, command: int) -> None:
    assert kind(vehicle).command(command) == UNSUPPORTED


@pytest.mark.parametrize("vehicle", KINDS)
def test_arming_twice_and_disarming_twice_are_accepted(vehicle: str) -> None:
    station = kind(vehicle)
    assert [station.arm(), station.arm()] == [ACCEPTED, ACCEPTED]
    disarm = mav.MAV_CMD_COMPONENT_ARM_DISARM
    assert [station.command(disarm, 0), station.command(disarm, 0)] == [ACCEPTED, ACCEPTED]


@pytest.mark.parametrize("vehicle", KINDS)
def test_messages_that_it_cannot_send_are_denied_with_words(vehicle: str) -> None:
    station = kind(vehicle)
    for message_id in (230, 331, 436, 410):
        assert station.interval(message_id, 4.0) == DENIED
        assert station.texts()[-1] == f"No ap_message for mavlink id ({message_id})"


# Setpoints of rovers.


@pytest.mark.parametrize(
    ("mask", "values"),
    [
        (VELOCITY & ~YAW, {"velocity": (2.0, 0.0, 0.0), "yaw": 0.5}),
        (VELOCITY & ~YAW_RATE, {"velocity": (2.0, 0.0, 0.0), "yaw_rate": 0.3}),
    ],
)
def test_headings_and_rates_of_turn_run_out_after_3_s_with_a_warning(
    mask: int, values: dict[str, object]
) -> None:
    station = rover()
    station.setpoint(mask, **values)  # type: ignore[arg-type]
    station.run(2.8)
    assert "target not received last 3secs, stopping" not in station.texts()
    station.run(0.5)
    (warning,) = (m for m in station.messages("STATUSTEXT") if m.text.startswith("target not"))
    assert warning.severity == mav.MAV_SEVERITY_WARNING
    station.run(4.0)
    assert math.hypot(*station.velocity[:2]) < 0.2


# Missions.


@pytest.mark.parametrize("vehicle", KINDS)
def test_clearing_the_mission_in_auto_is_an_error_and_it_continues(vehicle: str) -> None:
    station = under_way(vehicle)
    items = [waypoint(0, 0), waypoint(900, 0, 60), waypoint(900, 900, 60)]
    assert upload(station, items) == 0
    assert station.mode(PLANE_AUTO if vehicle == "plane" else ROVER_AUTO) == ACCEPTED
    clear = mav.MAVLink_mission_clear_all_message(1, 1)
    assert [m.type for m in station.send(clear) if m.get_type() == "MISSION_ACK"] == [ERROR]
    assert len(download(station)) == len(items)
    assert mode_of(station) == (PLANE_AUTO if vehicle == "plane" else ROVER_AUTO)
    station.mode(PLANE_GUIDED if vehicle == "plane" else HOLD)
    assert [m.type for m in station.send(clear) if m.get_type() == "MISSION_ACK"] == [0]


@pytest.mark.parametrize("vehicle", KINDS)
def test_item_0_is_home_whatever_was_sent(vehicle: str) -> None:
    station = kind(vehicle)
    assert upload(station, [waypoint(500, 500, 99), waypoint(10, 0)]) == 0
    first = download(station)[0]
    assert first.x == pytest.approx(-353632610, abs=20)
    assert first.z == pytest.approx(584.0, abs=1.0)


@pytest.mark.parametrize("vehicle", KINDS)
def test_uploads_are_asked_for_with_mission_request(vehicle: str) -> None:
    station = kind(vehicle)
    answers = station.send(mav.MAVLink_mission_count_message(1, 1, 2, 0))
    assert [message.get_type() for message in answers] == ["MISSION_REQUEST"]


@pytest.mark.parametrize("vehicle", KINDS)
def test_the_mission_state_is_none_not_started_active(vehicle: str) -> None:
    station = under_way(vehicle)
    station.interval(42, 10.0)
    station.run(0.5)
    assert station.last("MISSION_CURRENT").mission_state == 1
    upload(station, [waypoint(0, 0), waypoint(900, 0, 60)])
    station.run(0.5)
    assert station.last("MISSION_CURRENT").mission_state == 2
    station.mode(PLANE_AUTO if vehicle == "plane" else ROVER_AUTO)
    station.run(0.5)
    assert station.last("MISSION_CURRENT").mission_state == 3


@pytest.mark.parametrize("vehicle", KINDS)
def test_items_that_a_kind_cannot_do_are_taken_and_passed_over(vehicle: str) -> None:
    """Uploads in `copter_mission_misc` and `rover_mission`."""
    taken: tuple[int, ...] = (
        16,
        17,
        18,
        19,
        20,
        21,
        22,
        31,
        82,
        84,
        85,
        92,
        93,
        94,
        112,
        114,
        115,
        178,
        179,
        183,
    )
    taken += (189, 193, 194, 195, 197, 201, 206, 207, 211, 213, 217, 600)
    station = kind(vehicle)
    assert upload(station, [waypoint(0, 0), *(item(number, 10, 0) for number in taken)]) == 0
    for number in (33, 34, 36, 113, 176, 190, 192, 400, 420, 31000):
        assert upload(station, [waypoint(0, 0), item(number, 10, 0)]) == 3
