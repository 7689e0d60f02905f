r"""The phases of a flight to a point and the transitions between them.

    PREPARING --> ARMING --> TAKING_OFF --> NAVIGATING <--> HOLDING, PAUSED, BLOCKED
        \____________________________________^   |
                                               SETTLING --> ENDED

A cancel leads to ENDED before anything was asked of the vehicle, to DISARMING on the
ground and to BRAKING in the air. A vehicle that lifts off while it should disarm brakes;
one that flies by itself, as a replaced goal asked, is held.
"""

from __future__ import annotations

from enum import Enum, auto


class GotoPhase(Enum):
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


TRANSITIONS: dict[tuple[GotoPhase, PhaseEvent], GotoPhase] = {
    (GotoPhase.PREPARING, PhaseEvent.NEEDS_ARMING): GotoPhase.ARMING,
    (GotoPhase.PREPARING, PhaseEvent.NEEDS_TAKEOFF): GotoPhase.TAKING_OFF,
    (GotoPhase.PREPARING, PhaseEvent.FLIES): GotoPhase.NAVIGATING,
    (GotoPhase.PREPARING, PhaseEvent.STOP_ON_GROUND): GotoPhase.DISARMING,
    (GotoPhase.PREPARING, PhaseEvent.STOP_IN_AIR): GotoPhase.BRAKING,
    (GotoPhase.ARMING, PhaseEvent.NEEDS_TAKEOFF): GotoPhase.TAKING_OFF,
    # A rover or boat needs no take-off.
    (GotoPhase.ARMING, PhaseEvent.NEEDS_CONTROL): GotoPhase.PREPARING,
    (GotoPhase.ARMING, PhaseEvent.STOP_ON_GROUND): GotoPhase.DISARMING,
    # Some autopilots leave the mode that obeys setpoints for the take-off.
    (GotoPhase.TAKING_OFF, PhaseEvent.NEEDS_CONTROL): GotoPhase.PREPARING,
    (GotoPhase.TAKING_OFF, PhaseEvent.FLIES): GotoPhase.NAVIGATING,
    (GotoPhase.TAKING_OFF, PhaseEvent.STOP_ON_GROUND): GotoPhase.DISARMING,
    (GotoPhase.NAVIGATING, PhaseEvent.TRAJECTORY_ENDED): GotoPhase.SETTLING,
    (GotoPhase.NAVIGATING, PhaseEvent.POSITION_LOST): GotoPhase.HOLDING,
    (GotoPhase.NAVIGATING, PhaseEvent.REPLAN): GotoPhase.NAVIGATING,
    (GotoPhase.NAVIGATING, PhaseEvent.PAUSE): GotoPhase.PAUSED,
    (GotoPhase.NAVIGATING, PhaseEvent.STOP_IN_AIR): GotoPhase.BRAKING,
    (GotoPhase.SETTLING, PhaseEvent.POSITION_LOST): GotoPhase.HOLDING,
    (GotoPhase.SETTLING, PhaseEvent.REPLAN): GotoPhase.NAVIGATING,
    (GotoPhase.SETTLING, PhaseEvent.PAUSE): GotoPhase.PAUSED,
    (GotoPhase.SETTLING, PhaseEvent.STOP_IN_AIR): GotoPhase.BRAKING,
    (GotoPhase.HOLDING, PhaseEvent.REPLAN): GotoPhase.NAVIGATING,
    (GotoPhase.HOLDING, PhaseEvent.STOP_IN_AIR): GotoPhase.BRAKING,
    (GotoPhase.PAUSED, PhaseEvent.REPLAN): GotoPhase.NAVIGATING,
    (GotoPhase.PAUSED, PhaseEvent.POSITION_LOST): GotoPhase.HOLDING,
    (GotoPhase.PAUSED, PhaseEvent.STOP_IN_AIR): GotoPhase.BRAKING,
    (GotoPhase.DISARMING, PhaseEvent.STOP_IN_AIR): GotoPhase.BRAKING,
    # A ground station had stopped it in a mode of its own, and resumes it.
    (GotoPhase.NAVIGATING, PhaseEvent.NEEDS_CONTROL): GotoPhase.PREPARING,
    (GotoPhase.SETTLING, PhaseEvent.NEEDS_CONTROL): GotoPhase.PREPARING,
    (GotoPhase.HOLDING, PhaseEvent.NEEDS_CONTROL): GotoPhase.PREPARING,
    (GotoPhase.PAUSED, PhaseEvent.NEEDS_CONTROL): GotoPhase.PREPARING,
    (GotoPhase.BLOCKED, PhaseEvent.NEEDS_CONTROL): GotoPhase.PREPARING,
    # Wherever a flight begins or continues, obstacles may leave no path.
    (GotoPhase.PREPARING, PhaseEvent.NO_WAY): GotoPhase.BLOCKED,
    (GotoPhase.TAKING_OFF, PhaseEvent.NO_WAY): GotoPhase.BLOCKED,
    (GotoPhase.NAVIGATING, PhaseEvent.NO_WAY): GotoPhase.BLOCKED,
    (GotoPhase.SETTLING, PhaseEvent.NO_WAY): GotoPhase.BLOCKED,
    (GotoPhase.HOLDING, PhaseEvent.NO_WAY): GotoPhase.BLOCKED,
    (GotoPhase.PAUSED, PhaseEvent.NO_WAY): GotoPhase.BLOCKED,
    (GotoPhase.BLOCKED, PhaseEvent.NO_WAY): GotoPhase.BLOCKED,
    (GotoPhase.BLOCKED, PhaseEvent.REPLAN): GotoPhase.NAVIGATING,
    (GotoPhase.BLOCKED, PhaseEvent.POSITION_LOST): GotoPhase.HOLDING,
    (GotoPhase.BLOCKED, PhaseEvent.PAUSE): GotoPhase.PAUSED,
    (GotoPhase.BLOCKED, PhaseEvent.STOP_IN_AIR): GotoPhase.BRAKING,
}
TRANSITIONS.update(
    {
        (phase, PhaseEvent.OVER): GotoPhase.ENDED
        for phase in GotoPhase
        if phase is not GotoPhase.ENDED
    }
)


def next_phase(phase: GotoPhase, event: PhaseEvent) -> GotoPhase:
    """Return the phase that an event leads to.

    Raises:
        PhaseError: the event cannot happen in this phase.
    """
    try:
        return TRANSITIONS[phase, event]
    except KeyError:
        raise PhaseError(f"{event.name} cannot happen in phase {phase.name}.") from None
