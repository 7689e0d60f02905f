"""The replanner: when it replans and when it reports that there is no path."""

from __future__ import annotations

import itertools

import pytest

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.limits import Limits
from navigation_core.mapping.obstacle_shapes import Cylinder
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.planning.conflicts import MotionSamples
from navigation_core.planning.replanner import (
    Decision,
    ReplanEvent,
    Replanner,
    ReplannerError,
    ReplanRules,
    State,
)
from navigation_core.trajectories.trajectory import plan_to

RULES = ReplanRules(
    conflict_clearance_m=1.1,
    blocked_timeout_s=30.0,
    retry_s=0.5,
    elective_s=3.0,
    elective_gain=0.15,
)
HERE: Vector3 = (0.0, 0.0, 5.0)


def flown_samples(length_m: float = 40.0) -> MotionSamples:
    return MotionSamples.of(plan_to(KinematicState(HERE), (length_m, 0.0, 5.0), Limits()))


def post(x: float, y: float) -> Obstacles:
    return Obstacles.of((Cylinder("post", (x, y), 0.5),))


def flown(now: float = 0.0) -> Replanner:
    replanner = Replanner(RULES)
    replanner.found(HERE, now)
    return replanner


def check(
    replanner: Replanner,
    obstacles: Obstacles,
    now: float,
    on: MotionSamples,
    time_s: float = 0.0,
    least_m: float = 40.0,
    left_m: float = 40.0,
) -> Decision:
    x = float(on.positions_enu_m[on.times_s >= time_s][0, 0])
    return replanner.check(on, time_s, (x, 0.0, 5.0), least_m, left_m, obstacles, now)


def test_a_path_is_kept_while_nothing_comes_nearer_than_the_conflict_distance() -> None:
    replanner, on = flown(), flown_samples()
    assert check(replanner, NOTHING, 1.0, on) is Decision.KEEP
    # An obstacle that the path was planned clear of is no conflict once it seems a little nearer.
    assert check(replanner, post(20.0, 0.5 + 1.5), 2.0, on) is Decision.KEEP
    assert check(replanner, post(20.0, 0.5 + 1.15), 3.0, on) is Decision.KEEP
    assert check(replanner, post(20.0, 0.5 + 1.05), 4.0, on) is Decision.REPLAN


def test_a_conflict_far_ahead_counts_at_once() -> None:
    replanner, on = flown(), flown_samples(200.0)
    assert check(replanner, post(190.0, 0.0), 0.1, on) is Decision.REPLAN
    assert replanner.state is State.REPLANNING


def test_what_was_passed_is_in_nobodys_way() -> None:
    replanner, on = flown(), flown_samples()
    later_s = float(on.times_s[-5])
    assert check(replanner, post(10.0, 0.0), 0.1, on, later_s) is Decision.KEEP


def test_the_same_obstacles_and_the_same_path_are_looked_at_once() -> None:
    replanner, on, obstacles = flown(), flown_samples(), post(20.0, 5.0)
    assert check(replanner, obstacles, 0.1, on) is Decision.KEEP
    on.positions_enu_m[:, 1] += 5.0  # It would be in conflict, if anybody looked.
    assert replanner.check(on, 0.0, (0.0, 5.0, 5.0), 40.0, 40.0, obstacles, 9.0) is Decision.KEEP
    again = post(20.0, 5.0)
    assert replanner.check(on, 0.0, (0.0, 5.0, 5.0), 40.0, 40.0, again, 9.0) is Decision.REPLAN


