"""Behaviour trees over DDS: the program of docs/programs.md; leaves rejected and left."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

from mavbridge_trees.conditions import BatteryAbove, IsNear, LastEndWas
from mavbridge_trees.leaves import FlyOrbit, GoTo, HoldFor, LandHere, TakeOff
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_trees")]

PAGE = Path(__file__).resolve().parents[2] / "docs" / "programs.md"


def tick(flight: Flight, root: Behaviour, timeout_s: float = 90.0) -> Status:
    """Tick a tree until it ends."""

    def ended() -> bool:
        root.tick_once()
        return root.status is not Status.RUNNING

    for leaf in root.iterate():
        leaf.setup(node=flight.node)
    flight.wait(ended, timeout_s, "the end of the tree")
    return root.status


def test_leaves_fly_one_after_another_and_conditions_hold(flight: Flight) -> None:
    steps: list[Any] = [
        TakeOff(3.0),
        GoTo((5.0, 0.0, 3.0), speed_m_s=3.0),
        IsNear((5.0, 0.0, 3.0), 1.5),
        BatteryAbove(0.05),
        LastEndWas("SUCCESS"),
        HoldFor(0.5),
        FlyOrbit((5.0, 3.0), 3.0, laps=0.25),
    ]
    root = Sequence("steps", memory=True, children=steps)
    assert tick(flight, root) is Status.SUCCESS, [leaf.feedback_message for leaf in steps]
    assert steps[1].code == "SUCCESS"


def test_a_rejected_leaf_has_the_reason_and_the_tree_does_something_else(flight: Flight) -> None:
    below, away = GoTo((0.0, 0.0, -20.0)), GoTo((0.0, 0.0, 3.0))
    after = Sequence("after", memory=True, children=[LastEndWas("BELOW_GROUND"), away])
    assert tick(flight, Selector("way", memory=True, children=[below, after])) is Status.SUCCESS
    assert below.code == "BELOW_GROUND"
    assert "ground" in below.feedback_message
    assert away.code == "SUCCESS"


def test_a_leaf_that_is_left_cancels_its_goal(flight: Flight) -> None:
    far = GoTo((200.0, 0.0, 5.0), speed_m_s=2.0)
    far.setup(node=flight.node)

    def flies() -> bool:
        far.tick_once()
        return far.feedback is not None and far.feedback.current_status == "NAVIGATING"

    flight.wait(flies, 60.0, "the flight")
    far.stop(Status.INVALID)
    land = LandHere()
    flight.spin_for(4.0)
    assert far.code == "CANCELED"
    assert tick(flight, land) is Status.SUCCESS, land.feedback_message


def test_the_tree_of_the_documentation_inspects_four_towers_with_two_batteries(
    tmp_path: Path,
) -> None:
    """The battery is empty after 120 s in the air, and a PX4's simulator fills it on the ground."""
    text = PAGE.read_text("utf-8")
    program = next(b for b in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "TOWERS" in b)
    drain = ("--param", "SIM_BAT_DRAIN=120", "--param", "SIM_BAT_MIN_PCT=20")
    low = ("--param", "COM_LOW_BAT_ACT=0", "--param", "RTL_RETURN_ALT=10")
    flight = Flight(
        tmp_path, "--ros-args", "-p", "battery_policy:=warn", "--",
        simulator=("--autopilot", "px4", *drain, *low),
    )  # fmt: skip
    try:
        landed: list[int] = []
        towers = Process("towers", ["python", "-c", program], flight.environment)

        def over() -> bool:
            armed = flight.is_armed
            if landed[-1:] != [armed]:
                landed.append(armed)
            return towers.returncode is not None

        flight.wait(over, 400.0, "the end of the program")
        assert towers.wait(5.0) == 0, towers.text
        assert "SUCCESS" in towers.text
        # Armed, landed for another battery, and armed again.
        assert landed[-4:] == [False, True, False, True], landed
    finally:
        flight.close()
