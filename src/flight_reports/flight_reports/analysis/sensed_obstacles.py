"""Obstacles reported by the sensors in a log, and the clearance to them. No ROS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flight_logs.vehicles import Source
from flight_reports.contents.log_reader import Floats, LogContents
from flight_reports.flight_recording import NoFlightError, read_recording
from navigation_core.mapping.obstacles import Obstacles

LARGEST_LOG_BYTES = 8 << 20
"""The whole log passes the flight code, which takes about 3 s per MB."""
_SENSORS = frozenset({"OBSTACLE_DISTANCE", "DISTANCE_SENSOR"})


@dataclass(frozen=True)
class Sensed:
    """Obstacles in the map built from the sensors in a log.

    Attributes:
        ever: all that were ever in the map.
        at_end: those that were in it at the end.
    """

    ever: Obstacles
    at_end: Obstacles


@dataclass(frozen=True)
class SensedClearance:
    """Distance of the nearest obstacle measured by a scanner.

    Attributes:
        time_s: shape (n,), since the log's first packet.
        distance_m: shape (n,), from the scanner; infinite where it saw nothing.
    """

    time_s: Floats
    distance_m: Floats


def read_clearance(contents: LogContents, vehicle: Source) -> SensedClearance:
    """Return the shortest distance of each OBSTACLE_DISTANCE of a vehicle's system.

    It is measured, and not reckoned from the map: there, what moves leaves places behind that are
    still taken for occupied, and the vehicle may well be near those.
    """
    records = contents.records.get("OBSTACLE_DISTANCE")
    if records is None:
        return SensedClearance(np.zeros(0), np.zeros(0))
    own = records[records["system"] == vehicle[0]]
    # Above the sensor's reach means nothing was there; UINT16_MAX, that it was not looked
    # (https://mavlink.io/en/messages/common.html#OBSTACLE_DISTANCE).
    there = own["distances"] <= own["max_distance"][:, None]
    distance_m = np.where(there, own["distances"] * 0.01, np.inf).min(axis=1)
    return SensedClearance(own["time_s"].astype(np.float64), distance_m)


def obstacles_left_out(contents: LogContents) -> bool:
    """Return whether the log has obstacle data, but is too long."""
    return contents.counts.bytes > LARGEST_LOG_BYTES and bool(_SENSORS & contents.names)


def read_sensed(contents: LogContents, vehicle: Source) -> Sensed | None:
    """Return the obstacles sensed by a vehicle.

    Returns:
        None if nothing was seen, the log is too long, or another vehicle was the one to see.
    """
    if obstacles_left_out(contents) or not _SENSORS & contents.names:
        return None
    try:
        recording = read_recording(contents.path)
    except NoFlightError:
        return None
    if not recording.vehicle.endswith(f", system {vehicle[0]}") or not len(recording.obstacles):
        return None
    held = recording.obstacles.values
    posts = np.unique(np.concatenate([one.posts for one in held]).round(3), axis=0)
    boxes = np.unique(np.concatenate([one.boxes for one in held]).round(3), axis=0)
    return Sensed(ever=Obstacles(posts, boxes), at_end=held[-1])
