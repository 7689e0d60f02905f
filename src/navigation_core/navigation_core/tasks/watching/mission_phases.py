"""The phases of the mission task and the transitions between them."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto

from navigation_core.tasks.flying.goto_phases import PhaseError
from navigation_core.tasks.progress import Status


class MissionPhase(Enum):
    """The phase of the task."""

    HALTING = auto()
    """The vehicle stops what it flew before."""
    UPLOADING = auto()
    PREPARING = auto()
    """It enters the mode in which it can be armed."""
    ARMING = auto()
    STARTING = auto()
    FLYING = auto()
    PAUSING = auto()
    PAUSED = auto()
    STOPPING = auto()
    """It comes to a stop for good."""
    CLEARING = auto()
    """The mission is removed from it."""
    ENDED = auto()


_P = MissionPhase
FOLLOWING: Mapping[MissionPhase, frozenset[MissionPhase]] = {
    _P.HALTING: frozenset({_P.UPLOADING, _P.STOPPING, _P.ENDED}),
    _P.UPLOADING: frozenset({_P.PREPARING, _P.STARTING, _P.STOPPING, _P.ENDED}),
    _P.PREPARING: frozenset({_P.ARMING, _P.STOPPING}),
    _P.ARMING: frozenset({_P.STARTING, _P.STOPPING}),
    _P.STARTING: frozenset({_P.FLYING, _P.STOPPING}),
    _P.FLYING: frozenset({_P.PAUSING, _P.STOPPING, _P.ENDED}),
    _P.PAUSING: frozenset({_P.PAUSED, _P.STOPPING}),
    _P.PAUSED: frozenset({_P.STARTING, _P.STOPPING, _P.ENDED}),
    _P.STOPPING: frozenset({_P.CLEARING}),
    _P.CLEARING: frozenset({_P.ENDED}),
    _P.ENDED: frozenset(),
}
"""Once the mission is stored, it ends by STOPPING, unless the vehicle is somebody else's."""

STOPPING = frozenset({_P.STOPPING, _P.CLEARING, _P.ENDED})
STATUS: Mapping[MissionPhase, Status] = {
    _P.HALTING: Status.PREPARING,
    _P.UPLOADING: Status.UPLOADING,
    _P.PREPARING: Status.PREPARING,
    _P.ARMING: Status.ARMING,
    _P.STARTING: Status.PREPARING,
    _P.FLYING: Status.NAVIGATING,
    _P.PAUSING: Status.PAUSED,
    _P.PAUSED: Status.PAUSED,
    _P.STOPPING: Status.CANCELLING,
    _P.CLEARING: Status.CANCELLING,
    _P.ENDED: Status.NAVIGATING,
}


def check_change(before: MissionPhase, after: MissionPhase) -> None:
    """Reject a change that the table does not hold.

    Raises:
        PhaseError: a mistake in the task.
    """
    if after not in FOLLOWING[before]:
        raise PhaseError(f"{after.name} cannot follow {before.name}.")
