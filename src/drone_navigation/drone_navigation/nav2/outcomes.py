"""Results of goals for Nav2's clients, from those of the server. No ROS calls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from action_msgs.msg import GoalStatus

from custom_interfaces.msg import GoalCode
from drone_navigation.client.events import Ended


class Nav2Result(Protocol):
    """The fields that the result of each action has."""

    error_code: int
    error_msg: str


R = TypeVar("R", bound=Nav2Result)


@dataclass(frozen=True)
class Nav2Outcome:
    """The end of a goal of a Nav2 client.

    Attributes:
        status: STATUS_SUCCEEDED, STATUS_CANCELED or STATUS_ABORTED of GoalStatus.
        code: for `error_code`: a number of GoalCode.msg, all below 100, or one of Nav2's own
            for the action, all of which are 100 or more; 0 is success.
        message: for `error_msg`: "CODE: sentence"; empty for success.
        missed: indices of the waypoints that were missed.
    """

    status: int
    code: int = 0
    message: str = ""
    missed: tuple[int, ...] = field(default=())


SUCCEEDED = Nav2Outcome(GoalStatus.STATUS_SUCCEEDED)


def aborted(code: str, text: str, number: int | None = None) -> Nav2Outcome:
    """Return the end of a goal that is not executed.

    Args:
        code: a name of GoalCode.msg.
        text: a sentence.
        number: one of Nav2's own, for `error_code`; None for that of the code.
    """
    if number is None:
        number = getattr(GoalCode, code, GoalCode.INTERNAL_ERROR)
    return Nav2Outcome(GoalStatus.STATUS_ABORTED, number, f"{code}: {text}")


PREEMPTED = aborted("PREEMPTED", "A new goal replaced this one.")


def ended(end: Ended, *, cancelled: bool) -> Nav2Outcome:
    """Return the end for the client of a goal that the server has ended.

    Args:
        end: of the server's goal.
        cancelled: whether the client asked for it. Only then is it CANCELED: a goal that a
            ground station cancelled is ABORTED, as its client did not ask.
    """
    if end.state == "SUCCEEDED":
        return SUCCEEDED
    missed = end.waypoints_missed or ()
    if cancelled and end.code in ("CANCELED", "PREEMPTED"):
        return Nav2Outcome(GoalStatus.STATUS_CANCELED, GoalCode.CANCELED, end.message, missed)
    code = getattr(GoalCode, end.code, GoalCode.INTERNAL_ERROR)
    return Nav2Outcome(GoalStatus.STATUS_ABORTED, code, end.message, missed)


def result(make: Callable[[], R], outcome: Nav2Outcome) -> R:
    """Return the result message of an action for an end.

    Where nav2_msgs itself uses the numbers 1 and 2, those of GoalCode become its UNKNOWN.
    """
    message = make()
    own = [getattr(make, name, 0) for name in ("GOAL_REJECTED", "SEND_GOAL_FAILURE")]
    is_taken = outcome.code != 0 and outcome.code in own
    message.error_code = getattr(make, "UNKNOWN", 0) if is_taken else outcome.code
    message.error_msg = outcome.message
    if hasattr(message, "success"):
        message.success = outcome.status == GoalStatus.STATUS_SUCCEEDED
    return message
