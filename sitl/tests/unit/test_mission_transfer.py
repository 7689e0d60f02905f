"""The mission service of ArduPilot as observed: each test names what was seen."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import LinkFaults
from sitl_support.ground_station import AUTO, GUIDED, GroundStation, copter
from sitl_support.missions import (
    answer,
    download,
    home,
    item,
    take_off,
    upload,
    waypoint,
)

SQUARE = [take_off(10), waypoint(20, 0), waypoint(20, 20), waypoint(0, 20)]


def items(count: int) -> list[Any]:
    return [home(), take_off(10), *(waypoint(10.0 * i, 0) for i in range(count - 2))]


@pytest.fixture
def station() -> GroundStation:
    return copter().ready()


def test_an_empty_mission_has_count_1_once_home_is_set() -> None:
    station = copter(ready_after_s=20.0)
    station.run(1.0)
    request = mav.MAVLink_mission_request_list_message(1, 1, 0)
    assert answer(station, request).count == 0
    station.ready()
    assert answer(station, request).count == 1
    (only,) = download(station)
    assert (only.x, only.y) == (-353632610, 1491652300)


def test_what_was_uploaded_is_downloaded_but_for_home(station: GroundStation) -> None:
    wrong_home = waypoint(500, 500)
    sent = [wrong_home, *SQUARE]
    assert upload(station, sent) == mav.MAV_MISSION_ACCEPTED
    assert "Flight plan received" in station.texts()
    back = download(station)
    assert (back[0].x, back[0].y, back[0].z) == (-353632610, 1491652300, pytest.approx(584, abs=2))
    for got, expected in zip(back[1:], sent[1:], strict=True):
        for name in ("command", "frame", "x", "y", "z", "param1", "autocontinue"):
            assert getattr(got, name) == getattr(expected, name)


def test_it_asks_with_mission_request_and_takes_int_and_float_items(
    station: GroundStation,
) -> None:
    first = answer(station, mav.MAVLink_mission_count_message(1, 1, 2, 0))
    assert first.get_type() == "MISSION_REQUEST"
    second = answer(station, home())
    assert (second.get_type(), second.seq) == ("MISSION_REQUEST", 1)
    as_float = mav.MAVLink_mission_item_message(
        1, 1, 1, 3, 16, 0, 1, 0, 0, 0, 0, -35.3630813, 149.16523, 10.0, 0
    )
    assert answer(station, as_float).type == mav.MAV_MISSION_ACCEPTED
    back = download(station)[1]
    assert back.x == pytest.approx(-353630813, abs=40)


def test_mission_request_is_answered_with_a_float_item(station: GroundStation) -> None:
    upload(station, [home(), *SQUARE])
    got = answer(station, mav.MAVLink_mission_request_message(1, 1, 2, 0))
    assert got.get_type() == "MISSION_ITEM"
    assert got.x == pytest.approx(-35.363081, abs=1e-5)


def test_an_item_beyond_the_end_is_an_invalid_sequence(station: GroundStation) -> None:
    got = answer(station, mav.MAVLink_mission_request_int_message(1, 1, 5, 0))
    assert (got.get_type(), got.type) == ("MISSION_ACK", 13)


BAD = [
    (item(12345), 3),
    (item(frame=99), 2),
    (item(north_m=2e7), 10),
    (item(params=(math.nan,)), 6),
    (item(up_m=math.nan), 12),
    (item(params=(0, 0, 0, math.inf)), 9),
]


@pytest.mark.parametrize(("bad", "result"), BAD, ids=[str(result) for _, result in BAD])
def test_a_bad_item_ends_the_upload_with_its_result(
    station: GroundStation, bad: mav.MAVLink_message, result: int
) -> None:
    assert upload(station, [home(), take_off(10), bad, waypoint(1, 1)]) == result
    assert answer(station, waypoint(1, 1)).type == mav.MAV_MISSION_ERROR, "nothing is under way"


def test_too_many_items_are_rejected(station: GroundStation) -> None:
    got = answer(station, mav.MAVLink_mission_count_message(1, 1, 5000, 0))
    assert got.type == mav.MAV_MISSION_NO_SPACE
    assert "Only 650 items are supported" in station.texts()


def test_an_upload_left_alone_has_truncated_the_mission(station: GroundStation) -> None:
    """MISSION_COUNT 3, then silence: total 2, asked every second, cancelled after 8."""
    upload(station, items(6))
    station.run(0.1)
    begin_s = station.now_s
    station.send(mav.MAVLink_mission_count_message(1, 1, 3, 0))
    assert answer(station, mav.MAVLink_mission_request_list_message(1, 1, 0)).count == 3
    station.run(10.0)
    asked = [m for m in station.messages("MISSION_REQUEST", begin_s) if m.seq == 0]
    assert len(asked) == 8
    ack = station.messages("MISSION_ACK", begin_s)[-1]
    assert ack.type == mav.MAV_MISSION_OPERATION_CANCELLED
    assert "Mission upload timeout" in station.texts(begin_s)


def test_a_partial_upload_leaves_new_items_before_old_ones(station: GroundStation) -> None:
    upload(station, items(5))
    station.send(mav.MAVLink_mission_count_message(1, 1, 5, 0))
    for place, one in enumerate([home(), take_off(33)]):
        one.seq = place
        station.send(one)
    station.run(10.0)
    back = download(station)
    assert len(back) == 5
    assert back[1].z == 33
    assert back[2].command == mav.MAV_CMD_NAV_WAYPOINT


def test_an_item_sent_twice_is_no_mistake(station: GroundStation) -> None:
    station.send(mav.MAVLink_mission_count_message(1, 1, 2, 0))
    assert answer(station, home()).seq == 1
    assert answer(station, home()).seq == 1
    out_of_order = waypoint(1, 1)
    out_of_order.seq = 7
    assert answer(station, out_of_order).type == mav.MAV_MISSION_INVALID_SEQUENCE


def test_another_sender_is_denied_while_an_upload_runs(station: GroundStation) -> None:
    other = GroundStation(station.simulation, system=77)
    station.send(mav.MAVLink_mission_count_message(1, 1, 2, 0))
    assert answer(other, mav.MAVLink_mission_count_message(1, 1, 2, 0)).type == 14
    assert answer(other, home()).type == 14


def test_another_sender_clears_nothing_while_an_upload_runs(station: GroundStation) -> None:
    other = GroundStation(station.simulation, system=77)
    station.send(mav.MAVLink_mission_count_message(1, 1, 2, 0))
    answers = other.send(mav.MAVLink_mission_clear_all_message(1, 1, 0))
    assert [m.type for m in answers if m.get_type() == "MISSION_ACK"] == [14, 1]
    assert answer(station, home()).seq == 1


@pytest.mark.parametrize("mission_type", [0, 1, 2])
def test_clear_all_clears(station: GroundStation, mission_type: int) -> None:
    upload(station, items(4))
    corner = item(5003, params=(50.0,), mission_type=1)
    assert upload(station, [corner], 1) == mav.MAV_MISSION_ACCEPTED
    assert upload(station, [item(5100, 50, 50, 20, mission_type=2)], 2) == mav.MAV_MISSION_ACCEPTED
    got = answer(station, mav.MAVLink_mission_clear_all_message(1, 1, mission_type))
    assert (got.type, got.mission_type) == (mav.MAV_MISSION_ACCEPTED, mission_type)
    left = [
        answer(station, mav.MAVLink_mission_request_list_message(1, 1, kind)).count
        for kind in (0, 1, 2)
    ]
    assert left == [1 if mission_type == 0 else 4] + [
        0 if mission_type == kind else 1 for kind in (1, 2)
    ]


def test_a_polygon_needs_three_corners_and_a_circle_a_radius(station: GroundStation) -> None:
    two = [item(5001, 10.0 * i, 0, params=(2.0,), mission_type=1) for i in range(2)]
    assert upload(station, two, 1) == mav.MAV_MISSION_ERROR
    assert upload(station, [item(5003, mission_type=1)], 1) == mav.MAV_MISSION_ERROR


def test_an_unknown_list_is_unsupported(station: GroundStation) -> None:
    got = answer(station, mav.MAVLink_mission_request_list_message(1, 1, 9))
    assert got.type == mav.MAV_MISSION_UNSUPPORTED


def test_set_current_is_answered_by_mission_current(station: GroundStation) -> None:
    upload(station, items(5))
    assert answer(station, mav.MAVLink_mission_set_current_message(1, 1, 3)).seq == 3
    assert station.command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 2) == 0
    assert station.last("MISSION_CURRENT").seq == 2
    assert station.command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 99) == 2


def test_part_of_a_list_can_be_written_again(station: GroundStation) -> None:
    upload(station, items(5))
    station.send(mav.MAVLink_mission_write_partial_list_message(1, 1, 2, 2, 0))
    changed = waypoint(77, 7)
    changed.seq = 2
    assert answer(station, changed).type == mav.MAV_MISSION_ACCEPTED
    assert len(download(station)) == 5
    assert download(station)[2].x == changed.x
    beyond = mav.MAVLink_mission_write_partial_list_message(1, 1, 3, 9, 0)
    assert answer(station, beyond).type == mav.MAV_MISSION_ERROR


def test_a_mission_outlives_a_reboot(station: GroundStation) -> None:
    upload(station, items(5))
    station.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    station.run(5.0)
    assert len(download(station)) == 5


def test_an_upload_over_a_lossy_link_ends_well() -> None:
    """A fifth of all packets is lost; the client repeats what is not answered."""
    faults = LinkFaults(loss=0.2, duplicate=0.1)
    station = copter()
    station.ready()
    station.vehicle.link.set_faults(faults)
    sent = items(20)
    station.send(mav.MAVLink_mission_count_message(1, 1, len(sent), 0))
    first_s = begin_s = quiet_since_s = station.now_s
    place = -1
    while not [m for m in station.messages("MISSION_ACK", begin_s) if m.type == 0]:
        assert station.now_s - first_s < 60.0
        station.run(0.05)
        asked = station.messages("MISSION_REQUEST", begin_s)
        wanted = asked[-1].seq if asked else -1
        if station.messages("MISSION_ACK", begin_s):
            # The last item came, and its acknowledgement was lost: begin again.
            begin_s, wanted, place = station.now_s, -1, len(sent)
        if wanted != place or station.now_s - quiet_since_s > 0.5:
            place, quiet_since_s = wanted, station.now_s
            if place < 0:
                station.send(mav.MAVLink_mission_count_message(1, 1, len(sent), 0))
            else:
                sent[place].seq = place
                station.send(sent[place])
    station.vehicle.link.set_faults(None)
    assert [m.command for m in download(station)] == [m.command for m in sent]


def test_auto_without_a_mission_is_accepted_on_the_ground_only(station: GroundStation) -> None:
    assert station.mode(AUTO) == 0
    station.mode(GUIDED)
    station.take_off(5)
    assert station.mode(AUTO) == 4
    assert "Mode change to AUTO failed: init failed" in station.texts()
