"""The step of a firmware: from a state and inputs to a state and texts, and nothing else."""

from __future__ import annotations

from typing import Any

import pytest

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.autopilot.common.firmware import Firmware, Inputs, State, step
from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.personality.ardupilot import ARDUCOPTER
from mavlink_sitl.exchange import BatteryReading, Motion, Observation

KINDS = [(v, a) for a in ("ardupilot", "px4") for v in ("copter", "rover", "boat", "plane")]


STANDING = Observation(
    time_s=0.0,
    motion=Motion(*[0.0] * 12),
    gps_fix=True,
    battery=BatteryReading(12.6, 0.0, 0.0, 0.0, 100.0),
    touching_ground=True,
    impact_m_s=0.0,
    thrust_over_hover=0.0,
)
PARAMETERS = Parameters(ARDUCOPTER.parameter_table, {})


def inputs(armed: bool = False, position_lost: bool = False, **changed: Any) -> Inputs:
    """Return the inputs of a copter that stands on the ground, with some changed."""
    seen = STANDING._replace(**changed)
    return Inputs(seen, PARAMETERS, armed, False, position_lost, lambda at_s: at_s, 584.0)


def test_the_same_state_and_inputs_give_the_same() -> None:
    state, given = State(0.0), inputs(time_s=30.0, impact_m_s=2.0)
    first = step(Firmware({}), ARDUCOPTER, state, given)
    assert step(Firmware({}), ARDUCOPTER, state, given) == first
    assert state == State(0.0), "the state that went in is as it was"


def test_each_line_of_the_start_is_said_once_and_in_order() -> None:
    state, said = State(0.0), []
    for tick in range(1200):
        state, texts = step(Firmware({}), ARDUCOPTER, state, inputs(time_s=tick * 0.05))
        said += [each.text for each in texts]
    lines = [line.text.format(elevation=584.0) for line in ARDUCOPTER.boot]
    assert said == lines


def test_a_lost_position_and_its_return_are_said_once() -> None:
    state = step(Firmware({}), ARDUCOPTER, State(0.0), inputs(time_s=60.0))[0]
    lost = inputs(position_lost=True, time_s=61.0)
    state, texts = step(Firmware({}), ARDUCOPTER, state, lost)
    assert [each.text for each in texts] == [f"EKF3 IMU{i} stopped aiding" for i in (0, 1)]
    state, texts = step(Firmware({}), ARDUCOPTER, state, lost)
    assert not texts
    _, texts = step(Firmware({}), ARDUCOPTER, state, inputs(time_s=62.0))
    assert [each.text for each in texts] == [f"EKF3 IMU{i} is using GPS" for i in (0, 1)]


def test_a_copter_lands_after_it_was_quiet_for_a_while() -> None:
    state = State(0.0)
    aloft = inputs(armed=True, touching_ground=False, thrust_over_hover=1.0)
    state, _ = step(Firmware({}), ARDUCOPTER, state, aloft)
    assert not state.landing.landed
    for time_s, landed in ((1.0, False), (2.4, False), (2.6, True)):
        quiet = inputs(armed=True, time_s=time_s, thrust_over_hover=0.1)
        state, _ = step(Firmware({}), ARDUCOPTER, state, quiet)
        assert state.landing.landed is landed
    assert state.landing.since_s == 2.6


@pytest.mark.parametrize(("vehicle", "autopilot"), KINDS)
def test_the_table_of_each_kind_has_a_class_for_each_of_its_modes(
    vehicle: str, autopilot: str
) -> None:
    config = VehicleConfig(vehicle=vehicle, autopilot=autopilot)
    firmware = Simulation([config]).vehicles[0].firmware
    named = {spec.behaviour for spec in config.personality().modes.values()}
    assert named <= set(firmware.table.modes)
    assert firmware.table.first_mode in config.personality().modes
