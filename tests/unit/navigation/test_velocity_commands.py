"""Velocity commands are checked, and some of them start a goal."""

from __future__ import annotations

import math

import pytest

from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.tasks.velocity_commands import VelocityCommands
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame

TIMEOUT_S = 0.5
FORWARD = (1.0, 0.0, 0.0)
ZERO = (0.0, 0.0, 0.0)


def new_commands() -> VelocityCommands:
    return Bridge(Vehicle(), make_config({}).bridge).feature(VelocityCommands)


def command(now: float, linear: Vector3 = FORWARD, rate: float = 0.0) -> VelocityCommand:
    return VelocityCommand(now, VelocityFrame.BODY, linear, rate)


def starts(
    commands: VelocityCommands,
    now: float,
    linear: Vector3 = FORWARD,
    active: str = "",
    in_control: bool = True,
    may_start: bool = True,
) -> bool:
    assert not commands.keep(command(now, linear), TIMEOUT_S)
    begins, why = commands.starts_goal(active, in_control, may_start)
    assert not (begins and why)
    return begins


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(4))
def test_a_number_that_is_not_finite_is_rejected_and_stops_the_vehicle(
    bad: float, place: int
) -> None:
    commands = new_commands()
    commands.keep(command(0.0), TIMEOUT_S)
    numbers = [1.0, 0.0, 0.0, 0.0]
    numbers[place] = bad
    fault = commands.keep(command(0.1, (numbers[0], numbers[1], numbers[2]), numbers[3]), TIMEOUT_S)
    assert "every number must be finite" in fault
    assert f"{bad:g}" in fault
    assert commands.command is None
    assert not commands.keep(command(0.2), TIMEOUT_S)
    assert commands.command == command(0.2)


def test_the_first_command_that_moves_starts_a_goal_and_zeros_do_not() -> None:
    commands = new_commands()
    assert not starts(commands, 0.0, ZERO)
    assert starts(commands, 0.1)


def test_nothing_starts_a_goal_where_only_goals_may() -> None:
    commands = new_commands()
    commands.keep(command(0.0), TIMEOUT_S)
    begins, why = commands.starts_goal("", True, False)
    assert not begins
    assert "follow_velocity" in why


def test_who_steers_through_another_goal_must_let_go_before_a_goal_is_started() -> None:
    commands = new_commands()
    assert not starts(commands, 0.0, active="goal 1234 (navigate_to_waypoint)")
    for i in range(1, 20):  # the goal has ended, and the stick is still held
        assert not starts(commands, 0.1 * i)
    assert not starts(commands, 2.0, ZERO)
    assert starts(commands, 2.1)


def test_silence_releases_the_stick_too() -> None:
    commands = new_commands()
    assert not starts(commands, 0.0, active="goal 1234 (navigate_to_waypoint)")
    assert not starts(commands, 0.4)
    assert starts(commands, 1.0)


def test_a_vehicle_in_a_mode_of_somebody_else_is_left_alone() -> None:
    commands = new_commands()
    assert not starts(commands, 0.0, in_control=False)
    commands.goal_began()
    assert starts(commands, 1.0, in_control=False)  # a PX4 holds between the server's goals
    commands.lose_vehicle()
    assert not starts(commands, 2.0, in_control=False)
    assert starts(commands, 3.0, in_control=True)  # whoever chose this mode wants to be led


@pytest.mark.parametrize("code", list(OutcomeCode))
def test_after_an_end_that_was_not_that_of_its_commands_a_goal_must_be_sent(
    code: OutcomeCode,
) -> None:
    commands = new_commands()
    commands.goal_began()
    commands.ended_with(code)
    ended_by_itself = code in (OutcomeCode.SUCCESS, OutcomeCode.TIMEOUT)
    assert starts(commands, 1.0) is ended_by_itself
    assert starts(commands, 2.0) is ended_by_itself
    commands.goal_began()
    assert starts(commands, 3.0)


def test_a_vehicle_that_a_ground_station_flies_is_left_alone() -> None:
    commands = new_commands()
    commands.goal_began()
    commands.give_vehicle_away()
    assert not starts(commands, 1.0)
    commands.goal_began()
    assert starts(commands, 2.0)


def test_what_is_not_followed_is_reported_occasionally() -> None:
    commands = new_commands()
    told = [now for now in range(100) if commands.takes_log_line(0.1 * now)]
    assert told == [0, 50]
