"""Missions for the simulated autopilot: items near its home, and transfers as clients do them."""

from __future__ import annotations

import math
from typing import Any

from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.config import DEFAULT_HOME
from sitl_support.ground_station import GroundStation

Message = Any
METRE = 1e7 / 111318.845
"""1e7 degrees of latitude per metre"""
HOME = (round(DEFAULT_HOME.latitude_deg * 1e7), round(DEFAULT_HOME.longitude_deg * 1e7))


def item(
    command: int = mav.MAV_CMD_NAV_WAYPOINT,
    north_m: float = 0.0,
    east_m: float = 0.0,
    up_m: float = 0.0,
    params: tuple[float, ...] = (),
    frame: int = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    mission_type: int = 0,
    anywhere: bool = False,
) -> Message:
    """MISSION_ITEM_INT at an offset from the default home; `anywhere` leaves x and y zero."""
    values = [*params, *([0.0] * (4 - len(params)))]
    scale = math.cos(math.radians(DEFAULT_HOME.latitude_deg))
    x = 0 if anywhere else HOME[0] + round(north_m * METRE)
    y = 0 if anywhere else HOME[1] + round(east_m * METRE / scale)
    return mav.MAVLink_mission_item_int_message(
        1, 1, 0, frame, command, 0, 1, *values, x, y, up_m, mission_type
    )


def home() -> Message:
    """Item 0 of an ArduPilot mission."""
    return item(frame=mav.MAV_FRAME_GLOBAL, up_m=DEFAULT_HOME.altitude_amsl_m)


def take_off(height_m: float) -> Message:
    return item(mav.MAV_CMD_NAV_TAKEOFF, up_m=height_m, anywhere=True)


def waypoint(north_m: float, east_m: float, up_m: float = 10.0, stay_s: float = 0.0) -> Message:
    return item(north_m=north_m, east_m=east_m, up_m=up_m, params=(stay_s,))


def fence_with_hole() -> list[Message]:
    """A square of 200 m about home to stay in, and a circle of 8 m to keep out of."""
    corners = ((-100.0, -100.0), (-100.0, 100.0), (100.0, 100.0), (100.0, -100.0))
    square = [item(mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, n, e, params=(4.0,), frame=0)
              for n, e in corners]  # fmt: skip
    hole = item(mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, 30.0, 30.0, params=(8.0,), frame=0)
    return [*square, hole]


def rally_point() -> Message:
    return item(mav.MAV_CMD_NAV_RALLY_POINT, 20.0, -10.0, 15.0)


def upload(station: GroundStation, items: list[Message], mission_type: int = 0) -> int:
    """Upload a list; the MAV_MISSION_RESULT of its acknowledgement."""
    answers = station.send(mav.MAVLink_mission_count_message(1, 1, len(items), mission_type))
    for _ in range(2 * len(items) + 2):
        for message in answers:
            if message.get_type() == "MISSION_ACK":
                assert message.mission_type == mission_type
                return int(message.type)
        asked = [m for m in answers if m.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT")]
        assert len(asked) == 1, "one question at a time"
        wanted = items[asked[0].seq]
        wanted.seq = asked[0].seq
        answers = station.send(wanted)
    raise AssertionError("the upload does not end")


def download(station: GroundStation, mission_type: int = 0) -> list[Message]:
    """Download a list."""
    (count,) = station.send(mav.MAVLink_mission_request_list_message(1, 1, mission_type))
    assert count.get_type() == "MISSION_COUNT"
    found = []
    for seq in range(count.count):
        request = mav.MAVLink_mission_request_int_message(1, 1, seq, mission_type)
        (answer,) = station.send(request)
        assert answer.get_type() == "MISSION_ITEM_INT"
        assert answer.seq == seq
        found.append(answer)
    return found


def answer(station: GroundStation, message: Message) -> Message:
    """The only answer to a message; texts and values for all links do not count."""
    told = ("STATUSTEXT", "PARAM_VALUE")
    answers = [m for m in station.send(message) if m.get_type() not in told]
    assert len(answers) == 1, answers
    return answers[0]
