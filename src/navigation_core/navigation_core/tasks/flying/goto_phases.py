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


class PhaseEvent(Enum):
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


TRANSITIONS: dict[tuple[Phase, PhaseEvent], Phase] = {
    (Phase.PREPARING, PhaseEvent.NEEDS_ARMING): Phase.ARMING,
    (Phase.PREPARING, PhaseEvent.NEEDS_TAKEOFF): Phase.TAKING_OFF,
    (Phase.PREPARING, PhaseEvent.FLIES): Phase.NAVIGATING,
    (Phase.PREPARING, PhaseEvent.STOP_ON_GROUND): Phase.DISARMING,
    (Phase.PREPARING, PhaseEvent.STOP_IN_AIR): Phase.BRAKING,
    (Phase.ARMING, PhaseEvent.NEEDS_TAKEOFF): Phase.TAKING_OFF,
    # What drives needs no take-off.
    (Phase.ARMING, PhaseEvent.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.ARMING, PhaseEvent.STOP_ON_GROUND): Phase.DISARMING,
    # Some autopilots leave the mode that obeys setpoints for the take-off.
    (Phase.TAKING_OFF, PhaseEvent.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.TAKING_OFF, PhaseEvent.FLIES): Phase.NAVIGATING,
    (Phase.TAKING_OFF, PhaseEvent.STOP_ON_GROUND): Phase.DISARMING,
    (Phase.NAVIGATING, PhaseEvent.TRAJECTORY_ENDED): Phase.SETTLING,
    (Phase.NAVIGATING, PhaseEvent.POSITION_LOST): Phase.HOLDING,
    (Phase.NAVIGATING, PhaseEvent.REPLAN): Phase.NAVIGATING,
    (Phase.NAVIGATING, PhaseEvent.PAUSE): Phase.PAUSED,
    (Phase.NAVIGATING, PhaseEvent.STOP_IN_AIR): Phase.BRAKING,
    (Phase.SETTLING, PhaseEvent.POSITION_LOST): Phase.HOLDING,
    (Phase.SETTLING, PhaseEvent.REPLAN): Phase.NAVIGATING,
    (Phase.SETTLING, PhaseEvent.PAUSE): Phase.PAUSED,
    (Phase.SETTLING, PhaseEvent.STOP_IN_AIR): Phase.BRAKING,
    (Phase.HOLDING, PhaseEvent.REPLAN): Phase.NAVIGATING,
    (Phase.HOLDING, PhaseEvent.STOP_IN_AIR): Phase.BRAKING,
    (Phase.PAUSED, PhaseEvent.REPLAN): Phase.NAVIGATING,
    (Phase.PAUSED, PhaseEvent.POSITION_LOST): Phase.HOLDING,
    (Phase.PAUSED, PhaseEvent.STOP_IN_AIR): Phase.BRAKING,
    (Phase.DISARMING, PhaseEvent.STOP_IN_AIR): Phase.BRAKING,
    # A ground station had stopped it in a mode of its own, and resumes it.
    (Phase.NAVIGATING, PhaseEvent.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.SETTLING, PhaseEvent.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.HOLDING, PhaseEvent.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.PAUSED, PhaseEvent.NEEDS_CONTROL): Phase.PREPARING,
    (Phase.BLOCKED, PhaseEvent.NEEDS_CONTROL): Phase.PREPARING,
    # Wherever a flight begins or goes on, obstacles may leave no path.
    (Phase.PREPARING, PhaseEvent.NO_WAY): Phase.BLOCKED,
    (Phase.TAKING_OFF, PhaseEvent.NO_WAY): Phase.BLOCKED,
    (Phase.NAVIGATING, PhaseEvent.NO_WAY): Phase.BLOCKED,
    (Phase.SETTLING, PhaseEvent.NO_WAY): Phase.BLOCKED,
    (Phase.HOLDING, PhaseEvent.NO_WAY): Phase.BLOCKED,
    (Phase.PAUSED, PhaseEvent.NO_WAY): Phase.BLOCKED,
    (Phase.BLOCKED, PhaseEvent.NO_WAY): Phase.BLOCKED,
    (Phase.BLOCKED, PhaseEvent.REPLAN): Phase.NAVIGATING,
    (Phase.BLOCKED, PhaseEvent.POSITION_LOST): Phase.HOLDING,
    (Phase.BLOCKED, PhaseEvent.PAUSE): Phase.PAUSED,
    (Phase.BLOCKED, PhaseEvent.STOP_IN_AIR): Phase.BRAKING,
}
TRANSITIONS.update(
    {(phase, PhaseEvent.OVER): Phase.ENDED for phase in Phase if phase is not Phase.ENDED}
)


def next_phase(phase: Phase, event: PhaseEvent) -> Phase:
    """Return the phase that an event leads to.

    Raises:
        PhaseError: the event cannot happen in this phase.
    """
    try:
        return TRANSITIONS[phase, event]
    except KeyError:
        raise PhaseError(f"{event.name} cannot happen in phase {phase.name}.") from None
