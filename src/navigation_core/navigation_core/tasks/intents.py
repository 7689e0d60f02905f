"""Answers of a task at each step: an intent, or the outcome."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.observation import TaskOperation
from navigation_core.tasks.waypoint import MissionPlan


@dataclass(frozen=True)
class Setpoint:
    """The setpoint for the present moment.

    Attributes:
        position_enu_m: position in the map frame.
        velocity_enu_m_s: velocity feed-forward.
        acceleration_enu_m_s2: acceleration feed-forward.
        yaw_enu_rad: yaw.
        yaw_rate_rad_s: yaw rate feed-forward, counter-clockwise.
    """

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    acceleration_enu_m_s2: Vector3
    yaw_enu_rad: float
    yaw_rate_rad_s: float = 0.0


@dataclass(frozen=True)
class Wait:
    """Send nothing that moves the vehicle."""


@dataclass(frozen=True)
class Perform:
    """Have an operation done.

    Returned at every step until the report says that the operation has finished; it is to
    be started once.

    Attributes:
        kind: which operation.
        height_m: for TAKE_OFF, the height above the ground to climb to.
        target_enu_m: for REPOSITION, where to go.
        circle_m: for REPOSITION of a plane, the radius of its circle there, negative clockwise;
            None for its usual one.
        keeps_mode: for REPOSITION, whether it is to be rejected in a mode that somebody else chose,
            where the vehicle can do that (trait `reposition_keeps_mode`).
        speed_m_s: for CHANGE_SPEED.
        mission: for UPLOAD_MISSION, what is to be flown.
    """

    kind: TaskOperation
    height_m: float | None = None
    target_enu_m: Vector3 | None = None
    circle_m: float | None = None
    keeps_mode: bool = False
    speed_m_s: float | None = None
    mission: MissionPlan | None = None


@dataclass(frozen=True)
class Fly:
    """Send this setpoint now. A pending operation is to be given up for it.

    Attributes:
        setpoint: what to send.
        by_velocity: only its velocity and yaw are to be followed: an estimate that jumps would
            make the vehicle fly the jump back.
        turn_rate_rad_s: for a vehicle with the trait ``drives_by_turn_rate``: drive along the nose,
            which the setpoint's yaw is, and turn at this rate; a velocity against the nose is
            driven backwards. None to head for the direction of the velocity.
    """

    setpoint: Setpoint
    by_velocity: bool = False
    turn_rate_rad_s: float | None = None


Intent = Wait | Perform | Fly


@dataclass(frozen=True)
class Outcome:
    """The one end of a task.

    Attributes:
        code: stable reason.
        message: one sentence for display.
        final_error_m: measured distance to the target, or None if it was not measured.
    """

    code: OutcomeCode
    message: str
    final_error_m: float | None

    def after(self, stop: str, final_error_m: float | None = None) -> Outcome:
        """Return it for a vehicle that was stopped first, with how that went, a sentence."""
        return Outcome(self.code, f"{self.message} {stop}", final_error_m)


@dataclass(frozen=True)
class StopFirst:
    """An outcome before which the vehicle, or its motors, are to be stopped.

    Attributes:
        ending: the outcome.
    """

    ending: Outcome


class Handover(NamedTuple):
    """The setpoint that a replaced task sent last, from which its successor continues.

    Attributes:
        commanded: its state in the map frame; None to begin at the measured state.
        yaw_enu_rad: its yaw.
        time_s: when it was sent; None for the time of the start.
        by_itself: whether the vehicle moves by itself, in what the replaced task asked for, such
            as a return: a task that is cancelled at once has to stop it.
    """

    commanded: KinematicState | None = None
    yaw_enu_rad: float | None = None
    time_s: float | None = None
    by_itself: bool = False


NOTHING_SENT = Handover()
