"""Transition table of the life cycle of a goal.

A goal follows the states of a ROS 2 action goal (design.ros2.org, "Actions": goal
states). The bridge has its own copy of that machine because the vehicle decides how a goal ends,
and because rclpy 7.1 does not reject feedback after the end. The invariants, held by
``tests/unit/navigation/test_lifecycle.py``:

* every accepted goal reaches exactly one terminal state;
* nothing leads out of a terminal state;
* CANCELED is reached only through CANCELING.

            EXECUTE            SUCCEED
  ACCEPTED ---------> EXECUTING --------> SUCCEEDED
     |  |                |   | ABORT
     |  | CANCEL   CANCEL|   +----------> ABORTED <---+
     |  +-----> CANCELING <                           |
     | ABORT       | | SUCCEED, ABORT                 |
     +-------------|-+--------------------------------+
                   | CANCELED
                   +----------> CANCELED
"""

from __future__ import annotations

from enum import Enum

from navigation_core.outcomes import OutcomeCode


class GoalState(Enum):
    """State of an accepted goal, with the names of ``action_msgs/msg/GoalStatus``."""

    ACCEPTED = "ACCEPTED"
    EXECUTING = "EXECUTING"
    CANCELING = "CANCELING"
    SUCCEEDED = "SUCCEEDED"
    CANCELED = "CANCELED"
    ABORTED = "ABORTED"


class GoalEvent(Enum):
    """Events of a goal."""

    EXECUTE = "EXECUTE"
    CANCEL = "CANCEL"
    SUCCEED = "SUCCEED"
    ABORT = "ABORT"
    CANCELED = "CANCELED"


TERMINAL_STATES = frozenset({GoalState.SUCCEEDED, GoalState.CANCELED, GoalState.ABORTED})

TRANSITIONS: dict[tuple[GoalState, GoalEvent], GoalState] = {
    (GoalState.ACCEPTED, GoalEvent.EXECUTE): GoalState.EXECUTING,
    (GoalState.ACCEPTED, GoalEvent.CANCEL): GoalState.CANCELING,
    (GoalState.ACCEPTED, GoalEvent.ABORT): GoalState.ABORTED,
    (GoalState.EXECUTING, GoalEvent.CANCEL): GoalState.CANCELING,
    (GoalState.EXECUTING, GoalEvent.SUCCEED): GoalState.SUCCEEDED,
    (GoalState.EXECUTING, GoalEvent.ABORT): GoalState.ABORTED,
    (GoalState.CANCELING, GoalEvent.CANCEL): GoalState.CANCELING,
    (GoalState.CANCELING, GoalEvent.SUCCEED): GoalState.SUCCEEDED,
    (GoalState.CANCELING, GoalEvent.ABORT): GoalState.ABORTED,
    (GoalState.CANCELING, GoalEvent.CANCELED): GoalState.CANCELED,
}


class LifecycleError(Exception):
    """An event is not allowed in the state of the goal: a bug in the caller."""


def next_state(state: GoalState, event: GoalEvent) -> GoalState:
    """Return the state after ``event``.

    Raises:
        LifecycleError: the table has no entry for this pair.
    """
    try:
        return TRANSITIONS[(state, event)]
    except KeyError:
        raise LifecycleError(
            f"A goal in state {state.value} does not accept event {event.value}; "
            "check for a terminal state before acting on a goal."
        ) from None


def terminal_event(code: OutcomeCode) -> GoalEvent:
    """Return the event that ends a goal with outcome ``code``."""
    if code is OutcomeCode.SUCCESS:
        return GoalEvent.SUCCEED
    if code is OutcomeCode.CANCELED:
        return GoalEvent.CANCELED
    return GoalEvent.ABORT
