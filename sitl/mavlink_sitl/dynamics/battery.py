"""A lithium pack: open-circuit voltage by charge, sag by current, charge by counting.

The current was fitted to the recording `copter_guided`: 27.7 A in hover, 33 A when the
motors push 10 % harder.
"""

from __future__ import annotations

from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops


class BatteryModel(NamedTuple):
    """The pack; the same for all lanes."""

    cells: int = 3
    capacity_mah: float = 11_600.0
    """Hovers for 25 minutes."""
    internal_resistance_ohm: float = 0.01
    hover_current_a: float = 27.7
    current_exponent: float = 1.5
    """Power of a rotor goes with thrust to the power 1.5 (momentum theory)."""
    full_cell_v: float = 4.2
    nominal_cell_v: float = 3.7
    empty_cell_v: float = 3.3


class BatteryState(NamedTuple):
    """Charge taken and what the terminals show. Every field is a lane."""

    consumed_mah: Lane
    consumed_wh: Lane
    voltage_v: Lane
    current_a: Lane
    override_v: Lane
    """A voltage forced by a test or by SIM_BATT_VOLTAGE; 0 for the model's own."""


def charged(remaining_fraction: Lane, model: BatteryModel, o: Ops) -> BatteryState:
    """A pack with this much of its capacity left (0..1), at rest."""
    zero = o.full(0.0)
    consumed = (1.0 - remaining_fraction) * model.capacity_mah + zero
    state = BatteryState(consumed, zero, zero, zero, zero)
    return state._replace(voltage_v=open_circuit_v(state, model, o))


def open_circuit_v(state: BatteryState, model: BatteryModel, o: Ops) -> Lane:
    """Voltage without load: flat in the middle, steep in the last tenth."""
    left = o.clip(1.0 - state.consumed_mah / model.capacity_mah, 0.0, 1.0)
    plateau = model.nominal_cell_v + (model.full_cell_v - model.nominal_cell_v) * left
    knee = o.minimum(left / 0.1, 1.0)
    cell = plateau - (model.nominal_cell_v - model.empty_cell_v) * (1.0 - knee)
    return model.cells * cell


def step(
    state: BatteryState, thrust_over_hover: Lane, dt: float, model: BatteryModel, o: Ops
) -> BatteryState:
    """Draw current for dt seconds."""
    current = model.hover_current_a * thrust_over_hover**model.current_exponent
    rest = o.where(state.override_v > 0.0, state.override_v, open_circuit_v(state, model, o))
    sag = o.where(state.override_v > 0.0, 0.0, model.internal_resistance_ohm)
    voltage = o.maximum(rest - sag * current, 0.0)
    hours = dt / 3600.0
    return BatteryState(
        consumed_mah=state.consumed_mah + current * 1000.0 * hours,
        consumed_wh=state.consumed_wh + current * voltage * hours,
        voltage_v=voltage,
        current_a=current,
        override_v=state.override_v,
    )
