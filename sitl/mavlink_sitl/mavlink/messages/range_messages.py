"""Telemetry of the range sensors. Nothing is sent by a vehicle that has none."""

from __future__ import annotations

import math

from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import Snapshot, boot_ms, to_int

LEAST_CM = 10
SECTORS = 72
_BESIDE = 4
"""Sectors on each side of the nose that still count as forwards, 22.5 degrees as in ArduPilot"""


def obstacle_distance(s: Snapshot) -> Message | None:
    """OBSTACLE_DISTANCE: 72 sectors of 5 degrees, clockwise from the nose.

    max_distance + 1 means that nothing is within reach, as the message's definition says.
    """
    seen = s.vehicle.body.measure_ranges()
    if seen is None:
        return None
    reach_cm = to_int(seen.reach_m * 100.0, 0, 65533)
    distances = [
        max(round(d * 100.0), LEAST_CM) if math.isfinite(d) else reach_cm + 1
        for d in seen.sectors_m
    ]
    return dialect.MAVLink_obstacle_distance_message(
        s.time_boot_us, dialect.MAV_DISTANCE_SENSOR_LASER, distances, 360 // SECTORS, LEAST_CM,
        reach_cm, 360.0 / SECTORS, 0.0, dialect.MAV_FRAME_BODY_FRD,
    )  # fmt: skip


def distance_sensor(s: Snapshot) -> list[Message] | None:
    """DISTANCE_SENSOR: one downwards (id 0) and one forwards (id 1).

    Nothing within reach: the reach itself, with signal quality 1 ("invalid").
    """
    seen = s.vehicle.body.measure_ranges()
    if seen is None:
        return None
    ahead_m = min(*seen.sectors_m[: _BESIDE + 1], *seen.sectors_m[-_BESIDE:])
    return [
        _beam(s, 0, dialect.MAV_SENSOR_ROTATION_PITCH_270, seen.down_m, seen.reach_down_m),
        _beam(s, 1, dialect.MAV_SENSOR_ROTATION_NONE, ahead_m, seen.reach_m),
    ]


def _beam(s: Snapshot, number: int, orientation: int, distance_m: float, reach_m: float) -> Message:
    valid = math.isfinite(distance_m)
    reach_cm = to_int(reach_m * 100.0, 0, 65534)
    return dialect.MAVLink_distance_sensor_message(
        boot_ms(s), LEAST_CM, reach_cm, to_int(distance_m * 100.0, 0, 65535) if valid else reach_cm,
        dialect.MAV_DISTANCE_SENSOR_LASER, number, orientation, 255, 0.0, 0.0, [0.0] * 4,
        100 if valid else 1,
    )  # fmt: skip