def test_a_shorter_path_is_looked_for_now_and_then_and_only_if_there_can_be_one() -> None:
    replanner, on = flown(0.0), flown_samples()
    assert check(replanner, post(9.0, 9.0), 2.0, on, left_m=60.0) is Decision.KEEP
    assert check(replanner, post(9.0, 9.1), 3.5, on, left_m=44.0) is Decision.KEEP
    assert check(replanner, post(9.0, 9.2), 3.6, on, left_m=60.0) is Decision.COMPARE
    replanner.not_found(HERE, 3.6)
    assert replanner.replans == 0
    assert check(replanner, post(9.0, 9.3), 6.0, on, left_m=60.0) is Decision.KEEP
    assert check(replanner, post(9.0, 9.4), 6.7, on, left_m=60.0) is Decision.COMPARE
    replanner.found(HERE, 6.7)
    assert replanner.replans == 1


def test_it_does_not_flap_between_two_sides_that_are_about_equal() -> None:
    replanner, on = flown(), flown_samples()
    # Each new look at the obstacle makes the other side look a little shorter.
    for step, (left_m, other_m) in enumerate(itertools.cycle([(50.0, 46.0), (46.0, 50.0)])):
        if step == 40:
            break
        decision = check(replanner, post(9.0, 9.0 + 0.01 * step), 4.0 * step, on, left_m=left_m)
        if decision is Decision.COMPARE:
            assert not replanner.is_clearly_shorter(other_m, left_m)
            replanner.not_found(HERE, 4.0 * step)
    assert replanner.replans == 0
    assert replanner.is_clearly_shorter(42.0, 50.0)


def test_while_there_is_no_path_it_is_looked_for_again_and_again_and_then_given_up() -> None:
    replanner, on = flown(), flown_samples()
    assert check(replanner, post(20.0, 0.0), 1.0, on) is Decision.REPLAN
    replanner.not_found(HERE, 1.0)
    assert replanner.state is State.BLOCKED
    searches, now = 0, 1.0
    while (decision := replanner.wait(now, True)) is not Decision.GIVE_UP:
        if decision is Decision.REPLAN:
            replanner.not_found(HERE, now)
            searches += 1
        now += 0.05
    assert now == pytest.approx(31.0, abs=0.1)
    assert 50 <= searches <= 60
    assert replanner.state is State.GIVEN_UP


def test_a_path_that_opens_up_is_taken_and_counted() -> None:
    replanner, on = flown(), flown_samples()
    check(replanner, post(20.0, 0.0), 1.0, on)
    replanner.not_found(HERE, 1.0)
    assert replanner.wait(2.0, True) is Decision.REPLAN
    replanner.found(HERE, 2.0)
    assert (replanner.state, replanner.replans) == (State.KEEPING, 1)


def test_who_is_blocked_again_at_the_same_place_does_not_restart_the_count() -> None:
    replanner = flown()
    replanner.stop(HERE, 10.0)
    replanner.wait(12.0, True)
    replanner.found(HERE, 12.0)
    replanner.stop((1.0, 0.0, 5.0), 14.0)
    assert replanner.blocked_for_s(15.0) == pytest.approx(5.0)
    replanner.wait(16.0, True)
    replanner.found(HERE, 16.0)
    replanner.moved_on((3.0, 0.0, 5.0))
    replanner.stop((3.0, 0.0, 5.0), 20.0)
    assert replanner.blocked_for_s(21.0) == pytest.approx(1.0)


def test_nothing_is_planned_while_that_is_not_allowed() -> None:
    replanner = flown()
    replanner.stop(HERE, 1.0)
    assert replanner.wait(10.0, False) is Decision.WAIT
    assert replanner.wait(32.0, False) is Decision.GIVE_UP


def test_an_event_that_cannot_happen_is_an_error_and_changes_nothing() -> None:
    for state, events in (
        (State.KEEPING, {ReplanEvent.RETRY, ReplanEvent.TIME_OUT}),
        (State.REPLANNING, {ReplanEvent.RETRY, ReplanEvent.TIME_OUT}),
        (State.GIVEN_UP, set(ReplanEvent)),
    ):
        for event in events:
            replanner = Replanner(RULES)
            replanner.state = state
            with pytest.raises(ReplannerError, match=f"{event.name} cannot happen"):
                replanner._go(event)
            assert replanner.state is state
