"""What ROS saw, as MAVLink messages for the recording only.

A tlog holds what went over the link. Goals and their progress do not, so the recorder
adds them as STATUSTEXT and NAMED_VALUE_FLOAT, from a component id of their own that never
sends anything on the link (:data:`COMPONENT_ID`). Any tlog viewer shows them.
"""

from __future__ import annotations

from mavlink_vehicle import codec
from mavlink_vehicle.codec import Message
from navigation_core.geometry import Vector3
from navigation_core.tasks.base import Progress

# MAV_COMP_ID_ONBOARD_COMPUTER4 (common.xml): the recorder's own voice.
COMPONENT_ID = 194
_MAV_SEVERITY_INFO = 6


def text(words: str) -> Message:
    """Return a STATUSTEXT of at most 50 bytes."""
    return codec.make(
        "STATUSTEXT", severity=_MAV_SEVERITY_INFO, text=words.encode("ascii", "replace")[:50]
    )


def goal_accepted(short_id: str, target_enu_m: Vector3) -> Message:
    """Return the note of an accepted goal, which :func:`parse_goal` reads back."""
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


def progress(state: Progress, now: float) -> list[Message]:
    """Return the distance (m) and the time (s) that remain, as named values."""
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
    ]
