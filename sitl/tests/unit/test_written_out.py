"""The arithmetic written out for one vehicle equals that of `Ops` to the bit."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.autopilot.control import controller
from mavlink_sitl.lanes import Lane, Ops
from mavlink_sitl.physics import copter_pipeline
from mavlink_sitl.written_out import for_one

VALUES = (-2.5, -0.0, 0.0, 1e-300, 0.3, 1.0, 7.0, math.inf, -math.inf, math.nan)


class Pair(NamedTuple):
    first: Lane
    second: Lane


def smaller(x: Lane, y: Lane, z: Lane, o: Ops) -> Lane:
    return o.minimum(x, y) + 0.0 * z


def larger(x: Lane, y: Lane, z: Lane, o: Ops) -> Lane:
    return o.maximum(x + 1.0, y) - z


def limited(x: Lane, y: Lane, z: Lane, o: Ops) -> Lane:
    return o.clip(x * 3.0, -abs(y), abs(z) + 1.0)


def chosen(x: Lane, y: Lane, z: Lane, o: Ops) -> Lane:
    return o.where(x > y, o.maximum(o.minimum(x, z), -z), o.hypot(x, 2.0) + o.atan2(y, z))


def nested(x: Lane, y: Lane, z: Lane, o: Ops) -> Pair:
    def twice(value: Lane) -> Lane:
        return o.maximum(value + value, o.full(0.5))

    return Pair(o.sqrt(twice(x) * o.where(x > 0.0, x, 1.0) + 1.0), smaller(x, y, z, o))


def outcome(function: Callable[..., Any], *values: float) -> str:
    """A result to its last bit and its type, or the error."""
    try:
        found = function(*values, Ops())
    except (ValueError, OverflowError) as error:
        return repr(error)
    return repr(found)


@pytest.mark.parametrize("function", [smaller, larger, limited, chosen, nested])
def test_written_out_arithmetic_gives_the_same_bits(function: Callable[..., Any]) -> None:
    written = for_one(function)
    assert written is not function
    for x in VALUES:
        for y in VALUES:
            for z in VALUES:
                assert outcome(written, x, y, z) == outcome(function, x, y, z), (x, y, z)


def test_what_a_function_calls_is_written_out_too() -> None:
    written = for_one(controller.step)
    assert "_yaw" not in written.__code__.co_names
    assert not {"where", "clip", "maximum", "sqrt"} & set(written.__code__.co_names)
    assert for_one(controller.step) is written


def test_errors_in_it_point_to_the_source() -> None:
    written = for_one(controller.sqrt_approach)
    with pytest.raises(ZeroDivisionError) as caught:
        written(1.0, 0.0, 1.0, Ops())
    entry = caught.traceback[-1]
    assert str(entry.path).endswith("control/controller.py")
    assert "limit / (gain * gain)" in str(entry.statement)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_flight_has_the_same_bits_without_it(
    autopilot: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flown() -> str:
        simulation = Simulation([VehicleConfig(autopilot=autopilot)], seed=3)
        physics = simulation._fleets[0].physics
        rng = random.Random(1)
        simulation.run_for(1.0)
        physics.control = physics.control._replace(spool=1.0)
        physics.targets = physics.targets._replace(
            fly=1.0, track_position_xy=1.0, track_position_z=1.0, yaw_mode=float(rng.randrange(4))
        )
        level, upright = physics.control.horizontal, physics.control.vertical
        physics.control = physics.control._replace(
            horizontal=level._replace(target_north_m=20.0, target_east_m=-5.0),
            vertical=upright._replace(target_down_m=-10.0),
        )
        states = []
        for _ in range(900):
            physics.step()
            states.append(repr((physics.body, physics.control, physics.error)))
        assert physics.body.down_m < -5.0
        return "\n".join(states)

    written = flown()
    monkeypatch.setattr(copter_pipeline, "for_one", lambda function: function)
    assert flown() == written
