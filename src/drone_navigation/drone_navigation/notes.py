"""What ROS saw, as MAVLink messages for the recording only.

A tlog holds what went over the link. Goals and their progress do not, so the recorder
adds them as STATUSTEXT and NAMED_VALUE_FLOAT, from a component id of their own that never
sends anything on the link (:data:`COMPONENT_ID`). Any tlog viewer shows them.
"""

from __future__ import annotations

import itertools
import math

from mavlink_vehicle import codec
from mavlink_vehicle.codec import Message
from navigation_core.geometry import Vector3
from navigation_core.tasks.base import Progress

# MAV_COMP_ID_ONBOARD_COMPUTER4 (common.xml): the recorder's own voice.
COMPONENT_ID = 194
_MAV_SEVERITY_INFO = 6
_PLAN_NAME = b"plan"
_PLAN_POINTS = 19
_PLAN_POINTS_MAX = 95


def text(words: str) -> Message:
    """Return a STATUSTEXT of at most 50 bytes."""
    return codec.make(
        "STATUSTEXT", severity=_MAV_SEVERITY_INFO, text=words.encode("ascii", "replace")[:50]
    )


def goal_accepted(short_id: str, target_enu_m: Vector3) -> Message:
    """Return the note of an accepted goal, which :func:`parse_goal` reads back.

    A route has one for each of its waypoints, in order.
    """
    x, y, z = target_enu_m
    return text(f"goal {short_id} to {x:.2f} {y:.2f} {z:.2f}")


def parse_goal(words: str) -> tuple[str, Vector3] | None:
    """Return (short id, target ENU in metres) of a note made by :func:`goal_accepted`."""
    parts = words.split()
    if len(parts) != 6 or parts[0] != "goal" or parts[2] != "to":
        return None
    try:
        return parts[1], (float(parts[3]), float(parts[4]), float(parts[5]))
    except ValueError:
        return None


def plan(path_enu_m: tuple[Vector3, ...]) -> list[Message]:
    """Return a planned way as DEBUG_FLOAT_ARRAYs, which :func:`parse_plan` reads back.

    Each holds up to 19 points, east, north and up in metres; ``array_id`` counts what is to
    come after it, so that the last one is 0. NaN fills what is left.
    """
    step = max(math.ceil(len(path_enu_m) / _PLAN_POINTS_MAX), 1)
    points = [*path_enu_m[:-1:step], *path_enu_m[-1:]]
    parts = [points[i : i + _PLAN_POINTS] for i in range(0, len(points), _PLAN_POINTS)]
    return [
        codec.make(
            "DEBUG_FLOAT_ARRAY",
            time_usec=0,
            name=_PLAN_NAME,
            array_id=left,
            data=[*itertools.chain(*part)] + [math.nan] * (58 - 3 * len(part)),
        )
        for left, part in zip(range(len(parts) - 1, -1, -1), parts, strict=True)
    ]


def parse_plan(message: Message) -> tuple[tuple[Vector3, ...], bool] | None:
    """Return the points (ENU, m) of a part of a plan, and whether it is the last part.

    Returns:
        None if the message is not one made by :func:`plan`.
    """
    if message.get_type() != "DEBUG_FLOAT_ARRAY" or message.name.encode() != _PLAN_NAME:
        return None
    numbers = [value for value in message.data if math.isfinite(value)]
    points = tuple(zip(numbers[::3], numbers[1::3], numbers[2::3], strict=False))
    return points, message.array_id == 0


def progress(state: Progress, now: float) -> list[Message]:
    """Return the distance (m) and the time (s) that remain, and the replans, as named values."""
    boot_ms = int(now * 1000.0) & 0xFFFFFFFF
    return [
        codec.make(
            "NAMED_VALUE_FLOAT",
            time_boot_ms=boot_ms,
            name=b"dist_rem",
            value=state.distance_remaining_m,
        ),
        codec.make(
            "NAMED_VALUE_FLOAT",
            time_boot_ms=boot_ms,
            name=b"time_rem",
            value=state.time_remaining_s,
        ),
        codec.make("NAMED_VALUE_INT", time_boot_ms=boot_ms, name=b"replans", value=state.replans),
    ]
