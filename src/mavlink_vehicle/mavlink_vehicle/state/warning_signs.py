"""Records of what is wrong with the vehicle: the failsafe in force, and the signs of one."""

from __future__ import annotations

from typing import NamedTuple

from mavlink_vehicle.events import FailsafeKind


class Failsafe(NamedTuple):
    """A failsafe in force.

    Attributes:
        since_s: when it was first seen.
        kind: what it is about, as far as it is known by now.
        text: what shows it, as text; the autopilot's words if it has any for it.
    """

    since_s: float
    kind: FailsafeKind
    text: str


class Signs(NamedTuple):
    """The begin of each sign; None while there is none.

    Attributes:
        fence_s: a fence is breached (FENCE_STATUS, SYS_STATUS).
        battery_s: the charge state has become low, or worse than that (BATTERY_STATUS).
        radio_s: the receiver of the pilot's radio has become unhealthy (SYS_STATUS). A PX4 shows
            it 0.2 s after it has acted (observed).
        fix_s: the GPS has lost its 3D fix (GPS_RAW_INT). PX4 acts 5 s later, ArduCopter 8 s.
        estimator_s: the estimator has no horizontal position any more.
        stream_s: when it was last seen that setpoints had not come to a PX4 in OFFBOARD for longer
            than it waits: none went out, or nothing was heard of it either.
    """

    fence_s: float | None = None
    battery_s: float | None = None
    radio_s: float | None = None
    fix_s: float | None = None
    estimator_s: float | None = None
    stream_s: float | None = None


NO_SIGNS = Signs()
