"""Situations aimed at checks that others stand behind, so that a defect of one alone shows.

In each, two or three events coincide that seldom do in a drawn scenario. They were written for
planted defects that nothing had found (docs/explore_mutants.md).
"""

from __future__ import annotations

import math
from dataclasses import replace

from tests.explore.situations import Situation, Stage

_GOALS = ("navigate", "mission", "takeoff", "land", "go_home", "orbit", "steer")


def _begin_goal(stage: Stage, what: str) -> float:
    """Ask for a goal of a kind; return a time at which it is under way."""
    rng = stage.rng
    if what in ("land", "go_home", "orbit", "steer"):
        stage.add(0.0, "navigate", place=stage.away(25.0, 12.0))
        begun_s = 35.0
    else:
        begun_s = 0.0
    if what == "navigate":
        stage.add(begun_s, what, place=stage.away(90.0))
    elif what == "mission":
        stage.add(begun_s, "route", places=[stage.away(60.0), stage.away(70.0)], mission=True)
    elif what == "takeoff":
        stage.add(begun_s, what, height=20.0)
    elif what == "orbit":
        stage.add(begun_s, what, centre=[10.0, 0.0], radius=10.0, laps=4.0, height=10.0)
    elif what == "steer":
        stage.add(begun_s, what, linear=[1.0, 0.5, 0.0], rate=0.0, seconds=30.0)
    else:
        stage.add(begun_s, what)
    if what in ("land", "go_home"):
        return begun_s + rng.uniform(3.0, 6.0)
    return begun_s + (rng.uniform(8.0, 10.0) if what == "takeoff" else rng.uniform(12.0, 16.0))


def _a_restart_under_way(stage: Stage) -> None:
    begun_s = _begin_goal(stage, stage.rng.choice(_GOALS))
    stage.add(begun_s, "reboot")
    stage.end(begun_s + 40.0)


def _a_pilot_of_any_goal(stage: Stage) -> None:
    begun_s = _begin_goal(stage, stage.rng.choice(_GOALS))
    modes = {"ardupilot": ("LOITER", "ALT_HOLD", "BRAKE"), "px4": ("POSCTL", "AUTO.LOITER")}
    mode = stage.rng.choice(modes[stage.craft.autopilot])
    stage.add(begun_s, "pilot_mode", mode=mode)
    stage.end(begun_s + 20.0)


def _a_mission_that_is_cancelled(stage: Stage) -> None:
    places = [stage.away(60.0), stage.away(70.0), stage.away(50.0)]
    stage.add(0.0, "route", places=places, mission=True)
    begun_s = stage.rng.choice((6.0, 9.0, stage.soon()))
    stage.add(begun_s, "cancel")
    stage.end(begun_s + 40.0)


def _a_goal_with_an_old_position(stage: Stage) -> None:
    stage.add(0.0, "navigate", place=stage.away(8.0))
    stage.add(35.0, "unlocated", on=True)
    asked_s = 35.0 + stage.rng.choice((4.0, 8.0, 20.0))
    stage.add(asked_s, "navigate", place=stage.away(20.0))
    stage.add(asked_s + 1.0, "orbit", centre=[5.0, 0.0], radius=8.0, height=8.0)
    stage.end(asked_s + 20.0)


def _numbers_that_are_none(stage: Stage) -> None:
    stage.add(0.0, "takeoff", height=5.0)
    for number in range(4):
        place, speed = stage.away(15.0), 0.0
        if stage.rng.random() < 0.5:
            place[stage.rng.randrange(3)] = stage.rng.choice((math.nan, math.inf, -math.inf))
        else:
            speed = stage.rng.choice((math.nan, math.inf, -math.inf))
        turned = None
        if stage.rng.random() < 0.3:
            turned = [0.0, 0.0, stage.rng.choice((math.nan, math.inf)), 1.0]
        at_s = 20.0 + 5.0 * number
        stage.add(at_s, "navigate", place=place, speed=speed, orientation=turned)
    stage.end(45.0)


def _a_wall_and_a_slow_search(stage: Stage) -> None:
    stage.craft = replace(stage.craft, search_s=stage.rng.choice((0.0, 1.5)))
    east, north, up = stage.away(60.0, 6.0)
    stage.wall((east / 60.0, north / 60.0), 30.0, stage.rng.choice((2, 4)))
    speed = stage.rng.choice((3.0, 6.0))
    stage.add(0.0, "navigate", place=[east, north, up], avoid=True, speed=speed)


