"""The local frames of real firmwares agree with the assumed projections.

GLOBAL_POSITION_INT and LOCAL_POSITION_NED of one moment are the same place in degrees and in the
firmware's own metres. `tests/data/positions` has such pairs of two recordings, spread over the
way: a plane over 400 m (ArduPilot) and a copter over 40 m north and 13 m east (PX4).
"""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from flight_reports.contents.log_reader import read_contents
from flight_reports.contents.track import read_track
from mavlink_vehicle.codec import Codec, Message, mavlink
from mavlink_vehicle.io.tlog import TlogReader
from mavlink_vehicle.positions import frames
from mavlink_vehicle.positions.frames import (
    Geodetic,
    LocalFrame,
    Projection,
    Vector3,
    equidistant_at,
)
from mavlink_vehicle.profiles import ardupilot, px4
from mavlink_vehicle.state.reducer import VehicleState, reduce
from navigation_bridge.vehicle.map_frame import MapFrame

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("recordings")]  # each is played once

ROOT = Path(__file__).resolve().parents[2]
PLANE, MISSION = "positions/plane_guided", "positions/mission_clear"
RECORDINGS = [
    PLANE,
    MISSION,
    "copter_lowbatt",
    "rover_guided",
    "offboard_10m_20n_gt_api",
]
OTHERS: dict[str, Projection] = {
    PLANE: px4.PROJECTION,
    MISSION: ardupilot.PROJECTION,
}
SKEW_S = 0.02
# 1e-7 degree is 1.1 cm, cut off, in the origin and in the place, and the two are not always of the
# same moment.
AGREE_M = 0.025


class Pair(NamedTuple):
    """One moment: the reported position in degrees, and in metres."""

    place: Geodetic
    position_ned_m: Vector3


@functools.cache
def messages(name: str) -> tuple[tuple[float, Message], ...]:
    codec = Codec(255, 190)
    records = TlogReader(ROOT / f"tests/data/{name}.tlog")
    return tuple((time_s, message) for time_s, data in records for message in codec.decode(data))


def states(name: str, *, known: bool = True) -> list[VehicleState]:
    """Return the state after each position; `known` says whether the firmware was."""
    state, found = VehicleState(system_id=1), []
    for time_s, message in messages(name):
        if known or message.get_type() != "HEARTBEAT":
            state = reduce(state, message, time_s)
        if message.get_type() in ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"):
            found.append(state)
    return found


def pair_of(state: VehicleState) -> Pair | None:
    place, local = state.global_position, state.local_position
    if place is None or local is None:
        return None
    later_s = 1e-3 * (place.time_boot_ms - local.time_boot_ms)
    if abs(later_s) > SKEW_S:
        return None
    ned = np.array(local.position_ned_m) + later_s * np.array(local.velocity_ned_m_s)
    north, east, down = ned.tolist()
    return Pair(
        (place.latitude_deg, place.longitude_deg, place.altitude_amsl_m), (north, east, down)
    )


def pairs(name: str) -> list[Pair]:
    return [pair for state in states(name) if (pair := pair_of(state)) is not None]


def projection(name: str) -> Projection:
    (autopilot,) = {state.autopilot for state in states(name)[-1:]}
    return ardupilot.PROJECTION if autopilot == 3 else px4.PROJECTION


def apart_m(frame: LocalFrame, pair: Pair) -> float:
    return math.dist(frame.ned_m(pair.place)[:2], pair.position_ned_m[:2])


def farthest_m(name: str, tried: Projection) -> float:
    """The largest difference of any pair in the frame that the first one gives."""
    first, *rest = pairs(name)
    frame = LocalFrame.through(*first, tried)
    return max(apart_m(frame, pair) for pair in rest)


@pytest.mark.parametrize("name", RECORDINGS)
def test_every_pair_agrees_by_the_projection_of_the_profile(name: str) -> None:
    assert len(pairs(name)) > 15
    assert farthest_m(name, projection(name)) < AGREE_M


@pytest.mark.parametrize("name", OTHERS)
def test_no_other_projection_does(name: str) -> None:
    """So that the recordings tell them apart: by a decimetre over 400 m, by 2 cm over 40 m."""
    latitude_deg = pairs(name)[0].place[0]
    good_m = np.mean([apart_m(_frame(name, projection(name)), pair) for pair in pairs(name)])
    for other in (OTHERS[name], equidistant_at(latitude_deg)):
        found_m = np.mean([apart_m(_frame(name, other), pair) for pair in pairs(name)])
        assert found_m > 1.5 * good_m


