"""Compares motion: time to each target, and distance at equal times."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from comparison.recording import Timed
from comparison.replay import GUIDED, OFFBOARD, Conversation
from comparison.start import ARMED
from mavlink_sitl.geodesy import GeoPoint, LocalFrame
from mavlink_sitl.mavlink.codec import Message, dialect

Place = tuple[float, float, float]
Found = tuple[str, str | None, str | None, float]
"""The aspect, its recorded and its simulated value, and the time in s"""

TIME_TOLERANCE = 0.1
SAMPLE_S = 0.3
"""Positions are reported at 4 to 50 Hz"""
RMS_LIMIT_M = 1.5
NEAR_M = {"copter": 1.2, "rover": 2.5, "boat": 2.5}
NEAR_PART = 0.1
"""A target is also reached within this part of the way: the next may be sent right then"""
SHORTEST_S = 1.0
SAME_TARGET_M = 0.5
SHORTEST_SPAN_S = 2.0
_POSITION_IGNORED = 7
_AMSL_FRAMES = (0, 5)
_RELATIVE_FRAMES = (3, 6)
TAKE_OFF_PART = 0.9
LOWEST_TAKE_OFF_M = 1.5
_COMMANDS = ("COMMAND_LONG", "COMMAND_INT")
_COURSE_COMMANDS = (16, 17, 20, 21, 22, 176, 192, 193, 300, 400)


@dataclass(frozen=True)
class Target:
    """Somewhere to be. NED metres; the time is the recording's."""

    place: Place
    from_s: float
    to_s: float


def track(messages: Timed) -> NDArray[np.float64]:
    """Time since power-up and NED position, shape (N, 4)."""
    rows = [(t, m.x, m.y, m.z) for t, m in messages if m.get_type() == "LOCAL_POSITION_NED"]
    found = np.array(rows, dtype=np.float64).reshape(-1, 4)
    return found[np.isfinite(found).all(axis=1)]


def spans(flight: Conversation) -> list[tuple[float, float]]:
    """The times in which the real vehicle was armed and followed setpoints."""
    kind = flight.start.config.vehicle
    wanted = OFFBOARD if flight.recording.autopilot == "px4" else GUIDED[kind]
    found: list[tuple[float, float]] = []
    begin_s: float | None = None
    for time_s, beat in flight.recording.of("HEARTBEAT"):
        follows = beat.custom_mode == wanted and bool(beat.base_mode & ARMED)
        if follows and begin_s is None:
            begin_s = time_s
        elif not follows and begin_s is not None:
            found.append((begin_s, time_s))
            begin_s = None
    if begin_s is not None:
        found.append((begin_s, flight.recording.end_s))
    return [span for span in found if span[1] - span[0] > SHORTEST_SPAN_S]


def rms_distance_m(flight: Conversation, from_s: float, to_s: float) -> float:
    """Root mean square distance of the two at equal times; NaN when there is nothing."""
    real, ours = track(flight.real), track(flight.ours)
    real = real[(real[:, 0] >= from_s) & (real[:, 0] <= to_s)]
    if not len(real) or not len(ours):
        return math.nan
    there = np.stack([np.interp(real[:, 0], ours[:, 0], ours[:, i]) for i in (1, 2, 3)], axis=1)
    apart_m = np.linalg.norm(real[:, 1:] - there, axis=1)
    if flight.start.under_way:
        # It begins from rest where the real one flew past: what counts is from where they meet.
        met = np.flatnonzero(apart_m < RMS_LIMIT_M)
        apart_m = apart_m[met[0] :] if len(met) else apart_m
    return float(np.sqrt(np.mean(apart_m**2)))


def why_position_is_not_compared(flight: Conversation) -> str:
    """The reason why `position_differences` has nothing to say of a flight; empty if it has."""
    kind = flight.start.config.vehicle
    if kind != "copter":
        return f"no limit is known that fits a {kind}"
    if not spans(flight):
        return "the recorded copter did not fly in these modes"
    return "" if len(track(flight.real)) else "the recording has no LOCAL_POSITION_NED"


def position_differences(flight: Conversation) -> Iterator[Found]:
    """Spans in which a copter was elsewhere."""
    if why_position_is_not_compared(flight):
        return
    for from_s, to_s in spans(flight):
        distance_m = rms_distance_m(flight, from_s, to_s)
        if not distance_m <= RMS_LIMIT_M:
            said = f"{distance_m:.2f} m away (root mean square)"
            yield f"position until {to_s:.1f} s", "there", said, from_s


def target_differences(flight: Conversation) -> Iterator[Found]:
    """Targets that took another time, by more than a tenth."""
    for target in targets(flight):
        north, east, down = target.place
        real, ours = (_arrival_s(flight, side, target) for side in (flight.real, flight.ours))
        yield from _time_difference(
            f"target {north:.0f} {east:.0f} {down:.0f}", target.from_s, real, ours
        )
    yield from _climb_differences(flight)
    yield from _leg_differences(flight)


def _time_difference(
    what: str, from_s: float, real_s: float | None, our_s: float | None
) -> Iterator[Found]:
    if real_s is None or real_s < SHORTEST_S:
        return
    if our_s is None or abs(our_s - real_s) > max(TIME_TOLERANCE * real_s, SAMPLE_S):
        yield what, f"{real_s:.1f} s", None if our_s is None else f"{our_s:.1f} s", from_s


