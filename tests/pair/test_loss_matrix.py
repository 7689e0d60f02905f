"""Every action over every bad link ends in the right outcome; docs/loss_matrix.md shows them."""

from __future__ import annotations

import math

import pytest

from tests.support.flights.loss_matrix import (
    ACTIONS,
    DISTURBANCES,
    FIRMWARES,
    HEIGHT_M,
    LIMIT_S,
    PAGE,
    Action,
    Disturbance,
    expected,
    fly,
    outcomes_on_page,
)

pytestmark = pytest.mark.wide


# The effect of a loss of 40 % on a PX4 covers these, too, and its many messages cost time.
MILDER = ("loss 5 %", "loss 20 %")
CELLS = [
    pytest.param(firmware, action, disturbance, id=f"{firmware}-{action.name}-{disturbance.name}")
    for firmware in FIRMWARES
    for action in ACTIONS
    for disturbance in DISTURBANCES
    if not (firmware == "px4" and disturbance.name in MILDER)
]
# A brake from 3 m/s within GUID_TIMEOUT and after it takes 12 m at most (docs/autopilots.md).
BRAKE_M = 12.0
GOALS = {
    "Navigate": (12.0, 0.0, HEIGHT_M),
    "NavigateWaypoints SETPOINTS": (8.0, 8.0, HEIGHT_M),
    "NavigateWaypoints MISSION": (8.0, 8.0, HEIGHT_M),
    "Takeoff": (0.0, 0.0, HEIGHT_M),
    "Land": (0.0, 0.0, 0.0),
}


@pytest.mark.parametrize(("firmware", "action", "disturbance"), CELLS)
def test_a_cell_ends_in_the_right_outcome_and_leaves_the_vehicle_alone(
    firmware: str, action: Action, disturbance: Disturbance
) -> None:
    cell = fly(firmware, action, disturbance)
    assert cell.outcome == expected(firmware, action, disturbance), cell.message
    assert cell.ends == (0 if disturbance.kill else 1)
    assert cell.seconds < LIMIT_S
    assert cell.moving == ()
    assert not cell.streaming
    error_m = math.dist(cell.place_enu_m, GOALS[action.name])
    if cell.outcome == "SUCCESS":
        assert error_m < 1.5
        assert cell.speed_m_s < 0.3
    elif cell.outcome == "stands":
        assert error_m < BRAKE_M
        assert cell.place_enu_m[2] == pytest.approx(HEIGHT_M, abs=0.7)


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_the_page_reports_the_outcome_of_every_cell(firmware: str) -> None:
    told = outcomes_on_page(PAGE.read_text(encoding="utf-8"), firmware)
    assert told == {
        (disturbance.name, action.name): expected(firmware, action, disturbance)
        for action in ACTIONS
        for disturbance in DISTURBANCES
    }


@pytest.mark.parametrize("seed", [10, 12])
def test_no_run_of_losses_makes_a_mission_fail(seed: int) -> None:
    """With seed 12 13 questions for an item stay without an answer, with 10 5 to begin with it."""
    by_mission = next(action for action in ACTIONS if action.name.endswith("MISSION"))
    loss = next(disturbance for disturbance in DISTURBANCES if disturbance.name == "loss 40 %")
    cell = fly("ardupilot", by_mission, loss, seed)
    assert cell.outcome == "SUCCESS", cell.message