def _frame(name: str, tried: Projection) -> LocalFrame:
    """The frame of least squares, so that the rounding of the first pair is no matter."""
    first, *_ = pairs(name)
    frame = LocalFrame.through(*first, tried)
    off = np.mean([np.subtract(frame.ned_m(p.place), p.position_ned_m) for p in pairs(name)], 0)
    north_m, east_m, down_m = off.tolist()
    return replace(frame, origin=frame.geodetic((north_m, east_m, down_m)))


@pytest.mark.parametrize(
    ("name", "axis", "expected", "within"),
    [
        (PLANE, 0, 111318.845, 3.0),
        (PLANE, 1, 111318.845, 3.0),
        (MISSION, 0, 111194.927, 10.0),
        (MISSION, 1, 111194.927, 20.0),
    ],
)
def test_a_degree_has_the_firmwares_length(
    name: str, axis: int, expected: float, within: float
) -> None:
    """By a straight line through all pairs, which knows of no projection at all."""
    found = pairs(name)
    degrees = np.array([pair.place[axis] for pair in found])
    if axis == 1:
        degrees = degrees * math.cos(math.radians(np.mean([pair.place[0] for pair in found])))
    metres = np.array([pair.position_ned_m[axis] for pair in found])
    slope = np.polyfit(degrees - degrees.mean(), metres, 1)[0]
    assert slope == pytest.approx(expected, abs=within)
    assert {3: 111318.845, 12: 111194.927}[states(name)[-1].autopilot] == expected


@pytest.mark.parametrize("name", [MISSION, "copter_lowbatt", "offboard_10m_20n_gt_api"])
def test_home_is_reported_in_degrees_and_in_metres(name: str) -> None:
    homes = [m for _, m in messages(name) if m.get_type() == "HOME_POSITION"]
    frame = _frame(name, projection(name))
    for home in homes:
        place = (home.latitude * 1e-7, home.longitude * 1e-7, home.altitude * 1e-3)
        if math.isfinite(home.x):
            assert math.dist(frame.ned_m(place)[:2], (home.x, home.y)) < AGREE_M
    assert homes


@pytest.mark.parametrize(("known", "within_m"), [(True, AGREE_M), (False, 0.06)])
@pytest.mark.parametrize("name", RECORDINGS)
def test_the_map_frame_shows_what_the_vehicle_says_itself(
    name: str, known: bool, within_m: float
) -> None:
    """Feedback, arrival and topics are made of it; of an unknown firmware it is measured."""
    found = states(name, known=known)
    assert (found[-1].autopilot != mavlink.MAV_AUTOPILOT_GENERIC) == known
    frame, compared = MapFrame(), 0
    if not known:  # it learns on its first way
        for state in found:
            frame.update(state)
    for state in found:
        frame.update(state)
        pose, pair = frame.pose(state), pair_of(state)
        if pose is not None and pair is not None:
            north_m, east_m, _ = frames.enu_to_ned(pose.position_enu_m)
            assert math.dist((north_m, east_m), pair.position_ned_m[:2]) < within_m
            compared += 1
    assert compared > 15


@pytest.mark.parametrize("name", RECORDINGS)
def test_reports_draw_where_the_vehicle_said_that_it_was(name: str) -> None:
    contents = read_contents(ROOT / f"tests/data/{name}.tlog")
    track, places = read_track(contents, (1, 1)), contents.of("GLOBAL_POSITION_INT", (1, 1))
    assert places is not None
    assert track.frame is not None
    drawn = {
        int(place["time_boot_ms"]): position
        for place, position in zip(places[-len(track.time_s) :], track.position_enu_m, strict=True)
    }
    compared = 0
    for state in states(name):
        pair = pair_of(state)
        if pair is not None and state.global_position is not None:
            position = drawn.get(state.global_position.time_boot_ms)
            if position is not None:
                north_m, east_m, _ = pair.position_ned_m
                assert math.dist(position[:2], (east_m, north_m)) < AGREE_M
                compared += 1
    assert compared > 15
