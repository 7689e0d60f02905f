"""The life cycle of a goal over all its states and events."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_bridge.goals.lifecycle import (
    TERMINAL_STATES,
    TRANSITIONS,
    GoalEvent,
    GoalState,
    LifecycleError,
    next_state,
    terminal_event,
)
from navigation_core.outcomes import OutcomeCode

# Changes that ROS 2's actions do not allow (design.ros2.org/articles/actions.html, "Goal States").
REJECTED = [
    (GoalState.ACCEPTED, GoalEvent.SUCCEED),
    (GoalState.ACCEPTED, GoalEvent.CANCELED),
    (GoalState.EXECUTING, GoalEvent.EXECUTE),
    (GoalState.EXECUTING, GoalEvent.CANCELED),
    (GoalState.CANCELING, GoalEvent.EXECUTE),
    *itertools.product(TERMINAL_STATES, GoalEvent),
]


def test_what_an_action_does_not_allow_is_an_error_that_names_both() -> None:
    for state, event in REJECTED:
        with pytest.raises(
            LifecycleError, match=f"in state {state.value} does not accept event {event.value}"
        ):
            next_state(state, event)


def test_canceled_is_reached_through_canceling_alone() -> None:
    sources = {state for (state, _), to in TRANSITIONS.items() if to is GoalState.CANCELED}
    assert sources == {GoalState.CANCELING}


def test_every_state_can_still_end() -> None:
    for state in set(GoalState) - TERMINAL_STATES:
        assert next_state(state, GoalEvent.ABORT) is GoalState.ABORTED


@given(st.lists(st.sampled_from(GoalEvent), max_size=12))
def test_a_goal_ends_at_most_once(events: list[GoalEvent]) -> None:
    state, ends = GoalState.ACCEPTED, 0
    for event in events:
        try:
            state = next_state(state, event)
        except LifecycleError:
            continue
        ends += state in TERMINAL_STATES
    assert ends <= 1
    assert (ends == 1) == (state in TERMINAL_STATES)


@pytest.mark.parametrize("code", OutcomeCode, ids=lambda code: code.value)
def test_every_outcome_ends_a_goal_that_is_being_cancelled(code: OutcomeCode) -> None:
    state = next_state(GoalState.CANCELING, terminal_event(code))
    assert state in TERMINAL_STATES
    assert (state is GoalState.SUCCEEDED) == (code is OutcomeCode.SUCCESS)