def _climb_differences(flight: Conversation) -> Iterator[Found]:
    """Take-offs: until nine tenths of the height that the real one reached."""
    orders = [t for t, m in flight.sent if getattr(m, "command", 0) in _COURSE_COMMANDS]
    real, ours = track(flight.real), track(flight.ours)
    for time_s, message in flight.sent:
        if (
            getattr(message, "command", 0) != dialect.MAV_CMD_NAV_TAKEOFF
            or message.get_type() not in _COMMANDS
        ):
            continue
        end_s = min((t for t in orders if t > time_s), default=flight.recording.end_s)
        times = []
        height_m = None
        for way in (real, ours):
            part = way[(way[:, 0] >= time_s) & (way[:, 0] <= end_s)]
            if height_m is None:
                height_m = TAKE_OFF_PART * float(-part[:, 3].min()) if len(part) else 0.0
            above = np.flatnonzero(-part[:, 3] >= height_m)
            times.append(float(part[above[0], 0]) - time_s if len(above) else None)
        if height_m is not None and height_m > LOWEST_TAKE_OFF_M:
            yield from _time_difference("take-off", time_s, times[0], times[1])


def _leg_differences(flight: Conversation) -> Iterator[Found]:
    """From one MISSION_ITEM_REACHED, or a later order, to the next."""
    orders = [t for t, m in flight.sent if _is_order(m)]
    repeats = flight.recording.autopilot == "px4"
    real, ours = _reached(flight.real, repeats), _reached(flight.ours, repeats)
    if [seq for _, seq in real] != [seq for _, seq in ours]:
        said = [" ".join(str(seq) for _, seq in side) or None for side in (real, ours)]
        yield "items reached", said[0], said[1], (real or ours)[0][0]
        return
    before = (-math.inf, -math.inf)
    for (real_s, seq), (our_s, _) in zip(real, ours, strict=True):
        order_s = max((t for t in orders if t < real_s), default=-math.inf)
        begin_s = max(order_s, before[0])
        if math.isfinite(begin_s):
            leg_s = real_s - begin_s, our_s - max(order_s, before[1])
            yield from _time_difference(f"item {seq}", begin_s, *leg_s)
        before = (real_s, our_s)


def _reached(messages: Timed, repeats: bool) -> list[tuple[float, int]]:
    """Each item once, of firmware that repeats it."""
    found: list[tuple[float, int]] = []
    for time_s, message in messages:
        if message.get_type() != "MISSION_ITEM_REACHED":
            continue
        if not repeats or not found or found[-1][1] != message.seq:
            found.append((time_s, message.seq))
    return found


def _is_order(message: Message) -> bool:
    kind = message.get_type()
    return (
        kind.startswith(("SET_POSITION_TARGET", "SET_MODE", "MISSION_ITEM", "MISSION_SET"))
        or getattr(message, "command", 0) in _COURSE_COMMANDS
    )


def targets(flight: Conversation) -> list[Target]:
    """The places that the vehicle was sent to while it followed."""
    found: list[Target] = []
    courses = list(_courses(flight))
    ends = [*(t for t, _ in courses[1:]), flight.recording.end_s]
    for (time_s, place), end_s in zip(courses, ends, strict=False):
        if place is None:
            continue
        for from_s, to_s in spans(flight):
            begin_s, last_s = max(from_s, time_s), min(to_s, end_s)
            if begin_s < last_s:
                found.append(Target(place, begin_s, last_s))
    return found


def _courses(flight: Conversation) -> Iterator[tuple[float, Place | None]]:
    """Each new place to go to, and None for each other order."""
    last: Place | None = None
    for time_s, message in flight.sent:
        kind = message.get_type()
        if kind.startswith("SET_POSITION_TARGET"):
            place = _place(flight, message)
            if place is not None and last is not None and math.dist(place, last) < SAME_TARGET_M:
                continue
        elif kind == "SET_MODE" or getattr(message, "command", 0) in _COURSE_COMMANDS:
            place = None
        else:
            continue
        last = place
        yield time_s, place


def _place(flight: Conversation, message: Message) -> Place | None:
    if message.type_mask & _POSITION_IGNORED or flight.start.config.vehicle == "plane":
        return None
    place: Place | None = None
    if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
        if message.coordinate_frame == dialect.MAV_FRAME_LOCAL_NED:
            place = (message.x, message.y, message.z)
    else:
        config = flight.start.config
        home = LocalFrame(config.home, config.personality().projection)
        frame = message.coordinate_frame
        if frame in (*_AMSL_FRAMES, *_RELATIVE_FRAMES):
            up_m = message.alt + (home.origin.altitude_amsl_m if frame in _RELATIVE_FRAMES else 0.0)
            if abs(message.lat_int) <= 900_000_000:
                place = home.to_local(GeoPoint(message.lat_int / 1e7, message.lon_int / 1e7, up_m))
    return place if place is not None and all(map(math.isfinite, place)) else None


def _arrival_s(flight: Conversation, messages: Timed, target: Target) -> float | None:
    """Time until it was near, or None."""
    way = track(messages)
    way = way[(way[:, 0] >= target.from_s) & (way[:, 0] <= target.to_s)]
    if not len(way):
        return None
    place = np.array(target.place)
    if flight.start.config.vehicle in ("rover", "boat"):
        place, way = place * (1, 1, 0), way * (1, 1, 1, 0)
    apart_m = np.linalg.norm(way[:, 1:] - place, axis=1)
    near_m = max(NEAR_M.get(flight.start.config.vehicle, 1.0), NEAR_PART * apart_m[0])
    there = np.flatnonzero(apart_m < near_m)
    return float(way[there[0], 0] - target.from_s) if len(there) else None
