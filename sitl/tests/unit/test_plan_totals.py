"""ArduPilot reports the lengths of its lists, and why it rejects one."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import GroundStation
from sitl_support.kinds import kind
from sitl_support.missions import (
    answer,
    fence_with_hole,
    home,
    item,
    rally_point,
    take_off,
    upload,
    waypoint,
)

KINDS = ["copter", "rover", "boat", "plane"]
INCLUSION, EXCLUSION = 5001, 5002
CIRCLE_IN, CIRCLE_OUT, RETURN = 5003, 5004, 5000
FENCE, RALLY = 1, 2


@pytest.fixture(name="station")
def ready() -> GroundStation:
    return kind("copter")


def of(mission_type: int, items: list[mav.MAVLink_message]) -> list[mav.MAVLink_message]:
    """The same items for another list."""
    for one in items:
        one.mission_type = mission_type
    return items


def fence() -> list[mav.MAVLink_message]:
    return of(FENCE, fence_with_hole())


def told(station: GroundStation, name: str) -> list[float]:
    """The values of a parameter that were reported, unasked."""
    return [m.param_value for m in station.messages("PARAM_VALUE") if m.param_id == name]


def read(station: GroundStation, name: str) -> float:
    """The value of a parameter, as a ground station reads it."""
    request = mav.MAVLink_param_request_read_message(1, 1, name.encode(), -1)
    (value,) = station.send(request)
    return float(value.param_value)


def clear(station: GroundStation, mission_type: int) -> None:
    station.send(mav.MAVLink_mission_clear_all_message(1, 1, mission_type))


@pytest.mark.parametrize("vehicle", KINDS)
def test_parameters_count_what_is_stored(vehicle: str) -> None:
    station = kind(vehicle)
    assert upload(station, [home(), take_off(10), waypoint(5, 5)]) == 0
    assert upload(station, fence(), FENCE) == 0
    assert upload(station, of(RALLY, [rally_point(), rally_point()]), RALLY) == 0
    assert told(station, "MIS_TOTAL")[-3:] == [1, 2, 3]
    assert told(station, "FENCE_TOTAL") == [4 + 1 + 2]
    assert told(station, "RALLY_TOTAL") == [1, 2]
    assert [read(station, f"{n}_TOTAL") for n in ("MIS", "FENCE", "RALLY")] == [3, 7, 2]
    for mission_type in (0, FENCE, RALLY):
        clear(station, mission_type)
    assert [read(station, f"{n}_TOTAL") for n in ("MIS", "FENCE", "RALLY")] == [0, 0, 0]


def test_a_fence_of_one_circle_counts_as_none(station: GroundStation) -> None:
    """So that a client of the older protocol asks for no points."""
    assert upload(station, [item(CIRCLE_IN, params=(50.0,), mission_type=FENCE)], FENCE) == 0
    assert told(station, "FENCE_TOTAL") == [0]
    assert "Fence Indexed OK" in station.texts()


def test_totals_outlive_a_reboot(station: GroundStation) -> None:
    upload(station, fence(), FENCE)
    station.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    station.run(5.0)
    assert read(station, "FENCE_TOTAL") == 7


def corners(command: int, said: float, number: int) -> list[mav.MAVLink_message]:
    return [
        item(command, 10.0 * i, 5.0 * i * i, params=(said,), mission_type=FENCE)
        for i in range(number)
    ]


REJECTED = {
    "two corners": (corners(INCLUSION, 2, 2), "Invalid vertex count (2)"),
    "no number": (corners(INCLUSION, math.nan, 3), "Invalid vertex count (0)"),
    "kinds mixed": (
        [*corners(INCLUSION, 3, 2), *corners(EXCLUSION, 3, 1)],
        "Received incorrect vertex type (want=98 got=97)",
    ),
    "counts differ": (
        [*corners(INCLUSION, 3, 2), *corners(INCLUSION, 4, 1)],
        "Unexpected vertex count want=3 got=4\n",
    ),
    "a circle inside": (
        [*corners(INCLUSION, 3, 2), *corners(CIRCLE_OUT, 9, 1)],
        "Received incorrect type (want=98 got=93)",
    ),
    "too few corners": (corners(INCLUSION, 4, 3), "Incorrect item count"),
    "no radius": (corners(CIRCLE_OUT, 0, 1), "Non-positive circle radius"),
    "radius no number": (corners(CIRCLE_IN, math.nan, 1), "Non-positive circle radius"),
    "two returns": (corners(RETURN, 0, 2), "Multiple return points"),
    "off the earth": ([item(CIRCLE_IN, 2e7, params=(5.0,), mission_type=FENCE)], "Bad lat or lon"),
}


@pytest.mark.parametrize("case", REJECTED)
def test_a_bad_fence_is_an_error_with_its_reason(station: GroundStation, case: str) -> None:
    """And the fence before it stays."""
    assert upload(station, fence(), FENCE) == 0
    items, reason = REJECTED[case]
    assert upload(station, items, FENCE) == mav.MAV_MISSION_ERROR
    assert station.texts()[-2:] == [reason, "Fence validation failed"]
    assert len(station.vehicle.plans.fence.items) == 5
    assert read(station, "FENCE_TOTAL") == 7


@pytest.mark.parametrize("mission_type", [FENCE, RALLY])
def test_the_frame_of_actions_is_none_for_a_place(
    station: GroundStation, mission_type: int
) -> None:
    one = item(CIRCLE_IN if mission_type == FENCE else 5100, params=(9.0,), frame=2)
    one.mission_type = mission_type
    assert upload(station, [one], mission_type) == mav.MAV_MISSION_UNSUPPORTED_FRAME


def test_a_part_of_a_fence_is_denied(station: GroundStation) -> None:
    upload(station, fence(), FENCE)
    ack = answer(station, mav.MAVLink_mission_write_partial_list_message(1, 1, 0, 1, FENCE))
    assert (ack.get_type(), ack.type) == ("MISSION_ACK", mav.MAV_MISSION_DENIED)


def test_a_part_is_denied_during_an_upload(station: GroundStation) -> None:
    upload(station, [home(), take_off(10), waypoint(5, 5)])
    station.send(mav.MAVLink_mission_count_message(1, 1, 3, 0))
    ack = answer(station, mav.MAVLink_mission_write_partial_list_message(1, 1, 1, 1, 0))
    assert ack.type == mav.MAV_MISSION_DENIED
    assert answer(station, home()).get_type() == "MISSION_REQUEST", "the upload continues"


def test_a_part_beyond_the_list_is_an_error_with_a_text(station: GroundStation) -> None:
    ack = answer(station, mav.MAVLink_mission_write_partial_list_message(1, 1, 3, 9, 0))
    assert ack.type == mav.MAV_MISSION_ERROR
    assert station.texts()[-1] == "Flight plan update rejected"


def test_too_many_items_end_the_upload_under_way(station: GroundStation) -> None:
    station.send(mav.MAVLink_mission_count_message(1, 1, 3, 0))
    ack = answer(station, mav.MAVLink_mission_count_message(1, 1, 651, 0))
    assert ack.type == mav.MAV_MISSION_NO_SPACE
    assert answer(station, home()).type == mav.MAV_MISSION_ERROR, "nothing is under way"
    station.log.clear()
    station.run(3.0)
    assert not station.messages("MISSION_REQUEST")


@pytest.mark.parametrize(
    "message",
    [
        mav.MAVLink_fence_fetch_point_message(1, 1, 0),
        mav.MAVLink_fence_point_message(1, 1, 0, 1, -35.0, 149.0),
    ],
    ids=["FENCE_FETCH_POINT", "FENCE_POINT"],
)
def test_the_older_fence_protocol_is_not_answered(
    station: GroundStation, message: mav.MAVLink_message
) -> None:
    """As built, ArduPilot 4.7 has no handler for it (AC_Fence_config.h)."""
    upload(station, fence(), FENCE)
    assert station.send(message) == []
    assert len(station.vehicle.plans.fence.items) == 5
