r"""The phases of a flight to a point and the transitions between them.

    PREPARING --> ARMING --> TAKING_OFF --> NAVIGATING <--> HOLDING, PAUSED, BLOCKED
        \____________________________________^   |
                                               SETTLING --> ENDED

A cancel leads to ENDED before anything was asked of the vehicle, to DISARMING on the
ground and to BRAKING in the air. A vehicle that lifts off while it should disarm brakes.
"""

from __future__ import annotations

from enum import Enum, auto


class Phase(Enum):
    """The phase of the task."""

    PREPARING = auto()
    ARMING = auto()
    TAKING_OFF = auto()
    NAVIGATING = auto()
    SETTLING = auto()
    HOLDING = auto()
    PAUSED = auto()
    BLOCKED = auto()
    BRAKING = auto()
    DISARMING = auto()
    ENDED = auto()


class Event(Enum):
    """An event that changes the phase."""

    NEEDS_CONTROL = auto()
    NEEDS_ARMING = auto()
    NEEDS_TAKEOFF = auto()
    FLIES = auto()
    TRAJECTORY_ENDED = auto()
    POSITION_LOST = auto()
    REPLAN = auto()
    NO_WAY = auto()
    PAUSE = auto()
    STOP_ON_GROUND = auto()
    STOP_IN_AIR = auto()
    OVER = auto()


class PhaseError(RuntimeError):
    """An event came in a phase in which it cannot happen: a programming error."""


TRANSITIONS: dict[tuple[Phase, Event], Phase] = {
    (Phase.PREPARING, Event.NEEDS_ARMING): Phase.ARMING,
    (Phase.PREPARING, Event.NEEDS_TAKEOFF): Phase.TAKING_OFF,
    (Phase.PREPARING, Event.FLIES): Phase.NAVIGATING,
    (Phase.PREPARING, Event.STOP_ON_GROUND): Phase.DISARMING,
    (Phase.PREPARING, Event.STOP_IN_AIR): Phase.BRAKING,
    (Phase.ARMING, Event.NEEDS_TAKEOFF): Phase.TAKING_OFF,
    # What drives needs no take-off.
    (Phase.ARMING, Event.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.ARMING, Event.STOP_ON_GROUND): Phase.DISARMING,
    # Some autopilots leave the mode that obeys setpoints for the take-off.
    (Phase.TAKING_OFF, Event.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.TAKING_OFF, Event.FLIES): Phase.NAVIGATING,
    (Phase.TAKING_OFF, Event.STOP_ON_GROUND): Phase.DISARMING,
    (Phase.NAVIGATING, Event.TRAJECTORY_ENDED): Phase.SETTLING,
    (Phase.NAVIGATING, Event.POSITION_LOST): Phase.HOLDING,
    (Phase.NAVIGATING, Event.REPLAN): Phase.NAVIGATING,
    (Phase.NAVIGATING, Event.PAUSE): Phase.PAUSED,
    (Phase.NAVIGATING, Event.STOP_IN_AIR): Phase.BRAKING,
    (Phase.SETTLING, Event.POSITION_LOST): Phase.HOLDING,
    (Phase.SETTLING, Event.REPLAN): Phase.NAVIGATING,
    (Phase.SETTLING, Event.PAUSE): Phase.PAUSED,
    (Phase.SETTLING, Event.STOP_IN_AIR): Phase.BRAKING,
    (Phase.HOLDING, Event.REPLAN): Phase.NAVIGATING,
    (Phase.HOLDING, Event.STOP_IN_AIR): Phase.BRAKING,
    (Phase.PAUSED, Event.REPLAN): Phase.NAVIGATING,
    (Phase.PAUSED, Event.POSITION_LOST): Phase.HOLDING,
    (Phase.PAUSED, Event.STOP_IN_AIR): Phase.BRAKING,
    (Phase.DISARMING, Event.STOP_IN_AIR): Phase.BRAKING,
    # A ground station had stopped it in a mode of its own, and resumes it.
    (Phase.NAVIGATING, Event.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.SETTLING, Event.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.HOLDING, Event.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.PAUSED, Event.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.BLOCKED, Event.NEEDS_CONTROL): Phase.PREPARING,
    # Wherever a flight begins or goes on, obstacles may leave no path.
    (Phase.PREPARING, Event.NO_WAY): Phase.BLOCKED,
    (Phase.TAKING_OFF, Event.NO_WAY): Phase.BLOCKED,
    (Phase.NAVIGATING, Event.NO_WAY): Phase.BLOCKED,
    (Phase.SETTLING, Event.NO_WAY): Phase.BLOCKED,
    (Phase.HOLDING, Event.NO_WAY): Phase.BLOCKED,
    (Phase.PAUSED, Event.NO_WAY): Phase.BLOCKED,
    (Phase.BLOCKED, Event.NO_WAY): Phase.BLOCKED,
    (Phase.BLOCKED, Event.REPLAN): Phase.NAVIGATING,
    (Phase.BLOCKED, Event.POSITION_LOST): Phase.HOLDING,
    (Phase.BLOCKED, Event.PAUSE): Phase.PAUSED,
    (Phase.BLOCKED, Event.STOP_IN_AIR): Phase.BRAKING,
}
TRANSITIONS.update(
    {(phase, Event.OVER): Phase.ENDED for phase in Phase if phase is not Phase.ENDED}
)


def next_phase(phase: Phase, event: Event) -> Phase:
    """Return the phase that an event leads to.

    Raises:
        PhaseError: the event cannot happen in this phase.
    """
    try:
        return TRANSITIONS[phase, event]
    except KeyError:
        raise PhaseError(f"{event.name} cannot happen in phase {phase.name}.") from None
