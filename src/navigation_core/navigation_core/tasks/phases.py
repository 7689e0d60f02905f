"""The phases of all tasks, and for each task the table of those that may follow each other."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto
from typing import TypeAlias

from navigation_core.tasks.progress import Status


class Phase(Enum):
    """The phase of a task. Each task has some of them."""

    HALTING = auto()
    """The vehicle stops its flight by setpoints, before a mission is uploaded."""
    UPLOADING = auto()
    PREPARING = auto()
    """It gets into the mode in which it follows setpoints, or can be armed."""
    ARMING = auto()
    TAKING_OFF = auto()
    STARTING = auto()
    """It is asked to fly by itself: its mission, a landing, a return."""
    NAVIGATING = auto()
    SETTLING = auto()
    """It comes to rest at its target; a plane circles it."""
    HOLDING = auto()
    """It stands still because its position is unknown or in doubt."""
    BLOCKED = auto()
    """It stands still because obstacles leave no path."""
    PAUSING = auto()
    PAUSED = auto()
    STOPPING = auto()
    """It comes to a stop for good; a plane circles."""
    RELEASING = auto()
    """It stops in a mode of its own, because it is not in control."""
    DISARMING = auto()
    CLEARING = auto()
    """The mission is removed from it."""
    ENDED = auto()


class PhaseError(RuntimeError):
    """A phase that may not follow: a programming error."""


Table: TypeAlias = Mapping[Phase, frozenset[Phase]]
"""The phases that may follow each phase of a task."""

_P = Phase
_END = frozenset({_P.ENDED})
# A vehicle that flies or drives has come to a stop, or is taken over: control is taken again.
_IN_FLIGHT = frozenset({_P.PREPARING, _P.NAVIGATING, _P.BLOCKED, _P.STOPPING, _P.ENDED})
FLIGHT: Table = {
    _P.PREPARING: _IN_FLIGHT - {_P.PREPARING} | {_P.ARMING, _P.TAKING_OFF, _P.DISARMING},
    # A rover or boat needs no take-off.
    _P.ARMING: frozenset({_P.PREPARING, _P.TAKING_OFF, _P.DISARMING, _P.ENDED}),
    # Some autopilots leave the mode that obeys setpoints for the take-off.
    _P.TAKING_OFF: _IN_FLIGHT - {_P.STOPPING} | {_P.DISARMING},
    _P.NAVIGATING: _IN_FLIGHT | {_P.SETTLING, _P.HOLDING, _P.PAUSED},
    _P.SETTLING: _IN_FLIGHT | {_P.HOLDING, _P.PAUSED},
    _P.HOLDING: _IN_FLIGHT,
    _P.PAUSED: _IN_FLIGHT | {_P.HOLDING},
    _P.BLOCKED: _IN_FLIGHT | {_P.HOLDING, _P.PAUSED},
    _P.STOPPING: _END,
    # It lifts off while it should disarm.
    _P.DISARMING: _END | {_P.STOPPING},
}
"""A flight to a point or along a route, by setpoints."""

MISSION: Table = {
    _P.HALTING: _END | {_P.UPLOADING, _P.STOPPING},
    _P.UPLOADING: _END | {_P.PREPARING, _P.STARTING, _P.STOPPING},
    _P.PREPARING: frozenset({_P.ARMING, _P.STOPPING}),
    _P.ARMING: frozenset({_P.STARTING, _P.STOPPING}),
    _P.STARTING: frozenset({_P.NAVIGATING, _P.STOPPING}),
    _P.NAVIGATING: _END | {_P.PAUSING, _P.STOPPING},
    _P.PAUSING: frozenset({_P.PAUSED, _P.STOPPING}),
    _P.PAUSED: _END | {_P.STARTING, _P.STOPPING},
    _P.STOPPING: frozenset({_P.CLEARING}),
    _P.CLEARING: _END,
}
"""Once the mission is stored, it ends by STOPPING, unless the vehicle is somebody else's."""

_STOPS = frozenset({_P.STOPPING, _P.DISARMING, _P.ENDED})
PLANE: Table = {
    _P.PREPARING: _STOPS | {_P.PREPARING, _P.ARMING, _P.TAKING_OFF, _P.NAVIGATING},
    _P.ARMING: _STOPS | {_P.PREPARING, _P.TAKING_OFF},
    _P.TAKING_OFF: _STOPS | {_P.PREPARING, _P.NAVIGATING},
    _P.NAVIGATING: _STOPS | {_P.NAVIGATING, _P.SETTLING, _P.PAUSED},
    _P.SETTLING: _STOPS | {_P.NAVIGATING, _P.PAUSED},
    _P.PAUSED: _STOPS | {_P.NAVIGATING},
    _P.STOPPING: _END,
    _P.DISARMING: _END | {_P.STOPPING},
}
"""A plane is sent from target to target."""

LED: Table = {
    _P.STARTING: _END | {_P.NAVIGATING, _P.STOPPING},
    _P.NAVIGATING: _END | {_P.STOPPING},
    _P.STOPPING: _END,
}
"""A landing or a return."""

_LEAVES = frozenset({_P.PREPARING, _P.STOPPING, _P.RELEASING, _P.ENDED})
VELOCITY: Table = {
    _P.PREPARING: _LEAVES | {_P.NAVIGATING},
    _P.NAVIGATING: _LEAVES | {_P.HOLDING},
    _P.HOLDING: _LEAVES | {_P.NAVIGATING},
    _P.STOPPING: _END,
    _P.RELEASING: _END,
}
"""Velocity commands are followed."""

STOPPING = frozenset({_P.STOPPING, _P.RELEASING, _P.DISARMING, _P.CLEARING, _P.ENDED})
"""The phases of a task that ends; a cancel changes nothing."""
BEFORE_FLIGHT = frozenset({_P.PREPARING, _P.ARMING, _P.TAKING_OFF})

STATUS: Mapping[Phase, Status] = {
    _P.HALTING: Status.PREPARING,
    _P.UPLOADING: Status.UPLOADING,
    _P.PREPARING: Status.PREPARING,
    _P.ARMING: Status.ARMING,
    _P.TAKING_OFF: Status.TAKING_OFF,
    _P.STARTING: Status.PREPARING,
    _P.NAVIGATING: Status.NAVIGATING,
    _P.SETTLING: Status.SETTLING,
    _P.HOLDING: Status.HOLDING,
    _P.BLOCKED: Status.BLOCKED,
    _P.PAUSING: Status.PAUSED,
    _P.PAUSED: Status.PAUSED,
    _P.STOPPING: Status.CANCELLING,
    _P.RELEASING: Status.CANCELLING,
    _P.DISARMING: Status.CANCELLING,
    _P.CLEARING: Status.CANCELLING,
    _P.ENDED: Status.NAVIGATING,
}
"""The status in the feedback, where a task does not know it better."""


def check_change(table: Table, before: Phase, after: Phase) -> None:
    """Reject a change that a table does not hold.

    Raises:
        PhaseError: a mistake in the task.
    """
    if after not in table.get(before, ()):
        raise PhaseError(f"{after.name} cannot follow {before.name}.")