def _an_intruder_of_a_return(stage: Stage) -> None:
    rng = stage.rng
    stage.craft = replace(stage.craft, sees_traffic=True)
    stage.add(0.0, "navigate", place=stage.away(40.0, 12.0))
    # One that stands over home, or comes to the vehicle, and goes away again.
    stage.add(
        40.0, "intruder", course_deg=rng.uniform(0.0, 360.0), speed=rng.choice((0.0, 0.5, 3.0)),
        meets_s=rng.uniform(5.0, 15.0),
    )  # fmt: skip
    stage.add(40.0 + rng.uniform(1.0, 6.0), rng.choice(("go_home", "land")))
    stage.end(100.0)


def _a_mark_that_is_lost(stage: Stage) -> None:
    rng = stage.rng
    stage.add(0.0, "takeoff", height=rng.choice((8.0, 12.0)))
    stage.add(
        30.0, "land", mark=[rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0)],
        required=rng.random() < 0.7, retries=rng.choice((0, 0, 1)), fault="vanishes",
        fault_s=rng.uniform(2.0, 8.0),
    )  # fmt: skip
    stage.end(100.0)


def _a_mark_that_moves_away(stage: Stage) -> None:
    rng = stage.rng
    stage.add(0.0, "takeoff", height=8.0)
    stage.add(
        30.0, "land", mark=[0.5, 0.5], required=rng.random() < 0.7, told=True, fault="jumps",
        fault_s=2.0, jump=rng.choice((2.0, 4.0, 8.0)), jump_below=rng.choice((0.4, 0.8, 1.5)),
    )  # fmt: skip
    stage.end(100.0)


def _a_route_with_a_turn_rate(stage: Stage) -> None:
    places = [stage.away(25.0) for _ in range(3)]
    rate = stage.rng.choice((-0.3, -0.1, 0.1, 0.3))
    stage.add(0.0, "route", places=places, yaw_rate=rate, speed=3.0)


def _a_copter_slower_than_asked(stage: Stage) -> None:
    """The firmware's own limit, far below what the goal leads it with."""
    if stage.craft.autopilot == "px4":
        stage.fit(MPC_XY_VEL_MAX=0.4, MPC_XY_CRUISE=0.3)
    else:
        stage.fit(WPNAV_SPEED=25.0)
    stage.serve(arrival_speed_m_s=stage.rng.choice((0.5, 1.0)))
    stage.add(0.0, "navigate", place=stage.away(12.0), speed=stage.rng.choice((0.0, 2.0)))


def _an_end_that_is_not_heard(stage: Stage) -> None:
    """The server's frames are lost for 0.75 s while it hands the vehicle over to its hold mode."""
    stage.craft = replace(stage.craft, autopilot="px4", firmware="")
    stage.add(0.0, "navigate", place=stage.away(60.0), speed=2.0)
    begun_s = stage.soon()
    stage.add(begun_s, "cancel")
    lost_s = begun_s + stage.rng.uniform(2.85, 3.1)  # just before it stands
    stage.add(lost_s, "full", on=True)
    stage.add(lost_s + 0.75, "full", on=False)
    stage.end(begun_s + 30.0)


def _a_hold_that_ends_a_goal(stage: Stage) -> None:
    begun_s = _begin_goal(stage, stage.rng.choice(("navigate", "orbit", "steer")))
    stage.add(begun_s, "serve", service="hold", mode="")
    stage.end(begun_s + 20.0)


def _a_landing_that_is_disarmed_late(stage: Stage) -> None:
    stage.craft = replace(stage.craft, autopilot="px4", firmware="")
    stage.fit(COM_DISARM_LAND=stage.rng.choice((6.0, 12.0)))
    stage.add(0.0, "takeoff", height=4.0)
    stage.add(20.0, "land")
    stage.end(55.0)


AIMED: tuple[Situation, ...] = (
    *(_a_restart_under_way, _a_pilot_of_any_goal, _a_mission_that_is_cancelled),
    *(_a_goal_with_an_old_position, _numbers_that_are_none, _a_wall_and_a_slow_search),
    *(_an_intruder_of_a_return, _a_mark_that_is_lost, _a_mark_that_moves_away),
    *(_a_route_with_a_turn_rate, _a_copter_slower_than_asked),
    *(_an_end_that_is_not_heard, _a_hold_that_ends_a_goal, _a_landing_that_is_disarmed_late),
)
"""They follow those of `more_situations`."""
